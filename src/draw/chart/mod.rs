//! Charts: points, lines and heat maps over two axes, as SVG.
//!
//! A [`Chart`] takes layers in the order in which they lie on one another; axes fit themselves to what is drawn, unless they
//! are told. The legend stands beside the plot and lists each layer with a label. The same input gives the same bytes.
//!
//! ```
//! use wayhome::draw::chart::{Axis, Chart, Mark, Stroke};
//!
//! let exact = (0..=50).map(|k| [f64::from(k), 0.5 * f64::from(k * k)]);
//! let svg = Chart::new("A falling stone", Axis::linear("time (s)"), Axis::linear("way (m)"))
//!     .line(exact, &Stroke::EXACT, "t\u{b2} / 2")
//!     .points([[10.0, 50.2], [20.0, 199.0]], &Mark::MEASURED, "measured")
//!     .to_svg();
//! assert!(svg.starts_with("<svg"));
//! ```

mod axis;
mod bars;
mod ramp;

use svg::node::element::{Circle, ClipPath, Definitions, Group};

pub(crate) use crate::draw::shapes::{FAINT_INK, INK, blend, circle, line, points, px, rectangle, stroked, text};
use crate::draw::shapes::{GRID, page, polyline};
pub use crate::draw::shapes::{SERIES, Stroke};
pub use axis::Axis;
use axis::Placed;
pub use bars::{BarSeries, Bars};
pub use ramp::Ramp;

/// Size of a chart, px.
const WIDTH_PX: f64 = 760.0;
const HEIGHT_PX: f64 = 440.0;
/// The plot within it, px: left, top, right, bottom.
const PLOT_PX: [f64; 4] = [78.0, 50.0, 560.0, 382.0];
/// Where the legend begins, px.
const LEGEND_PX: f64 = 584.0;

/// How a point is drawn: a disc with a white rim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Colour, as SVG has it.
    pub colour: &'static str,
    /// Radius, px.
    pub radius_px: f64,
}

impl Mark {
    /// What was measured.
    pub const MEASURED: Self = Self { colour: SERIES[1], radius_px: 4.0 };

    /// A disc in one of the [`SERIES`] colours, round and round.
    pub fn series(k: usize) -> Self {
        Self { colour: SERIES[k % SERIES.len()], radius_px: 3.6 }
    }
}

/// A field of coloured cells: `values[row][column]` over the column's x and the row's y, which lie in the cells' middles.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// Middles of the columns, ascending.
    pub x: Vec<f64>,
    /// Middles of the rows, ascending.
    pub y: Vec<f64>,
    /// One row of values for each y.
    pub values: Vec<Vec<f64>>,
    /// From value to colour.
    pub ramp: Ramp,
    /// What the colours show, with its unit.
    pub label: String,
    /// Decimals of the number in each cell.
    pub decimals: usize,
}

#[derive(Debug, Clone)]
enum Layer {
    Line(Vec<[f64; 2]>, Stroke, String),
    Points(Vec<[f64; 2]>, Mark, String),
    Heat(HeatMap),
}

/// A chart that is being drawn.
#[derive(Debug, Clone)]
#[must_use]
pub struct Chart {
    title: String,
    x: Axis,
    y: Axis,
    layers: Vec<Layer>,
    notes: Vec<String>,
}

