//! The renderer that needs no graphics adapter. The twin of `shaders/panorama.wgsl`.
//!
//! The picture is cut into bands of rows, which threads share, and bands into tiles of a few columns, which fit into the
//! nearest cache. In a tile each column's hits claim rows by distance. Runs of rows that show the same side are then shaded
//! down the column, where u and level of detail stay the same; runs of columns that show the same horizontal surface along
//! the row, where distance and level of detail do. The picture does not depend on the number of threads, since no pixel
//! depends on how the work is cut.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::columns::{Face, Hit};
use super::frame::{FAR, Frame, Row};
use super::hits::ColumnHits;
use super::sample::RUN;
use super::shade::{Plane, shade_side};
use super::{Renderer, RendererInfo, Scene, View};
use crate::error::Result;
use crate::panorama::Panorama;

/// Most rows in a band: the unit of work of a thread.
const BAND: usize = RUN;
/// Columns of a tile.
const TILE: usize = 32;
/// Colour where there is nothing.
const VOID: u32 = 0xff00_0000;

/// Number of a band, and its part of the colours, ranges and instance ids.
type BandBuffers<'a> = (usize, ((&'a mut [u8], &'a mut [f32]), &'a mut [u16]));

/// The CPU renderer.
#[derive(Debug)]
pub struct CpuRenderer {
    info: RendererInfo,
    /// Those that are idle; there are as many as pictures were ever rendered at once.
    painters: Mutex<Vec<Painter>>,
}

/// What it takes to render a picture. Its buffers grow with the first one.
#[derive(Debug)]
struct Painter {
    frame: Frame,
    hits: ColumnHits,
}

impl CpuRenderer {
    /// A renderer; its buffers grow with the first picture.
    #[must_use]
    pub fn new() -> Self {
        let info = RendererInfo { kind: "cpu".to_owned(), adapter: instruction_set().to_owned(), driver: String::new() };
        Self { info, painters: Mutex::new(Vec::new()) }
    }

    /// Does something with an idle painter, or a new one.
    fn paint_with<T>(&self, work: impl FnOnce(&mut Painter) -> T) -> T {
        let idle = || self.painters.lock().unwrap_or_else(PoisonError::into_inner);
        let painter = idle().pop();
        let mut painter = painter.unwrap_or_else(|| Painter { frame: Frame::new(), hits: ColumnHits::default() });
        let result = work(&mut painter);
        idle().push(painter);
        result
    }
}

fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        return "x86_64 with AVX2";
    }
    std::env::consts::ARCH
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
        self.paint_with(|painter| painter.paint(scene, view, out, alone))
    }

    fn render_group(&mut self, scene: &Scene, views: &[View<'_>], out: &mut [Panorama]) -> Result<()> {
        assert_eq!(views.len(), out.len(), "a place for each view");
        if let ([view], [out]) = (views, &mut *out) {
            return self.paint_with(|painter| painter.paint(scene, view, out, true));
        }
        views
            .par_iter()
            .zip(out)
            .with_max_len(1)
            .try_for_each(|(view, out)| self.paint_with(|painter| painter.paint(scene, view, out, false)))
    }

    fn info(&self) -> &RendererInfo {
        &self.info
    }
}

