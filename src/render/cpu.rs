//! The renderer that needs no graphics adapter. The twin of `shaders/panorama.wgsl`.
//!
//! First each column is laid out in runs of rows that show the same face (`hits`, `spans`). Then the picture is cut into bands
//! of rows, which threads share, and whose colours fit into the second cache. In a band upright faces are shaded down their
//! columns, where u and level of detail stay the same; then horizontal ones along the rows, where distance and level of detail
//! do, as row after row is put into the picture. No pixel depends on how the work is cut, nor on the number of threads.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::columns::Face;
use super::frame::{FAR, Frame, Row};
use super::hits::ColumnHits;
use super::sample::{LANES, POINTS, PointRoom, RUN};
use super::shade::{Plane, Side, SideRoom, Sight};
use super::spans::{NOTHING, Spans};
use super::{InstructionSet, Renderer, RendererInfo, Scene, View};
use crate::error::Result;
use crate::panorama::Panorama;

/// Most rows in a band: the unit of work of a thread.
const BAND: usize = RUN;
/// Most pixels in a band that is higher than [`LEAST_ROWS`]: low bands cut columns short, high ones leave the second cache.
const BAND_PIXELS: usize = 384 << 10;
/// Rows of a band of a very wide picture.
const LEAST_ROWS: usize = 16;
/// Colour where there is nothing.
const VOID: u32 = 0xff00_0000;

/// Number of a band, and its part of the colours, ranges and instance ids.
type BandBuffers<'a> = (usize, ((&'a mut [u8], &'a mut [f32]), &'a mut [u16]));

/// The CPU renderer.
#[derive(Debug)]
pub struct CpuRenderer {
    info: RendererInfo,
    instructions: InstructionSet,
    /// Those that are idle; there are as many as pictures were ever rendered at once.
    painters: Mutex<Vec<Painter>>,
}

/// What it takes to render a picture. Its buffers grow with the first one.
#[derive(Debug, Default)]
struct Painter {
    frame: Frame,
    hits: ColumnHits,
    spans: Spans,
    desks: Mutex<Vec<Desk>>,
}

impl CpuRenderer {
    /// A renderer on the widest instruction set at hand; its buffers grow with the first picture.
    #[must_use]
    pub fn new() -> Self {
        Self::with(InstructionSet::best())
    }

    /// A renderer on an instruction set of choice.
    ///
    /// # Errors
    /// When this processor does not have it.
    pub fn on(instructions: InstructionSet) -> Result<Self> {
        instructions.available().map(Self::with)
    }

    fn with(instructions: InstructionSet) -> Self {
        let adapter = format!("{} with {instructions} instructions", std::env::consts::ARCH);
        let info = RendererInfo { kind: "cpu".to_owned(), adapter, driver: String::new() };
        Self { info, instructions, painters: Mutex::new(Vec::new()) }
    }

    /// Renders a view; `share` its bands with the other threads or paint them all in this one.
    fn paint(&self, scene: &Scene, view: &View<'_>, out: &mut Panorama, share: bool) -> Result<()> {
        with_idle(&self.painters, |painter| painter.paint(self.instructions, scene, view, out, share))
    }
}

/// Does something with one of the idle things, or a new one.
fn with_idle<I: Default, T>(things: &Mutex<Vec<I>>, work: impl FnOnce(&mut I) -> T) -> T {
    let idle = || things.lock().unwrap_or_else(PoisonError::into_inner);
    let thing = idle().pop();
    let mut thing = thing.unwrap_or_default();
    let result = work(&mut thing);
    idle().push(thing);
    result
}

impl Default for CpuRenderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer for CpuRenderer {
    fn render(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama) -> Result<()> {
        // Inside a pool the caller already spreads pictures over the cores.
        let alone = rayon::current_thread_index().is_none();
        self.paint(scene, view, out, alone)
    }