impl Chart {
    /// An empty chart.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self { title: title.into(), x, y, layers: Vec::new(), notes: Vec::new() }
    }

    /// Adds a line through points. Points that are not finite break it.
    pub fn line(mut self, points: impl IntoIterator<Item = [f64; 2]>, stroke: &Stroke, label: &str) -> Self {
        self.layers.push(Layer::Line(points.into_iter().collect(), *stroke, label.to_owned()));
        self
    }

    /// Adds points. Those that are not finite are left out.
    pub fn points(mut self, points: impl IntoIterator<Item = [f64; 2]>, mark: &Mark, label: &str) -> Self {
        self.layers.push(Layer::Points(points.into_iter().collect(), *mark, label.to_owned()));
        self
    }

    /// Adds a field of coloured cells.
    pub fn heat(mut self, map: HeatMap) -> Self {
        self.layers.push(Layer::Heat(map));
        self
    }

    /// Adds a line of text below the legend.
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// The drawing as SVG text.
    pub fn to_svg(&self) -> String {
        let [left, top, right, bottom] = PLOT_PX;
        let (mut xs, mut ys) = (Vec::new(), Vec::new());
        for layer in &self.layers {
            match layer {
                Layer::Line(points, ..) | Layer::Points(points, ..) => {
                    xs.extend(points.iter().map(|p| p[0]));
                    ys.extend(points.iter().map(|p| p[1]));
                }
                Layer::Heat(map) => {
                    xs.extend(rims(&map.x, &self.x));
                    ys.extend(rims(&map.y, &self.y));
                }
            }
        }
        let tight = self.layers.iter().any(|layer| matches!(layer, Layer::Heat(_)));
        let x = self.x.place(&xs, [left, right], tight);
        let y = self.y.place(&ys, [bottom, top], tight);

        let clip = ClipPath::new().set("id", "plot").add(rectangle([left, top, right, bottom]));
        let mut layers = Group::new().set("clip-path", "url(#plot)");
        for layer in &self.layers {
            layers = layers.add(draw(layer, &x, &y, [&self.x, &self.y]));
        }
        let (grid, axes) = self.draw_axes(&x, &y);
        titled(&self.title, [WIDTH_PX, HEIGHT_PX], left, Some(Definitions::new().add(clip)))
            .add(grid)
            .add(layers)
            .add(axes)
            .add(self.draw_legend())
            .to_string()
            + "\n"
    }

    fn draw_axes(&self, x: &Placed, y: &Placed) -> (Group, Group) {
        let [left, top, right, bottom] = PLOT_PX;
        let mut grid = Group::new().set("stroke", GRID).set("stroke-width", 1);
        let mut marks = Group::new().set("stroke", FAINT_INK).set("stroke-width", 1);
        let mut names = Group::new().set("fill", INK);
        for (at, label) in &x.ticks {
            grid = grid.add(line([*at, top], [*at, bottom]));
            marks = marks.add(line([*at, bottom], [*at, bottom + 5.0]));
            names = names.add(text(label, *at, bottom + 19.0, 12.0).set("text-anchor", "middle"));
        }
        for (at, _) in &y.ticks {
            marks = marks.add(line([left - 5.0, *at], [left, *at]));
        }
        let [grid, mut names] = y.draw_vertical([left, right], grid, names);
        marks = marks.add(line([left, top], [left, bottom])).add(line([left, bottom], [right, bottom]));
        names = names.add(text(&self.x.label, 0.5 * (left + right), bottom + 43.0, 13.0).set("text-anchor", "middle"));
        names = names.add(y.vertical_name());
        (grid, Group::new().add(marks).add(names))
    }

    fn draw_legend(&self) -> Group {
        let mut group = Group::new().set("fill", INK);
        let mut at = PLOT_PX[1] + 8.0;
        for layer in &self.layers {
            let label = match layer {
                Layer::Line(_, stroke, label) if !label.is_empty() => {
                    let sample = line([LEGEND_PX, at], [LEGEND_PX + 24.0, at]);
                    group = group.add(stroked(sample, stroke));
                    label
                }
                Layer::Points(_, mark, label) if !label.is_empty() => {
                    group = group.add(disc([LEGEND_PX + 12.0, at], mark));
                    label
                }
                Layer::Heat(map) => {
                    group = group.add(map.ramp.draw_key(&map.label, LEGEND_PX, at));
                    at += ramp::KEY_PX;
                    continue;
                }
                _ => continue,
            };
            for part in wrapped(label, 19) {
                group = group.add(text(&part, LEGEND_PX + 32.0, at + 4.0, 12.0));
                at += 16.0;
            }
            at += 6.0;
        }
        at += 8.0;
        for part in self.notes.iter().flat_map(|note| wrapped(note, 24)) {
            group = group.add(text(&part, LEGEND_PX, at + 4.0, 12.0).set("fill", FAINT_INK));
            at += 16.0;
        }
        group
    }
}

/// A page with a title above what begins at `left`.
fn titled(title: &str, [width, height]: [f64; 2], left: f64, definitions: Option<Definitions>) -> svg::Document {
    let mut document = page(width, height);
    if let Some(definitions) = definitions {
        document = document.add(definitions);
    }
    document
        .add(rectangle([0.0, 0.0, width, height]).set("fill", "#ffffff"))
        .add(text(title, left, 28.0, 15.0).set("font-weight", "bold").set("fill", INK))
}

