//! Curves over the levels of one axis, with intervals: what shares and ratios do as something gets worse.

use svg::Document;
use svg::node::element::{Group, Polyline};

use crate::draw::chart::{FAINT_INK, INK, SERIES, circle, line, points, px, rectangle, text};

/// Width of a figure, px: that of a phone, where it is shown as it is; on a desk several stand side by side.
pub(super) const WIDTH_PX: f64 = 360.0;
/// The plot, px: left, top, right, bottom.
const PLOT_PX: [f64; 4] = [44.0, 34.0, WIDTH_PX - 8.0, 222.0];
/// How far the curves stand aside of one another, px.
const ASIDE_PX: f64 = 5.0;

/// A curve: what it is called, and at each level the value with its interval where there is one.
pub(super) struct Curve {
    pub label: String,
    pub points: Vec<Option<[f64; 3]>>,
}

/// How values are written on the vertical axis.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Unit {
    /// Shares as percent, from 0 to 1.
    Percent,
    /// Ratios, from 1 on.
    Ratio,
}

/// An empty white figure.
pub(super) fn document([width, height]: [f64; 2]) -> Document {
    Document::new()
        .set("viewBox", format!("0 0 {} {}", px(width), px(height)))
        .set("font-family", "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif")
        .add(rectangle([0.0, 0.0, width, height]).set("fill", "#ffffff"))
}

/// Curves over the levels of the axis that `label` names, and how high the drawing is, px.
pub(super) fn curves(title: &str, (label, levels): (&str, &[String]), unit: Unit, curves: &[Curve]) -> (Group, f64) {
    let [left, top, right, bottom] = PLOT_PX;
    let ticks = match unit {
        Unit::Percent => vec![0.0, 0.25, 0.5, 0.75, 1.0],
        Unit::Ratio => ratio_ticks(curves),
    };
    let (low, high) = (ticks[0], ticks[ticks.len() - 1]);
    let y_of = |value: f64| bottom - (bottom - top) * ((value - low) / (high - low)).clamp(0.0, 1.0);
    let step = (right - left) / levels.len() as f64;
    // Two labels a line where each has room beside its sample.
    let width_px = 0.5 * (right - left + 30.0);
    let fit = curves.iter().all(|curve| 32.0 + 6.6 * curve.label.chars().count() as f64 <= width_px);
    let columns = if fit { 2 } else { 1 };
    let height = bottom + 48.0 + 17.0 * curves.len().div_ceil(columns) as f64;
    let mut page = Group::new().add(text(title, 4.0, 18.0, 14.0).set("font-weight", "bold").set("fill", INK));
    for tick in &ticks {
        let at = y_of(*tick);
        let label = if unit == Unit::Percent { format!("{:.0} %", 100.0 * tick) } else { format!("{tick}") };
        page = page
            .add(line([left, at], [right, at]).set("stroke", "#e8e7e3"))
            .add(text(&label, left - 6.0, at + 4.0, 11.0).set("text-anchor", "end").set("fill", FAINT_INK));
    }
    page = page.add(line([left, bottom], [right, bottom]).set("stroke", FAINT_INK));
    let crowded = levels.iter().any(|level| 6.4 * level.chars().count() as f64 > step);
    for (k, level) in levels.iter().enumerate() {
        let at = left + step * (k as f64 + 0.5);
        let drop = if crowded && k % 2 == 1 { 26.0 } else { 15.0 };
        page = page.add(text(level, at, bottom + drop, 11.0).set("text-anchor", "middle").set("fill", INK));
    }
    let name = text(label, 0.5 * (left + right), bottom + if crowded { 41.0 } else { 33.0 }, 12.0);
    page = page.add(name.set("text-anchor", "middle").set("fill", FAINT_INK));
    for (k, curve) in curves.iter().enumerate() {
        let aside = ASIDE_PX * (k as f64 - 0.5 * (curves.len() - 1) as f64);
        let at = |level: usize| left + step * (level as f64 + 0.5) + aside;
        page = page.add(draw(curve, SERIES[k % SERIES.len()], &at, &y_of));
        let corner = [
            left - 30.0 + (k % columns) as f64 * width_px,
            bottom + if crowded { 60.0 } else { 52.0 } + 17.0 * (k / columns) as f64,
        ];
        let sample = line([corner[0], corner[1] - 4.0], [corner[0] + 18.0, corner[1] - 4.0]);
        page = page
            .add(sample.set("stroke", SERIES[k % SERIES.len()]).set("stroke-width", 2.4))
            .add(text(&curve.label, corner[0] + 24.0, corner[1], 12.0).set("fill", INK));
    }
    (page, height)
}

fn draw(curve: &Curve, colour: &str, x: &dyn Fn(usize) -> f64, y: &dyn Fn(f64) -> f64) -> Group {
    let mut group = Group::new();
    let known: Vec<(usize, [f64; 3])> = curve.points.iter().enumerate().filter_map(|(k, p)| Some((k, (*p)?))).collect();
    let corners = points(known.iter().map(|(k, [_, middle, _])| [x(*k), y(*middle)]));
    let joined = Polyline::new().set("points", corners).set("fill", "none").set("stroke", colour);
    group = group.add(joined.set("stroke-width", 1.4).set("stroke-opacity", 0.55));
    for (k, [low, middle, high]) in known {
        let at = x(k);
        let interval = line([at, y(low)], [at, y(high)]).set("stroke", colour).set("stroke-width", 1.5);
        group = group.add(interval).add(circle([at, y(middle)], 3.0).set("fill", colour));
    }
    group
}

/// From 1 to just above the greatest value, in even steps.
fn ratio_ticks(curves: &[Curve]) -> Vec<f64> {
    let points = curves.iter().flat_map(|curve| curve.points.iter().flatten());
    let most = points.map(|p| p[2]).fold(1.2, f64::max);
    let step = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0].into_iter().find(|step| (most - 1.0) / step <= 5.0).unwrap_or(20.0);
    let count = libm::ceil((most - 1.0) / step - 1e-9) as u32;
    (0..=count).map(|k| libm::round((1.0 + f64::from(k) * step) * 10.0) / 10.0).collect()
}
