//! The hits of all columns at once: each wall and body is projected into the columns that it spans, and only those test it.
//!
//! The tests themselves are those of [`super::columns`]; the projection merely leaves out columns in which they would fail.
//! Functions are inlined throughout, so that they are compiled for the vector unit of their caller.

use std::ops::Range;

use super::columns::{Hit, MAX_HITS, hit_body, hit_wall};
use super::frame::Frame;
use super::records::{Edge, FAR};
use crate::geometry::{Vector2, atan2, cross};

/// The hits of every column, nearest first.
#[derive(Debug, Default)]
pub(super) struct ColumnHits {
    hits: Vec<Hit>,
    counts: Vec<u32>,
}

impl ColumnHits {
    #[inline(always)]
    pub fn of(&self, column: usize) -> &[Hit] {
        &self.hits[column * MAX_HITS..][..self.counts[column] as usize]
    }

    #[inline(always)]
    pub fn find(&mut self, frame: &Frame) {
        let width = frame.params.width as usize;
        self.hits.resize(width * MAX_HITS, *Hit::NONE);
        self.counts.clear();
        self.counts.resize(width, 0);
        let wall_count = frame.params.wall_count as usize;
        for (k, edge) in frame.edges[..wall_count].iter().enumerate() {
            let (a, b) = corners(edge);
            let [n, t] = [edge.normal, edge.tangent].map(|v| v.map(f64::from));
            if cross(a, b) * (t[0] * n[1] - t[1] * n[0]) <= 0.0 {
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
        for (k, body) in frame.bodies.iter().enumerate() {
            for column in body_span(frame, k) {
                if let Some(hit) = hit_body(body, k as u32, &frame.edges, &frame.params, frame.directions[column]) {
                    self.insert(column, hit, wall_count as u32);
                }
            }
        }
    }

    /// Inserts a body before the wall of its column, and cuts it off there.
    #[inline(always)]
    fn insert(&mut self, column: usize, hit: Hit, wall_count: u32) {
        let hits = &mut self.hits[column * MAX_HITS..][..MAX_HITS];
        let mut count = self.counts[column] as usize;
        let wall = count > 0 && hits[count - 1].surface < 2 + wall_count;
        let limit = if wall { hits[count - 1].near } else { FAR };
        if hit.near >= limit {
            return;
        }
        let bodies = count - usize::from(wall);
        let place = hits[..bodies].partition_point(|h| h.near <= hit.near);
        // One place is kept for the wall.
        if bodies == MAX_HITS - 1 {
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

#[inline(always)]
fn corners(edge: &Edge) -> (Vector2<f64>, Vector2<f64>) {
    let [n, t] = [edge.normal, edge.tangent].map(|v| Vector2::new(f64::from(v[0]), f64::from(v[1])));
    let a = n * f64::from(edge.distance) + t * f64::from(edge.along);
    (a, a + t * f64::from(edge.length))
}

/// Columns that may see body `k`, each once.
#[inline(always)]
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
#[inline(always)]
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

#[inline(always)]
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

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let column = self.range.next()?;
        Some(if column >= self.width { column - self.width } else { column })
    }
}