    fn render_group(&mut self, scene: &Scene, views: &[View<'_>], out: &mut [Panorama]) -> Result<()> {
        assert_eq!(views.len(), out.len(), "a place for each view");
        if let ([view], [out]) = (views, &mut *out) {
            return self.paint(scene, view, out, true);
        }
        views.par_iter().zip(out).with_max_len(1).try_for_each(|(view, out)| self.paint(scene, view, out, false))
    }

    fn info(&self) -> &RendererInfo {
        &self.info
    }
}

impl Painter {
    /// Renders a view; `share` its bands with the other threads or paint them all in this one.
    fn paint(
        &mut self,
        instructions: InstructionSet,
        scene: &Scene,
        view: &View<'_>,
        out: &mut Panorama,
        share: bool,
    ) -> Result<()> {
        self.frame.prepare(scene, view)?;
        self.hits.find(&self.frame);
        self.spans.find(&self.frame, &self.hits);
        out.reshape(view.projection)?;
        let (width, height) = (view.projection.width as usize, view.projection.height as usize);
        let most = (BAND_PIXELS / width).clamp(LEAST_ROWS, BAND);
        let most = if share { most.min(height.div_ceil(rayon::current_num_threads())) } else { most };
        let rows = height.div_ceil(height.div_ceil(most));
        let size = rows * width;
        let paint_band = |(k, ((rgba, range), instance)): BandBuffers<'_>| {
            with_idle(&self.desks, |desk| {
                let (frame, hits, spans) = (&self.frame, &self.hits, &self.spans);
                let paint = match instructions {
                    InstructionSet::Portable => paint,
                    InstructionSet::Avx2 => paint_avx2,
                    InstructionSet::Avx512 => paint_avx512,
                };
                paint(Band { scene, frame, hits, spans, first_row: k * rows, rgba, range, instance }, desk);
            });
        };
        if share {
            out.rgba
                .par_chunks_mut(4 * size)
                .zip(out.range_m.par_chunks_mut(size))
                .zip(out.instance.par_chunks_mut(size))
                .enumerate()
                .for_each(paint_band);
        } else {
            out.rgba
                .chunks_mut(4 * size)
                .zip(out.range_m.chunks_mut(size))
                .zip(out.instance.chunks_mut(size))
                .enumerate()
                .for_each(paint_band);
        }
        Ok(())
    }
}

/// Some whole rows of the picture.
struct Band<'a> {
    scene: &'a Scene,
    frame: &'a Frame,
    hits: &'a ColumnHits,
    spans: &'a Spans,
    first_row: usize,
    rgba: &'a mut [u8],
    range: &'a mut [f32],
    instance: &'a mut [u16],
}

/// Where a band is worked on.
#[derive(Debug, Default)]
struct Desk {
    /// Colours, row by row, each a little longer than the picture's.
    colours: Vec<u32>,
    stride: usize,
    /// Changes of what a column shows, and for each row the number of the first of them, from 1.
    changes: Vec<Change>,
    first_change: Vec<u32>,
    levels: Vec<Level>,
    /// What the columns show in the row at work.
    now: Now,
    columns: Columns,
    side: SideRoom,
    point: PointRoom,
}

/// Colours of some columns, each from the top, and of what may be written after its end.
#[derive(Debug)]
struct Columns([[u32; RUN + 2 * LANES]; LANES]);

impl Default for Columns {
    fn default() -> Self {
        Self([[VOID; RUN + 2 * LANES]; LANES])
    }
}

/// A column shows another face from some row on.
#[derive(Debug, Clone, Copy)]
struct Change {
    /// Number of the next change of the same row; 0 where there is none.
    next: u32,
    column: u32,
    instance: u16,
    /// Distance is `near`, and `height` times the inverse tangent of the row, and `room` times the distance of floor or ceiling.
    near: f32,
    height: f32,
    room: f32,
}

/// What columns show in a row; see [`Change`].
#[derive(Debug, Default)]
struct Now {
    near: Vec<f32>,
    height: Vec<f32>,
    room: Vec<f32>,
    instance: Vec<u16>,
    /// Directions of the columns, with some more at the end to make up whole groups.
    directions: [Vec<f32>; 2],
}

