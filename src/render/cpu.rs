//! The renderer that needs no graphics adapter. The twin of `shaders/panorama.wgsl`.
//!
//! First each column is laid out in runs of rows that show the same face (`hits`, `spans`). Then the picture is cut into bands
//! of rows, which threads share, and these into tiles, whose colours fit into the second cache. A tile is painted group of
//! columns by group of columns: upright faces down the columns, where u and level of detail stay the same; then horizontal ones
//! along the rows, where distance and level of detail do, and one row looks at nearly the texels of the row before. At last the
//! tile's rows are put into the picture. No pixel depends on how the work is cut, nor on the number of threads.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::columns::{Face, Hit};
use super::frame::Frame;
use super::hits::ColumnHits;
use super::now::{Now, Shown, Unit};
use super::sample::{LANES, POINTS, PointRoom, RUN, StripRoom};
use super::shade::{Light, Plane, PlaneRow, Run, Sides};
use super::spans::{NOTHING, Spans};
use super::texels::{Gathered, LookUp, OneByOne};
use super::{InstructionSet, Renderer, RendererInfo, Scene, View, stream};
use crate::error::Result;
use crate::panorama::Panorama;

/// Most rows in a band: the unit of work of a thread.
const BAND: usize = RUN;
/// Most columns in a tile: the colours of wide ones leave the second cache; narrow ones write rows in pieces too short for the
/// processor to see them coming, and picture memory is far away.
const TILE: usize = 8 * POINTS;
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
    desks: Mutex<Vec<Box<Desk>>>,
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
        self.paint(scene, view, out, rayon::current_num_threads() > 1)
    }

    fn render_group(&mut self, scene: &Scene, views: &[View<'_>], out: &mut [Panorama]) -> Result<()> {
        assert_eq!(views.len(), out.len(), "a place for each view");
        // Where threads would be left without a picture they share those there are.
        let share = views.len() < rayon::current_num_threads();
        views.par_iter().zip(out).with_max_len(1).try_for_each(|(view, out)| self.paint(scene, view, out, share))
    }

    fn render_batch(
        &mut self,
        scene: &Scene,
        views: &[View<'_>],
        sink: &mut (dyn FnMut(usize, &mut [Panorama]) -> Result<()> + Send),
    ) -> Result<()> {
        stream::run(views, |view, out, share| self.paint(scene, view, out, share), sink)
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
        if instructions == InstructionSet::Portable {
            self.hits.find(&self.frame);
            self.spans.find(&self.frame, &self.hits);
        } else {
            find_avx2(&self.frame, &mut self.hits, &mut self.spans);
        }
        out.reshape(view.projection)?;
        let (width, height) = (view.projection.width as usize, view.projection.height as usize);
        let most = if share { BAND.min(height.div_ceil(rayon::current_num_threads())) } else { BAND };
        let rows = height.div_ceil(height.div_ceil(most));
        let size = rows * width;
        let paint_band = |(k, ((rgba, range), instance)): BandBuffers<'_>| {
            with_idle(&self.desks, |desk| {
                let (frame, hits, spans) = (&self.frame, &self.hits, &self.spans);
                let band = Band { scene, frame, hits, spans, first_row: k * rows, rgba, range, instance };
                match (instructions, Gathered::new()) {
                    (InstructionSet::Avx512, Some(look_up)) => paint_avx512(look_up, band, desk),
                    (InstructionSet::Avx2, _) => paint_avx2(band, desk),
                    _ => paint(OneByOne, band, desk),
                }
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

/// Where a tile is worked on.
#[derive(Debug, Default)]
struct Desk {
    /// Colours, row by row, each a little longer than the tile's.
    colours: Vec<u32>,
    stride: usize,
    /// Changes of what a column shows, and for each row the number of the first of them, from 1.
    changes: Vec<Change>,
    first_change: Vec<u32>,
    /// Horizontal surfaces that the group of columns at work sees.
    levels: Vec<Level>,
    /// For each of them and each row, and the one after the last, the columns that begin or cease to see it there, a bit each.
    masks: Vec<u64>,
    /// What the columns show in the row at work.
    now: Now,
    columns: Columns,
    /// Where sides are worked on: one is shaded while the texels of the next are brought.
    strips: [StripRoom; 2],
    light: Light,
    /// Where horizontal surfaces are.
    points: PointRoom,
}

/// Colours of some columns, each from the top, and of what may be written after its end.
#[derive(Debug)]
#[repr(align(64))]
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
    /// Column of the tile.
    column: u16,
    shown: Shown,
}

/// A horizontal surface that some columns of a group see, and the rows in which they may.
#[derive(Debug)]
struct Level {
    surface: u32,
    face: Face,
    plane: Plane,
    rows: Range<usize>,
}

impl Desk {
    /// Clears the desk for so many rows and columns.
    fn prepare(&mut self, rows: usize, columns: usize) {
        // Rows must not all fall into the same places of the cache, which repeat every 4 KiB.
        self.stride = columns.next_multiple_of(POINTS) + LANES;
        self.colours.resize(rows * self.stride, VOID);
        self.changes.clear();
        self.first_change.clear();
        self.first_change.resize(rows, 0);
        self.now.resize(columns);
    }

    /// Puts some rows of the columns that were worked on into the tile's, from its column `first` on.
    #[inline(always)]
    fn turn(&mut self, first: usize, rows: Range<usize>) {
        let columns = &self.columns.0;
        for (r, places) in self.colours.chunks_exact_mut(self.stride).enumerate().take(rows.end).skip(rows.start) {
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
fn paint<L: LookUp>(look_up: L, mut band: Band<'_>, desk: &mut Desk) {
    let width = band.frame.params.width as usize;
    let rows = band.range.len() / width;
    let room = room(&band, rows);
    let mut tasks = Vec::new();
    let columns = width.div_ceil(width.div_ceil(TILE)).next_multiple_of(POINTS);
    for first in (0..width).step_by(columns) {
        let tile = first..width.min(first + columns);
        desk.prepare(rows, tile.len());
        for group in tile.clone().step_by(POINTS) {
            let group = group..tile.end.min(group + POINTS);
            desk.levels.clear();
            desk.masks.clear();
            for some in group.clone().step_by(LANES) {
                tasks.clear();
                for column in some..group.end.min(some + LANES) {
                    lay_out(&band, desk, rows, column, first, &mut tasks);
                }
                for tasks in tasks.chunks(LANES) {
                    shade_sides(look_up, &band, desk, tasks);
                }
                desk.turn(some - first, rows_of(&tasks));
            }
            shade_levels(look_up, &band, &room, desk, group, first);
        }
        for row in 0..rows {
            show_row(&mut band, desk, row, tile.clone());
        }
    }
}

/// What each row of a band sees of floor or ceiling, if it does.
#[inline(always)]
fn room<'a>(band: &Band<'a>, rows: usize) -> Vec<PlaneRow<'a>> {
    let planes = [false, true].map(|ceiling| Plane::new(band.scene, band.frame, u32::from(ceiling), ceiling));
    let rows = &band.frame.rows[band.first_row..band.first_row + rows];
    rows.iter().map(|row| planes[usize::from(row.tan >= 0.0)].row(band.scene, band.frame, row, row.plane)).collect()
}

/// From the first row of some tasks to the last; empty where there is none.
#[inline(always)]
fn rows_of(tasks: &[Task<'_>]) -> Range<usize> {
    let start = tasks.iter().map(|task| task.start).min().unwrap_or(0);
    start..tasks.iter().map(|task| task.start + task.run.count).max().unwrap_or(0)
}

/// Does some tasks, at most [`LANES`]. The texels of each are brought before the one ahead of it is shaded: what was just written
/// takes long to load, and what is far away in memory, longer.
#[inline(always)]
fn shade_sides<L: LookUp>(look_up: L, band: &Band<'_>, desk: &mut Desk, tasks: &[Task<'_>]) {
    let (scene, frame) = (band.scene, band.frame);
    let sides = Sides::new(scene, frame, std::array::from_fn(|k| &tasks[k.min(tasks.len() - 1)].run));
    for k in 0..=tasks.len() {
        if tasks.get(k).is_some_and(|task| task.sees_side) {
            sides.at(k).mix(frame, &mut desk.strips[k % 2]);
        }
        let Some(ahead) = k.checked_sub(1) else { continue };
        let task = &tasks[ahead];
        let colours = &mut desk.columns.0[task.column % LANES][task.start..];
        if task.sees_side {
            sides.at(ahead).shade(look_up, scene, frame, &mut desk.strips[ahead % 2], &mut desk.light, colours);
        } else {
            colours[..task.run.count].fill(VOID);
        }
    }
}

/// Shades the horizontal surfaces that a group of columns sees.
#[inline(always)]
fn shade_levels<L: LookUp>(
    look_up: L,
    band: &Band<'_>,
    room: &[PlaneRow<'_>],
    desk: &mut Desk,
    group: Range<usize>,
    first: usize,
) {
    let frame = band.frame;
    let (mut x, mut y) = ([0.0; POINTS], [0.0; POINTS]);
    for (k, direction) in frame.directions[group.clone()].iter().take(POINTS).enumerate() {
        [x[k], y[k]] = *direction;
    }
    let masks = desk.masks.chunks_exact(desk.first_change.len() + 1);
    for (level, masks) in desk.levels.iter().zip(masks) {
        let height = level.plane.height() - frame.params.camera_height;
        let rows = desk.colours.chunks_exact_mut(desk.stride).enumerate();
        let mut wanted = 0;
        for (number, colours) in rows.take(level.rows.end).skip(level.rows.start) {
            wanted ^= masks[number];
            let Some(colours) = colours[group.start - first..].first_chunk_mut() else { continue };
            let own;
            let row = if level.surface < 2 {
                &room[number]
            } else {
                let row = &frame.rows[band.first_row + number];
                own = level.plane.row(band.scene, frame, row, height * row.inverse_tan);
                &own
            };
            row.shade(look_up, frame, [&x, &y], wanted, &mut desk.points, colours);
        }
    }
}

/// What the columns see, on AVX2, for wider vectors gain nothing here.
#[multiversion::multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn find_avx2(frame: &Frame, hits: &mut ColumnHits, spans: &mut Spans) {
    hits.find(frame);
    spans.find(frame, hits);
}

#[multiversion::multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn paint_avx2(band: Band<'_>, desk: &mut Desk) {
    paint(OneByOne, band, desk);
}

/// The crate adds the other parts of AVX-512 that processors have on which it is fast.
#[multiversion::multiversion(targets("x86_64+avx512f+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn paint_avx512(look_up: Gathered, band: Band<'_>, desk: &mut Desk) {
    paint(look_up, band, desk);
}

/// Rows of a column, from `start` of the band on, that see an upright face, or nothing.
struct Task<'a> {
    column: usize,
    start: usize,
    sees_side: bool,
    run: Run<'a>,
}

/// Notes what a column shows, and what is to be done for it.
#[inline(always)]
fn lay_out<'a>(band: &Band<'a>, desk: &mut Desk, rows: usize, column: usize, first: usize, tasks: &mut Vec<Task<'a>>) {
    let (frame, eye) = (band.frame, band.frame.params.camera_height);
    let hits = band.hits.of(column);
    for span in band.spans.of(column) {
        let start = (span.start as usize).saturating_sub(band.first_row);
        let end = (span.end as usize).saturating_sub(band.first_row).min(rows);
        if start >= end {
            continue;
        }
        let hit = hits.get(usize::from(span.hit));
        let (distance, unit) = match (span.face, hit) {
            (Face::Side, Some(hit)) => (hit.near, Unit::Metre),
            (Face::Top, Some(hit)) => (hit.top - eye, Unit::InverseTan),
            (Face::Underside, Some(hit)) => (hit.bottom - eye, Unit::InverseTan),
            (_, None) => (1.0, Unit::Plane),
        };
        let shown = Shown { distance, unit, instance: frame.instance(span.surface) };
        let next = desk.first_change[start];
        desk.changes.push(Change { next, column: (column - first) as u16, shown });
        desk.first_change[start] = desk.changes.len() as u32;
        let task = |sees_side, hit| {
            let run = Run { hit, direction: frame.directions[column], first_row: band.first_row + start, count: end - start };
            Task { column, start, sees_side, run }
        };
        match (span.face, hit) {
            (Face::Side, Some(hit)) => tasks.push(task(true, hit)),
            _ if span.surface == NOTHING => tasks.push(task(false, Hit::NONE)),
            _ => note_level(band, desk, span.surface, span.face, start..end, column - first),
        }
    }
}

/// Notes that rows of a column see a horizontal surface, where none was noted to see it before.
#[inline(always)]
fn note_level(band: &Band<'_>, desk: &mut Desk, surface: u32, face: Face, rows: Range<usize>, column: usize) {
    let all_rows = desk.first_change.len();
    let known = desk.levels.iter().position(|l| l.surface == surface && l.face == face);
    let k = known.unwrap_or_else(|| {
        let plane = Plane::new(band.scene, band.frame, surface, face == Face::Underside);
        desk.levels.push(Level { surface, face, plane, rows: rows.clone() });
        desk.masks.resize(desk.masks.len() + all_rows + 1, 0);
        desk.levels.len() - 1
    });
    let level = &mut desk.levels[k];
    level.rows = level.rows.start.min(rows.start)..level.rows.end.max(rows.end);
    let changes = &mut desk.masks[k * (all_rows + 1)..][..=all_rows];
    for row in [rows.start, rows.end] {
        changes[row] ^= 1 << (column % POINTS);
    }
}

/// Puts a tile's row into the picture.
#[inline(always)]
fn show_row(band: &mut Band<'_>, desk: &mut Desk, number: usize, columns: Range<usize>) {
    let frame = band.frame;
    let row = &frame.rows[band.first_row + number];
    let now = &mut desk.now;
    let mut next = desk.first_change[number] as usize;
    while let Some(change) = next.checked_sub(1).and_then(|k| desk.changes.get(k)) {
        now.set(usize::from(change.column), change.shown);
        next = change.next as usize;
    }
    let start = frame.params.width as usize * number + columns.start;
    let places = start..start + columns.len();
    let colours = &desk.colours[number * desk.stride..][..columns.len()];
    band.rgba[4 * places.start..4 * places.end].copy_from_slice(bytemuck::cast_slice(colours));
    now.show(*row, &mut band.instance[places.clone()], &mut band.range[places]);
}
