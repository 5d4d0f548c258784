//! The renderer that needs no graphics adapter.
//!
//! Each wall and body is projected once into the columns that it spans, and only those test it exactly. Then bands of rows are
//! painted, column by column: the hits of a column claim rows by distance, and each run of rows with the same owner is shaded
//! as one strip. The picture does not depend on the number of threads, since no pixel depends on how the work is cut.

use std::ops::Range;

use rayon::prelude::*;

use super::columns::{Face, Hit, MAX_HITS, hit_body, hit_wall};
use super::frame::{Edge, Frame};
use super::shade::{Plane, Side, pack};
use super::{Renderer, RendererInfo, Scene, View};
use crate::error::Result;
use crate::geometry::{Vector2, atan2, cross};
use crate::panorama::Panorama;

/// Most rows in a band: the unit of work of a thread.
const BAND: usize = 64;

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
        let rgba: &mut [u32] = bytemuck::cast_slice_mut(&mut out.rgba);
        let paint = |(k, ((rgba, range), instance)): (usize, ((&mut [u32], &mut [f32]), &mut [u16]))| {
            Band { scene, frame, hits, first_row: k * rows, rgba, range, instance }.paint();
        };
        // Inside a pool the caller already spreads pictures over the cores.
        if rayon::current_thread_index().is_some() {
            rgba.chunks_mut(size)
                .zip(out.range_m.chunks_mut(size))
                .zip(out.instance.chunks_mut(size))
                .enumerate()
                .for_each(paint);
        } else {
            rgba.par_chunks_mut(size)
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

/// The hits of every column, nearest first.
#[derive(Debug, Default)]
struct ColumnHits {
    hits: Vec<Hit>,
    counts: Vec<u32>,
}

impl ColumnHits {
    fn of(&self, column: usize) -> &[Hit] {
        &self.hits[column * MAX_HITS..][..self.counts[column] as usize]
    }

    fn find(&mut self, frame: &Frame) {
        let width = frame.params.width as usize;
        self.hits.resize(width * MAX_HITS, Hit::NONE);
        self.counts.clear();
        self.counts.resize(width, 0);
        let wall_count = frame.params.wall_count as usize;
        for (k, edge) in frame.edges[..wall_count].iter().enumerate() {
            let (a, b) = corners(edge);
            if cross(a, b) <= 0.0 {
                continue; // seen from behind
            }
            for column in span(frame, [a, b].into_iter()) {
                if let Some(hit) = hit_wall(edge, k as u32, frame.directions[column]) {
                    let nearest = &mut self.hits[column * MAX_HITS];
                    if self.counts[column] == 0 || hit.near < nearest.near {
                        *nearest = hit;
                        self.counts[column] = 1;
                    }
                }
            }
        }
        for k in 0..frame.bodies.len() {
            for column in body_span(frame, k) {
                if let Some(hit) = hit_body(frame, k as u32, frame.directions[column]) {
                    self.insert(column, hit, wall_count as u32);
                }
            }
        }
    }

    /// Inserts a body before the wall of its column, and cuts it off there.
    fn insert(&mut self, column: usize, hit: Hit, wall_count: u32) {
        let hits = &mut self.hits[column * MAX_HITS..][..MAX_HITS];
        let mut count = self.counts[column] as usize;
        let wall = count > 0 && hits[count - 1].surface < 2 + wall_count;
        let limit = if wall { hits[count - 1].near } else { super::frame::FAR };
        if hit.near >= limit {
            return;
        }
        let bodies = count - usize::from(wall);
        let place = hits[..bodies].partition_point(|h| h.near <= hit.near);
        if count == MAX_HITS {
            if place >= bodies {
                return;
            }
            // The farthest body makes room.
            hits.copy_within(place..bodies - 1, place + 1);
        } else {
            hits.copy_within(place..count, place + 1);
            count += 1;
        }
        hits[place] = Hit { far: hit.far.min(limit), ..hit };
        self.counts[column] = count as u32;
    }
}

fn corners(edge: &Edge) -> (Vector2<f64>, Vector2<f64>) {
    let [n, t] = [edge.normal, edge.tangent].map(|v| Vector2::new(f64::from(v[0]), f64::from(v[1])));
    let a = n * f64::from(edge.distance) + t * f64::from(edge.along);
    (a, a + t * f64::from(edge.length))
}

/// Columns that may see body `k`, each once.
fn body_span(frame: &Frame, k: usize) -> impl Iterator<Item = usize> + use<> {
    const CLOSE: f64 = 1e-3;
    let body = &frame.bodies[k];
    if body.radius > 0.0 {
        let centre = Vector2::new(f64::from(body.centre[0]), f64::from(body.centre[1]));
        let square = centre.x * centre.x + centre.y * centre.y;
        let radius = f64::from(body.radius) + CLOSE;
        if square <= radius * radius {
            return all(frame);
        }
        // The two tangents to the disc touch it at right angles to their radii.
        let reach = (square - radius * radius).sqrt();
        let aside = Vector2::new(-centre.y, centre.x) * (radius / reach);
        span(frame, [centre - aside, centre + aside].into_iter())
    } else {
        let edges = &frame.edges[body.first_edge as usize..][..body.edge_count as usize];
        if edges.iter().all(|e| f64::from(e.distance) > -CLOSE) {
            return all(frame);
        }
        span(frame, edges.iter().map(|e| corners(e).0))
    }
}

/// Columns that look between the outermost of some points, which together span less than half a turn; one more on each side.
fn span(frame: &Frame, points: impl Iterator<Item = Vector2<f64>>) -> Columns {
    let width = frame.params.width as usize;
    let per_rad = f64::from(frame.params.width) / std::f64::consts::TAU;
    let forward = frame.directions[0].map(f64::from);
    let forward = Vector2::new(forward[0], forward[1]);
    let relative = |from: Vector2<f64>, p: Vector2<f64>| atan2(cross(from, p), from.x * p.x + from.y * p.y);
    let mut reference = None;
    let (mut first, mut last) = (0.0_f64, 0.0_f64);
    for p in points {
        let reference = *reference.get_or_insert(p);
        let angle = relative(reference, p);
        first = first.min(angle);
        last = last.max(angle);
    }
    let Some(reference) = reference else { return Columns { range: 0..0, width } };
    let middle = relative(forward, reference);
    let first = libm::floor((middle + first) * per_rad) as i64 - 1;
    let count = (libm::ceil((middle + last) * per_rad) as i64 + 2 - first).min(width as i64);
    let first = first.rem_euclid(width as i64) as usize;
    Columns { range: first..first + count as usize, width }
}

fn all(frame: &Frame) -> Columns {
    let width = frame.params.width as usize;
    Columns { range: 0..width, width }
}

/// A range of columns on the circle.
struct Columns {
    range: Range<usize>,
    width: usize,
}

impl Iterator for Columns {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let column = self.range.next()?;
        Some(if column >= self.width { column - self.width } else { column })
    }
}

