//! Shapes and colours that charts and maps share, in pixels of the page.

use svg::Document;
use svg::node::element::{Circle, Line, Polyline, Rectangle, Text};

/// Text and lines in front.
pub(crate) const INK: &str = "#1a1a1a";
/// Text and lines behind.
pub(crate) const FAINT_INK: &str = "#6b6b6b";
/// Lines of a grid.
pub(super) const GRID: &str = "#e8e7e3";

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008), for series in order.
pub const SERIES: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use]
pub struct Stroke {
    /// Colour, as SVG has it.
    pub colour: &'static str,
    /// Width, px.
    pub width_px: f64,
    /// Lengths of dashes and gaps, px, as SVG has them; empty for a full line.
    pub dashes: &'static str,
}

impl Stroke {
    /// What theory says.
    pub const EXACT: Self = Self { colour: INK, width_px: 1.6, dashes: "" };
    /// A bound or another thing to compare with.
    pub const BOUND: Self = Self { colour: FAINT_INK, width_px: 1.3, dashes: "5 4" };
    /// The true path of a run.
    pub const TRUTH: Self = Self { colour: INK, width_px: 2.0, dashes: "" };
    /// The estimated path.
    pub const ESTIMATE: Self = Self { colour: SERIES[1], width_px: 1.6, dashes: "5 3" };
    /// The path by wheel odometry alone.
    pub const ODOMETRY: Self = Self { colour: SERIES[2], width_px: 1.4, dashes: "2 3" };

    /// A full line in one of the [`SERIES`] colours, round and round.
    pub fn series(k: usize) -> Self {
        Self { colour: SERIES[k % SERIES.len()], width_px: 1.8, dashes: "" }
    }

    /// The same line with dashes.
    pub fn dashed(self, dashes: &'static str) -> Self {
        Self { dashes, ..self }
    }
}

/// Sets a shape's line.
pub(crate) fn stroked<N: svg::Node>(mut shape: N, stroke: &Stroke) -> N {
    shape.assign("stroke", stroke.colour);
    shape.assign("stroke-width", px(stroke.width_px));
    if !stroke.dashes.is_empty() {
        shape.assign("stroke-dasharray", stroke.dashes);
    }
    shape
}

/// A white page.
pub(super) fn page(width: f64, height: f64) -> Document {
    Document::new()
        .set("viewBox", (0, 0, width, height))
        .set("width", px(width))
        .set("height", px(height))
        .set("font-family", "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif")
}

/// A length with two decimals, without a needless tail.
pub(crate) fn px(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Text from its left end on its baseline.
pub(crate) fn text(content: &str, x: f64, y: f64, size_px: f64) -> Text {
    Text::new(content).set("x", px(x)).set("y", px(y)).set("font-size", px(size_px))
}

pub(crate) fn line(a: impl Into<[f64; 2]>, b: impl Into<[f64; 2]>) -> Line {
    let ([ax, ay], [bx, by]) = (a.into(), b.into());
    Line::new().set("x1", px(ax)).set("y1", px(ay)).set("x2", px(bx)).set("y2", px(by))
}

/// An open line without filling.
pub(super) fn polyline(corners: impl IntoIterator<Item = impl Into<[f64; 2]>>) -> Polyline {
    Polyline::new().set("points", points(corners)).set("fill", "none").set("stroke-linejoin", "round")
}

/// Corners as SVG has them.
pub(crate) fn points(corners: impl IntoIterator<Item = impl Into<[f64; 2]>>) -> String {
    let corners = corners.into_iter().map(Into::into).map(|[x, y]: [f64; 2]| format!("{},{}", px(x), px(y)));
    corners.collect::<Vec<_>>().join(" ")
}

pub(crate) fn rectangle([left, top, right, bottom]: [f64; 4]) -> Rectangle {
    Rectangle::new().set("x", px(left)).set("y", px(top)).set("width", px(right - left)).set("height", px(bottom - top))
}

pub(crate) fn circle(centre: impl Into<[f64; 2]>, radius: f64) -> Circle {
    let [x, y] = centre.into();
    Circle::new().set("cx", px(x)).set("cy", px(y)).set("r", px(radius))
}

/// Ticks at the multiples of `step`, which is 1, 2 or 5 times a power of ten, from `low` to `high`, with what they are called.
pub(super) fn ticks(step: f64, low: f64, high: f64) -> Vec<(f64, String)> {
    let decimals = (-libm::floor(libm::log10(step) + 1e-9)).max(0.0) as usize;
    let (first, last) = (libm::ceil(low / step - 1e-9) as i64, libm::floor(high / step + 1e-9) as i64);
    (first..=last).map(|k| k as f64 * step).map(|at| (at, number(at, decimals))).collect()
}

/// A number as an axis shows it.
pub(super) fn number(value: f64, decimals: usize) -> String {
    format!("{:.decimals$}", value + 0.0).replace('-', "\u{2212}")
}

/// The colour at a value, straight between those of the stops around it, which ascend; red, green and blue are 0 to 255.
pub(crate) fn blend(stops: &[(f64, [f64; 3])], value: f64) -> String {
    let after = stops.iter().position(|(at, _)| *at >= value).unwrap_or(stops.len() - 1).max(1);
    let ((low, from), (high, to)) = (stops[after - 1], stops[after]);
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    let [r, g, b] = [0, 1, 2].map(|k| (from[k] + t * (to[k] - from[k])).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}
