//! The renderer that needs no graphics adapter. The twin of `shaders/panorama.wgsl`.
//!
//! The picture is cut into bands of rows, which threads share, and bands into tiles of a few columns, which fit into the
//! nearest cache. In a tile each column's hits claim rows by distance. Runs of rows that show the same side are then shaded
//! down the column, where u and level of detail stay the same; runs of columns that show the same horizontal surface along
//! the row, where distance and level of detail do. The picture does not depend on the number of threads, since no pixel
//! depends on how the work is cut.

use std::ops::Range;

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
const TILE: usize = 16;
/// Colour where there is nothing.
const VOID: u32 = 0xff00_0000;

/// Number of a band, and its part of the colours, ranges and instance ids.
type BandBuffers<'a> = (usize, ((&'a mut [u8], &'a mut [f32]), &'a mut [u16]));

/// The CPU renderer.
#[derive(Debug)]
pub struct CpuRenderer {
    info: RendererInfo,
    frame: Frame,
    hits: ColumnHits,
}

impl CpuRenderer {
    /// A renderer; its buffers grow with the first picture.
    #[must_use]
    pub fn new() -> Self {
        let info = RendererInfo { kind: "cpu".to_owned(), adapter: std::env::consts::ARCH.to_owned(), driver: String::new() };
        Self { info, frame: Frame::new(), hits: ColumnHits::default() }
    }
}

impl Default for CpuRenderer {
    fn default() -> Self {
        Self::new()
    }
}

impl Renderer for CpuRenderer {
    fn render(&mut self, scene: &Scene, view: &View<'_>, out: &mut Panorama) -> Result<()> {
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
        let paint = |(k, ((rgba, range), instance)): BandBuffers<'_>| {
            Band { scene, frame, hits, rows: &frame.rows[k * rows..], rgba, range, instance }.paint();
        };
        // Inside a pool the caller already spreads pictures over the cores.
        if rayon::current_thread_index().is_some() {
            out.rgba
                .chunks_mut(4 * size)
                .zip(out.range_m.chunks_mut(size))
                .zip(out.instance.chunks_mut(size))
                .enumerate()
                .for_each(paint);
        } else {
            out.rgba
                .par_chunks_mut(4 * size)
                .zip(out.range_m.par_chunks_mut(size))
                .zip(out.instance.par_chunks_mut(size))
                .enumerate()
                .for_each(paint);
        }
        Ok(())
    }

    fn info(&self) -> &RendererInfo {
        &self.info
    }
}

/// Some whole rows of the picture. `rows` begins with the first of them.
struct Band<'a> {
    scene: &'a Scene,
    frame: &'a Frame,
    hits: &'a ColumnHits,
    rows: &'a [Row],
    rgba: &'a mut [u8],
    range: &'a mut [f32],
    instance: &'a mut [u16],
}

/// What the rows of one column see: how far away, and which face, as [`owner`] has it.
#[derive(Clone, Copy)]
struct Column {
    distance: [f32; BAND],
    owner: [u32; BAND],
}

/// Floor or ceiling, as owner of a row.
const ROOM: u32 = 1 << 16;
/// Owner of a row that would meet floor or ceiling beyond all distance.
const NOTHING: u32 = 2 << 16;

/// Number of a face of a hit, or of the [`ROOM`].
fn owner(hit: u32, face: Face) -> u32 {
    4 * hit + face as u32
}

/// No horizontal surface.
const NO_PLANE: u32 = u32::MAX;

/// A tile: arrays of its rows.
struct Tile {
    distance: [[f32; TILE]; BAND],
    /// Instance and horizontal surface: the surface's number times two, one more for an underside.
    instance: [[u16; TILE]; BAND],
    plane: [[u32; TILE]; BAND],
    colour: [[u32; TILE]; BAND],
}

