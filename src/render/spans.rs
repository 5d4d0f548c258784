//! What the rows of each column see: runs of rows, from the top, each with the face that it shows.
//!
//! Rows look lower and lower, so that each condition that makes a face visible holds from some row on or up to some row. A
//! column's hits are laid out in runs without looking at a single pixel; only where faces of bodies that overlap compete for
//! the same rows are distances compared row by row. Functions are inlined throughout, so that they are compiled for the vector unit
//! of their caller.

use std::ops::Range;

use super::columns::{Face, Hit};
use super::frame::Frame;
use super::hits::ColumnHits;
use super::records::{FAR, Row};

/// Rows that show the same face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    /// First row.
    pub start: u32,
    /// The row after the last.
    pub end: u32,
    /// Number of the surface; [`NOTHING`] where there is none.
    pub surface: u32,
    /// Its face.
    pub face: Face,
    /// Number of the hit in the column's list; of no meaning for floor and ceiling.
    pub hit: u8,
}

/// Surface of rows that would meet floor or ceiling beyond all distance.
pub(super) const NOTHING: u32 = 0xffff;

/// Number of the hit of floor and ceiling, which are none.
const NO_HIT: u8 = u8::MAX;

/// The spans of all columns, column after column.
#[derive(Debug, Default)]
pub(super) struct Spans {
    spans: Vec<Span>,
    /// Where each column's spans begin, and where the last ones end.
    starts: Vec<u32>,
    finder: RowFinder,
    column: Vec<Span>,
    pieces: Vec<Span>,
    rows: Vec<(f32, Span)>,
}

impl Spans {
    #[inline(always)]
    pub fn of(&self, column: usize) -> &[Span] {
        &self.spans[self.starts[column] as usize..self.starts[column + 1] as usize]
    }

    #[inline(always)]
    pub fn find(&mut self, frame: &Frame, hits: &ColumnHits) {
        self.finder.prepare(&frame.rows);
        self.spans.clear();
        self.starts.clear();
        self.starts.push(0);
        let room = room(&frame.rows);
        let mut ahead = 0..0;
        for column in 0..frame.params.width as usize {
            let hits = hits.of(column);
            if let [wall] = hits
                && wall.top >= FAR
            {
                ahead = before_planes_beside(frame, wall.near, &ahead);
                self.lay_out_wall(wall, &ahead, &room);
            } else if hits.windows(2).all(|pair| pair[0].far <= pair[1].near) {
                // Whose footprints do not overlap hide one another as a whole.
                self.lay_out(frame, hits, &room);
            } else {
                self.compete(frame, hits, &room);
            }
            self.starts.push(self.spans.len() as u32);
        }
    }

    /// A wall with nothing before it, which rows `ahead` see.
    #[inline(always)]
    fn lay_out_wall(&mut self, wall: &Hit, ahead: &Range<usize>, room: &[Span]) {
        let (start, end) = (ahead.start as u32, ahead.end as u32);
        let above = room.iter().filter(|r| r.start < start);
        self.spans.extend(above.map(|r| Span { end: r.end.min(start), ..*r }));
        if start < end {
            self.spans.push(Span { start, end, surface: wall.surface, face: Face::Side, hit: 0 });
        }
        let below = room.iter().filter(|r| r.end > end);
        self.spans.extend(below.map(|r| Span { start: r.start.max(end), ..*r }));
    }

    /// Nearest hits first: each takes what is left of the rows that see it.
    #[inline(always)]
    fn lay_out(&mut self, frame: &Frame, hits: &[Hit], room: &[Span]) {
        let rows = &frame.rows;
        self.column.clear();
        self.column.push(Span { start: 0, end: rows.len() as u32, surface: NOTHING, face: Face::Side, hit: NO_HIT });
        for (number, hit) in hits.iter().enumerate() {
            faces(frame, &self.finder, hit, number as u8, |span| claim(&mut self.column, &mut self.pieces, span));
        }
        for span in &self.column {
            if span.hit == NO_HIT {
                // Nothing stands before floor and ceiling.
                self.spans.extend(room.iter().filter_map(|r| {
                    let (start, end) = (r.start.max(span.start), r.end.min(span.end));
                    (start < end).then_some(Span { start, end, ..*r })
                }));
            } else {
                self.spans.push(*span);
            }
        }
    }