fn draw(layer: &Layer, x: &Placed, y: &Placed, axes: [&Axis; 2]) -> Group {
    let at = |point: &[f64; 2]| [x.at(point[0]), y.at(point[1])];
    let seen = |point: &[f64; 2]| point.iter().all(|v| v.is_finite());
    match layer {
        Layer::Line(points, stroke, _) => points
            .split(|point| !seen(point))
            .filter(|piece| piece.len() > 1)
            .fold(Group::new(), |group, piece| group.add(stroked(polyline(piece.iter().map(at)), stroke))),
        Layer::Points(points, mark, _) => {
            points.iter().filter(|point| seen(point)).fold(Group::new(), |group, point| group.add(disc(at(point), mark)))
        }
        Layer::Heat(map) => {
            let (xs, ys) = (rims(&map.x, axes[0]), rims(&map.y, axes[1]));
            let mut group = Group::new();
            for (row, values) in map.values.iter().enumerate() {
                for (column, value) in values.iter().enumerate() {
                    let [left, right] = [x.at(xs[column]), x.at(xs[column + 1])];
                    let [bottom, top] = [y.at(ys[row]), y.at(ys[row + 1])];
                    let (colour, ink) = map.ramp.colour(*value);
                    // A hair of overlap hides the seams that renderers leave between cells.
                    let cell = rectangle([left, top, right + 0.4, bottom + 0.4]).set("fill", colour);
                    let number =
                        text(&format!("{value:.*}", map.decimals), 0.5 * (left + right), 0.5 * (top + bottom) + 4.0, 11.0);
                    group = group.add(cell).add(number.set("text-anchor", "middle").set("fill", ink));
                }
            }
            group
        }
    }
}

/// Borders of cells around ascending middles: halfway between neighbours, as the axis measures.
fn rims(middles: &[f64], axis: &Axis) -> Vec<f64> {
    let at: Vec<f64> = middles.iter().map(|v| axis.measure(*v)).collect();
    let [Some(first), Some(last)] = [at.first(), at.last()] else { return Vec::new() };
    if at.len() == 1 {
        return vec![axis.unmeasure(first - 0.5), axis.unmeasure(first + 0.5)];
    }
    let mut rims = vec![first - 0.5 * (at[1] - first)];
    rims.extend(at.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])));
    rims.push(last + 0.5 * (last - at[at.len() - 2]));
    rims.into_iter().map(|v| axis.unmeasure(v)).collect()
}

/// A text in lines of at most `most` letters, broken between words.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

pub(crate) fn disc(at: [f64; 2], mark: &Mark) -> Circle {
    circle(at, mark.radius_px).set("fill", mark.colour).set("stroke", "#ffffff").set("stroke-width", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_where_the_ticks_say() {
        let chart = Chart::new("t", Axis::linear("x").from(0.0).to(10.0), Axis::log("y").from(1.0).to(100.0));
        let svg = chart.points([[5.0, 10.0], [f64::NAN, 1.0]], &Mark::MEASURED, "").to_svg();
        let [left, top, right, bottom] = PLOT_PX;
        let middle = format!("cx=\"{}\" cy=\"{}\"", px(0.5 * (left + right)), px(0.5 * (top + bottom)));
        assert!(svg.contains(&middle), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 1, "what is not finite is left out");
        assert_eq!(svg.lines().filter(|line| *line == "10").count(), 2, "a tick at 10 on each axis");
    }

    #[test]
    fn cells_cover_the_plot_and_labels_are_broken_between_words() {
        let ramp = Ramp { low: 0.0, high: 3.0 };
        let map = HeatMap {
            x: vec![1.0, 2.0],
            y: vec![1.0, 10.0],
            values: vec![vec![0.0, 1.0], vec![2.0, 3.0]],
            ramp,
            label: "error (cm)".into(),
            decimals: 1,
        };
        let (x, y) = (Axis::linear("x"), Axis::log("y"));
        assert_eq!(rims(&map.x, &x), [0.5, 1.5, 2.5]);
        assert!((rims(&map.y, &y)[1] - 10.0_f64.sqrt()).abs() < 1e-12);
        assert!(Chart::new("t", x, y).heat(map).to_svg().lines().any(|line| line == "3.0"));
        assert_eq!(wrapped("a long label of words", 11), ["a long", "label of", "words"]);
    }
}