/// Where a horizontal surface is seen in a group of columns: a bit for each of them, row after row.
#[derive(Debug)]
struct Level {
    group: usize,
    surface: u32,
    face: Face,
    rows: Range<usize>,
    masks: Vec<u64>,
}

impl Desk {
    /// Clears the desk for a band of so many rows.
    fn prepare(&mut self, frame: &Frame, rows: usize) {
        let width = frame.params.width as usize;
        let whole = width.next_multiple_of(POINTS);
        // Rows must not all fall into the same places of the cache, which repeat every 4 KiB.
        self.stride = whole + LANES;
        self.colours.resize(rows * self.stride, VOID);
        self.changes.clear();
        self.levels.clear();
        self.first_change.clear();
        self.first_change.resize(rows, 0);
        let now = &mut self.now;
        for values in [&mut now.near, &mut now.height, &mut now.room] {
            values.resize(width, 0.0);
        }
        now.instance.resize(width, 0);
        for (axis, values) in now.directions.iter_mut().enumerate() {
            values.clear();
            values.extend(frame.directions.iter().map(|d| d[axis]));
            values.resize(whole, 0.0);
        }
    }

    /// Puts the columns that were worked on into the rows, from column `first` on.
    #[inline(always)]
    fn turn(&mut self, rows: usize, first: usize) {
        let columns = &self.columns.0;
        for (r, places) in self.colours.chunks_exact_mut(self.stride).enumerate().take(rows.min(RUN)) {
            if let Some(places) = places[first..].first_chunk_mut::<LANES>() {
                for c in 0..LANES {
                    places[c] = columns[c][r];
                }
            }
        }
    }
}

/// Paints a band. Inlined into the functions below, all of it is compiled once for each instruction set; results are the same.
#[inline(always)]
fn paint(mut band: Band<'_>, desk: &mut Desk) {
    let width = band.frame.params.width as usize;
    let rows = band.range.len() / width;
    desk.prepare(band.frame, rows);
    let mut runs = Vec::new();
    for first in (0..width).step_by(LANES) {
        for column in first..width.min(first + LANES) {
            lay_out(&band, desk, rows, column, &mut runs);
        }
        for run in runs.drain(..) {
            let colours = &mut desk.columns.0[run.column % LANES][run.start..];
            match &run.side {
                Some(side) => side.shade(band.frame, &mut desk.side, colours),
                None => colours[..run.count].fill(VOID),
            }
        }
        desk.turn(rows, first);
    }
    for row in 0..rows {
        show_row(&mut band, desk, row);
    }
}

#[multiversion::multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn paint_avx2(band: Band<'_>, desk: &mut Desk) {
    paint(band, desk);
}

/// The crate adds the other parts of AVX-512 that processors have on which it is fast.
#[multiversion::multiversion(targets("x86_64+avx512f+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn paint_avx512(band: Band<'_>, desk: &mut Desk) {
    paint(band, desk);
}

/// Rows of a column to be shaded: they see an upright face, or nothing.
struct Run<'a> {
    column: usize,
    start: usize,
    count: usize,
    side: Option<Side<'a>>,
}