    /// Row by row: of all faces that a ray meets, the nearest.
    #[inline(always)]
    fn compete(&mut self, frame: &Frame, hits: &[Hit], room: &[Span]) {
        let rows = &frame.rows;
        self.rows.clear();
        for span in room {
            self.rows.extend((span.start..span.end).map(|r| (rows[r as usize].plane, *span)));
        }
        for (number, hit) in hits.iter().enumerate() {
            faces(frame, &self.finder, hit, number as u8, |span| {
                let places = &mut self.rows[span.start as usize..span.end as usize];
                for (place, row) in places.iter_mut().zip(&rows[span.start as usize..]) {
                    let distance = distance(frame, hit, span.face, row);
                    if distance < place.0 {
                        *place = (distance, span);
                    }
                }
            });
        }
        let mut start = 0;
        for same in self.rows.chunk_by(|a, b| a.1 == b.1) {
            let end = start + same.len() as u32;
            self.spans.push(Span { start, end, ..same[0].1 });
            start = end;
        }
    }
}

/// Horizontal distance at which a row meets a face of a hit.
#[inline(always)]
fn distance(frame: &Frame, hit: &Hit, face: Face, row: &Row) -> f32 {
    match face {
        Face::Side => hit.near,
        Face::Top => (hit.top - frame.params.camera_height) * row.inverse_tan,
        Face::Underside => (hit.bottom - frame.params.camera_height) * row.inverse_tan,
    }
}

/// Ceiling, floor, and the rows near the horizon that meet neither.
#[inline(always)]
fn room(rows: &[Row]) -> Vec<Span> {
    let face = |row: &Row| match (row.plane < FAR, row.tan < 0.0) {
        (false, _) => (NOTHING, Face::Side),
        (true, true) => (0, Face::Top),
        (true, false) => (1, Face::Underside),
    };
    let mut start = 0;
    let spans = rows.chunk_by(|a, b| face(a) == face(b)).map(|same| {
        let (surface, face) = face(&same[0]);
        let span = Span { start, end: start + same.len() as u32, surface, face, hit: NO_HIT };
        start = span.end;
        span
    });
    spans.collect()
}

/// The faces of a hit before floor and ceiling, each with the rows that would see it if nothing else were there.
#[inline(always)]
fn faces(frame: &Frame, finder: &RowFinder, hit: &Hit, number: u8, mut show: impl FnMut(Span)) {
    let rows = &frame.rows;
    let eye = frame.params.camera_height;
    let mut span = |rows: Range<usize>, face: Face| {
        if rows.start < rows.end {
            show(Span { start: rows.start as u32, end: rows.end as u32, surface: hit.surface, face, hit: number });
        }
    };
    // The rows to which floor and ceiling are farther away lie around the horizon.
    let ahead = finder.before_planes(frame, hit.near);
    if hit.top >= FAR {
        span(ahead, Face::Side); // a wall
        return;
    }
    let below_top = finder.first(rows, (hit.top - eye) / hit.near, |r| eye + hit.near * r.tan <= hit.top);
    let below_bottom = finder.first(rows, (hit.bottom - eye) / hit.near, |r| eye + hit.near * r.tan < hit.bottom);
    span(below_top.max(ahead.start)..below_bottom.min(ahead.end), Face::Side);
    if hit.top < eye {
        let from = finder.first(rows, (hit.top - eye) / hit.far, |r| eye + hit.far * r.tan < hit.top);
        span(from..below_top, Face::Top);
    } else if hit.bottom > eye {
        let to = finder.first(rows, (hit.bottom - eye) / hit.far, |r| eye + hit.far * r.tan <= hit.bottom);
        span(below_bottom..to, Face::Underside);
    }
}

/// Gives `span` the rows that nobody has claimed.
#[inline(always)]
fn claim(column: &mut Vec<Span>, pieces: &mut Vec<Span>, span: Span) {
    if !column.iter().any(|c| c.hit == NO_HIT && c.start < span.end && span.start < c.end) {
        return;
    }
    pieces.clear();
    for c in column.iter() {
        let (start, end) = (c.start.max(span.start), c.end.min(span.end));
        if c.hit != NO_HIT || start >= end {
            pieces.push(*c);
            continue;
        }
        if c.start < start {
            pieces.push(Span { end: start, ..*c });
        }
        pieces.push(Span { start, end, ..span });
        if end < c.end {
            pieces.push(Span { start: end, ..*c });
        }
    }
    std::mem::swap(column, pieces);
}