/// Some whole rows of the picture.
struct Band<'a> {
    scene: &'a Scene,
    frame: &'a Frame,
    hits: &'a ColumnHits,
    first_row: usize,
    rgba: &'a mut [u32],
    range: &'a mut [f32],
    instance: &'a mut [u16],
}

/// Owner of a row that no hit has claimed.
const FLOOR_OR_CEILING: u8 = u8::MAX;

/// Which hit each row of a band shows in one column, and how far away.
struct Column {
    distance: [f32; BAND],
    owner: [(u8, Face); BAND],
}

impl Band<'_> {
    fn paint(&mut self) {
        let width = self.frame.params.width as usize;
        let mut column = Column { distance: [0.0; BAND], owner: [(0, Face::Side); BAND] };
        for c in 0..width {
            self.claim(c, &mut column);
            self.shade(c, &column);
        }
    }

    fn rows(&self) -> usize {
        self.rgba.len() / self.frame.params.width as usize
    }

    /// Decides what each row sees: of all faces that its ray meets, the nearest.
    fn claim(&self, c: usize, column: &mut Column) {
        let rows = &self.frame.rows[self.first_row..][..self.rows()];
        let height = self.frame.params.camera_height;
        let distance = &mut column.distance[..rows.len()];
        let owner = &mut column.owner[..rows.len()];
        for (d, row) in distance.iter_mut().zip(rows) {
            *d = row.plane;
        }
        owner.fill((FLOOR_OR_CEILING, Face::Top));
        for (k, hit) in self.hits.of(c).iter().enumerate() {
            // Rows look lower and lower, so that each condition holds from some row on or up to some row.
            let at_entry = |z: f32| rows.partition_point(|r| height + hit.near * r.tan > z);
            let at_exit = |z: f32| rows.partition_point(|r| height + hit.far * r.tan >= z);
            let below_top = at_entry(hit.top);
            let below_bottom = rows.partition_point(|r| height + hit.near * r.tan >= hit.bottom);
            for r in below_top..below_bottom {
                if hit.near < distance[r] {
                    distance[r] = hit.near;
                    owner[r] = (k as u8, Face::Side);
                }
            }
            let cap = if hit.top < height {
                (at_exit(hit.top)..below_top, hit.top, Face::Top)
            } else if hit.bottom > height {
                let above = rows.partition_point(|r| height + hit.far * r.tan > hit.bottom);
                (below_bottom..above, hit.bottom, Face::Underside)
            } else {
                continue;
            };
            for r in cap.0 {
                let t = (cap.1 - height) * rows[r].inverse_tan;
                if t < distance[r] {
                    distance[r] = t;
                    owner[r] = (k as u8, cap.2);
                }
            }
        }
    }

    /// Shades the runs of rows that show the same face.
    fn shade(&mut self, c: usize, column: &Column) {
        let owner = &column.owner[..self.rows()];
        let mut start = 0;
        while start < owner.len() {
            let len = owner[start..].iter().position(|o| *o != owner[start]).unwrap_or(owner.len() - start);
            self.shade_run(c, column, start..start + len);
            start += len;
        }
    }

    fn shade_run(&mut self, c: usize, column: &Column, run: Range<usize>) {
        let (scene, frame) = (self.scene, self.frame);
        let width = frame.params.width as usize;
        let direction = frame.directions[c];
        let rows = &frame.rows[self.first_row..];
        let (owner, face) = column.owner[run.start];
        let hit = self.hits.of(c).get(usize::from(owner)).copied();
        if let (Some(hit), Face::Side) = (hit, face) {
            let side = Side::new(scene, frame, &hit, direction);
            let (mut z, mut light) = ([0.0; BAND], [0.0; BAND]);
            let n = run.len();
            for (z, row) in z.iter_mut().zip(&rows[run.clone()]) {
                *z = frame.params.camera_height + hit.near * row.tan;
            }
            side.light(frame, &z[..n], &mut light[..n]);
            for (k, r) in run.enumerate() {
                let at = r * width + c;
                self.rgba[at] = pack(side.colour(scene, z[k]), light[k]);
                self.range[at] = hit.near * rows[r].stretch;
                self.instance[at] = hit.surface as u16 + 1;
            }
            return;
        }
        for r in run {
            let row = &rows[r];
            let t = column.distance[r];
            let at = r * width + c;
            let (plane, surface) = match &hit {
                Some(hit) => (Plane::of_body(scene, frame, hit, face == Face::Top), hit.surface),
                None => (Plane::of_room(scene, frame, row.tan >= 0.0), u32::from(row.tan >= 0.0)),
            };
            if t >= super::frame::FAR {
                (self.rgba[at], self.range[at], self.instance[at]) = (0xff00_0000, 0.0, 0);
                continue;
            }
            let (colour, light) = plane.shade(scene, frame, direction, t, row.inverse_tan);
            self.rgba[at] = pack(colour, light);
            self.range[at] = t * row.stretch;
            self.instance[at] = surface as u16 + 1;
        }
    }
}
