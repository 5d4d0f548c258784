//! Success against each condition, one panel an axis.

use svg::Document;
use svg::node::element::{Circle, Group, Line, Path, Polyline, Rectangle, Text};

use super::{share, title};
use crate::study::robustness::{Axis, Cell, Robustness};

/// The page, px.
const PAGE: [f64; 2] = [900.0, 700.0];
/// A panel's plot area, px.
const PANEL: [f64; 2] = [350.0, 220.0];
/// Upper left corners of the plot areas, px.
const CORNERS: [[f64; 2]; 4] = [[70.0, 76.0], [520.0, 76.0], [70.0, 388.0], [520.0, 388.0]];
/// Baseline of the legend, px.
const LEGEND_Y: f64 = 682.0;
/// Free space between the plot area's sides and the first and last level, px.
const RIM: f64 = 16.0;
/// Labels of levels closer than this are left out, px.
const LEAST_LABEL_GAP: f64 = 25.0;

const INK: &str = "#1a1a1a";
const FAINT: &str = "#6b6b6b";
const GRID: &str = "#e8e7e3";
const SUCCESS: &str = "#0072b2";
const WRONG: &str = "#c0143c";

/// Draws the study. The same study gives the same bytes.
pub(super) fn svg(study: &Robustness) -> String {
    let [width, height] = PAGE;
    let [first, last] = study.seeds;
    let heading = format!("Runs that come home in {}, seeds {first} to {last}", study.world);
    let mut page = Document::new()
        .set("viewBox", (0, 0, width, height))
        .set("width", width)
        .set("height", height)
        .set("font-family", "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif")
        .add(Rectangle::new().set("width", width).set("height", height).set("fill", "#ffffff"))
        .add(text(&heading, 24.0, 30.0, 16.0).set("font-weight", "bold"));
    let axes = Axis::ALL.into_iter().filter(|axis| study.cells.iter().any(|c| c.axis == *axis));
    for (axis, corner) in axes.zip(CORNERS) {
        let cells: Vec<&Cell> = study.cells.iter().filter(|c| c.axis == axis).collect();
        page = page.add(panel(axis, &cells).set("transform", format!("translate({} {})", px(corner[0]), px(corner[1]))));
    }
    page.add(legend()).to_string() + "\n"
}

fn panel(axis: Axis, cells: &[&Cell]) -> Group {
    let [width, height] = PANEL;
    let y = |share: f64| height * (1.0 - share);
    let mut group = Group::new().add(text(title(axis), 0.0, -10.0, 13.0).set("font-weight", "bold"));
    for percent in [0, 25, 50, 75, 100] {
        let at = y(f64::from(percent) / 100.0);
        group = group
            .add(line([0.0, at], [width, at], GRID, 1.0))
            .add(text(&format!("{percent} %"), -8.0, at + 4.0, 11.0).set("text-anchor", "end").set("fill", FAINT));
    }
    group = group.add(line([0.0, height], [width, height], FAINT, 1.0));
    let points: Vec<f64> = cells.iter().map(|c| place(axis, c.level)).collect();
    let mut labelled_to = f64::NEG_INFINITY;
    for (cell, &x) in cells.iter().zip(&points) {
        group = group.add(line([x, height], [x, height + 5.0], FAINT, 1.0));
        if x - labelled_to >= LEAST_LABEL_GAP {
            group = group.add(text(&cell.level.to_string(), x, height + 19.0, 11.0).set("text-anchor", "middle"));
            labelled_to = x;
        }
    }
    let curve: Vec<String> = cells.iter().zip(&points).map(|(c, &x)| format!("{},{}", px(x), px(y(share(c))))).collect();
    let curve = Polyline::new().set("points", curve.join(" ")).set("fill", "none");
    group = group.add(curve.set("stroke", SUCCESS).set("stroke-width", 1.5).set("stroke-opacity", 0.5));
    for (cell, &x) in cells.iter().zip(&points) {
        let [low, high] = cell.tally.home_share_95;
        let wrong = cell.tally.wrong_claims as f64 / cell.tally.runs.max(1) as f64;
        group = group.add(interval(x, y(low), y(high))).add(point(x, y(share(cell)))).add(cross(x, y(wrong)));
    }
    group
}

/// Where a level lies on its axis, px from the left. All axes worsen to the right; that of noise is logarithmic.
fn place(axis: Axis, level: f64) -> f64 {
    let scale = |v: f64| if axis == Axis::Noise { libm::log(v) } else { v };
    let levels = axis.levels();
    let (first, last) = (scale(levels[0]), scale(levels[levels.len() - 1]));
    RIM + (PANEL[0] - 2.0 * RIM) * (scale(level) - first) / (last - first)
}

fn legend() -> Group {
    let entry = |x: f64, label: &str| text(label, x + 14.0, LEGEND_Y, 12.0);
    let middle = LEGEND_Y - 4.0;
    Group::new()
        .add(interval(74.0, middle - 8.0, middle + 8.0))
        .add(point(74.0, middle))
        .add(entry(74.0, "came home, with 95 % Wilson interval"))
        .add(cross(390.0, middle))
        .add(entry(390.0, "wrongly claimed to be home"))
}

fn point(x: f64, y: f64) -> Circle {
    Circle::new().set("cx", px(x)).set("cy", px(y)).set("r", 3.5).set("fill", SUCCESS)
}

fn interval(x: f64, low: f64, high: f64) -> Group {
    let cap = |y: f64| line([x - 3.0, y], [x + 3.0, y], SUCCESS, 1.3);
    Group::new().add(line([x, low], [x, high], SUCCESS, 1.3)).add(cap(low)).add(cap(high))
}

fn cross(x: f64, y: f64) -> Path {
    let (left, right, top, bottom) = (px(x - 3.0), px(x + 3.0), px(y - 3.0), px(y + 3.0));
    let strokes = format!("M{left} {top}L{right} {bottom}M{left} {bottom}L{right} {top}");
    Path::new().set("d", strokes).set("stroke", WRONG).set("stroke-width", 1.5)
}

fn line(from: [f64; 2], to: [f64; 2], colour: &str, width: f64) -> Line {
    Line::new()
        .set("x1", px(from[0]))
        .set("y1", px(from[1]))
        .set("x2", px(to[0]))
        .set("y2", px(to[1]))
        .set("stroke", colour)
        .set("stroke-width", width)
}

fn text(content: &str, x: f64, y: f64, size: f64) -> Text {
    Text::new(content).set("x", px(x)).set("y", px(y)).set("font-size", px(size)).set("fill", INK)
}

/// A length with one decimal at most.
fn px(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}
