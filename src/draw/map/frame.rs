//! The page under a map: scale, grid, axes.

use svg::node::element::Group;

use super::WIDTH_PX;
use crate::draw::shapes::{FAINT_INK, GRID, INK, line, px, text, ticks};
use crate::geometry::Vector2;
use crate::world::polygon::bounds;

/// Page left of the map, px.
pub(super) const LEFT_PX: f64 = 62.0;
/// Page below the map, for ticks, the axis' name and the scale bar, px.
pub(super) const AXIS_PX: f64 = 50.0;
/// Page right of the map, px.
const RIGHT_PX: f64 = 20.0;
/// Page around the room inside the map, for the thickness of walls, px.
const RIM_PX: f64 = 10.0;
/// Greatest height of a map, px. A room taller than wide gets a smaller scale.
const MOST_HEIGHT_PX: f64 = 860.0;

/// Where the room lies on the page. The map's own y starts at 0.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    low: Vector2<f64>,
    high: Vector2<f64>,
    /// Scale.
    pub px_per_m: f64,
}

impl Frame {
    pub(super) fn around(outline: &[Vector2<f64>]) -> Self {
        let (low, high) = bounds(outline);
        let size = high - low;
        let free = [WIDTH_PX - LEFT_PX - RIGHT_PX - 2.0 * RIM_PX, MOST_HEIGHT_PX - 2.0 * RIM_PX];
        Self { low, high, px_per_m: (free[0] / size.x).min(free[1] / size.y) }
    }

    /// A point of the room on the page, px.
    pub(super) fn at(&self, point: Vector2<f64>) -> Vector2<f64> {
        let left = LEFT_PX + RIM_PX;
        Vector2::new(left + (point.x - self.low.x) * self.px_per_m, RIM_PX + (self.high.y - point.y) * self.px_per_m)
    }

    pub(super) fn height_px(&self) -> f64 {
        (self.high.y - self.low.y) * self.px_per_m + 2.0 * RIM_PX
    }

    fn right_px(&self) -> f64 {
        self.at(self.high).x + RIM_PX
    }

    /// Distance between ticks: 1, 2 or 5 times a power of ten, at least 60 px apart.
    fn tick_m(&self) -> f64 {
        let least = 60.0 / self.px_per_m;
        let mut step = 0.001;
        for factor in [2.0, 2.5, 2.0].iter().cycle() {
            if step >= least {
                break;
            }
            step *= factor;
        }
        step
    }

    /// Ticks within a range, with what they are called.
    fn ticks(&self, low: f64, high: f64) -> Vec<(f64, String)> {
        ticks(self.tick_m(), low, high)
    }

    /// Lines through all ticks, over the whole map.
    pub(super) fn draw_grid(&self) -> Group {
        let mut grid = Group::new().set("stroke", GRID).set("stroke-width", 1);
        let [left, top, right, bottom] = [LEFT_PX, 0.0, self.right_px(), self.height_px()];
        for (x, _) in self.ticks(self.low.x, self.high.x) {
            let at = self.at(Vector2::new(x, 0.0)).x;
            grid = grid.add(line([at, top], [at, bottom]));
        }
        for (y, _) in self.ticks(self.low.y, self.high.y) {
            let at = self.at(Vector2::new(0.0, y)).y;
            grid = grid.add(line([left, at], [right, at]));
        }
        grid
    }

    pub(super) fn draw_axes(&self) -> Group {
        let [left, right, bottom] = [LEFT_PX, self.right_px(), self.height_px()];
        let mut marks = Group::new().set("stroke", FAINT_INK).set("stroke-width", 1);
        let mut names = Group::new().set("fill", INK);
        marks = marks.add(line([left, 0.0], [left, bottom])).add(line([left, bottom], [right, bottom]));
        for (x, label) in self.ticks(self.low.x, self.high.x) {
            let at = self.at(Vector2::new(x, 0.0)).x;
            marks = marks.add(line([at, bottom], [at, bottom + 5.0]));
            names = names.add(text(&label, at, bottom + 18.0, 12.0).set("text-anchor", "middle"));
        }
        for (y, label) in self.ticks(self.low.y, self.high.y) {
            let at = self.at(Vector2::new(0.0, y)).y;
            marks = marks.add(line([left - 5.0, at], [left, at]));
            names = names.add(text(&label, left - 9.0, at + 4.0, 12.0).set("text-anchor", "end"));
        }
        let middle = [0.5 * (left + right), 0.5 * bottom];
        names = names.add(text("x (m)", middle[0], bottom + 37.0, 13.0).set("text-anchor", "middle"));
        let turned = format!("rotate(-90 {} {})", px(left - 42.0), px(middle[1]));
        names =
            names.add(text("y (m)", left - 42.0, middle[1] + 4.0, 13.0).set("text-anchor", "middle").set("transform", turned));
        Group::new().add(marks).add(names).add(self.draw_scale_bar(right, bottom + 33.0))
    }

    /// A bar of about a tenth of the map's width that ends at `right`.
    fn draw_scale_bar(&self, right: f64, y: f64) -> Group {
        let length_m = self.tick_m();
        let left = right - length_m * self.px_per_m;
        let end = |x: f64| line(Vector2::new(x, y - 4.0), Vector2::new(x, y + 4.0));
        let bar = Group::new()
            .set("stroke", INK)
            .set("stroke-width", 2)
            .add(line([left, y], [right, y]))
            .add(end(left))
            .add(end(right));
        let label = text(&format!("{length_m} m"), left - 8.0, y + 4.0, 12.0).set("text-anchor", "end").set("fill", INK);
        Group::new().add(bar).add(label)
    }
}
