//! Bar charts: groups of bars side by side, as SVG.

use svg::node::element::Group;

use super::{Axis, SERIES, Stroke, stroked, titled, wrapped};
use crate::draw::shapes::{FAINT_INK, GRID, INK, line, rectangle, text};

/// Size of a chart, px.
const WIDTH_PX: f64 = 900.0;
const HEIGHT_PX: f64 = 440.0;
/// The plot within it, px: left, top, right, bottom.
const PLOT_PX: [f64; 4] = [70.0, 50.0, 660.0, 392.0];
/// Where the legend begins, px.
const LEGEND_PX: f64 = 680.0;
/// Share of a group's width that its bars fill.
const FILLED: f64 = 0.84;

/// Bars of one colour: one a group.
#[derive(Debug, Clone, PartialEq)]
pub struct BarSeries {
    /// What they are.
    pub label: String,
    /// One a group; `None` where there is no value, which is marked by a cross.
    pub values: Vec<Option<f64>>,
}

/// A bar chart.
#[derive(Debug, Clone, PartialEq)]
pub struct Bars {
    /// The line above.
    pub title: String,
    /// Name of the vertical axis, with its unit.
    pub axis: String,
    /// Names of the groups.
    pub groups: Vec<String>,
    /// The bars.
    pub series: Vec<BarSeries>,
    /// A level across each group's bars, and what it is.
    pub bound: (String, Vec<f64>),
    /// A remark below the legend.
    pub note: String,
}

impl Bars {
    /// The drawing as SVG text. The same chart gives the same bytes.
    pub fn to_svg(&self) -> String {
        let [left, top, right, bottom] = PLOT_PX;
        let values: Vec<f64> = self.series.iter().flat_map(|s| s.values.iter().flatten().copied()).chain([0.0]).collect();
        let axis = Axis::linear(self.axis.clone()).from(0.0);
        let y = axis.place(&values, [bottom, top], false);
        let grid = Group::new().set("stroke", GRID).set("stroke-width", 1);
        let [grid, mut names] = y.draw_vertical([left, right], grid, Group::new().set("fill", INK));
        names = names.add(y.vertical_name());
        let mut bars = Group::new();
        let group_px = (right - left) / self.groups.len().max(1) as f64;
        let bar_px = FILLED * group_px / self.series.len().max(1) as f64;
        for (g, name) in self.groups.iter().enumerate() {
            let from = left + (g as f64 + 0.5 * (1.0 - FILLED)) * group_px;
            let to = from + FILLED * group_px;
            for (k, series) in self.series.iter().enumerate() {
                let x = from + k as f64 * bar_px;
                match series.values.get(g).copied().flatten() {
                    Some(value) => {
                        bars = bars.add(rectangle([x + 0.5, y.at(value), x + bar_px - 0.5, bottom]).set("fill", colour(k)));
                    }
                    None => {
                        let cross = text("\u{d7}", x + 0.5 * bar_px, bottom - 4.0, 14.0).set("fill", colour(k));
                        bars = bars.add(cross.set("text-anchor", "middle").set("font-weight", "bold"));
                    }
                }
            }
            if let Some(bound) = self.bound.1.get(g) {
                bars =
                    bars.add(stroked(line([from - 3.0, y.at(*bound)], [to + 3.0, y.at(*bound)]), &Stroke::EXACT.dashed("5 3")));
            }
            names = names.add(text(name, 0.5 * (from + to), bottom + 20.0, 13.0).set("text-anchor", "middle"));
        }
        titled(&self.title, [WIDTH_PX, HEIGHT_PX], left, None)
            .add(grid)
            .add(bars)
            .add(stroked(line([left, bottom], [right, bottom]), &Stroke { colour: FAINT_INK, width_px: 1.0, dashes: "" }))
            .add(names)
            .add(self.legend())
            .to_string()
            + "\n"
    }

    fn legend(&self) -> Group {
        let mut group = Group::new().set("fill", INK);
        let mut at = PLOT_PX[1] + 8.0;
        let labels = self.series.iter().map(|series| &series.label).chain([&self.bound.0]);
        for (k, label) in labels.enumerate() {
            group = if k < self.series.len() {
                group.add(rectangle([LEGEND_PX, at - 6.0, LEGEND_PX + 16.0, at + 6.0]).set("fill", colour(k)))
            } else {
                let level = line([LEGEND_PX - 2.0, at], [LEGEND_PX + 18.0, at]);
                group.add(stroked(level, &Stroke::EXACT.dashed("5 3")))
            };
            for part in wrapped(label, 26) {
                group = group.add(text(&part, LEGEND_PX + 26.0, at + 4.0, 12.0));
                at += 15.0;
            }
            at += 5.0;
        }
        for (k, part) in wrapped(&self.note, 32).iter().enumerate() {
            group = group.add(text(part, LEGEND_PX, at + 12.0 + 15.0 * k as f64, 12.0).set("fill", FAINT_INK));
        }
        group
    }
}

/// Colour of a series: those of charts, then two greys.
fn colour(k: usize) -> &'static str {
    SERIES.get(k).copied().unwrap_or(if k == SERIES.len() { "#8a8a8a" } else { "#3c3c3c" })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_for_each_value_and_a_cross_for_none() {
        let series = |label: &str, values: [Option<f64>; 2]| BarSeries { label: label.into(), values: values.into() };
        let chart = Bars {
            title: "t".into(),
            axis: "time (s)".into(),
            groups: vec!["P1".into(), "P2".into()],
            series: vec![series("a", [Some(10.0), Some(20.0)]), series("b", [None, Some(5.0)])],
            bound: ("straight line".into(), vec![8.0, 4.0]),
            note: String::new(),
        };
        let svg = chart.to_svg();
        // Page, three bars, two in the legend.
        assert_eq!((svg.matches("<rect").count(), svg.matches('\u{d7}').count()), (6, 1), "{svg}");
        assert!(!svg.contains("NaN"));
    }
}