/// The same as [`RowFinder::before_planes`], where it was `beside` a column before: most columns see a wall like their neighbours.
#[inline(always)]
fn before_planes_beside(frame: &Frame, near: f32, beside: &Range<usize>) -> Range<usize> {
    let start = first_beside(&frame.rows, beside.start, |r| r.tan < 0.0 || r.plane > near);
    let end = first_beside(&frame.rows, beside.end, |r| r.tan < 0.0 && r.plane <= near);
    start..end
}

/// The first row for which `below` holds, which it does for all rows after the first; sought from `row` on.
#[inline(always)]
fn first_beside(rows: &[Row], mut row: usize, below: impl Fn(&Row) -> bool) -> usize {
    while row > 0 && below(&rows[row - 1]) {
        row -= 1;
    }
    while row < rows.len() && !below(&rows[row]) {
        row += 1;
    }
    row
}

/// Finds rows by the tangent of their elevation: a table says where to look, a few steps from there are exact.
#[derive(Debug, Default)]
struct RowFinder {
    /// First row at or below evenly spaced tangents, from the top.
    table: Vec<u32>,
    top: f32,
    per_tan: f32,
}

impl RowFinder {
    #[inline(always)]
    fn prepare(&mut self, rows: &[Row]) {
        let (first, last) = (rows[0].tan, rows[rows.len() - 1].tan);
        let cells = 2 * rows.len();
        self.top = first;
        self.per_tan = cells as f32 / (first - last).max(1e-6);
        self.table.clear();
        let mut row = 0;
        self.table.extend((0..=cells).map(|cell| {
            let tan = first - cell as f32 / self.per_tan;
            while row < rows.len() && rows[row].tan > tan {
                row += 1;
            }
            row as u32
        }));
    }

    /// The first row for which `below` holds, which it does for all rows after the first; that is about where the tangent of
    /// elevation falls to `tan`.
    #[inline(always)]
    fn first(&self, rows: &[Row], tan: f32, below: impl Fn(&Row) -> bool) -> usize {
        let cell = ((self.top - tan) * self.per_tan).clamp(0.0, (self.table.len() - 1) as f32);
        first_beside(rows, self.table[cell as usize] as usize, below)
    }

    /// The rows whose rays come farther than `near` before they meet floor or ceiling.
    #[inline(always)]
    fn before_planes(&self, frame: &Frame, near: f32) -> Range<usize> {
        let (rows, p) = (&frame.rows, &frame.params);
        let start = self.first(rows, (p.room_height - p.camera_height) / near, |r| r.tan < 0.0 || r.plane > near);
        let end = self.first(rows, -p.camera_height / near, |r| r.tan < 0.0 && r.plane <= near);
        start..end
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose;
    use crate::render::{Scene, View};
    use crate::world::World;

    /// The short way and the general one, with walls that jump between near and far, and with a horizon in and beyond the picture.
    #[test]
    fn a_lone_wall_is_laid_out_like_any_hit() {
        let world = World::open("lab").unwrap();
        let scene = Scene::new(&world).unwrap();
        let bodies = world.body_poses();
        for (height, horizon_row) in [(1, 0.5), (2, 1.0), (40, 12.3), (40, -9.0), (40, 55.0)] {
            let projection = crate::panorama::Projection { horizon_row, ..world.projection_of_size(90, height) };
            let mut frame = Frame::new();
            let robot = Pose::new(world.home.x, world.home.y, 0.0);
            frame.prepare(&scene, &View { projection, robot, bodies: &bodies }).unwrap();
            let (room, mut ahead) = (room(&frame.rows), 0..0);
            let mut spans = [Spans::default(), Spans::default()];
            for near in [3.0, 0.01, 0.4, 900.0, 5.0, 5.1, 0.2, 2.0e8] {
                let wall = Hit { near, far: near, surface: 2, ..*Hit::NONE };
                spans.iter_mut().for_each(|s| s.spans.clear());
                spans[0].finder.prepare(&frame.rows);
                spans[0].lay_out(&frame, &[wall], &room);
                ahead = before_planes_beside(&frame, near, &ahead);
                spans[1].lay_out_wall(&wall, &ahead, &room);
                assert_eq!(spans[0].spans, spans[1].spans, "{height} {horizon_row} {near}");
                assert_eq!(spans[1].spans.last().unwrap().end, height);
            }
        }
    }
}