/// Notes what a column shows. Texels of upright faces are asked for, so that they are there when the runs are shaded.
#[inline(always)]
fn lay_out<'a>(band: &Band<'a>, desk: &mut Desk, rows: usize, column: usize, runs: &mut Vec<Run<'a>>) {
    let (frame, eye) = (band.frame, band.frame.params.camera_height);
    let hits = band.hits.of(column);
    for span in band.spans.of(column) {
        let start = (span.start as usize).saturating_sub(band.first_row);
        let end = (span.end as usize).saturating_sub(band.first_row).min(rows);
        if start >= end {
            continue;
        }
        let hit = hits.get(usize::from(span.hit));
        let (mut near, mut height, mut room) = (0.0, 0.0, 0.0);
        match (span.face, hit) {
            (Face::Side, Some(hit)) => near = hit.near,
            (Face::Top, Some(hit)) => height = hit.top - eye,
            (Face::Underside, Some(hit)) => height = hit.bottom - eye,
            (_, None) => room = 1.0,
        }
        let (next, instance) = (desk.first_change[start], (span.surface + 1) as u16);
        desk.changes.push(Change { next, column: column as u32, instance, near, height, room });
        desk.first_change[start] = desk.changes.len() as u32;
        let count = end - start;
        match (span.face, hit) {
            (Face::Side, Some(hit)) => {
                let side = Side::new(band.scene, frame, hit, frame.directions[column], band.first_row + start, count);
                side.fetch();
                runs.push(Run { column, start, count, side: Some(side) });
            }
            _ if span.surface == NOTHING => runs.push(Run { column, start, count, side: None }),
            _ => note_level(desk, span.surface, span.face, start..end, column),
        }
    }
}

/// Notes that rows of a column see a horizontal surface.
#[inline(always)]
fn note_level(desk: &mut Desk, surface: u32, face: Face, rows: Range<usize>, column: usize) {
    let group = column / POINTS;
    let mut of_group = desk.levels.iter().rev().take_while(|l| l.group == group);
    let known = of_group.position(|l| l.surface == surface && l.face == face).map(|k| desk.levels.len() - 1 - k);
    let k = known.unwrap_or_else(|| {
        let masks = vec![0; desk.first_change.len()];
        desk.levels.push(Level { group, surface, face, rows: rows.clone(), masks });
        desk.levels.len() - 1
    });
    let level = &mut desk.levels[k];
    level.rows = level.rows.start.min(rows.start)..level.rows.end.max(rows.end);
    for mask in &mut level.masks[rows] {
        *mask |= 1 << (column % POINTS);
    }
}

/// Shades the horizontal surfaces of a row, and puts the row into the picture.
#[inline(always)]
fn show_row(band: &mut Band<'_>, desk: &mut Desk, number: usize) {
    let frame = band.frame;
    let width = frame.params.width as usize;
    let row = &frame.rows[band.first_row + number];
    let now = &mut desk.now;
    let mut next = desk.first_change[number] as usize;
    while let Some(change) = next.checked_sub(1).and_then(|k| desk.changes.get(k)) {
        let column = change.column as usize;
        (now.near[column], now.height[column], now.room[column]) = (change.near, change.height, change.room);
        now.instance[column] = change.instance;
        next = change.next as usize;
    }
    let colours = &mut desk.colours[number * desk.stride..][..desk.stride];
    for level in desk.levels.iter().filter(|l| l.rows.contains(&number)) {
        let columns = POINTS * level.group..POINTS * (level.group + 1);
        let [x, y] = now.directions.each_ref().map(|d| d[columns.clone()].first_chunk());
        if let (Some(x), Some(y), Some(out)) = (x, y, colours[columns].first_chunk_mut()) {
            let plane = Plane::new(band.scene, frame, level.surface, level.face == Face::Underside);
            let height = plane.height() - frame.params.camera_height;
            let t = if level.surface < 2 { row.plane } else { height * row.inverse_tan };
            let sight = Sight { scene: band.scene, frame, row, t };
            plane.shade(sight, [x, y], level.masks[number], &mut desk.point, out);
        }
    }
    let places = width * number..width * (number + 1);
    band.rgba[4 * places.start..4 * places.end].copy_from_slice(bytemuck::cast_slice(&colours[..width]));
    band.instance[places.clone()].copy_from_slice(&now.instance);
    show_ranges(*row, now, &mut band.range[places]);
}

/// The ranges of a row.
#[inline(always)]
fn show_ranges(row: Row, now: &Now, out: &mut [f32]) {
    let count = out.len();
    let (near, height, room) = (&now.near[..count], &now.height[..count], &now.room[..count]);
    for k in 0..count {
        let distance = near[k] + height[k] * row.inverse_tan + room[k] * row.plane;
        out[k] = if distance < FAR { distance * row.stretch } else { 0.0 };
    }
}
