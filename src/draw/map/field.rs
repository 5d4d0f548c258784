//! Layers that cover the floor: coloured cells, arrows, spots.

use svg::node::element::Group;

use super::MapDrawing;
use super::legend::Swatch;
use super::paint;
use crate::draw::chart::Ramp;
use crate::draw::shapes::{INK, circle, rectangle};
use crate::geometry::Vector2;

/// Colours of a field; neighbours of one colour are drawn as one.
const STEPS: f64 = 24.0;
/// Radius of a spot, px.
const SPOT_PX: f64 = 5.0;

impl MapDrawing {
    /// Covers the floor with square cells of `size_m`, given as (middle, value) row by row. Values beyond the ramp take its ends'
    /// colours; cells whose value is NaN are left out.
    pub fn field(mut self, cells: impl IntoIterator<Item = (Vector2<f64>, f64)>, size_m: f64, ramp: Ramp, label: &str) -> Self {
        let step = |value: f64| {
            let share = ((value - ramp.low) / (ramp.high - ramp.low)).clamp(0.0, 1.0);
            ramp.low + (share * STEPS).round() / STEPS * (ramp.high - ramp.low)
        };
        // A run of cells in one row: first middle, last middle, value.
        let mut run: Option<(Vector2<f64>, Vector2<f64>, f64)> = None;
        let mut group = Group::new();
        let mut draw = |(first, last, value): (Vector2<f64>, Vector2<f64>, f64)| {
            let half = Vector2::new(0.5, -0.5) * size_m;
            let (corner, opposite) = (self.frame.at(first - half), self.frame.at(last + half));
            // A hair of overlap hides the seams that renderers leave between cells.
            let cell = rectangle([corner.x, corner.y, opposite.x + 0.3, opposite.y + 0.3]).set("fill", ramp.colour(value).0);
            group = std::mem::take(&mut group).add(cell);
        };
        for (middle, value) in cells {
            let value = step(value);
            match &mut run {
                Some((_, last, same))
                    if *same == value && last.y == middle.y && (middle.x - last.x - size_m).abs() < 1e-6 * size_m =>
                {
                    *last = middle;
                }
                _ => {
                    if let Some(done) = run.take() {
                        draw(done);
                    }
                    run = (!value.is_nan()).then_some((middle, middle, value));
                }
            }
        }
        if let Some(done) = run {
            draw(done);
        }
        self.field = self.field.add(group.set("clip-path", "url(#room)"));
        self.legend.add(Swatch::Field(ramp), label);
        self
    }

    /// Adds arrows, each through a point of the room frame along a heading, `length_m` long.
    pub fn arrows(mut self, arrows: impl IntoIterator<Item = (Vector2<f64>, f64)>, length_m: f64, label: &str) -> Self {
        let length = length_m * self.frame.px_per_m;
        for (point, heading_rad) in arrows {
            let tail = self.frame.at(point) - paint::on_page(heading_rad) * (0.5 * length);
            self.paths = self.paths.add(paint::arrow(tail, length, heading_rad, INK, 1.2));
        }
        self.legend.add(Swatch::Arrow, label);
        self
    }

    /// Adds spots at points of the room frame.
    pub fn spots(mut self, points: impl IntoIterator<Item = Vector2<f64>>, colour: &'static str, label: &str) -> Self {
        for point in points {
            let spot =
                circle(self.frame.at(point), SPOT_PX).set("fill", colour).set("stroke", "#ffffff").set("stroke-width", 1);
            self.field = self.field.add(spot);
        }
        self.legend.add(Swatch::Spot(colour), label);
        self
    }
}