impl Painter {
    /// Renders a view; `share` its bands with the other threads or paint them all in this one.
    fn paint(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama, share: bool) -> Result<()> {
        self.frame.prepare(scene, view)?;
        self.hits.find(&self.frame);
        let pixels = view.projection.pixels();
        out.projection = view.projection;
        out.rgba.resize(4 * pixels, 0);
        out.range_m.resize(pixels, 0.0);
        out.instance.resize(pixels, 0);
        let (frame, hits) = (&self.frame, &self.hits);
        let (width, height) = (view.projection.width as usize, view.projection.height as usize);
        let rows = height.div_ceil(height.div_ceil(BAND));
        let size = rows * width;
        let paint_band = |(k, ((rgba, range), instance)): BandBuffers<'_>| {
            paint(Band { scene, frame, hits, first_row: k * rows, rgba, range, instance });
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
    first_row: usize,
    rgba: &'a mut [u8],
    range: &'a mut [f32],
    instance: &'a mut [u16],
}

/// Code of a face that a pixel shows: four times its surface's number, plus the face.
fn code(surface: u32, face: Face) -> u32 {
    4 * surface + face as u32
}

/// Code of a pixel that would meet floor or ceiling beyond all distance. As an instance it becomes 0.
const NOTHING: u32 = 4 * 0xffff;

/// The instance that a code stands for.
#[inline(always)]
fn instance(code: u32) -> u16 {
    ((code >> 2) + 1) as u16
}

/// Whether a code is that of a horizontal surface.
#[inline(always)]
fn is_level(code: u32) -> bool {
    code & 3 != 0
}

/// What the rows of one column see: how far away, horizontally, and which face.
#[derive(Clone, Copy)]
struct Column {
    distance: [f32; BAND],
    code: [u32; BAND],
}

/// The same for the columns of a tile, row by row, and the colours.
struct Tile {
    distance: [[f32; TILE]; BAND],
    code: [[u32; TILE]; BAND],
    colour: [[u32; TILE]; BAND],
}

/// Paints a band, on the widest vector unit at hand: results are the same on all.
#[multiversion::multiversion(targets("x86_64+avx2+bmi1+bmi2+lzcnt+popcnt"))]
fn paint(mut band: Band<'_>) {
    let band = &mut band;
    let width = band.frame.params.width as usize;
    let rows = &band.frame.rows[band.first_row..][..band.range.len() / width];
    let mut room = Column { distance: [FAR; BAND], code: [NOTHING; BAND] };
    for (k, row) in rows.iter().enumerate().filter(|(_, row)| row.plane < FAR) {
        room.distance[k] = row.plane;
        room.code[k] = if row.tan < 0.0 { code(0, Face::Top) } else { code(1, Face::Underside) };
    }
    let mut tile = Tile { distance: [[0.0; TILE]; BAND], code: [[0; TILE]; BAND], colour: [[VOID; TILE]; BAND] };
    for first in (0..width).step_by(TILE) {
        let columns = first..width.min(first + TILE);
        for c in columns.clone() {
            let mut column = room;
            claim(band.frame, rows, band.hits.of(c), &mut column);
            shade_sides(band, rows.len(), c, &column, &mut tile, c - first);
        }
        shade_planes(band, rows, columns.clone(), &mut tile);
        write(band, rows, columns, &tile);
    }
}

/// Decides what each row of a column sees: of all faces that its ray meets, the nearest.
#[inline(always)]
fn claim(frame: &Frame, rows: &[Row], hits: &[Hit], column: &mut Column) {
    let eye = frame.params.camera_height;
    for hit in hits {
        let side = code(hit.surface, Face::Side);
        if hit.top >= FAR {
            take(column, 0..rows.len(), |_| hit.near, side); // a wall
            continue;
        }
        // Rows look lower and lower, so that each condition holds from some row on or up to some row.
        let below_top = rows.partition_point(|r| eye + hit.near * r.tan > hit.top);
        let below_bottom = rows.partition_point(|r| eye + hit.near * r.tan >= hit.bottom);
        take(column, below_top..below_bottom, |_| hit.near, side);
        if hit.top < eye {
            let from = rows.partition_point(|r| eye + hit.far * r.tan >= hit.top);
            let top = |r: usize| (hit.top - eye) * rows[r].inverse_tan;
            take(column, from..below_top, top, code(hit.surface, Face::Top));
        } else if hit.bottom > eye {
            let to = rows.partition_point(|r| eye + hit.far * r.tan > hit.bottom);
            let underside = |r: usize| (hit.bottom - eye) * rows[r].inverse_tan;
            take(column, below_bottom..to, underside, code(hit.surface, Face::Underside));
        }
    }
}

/// Rows that see nothing nearer than `distance` show the face `code`.
#[inline(always)]
fn take(column: &mut Column, rows: Range<usize>, distance: impl Fn(usize) -> f32, code: u32) {
    if rows.start >= rows.end {
        return;
    }
    let places = column.distance[rows.clone()].iter_mut().zip(&mut column.code[rows.clone()]);
    for (r, (d, c)) in rows.zip(places) {
        let t = distance(r);
        let nearer = t < *d;
        *d = if nearer { t } else { *d };
        *c = if nearer { code } else { *c };
    }
}

/// Stores a column in its tile and shades its runs of rows that show the same side. Horizontal surfaces come later.
#[inline(always)]
fn shade_sides(band: &Band<'_>, rows: usize, c: usize, column: &Column, tile: &mut Tile, lane: usize) {
    let codes = &column.code[..rows];
    for r in 0..rows.min(BAND) {
        tile.distance[r][lane % TILE] = column.distance[r];
        tile.code[r][lane % TILE] = column.code[r];
    }
    let hits = band.hits.of(c);
    let direction = band.frame.directions[c];
    let mut colours = [VOID; RUN];
    let mut start = 0;
    while start < rows {
        let one = codes[start];
        let end = start + codes[start..].iter().position(|o| *o != one).unwrap_or(rows - start);
        if !is_level(one) {
            match hits.iter().find(|h| h.surface == one >> 2) {
                Some(hit) => {
                    let row = band.first_row + start;
                    shade_side(band.scene, band.frame, hit, direction, row, end - start, &mut colours);
                }
                None => colours = [VOID; RUN],
            }
            for (places, colour) in tile.colour[start..end].iter_mut().zip(&colours) {
                places[lane % TILE] = *colour;
            }
        }
        start = end;
    }
}

/// Shades the runs of columns that show the same horizontal surface, row by row.
#[inline(always)]
fn shade_planes(band: &Band<'_>, rows: &[Row], columns: Range<usize>, tile: &mut Tile) {
    let count = columns.len();
    let mut directions = [[0.0; TILE]; 2];
    for (k, direction) in band.frame.directions[columns].iter().enumerate() {
        (directions[0][k], directions[1][k]) = (direction[0], direction[1]);
    }
    // Rows below one another mostly show the same surface.
    let mut plane = (NOTHING, Plane::new(band.scene, band.frame, 0, false));
    for ((row, codes), (distances, colours)) in rows.iter().zip(&tile.code).zip(tile.distance.iter().zip(&mut tile.colour)) {
        let mut start = 0;
        while start < count {
            let one = codes[start];
            let end = start + codes[start..count].iter().position(|c| *c != one).unwrap_or(count - start);
            if is_level(one) {
                if plane.0 != one {
                    plane = (one, Plane::new(band.scene, band.frame, one >> 2, one == code(one >> 2, Face::Underside)));
                }
                let t = distances[start];
                let shaded = plane.1.shade(band.scene, band.frame, &directions, t, row.inverse_tan, start..end);
                colours[start..end].copy_from_slice(&shaded[start..end]);
            }
            start = end;
        }
    }
}

/// Copies a tile into the picture.
#[inline(always)]
fn write(band: &mut Band<'_>, rows: &[Row], columns: Range<usize>, tile: &Tile) {
    let width = band.frame.params.width as usize;
    let count = columns.len();
    for (r, row) in rows.iter().enumerate() {
        let range = tile.distance[r].map(|d| if d < FAR { d * row.stretch } else { 0.0 });
        let instances = tile.code[r].map(instance);
        let colours: &[u8; 4 * TILE] = bytemuck::cast_ref(&tile.colour[r]);
        let at = r * width + columns.start;
        let rgba = &mut band.rgba[4 * at..4 * (at + count)];
        let ranges = &mut band.range[at..at + count];
        let places = &mut band.instance[at..at + count];
        if count == TILE {
            // The lengths are known here, so that these are moves and no calls.
            rgba.copy_from_slice(colours);
            ranges.copy_from_slice(&range);
            places.copy_from_slice(&instances);
        } else {
            rgba.copy_from_slice(&colours[..4 * count]);
            ranges.copy_from_slice(&range[..count]);
            places.copy_from_slice(&instances[..count]);
        }
    }
}