impl Band<'_> {
    fn paint(&mut self) {
        let width = self.frame.params.width as usize;
        self.rows = &self.rows[..self.range.len() / width];
        let mut room = Column { distance: [FAR; BAND], owner: [NOTHING; BAND] };
        for (k, row) in self.rows.iter().enumerate().filter(|(_, row)| row.plane < FAR) {
            room.distance[k] = row.plane;
            room.owner[k] = ROOM + owner(0, if row.tan < 0.0 { Face::Top } else { Face::Underside });
        }
        let mut tile = Tile {
            distance: [[0.0; TILE]; BAND],
            instance: [[0; TILE]; BAND],
            plane: [[NO_PLANE; TILE]; BAND],
            colour: [[VOID; TILE]; BAND],
        };
        for first in (0..width).step_by(TILE) {
            let columns = first..width.min(first + TILE);
            for c in columns.clone() {
                let mut column = room;
                self.claim(c, &mut column);
                self.shade_sides(c, &column, &mut tile, c - first);
            }
            self.shade_planes(columns.clone(), &mut tile);
            self.write(columns, &tile);
        }
    }

    /// Decides what each row of column `c` sees: of all faces that its ray meets, the nearest.
    fn claim(&self, c: usize, column: &mut Column) {
        let rows = self.rows;
        let eye = self.frame.params.camera_height;
        for (k, hit) in (0..).zip(self.hits.of(c)) {
            let side = owner(k, Face::Side);
            if hit.top >= FAR {
                take(column, 0..rows.len(), hit.near, side); // a wall
                continue;
            }
            // Rows look lower and lower, so that each condition holds from some row on or up to some row.
            let below_top = rows.partition_point(|r| eye + hit.near * r.tan > hit.top);
            let below_bottom = rows.partition_point(|r| eye + hit.near * r.tan >= hit.bottom);
            take(column, below_top..below_bottom, hit.near, side);
            if hit.top < eye {
                let from = rows.partition_point(|r| eye + hit.far * r.tan >= hit.top);
                self.take_plane(column, from..below_top, hit.top - eye, owner(k, Face::Top));
            } else if hit.bottom > eye {
                let to = rows.partition_point(|r| eye + hit.far * r.tan > hit.bottom);
                self.take_plane(column, below_bottom..to, hit.bottom - eye, owner(k, Face::Underside));
            }
        }
    }

    fn take_plane(&self, column: &mut Column, rows: Range<usize>, above_eye: f32, owner: u32) {
        for r in rows {
            let t = above_eye * self.rows[r].inverse_tan;
            if t < column.distance[r] {
                column.distance[r] = t;
                column.owner[r] = owner;
            }
        }
    }

    /// Stores a column in its tile and shades its runs of rows that show the same side. Horizontal surfaces come later.
    fn shade_sides(&self, c: usize, column: &Column, tile: &mut Tile, lane: usize) {
        let hits = self.hits.of(c);
        let direction = self.frame.directions[c];
        let count = self.rows.len();
        for (distances, distance) in tile.distance[..count].iter_mut().zip(&column.distance) {
            distances[lane] = *distance;
        }
        let owners = &column.owner[..count];
        let mut colours = [VOID; RUN];
        let mut start = 0;
        while start < count {
            let one = owners[start];
            let end = start + owners[start..].iter().position(|o| *o != one).unwrap_or(count - start);
            let run = start..end;
            let (surface, plane) = match one {
                NOTHING => (None, NO_PLANE),
                _ if one >= ROOM => {
                    let surface = u32::from(one == ROOM + owner(0, Face::Underside));
                    (Some(surface), 3 * surface)
                }
                _ => {
                    let surface = hits[one as usize / 4].surface;
                    let face = one % 4;
                    let plane = if face == Face::Side as u32 {
                        NO_PLANE
                    } else {
                        2 * surface + u32::from(face == Face::Underside as u32)
                    };
                    (Some(surface), plane)
                }
            };
            if plane == NO_PLANE {
                match surface {
                    Some(_) => {
                        let hit: &Hit = &hits[one as usize / 4];
                        shade_side(self.scene, self.frame, hit, direction, &self.rows[run.clone()], &mut colours);
                    }
                    None => colours[..run.len()].fill(VOID),
                }
                for (places, colour) in tile.colour[run.clone()].iter_mut().zip(&colours) {
                    places[lane] = *colour;
                }
            }
            let instance = surface.map_or(0, |s| s as u16 + 1);
            for (instances, planes) in tile.instance[run.clone()].iter_mut().zip(&mut tile.plane[run]) {
                instances[lane] = instance;
                planes[lane] = plane;
            }
            start = end;
        }
    }

    /// Shades the runs of columns that show the same horizontal surface, row by row.
    fn shade_planes(&self, columns: Range<usize>, tile: &mut Tile) {
        let count = columns.len();
        let mut directions = [[0.0; TILE]; 2];
        for (k, direction) in self.frame.directions[columns].iter().enumerate() {
            (directions[0][k], directions[1][k]) = (direction[0], direction[1]);
        }
        for (r, row) in self.rows.iter().enumerate() {
            let planes = &tile.plane[r][..count];
            let mut start = 0;
            while start < count {
                let one = planes[start];
                let end = start + planes[start..].iter().position(|p| *p != one).unwrap_or(count - start);
                if one != NO_PLANE {
                    let plane = Plane::new(self.scene, self.frame, one / 2, one % 2 == 1);
                    let distance = tile.distance[r][start];
                    let colours = plane.shade(self.scene, self.frame, &directions, distance, row.inverse_tan, start..end);
                    tile.colour[r][start..end].copy_from_slice(&colours[start..end]);
                }
                start = end;
            }
        }
    }

    fn write(&mut self, columns: Range<usize>, tile: &Tile) {
        let width = self.frame.params.width as usize;
        let count = columns.len();
        for (r, row) in self.rows.iter().enumerate() {
            let at = r * width + columns.start;
            let pixels = at..at + count;
            let colours: &[u8] = bytemuck::cast_slice(&tile.colour[r]);
            self.rgba[4 * pixels.start..4 * pixels.end].copy_from_slice(&colours[..4 * count]);
            self.instance[pixels.clone()].copy_from_slice(&tile.instance[r][..count]);
            for (range, distance) in self.range[pixels].iter_mut().zip(&tile.distance[r]) {
                *range = if *distance < FAR { distance * row.stretch } else { 0.0 };
            }
        }
    }
}

/// Rows that see nothing nearer than `distance` go to `owner`.
fn take(column: &mut Column, rows: Range<usize>, distance: f32, owner: u32) {
    if rows.start >= rows.end {
        return;
    }
    for (d, o) in column.distance[rows.clone()].iter_mut().zip(&mut column.owner[rows]) {
        let nearer = distance < *d;
        *d = if nearer { distance } else { *d };
        *o = if nearer { owner } else { *o };
    }
}
