//! Axes: from values to pixels, and where the ticks are.

use svg::node::element::Group;

use crate::draw::shapes::{line, number, px, text, ticks};

/// An axis with its name, its scale, and its range where it is told.
#[derive(Debug, Clone, PartialEq)]
#[must_use]
pub struct Axis {
    /// Name with unit.
    pub(crate) label: String,
    log: bool,
    low: Option<f64>,
    high: Option<f64>,
}

/// An axis on the page.
pub(crate) struct Placed {
    axis: Axis,
    low: f64,
    high: f64,
    page: [f64; 2],
    /// Where ticks are, px, and what they are called.
    pub ticks: Vec<(f64, String)>,
}

impl Axis {
    /// An even axis.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: false, low: None, high: None }
    }

    /// A logarithmic axis. Values that are not positive have no place on it.
    pub fn log(label: impl Into<String>) -> Self {
        Self { log: true, ..Self::linear(label) }
    }

    /// Sets where it begins.
    pub fn from(self, low: f64) -> Self {
        Self { low: Some(low), ..self }
    }

    /// Sets where it ends.
    pub fn to(self, high: f64) -> Self {
        Self { high: Some(high), ..self }
    }

    /// A value as the axis measures it.
    pub(crate) fn measure(&self, value: f64) -> f64 {
        if self.log { libm::log10(value) } else { value }
    }

    /// The inverse of [`measure`](Self::measure).
    pub(crate) fn unmeasure(&self, measure: f64) -> f64 {
        if self.log { libm::pow(10.0, measure) } else { measure }
    }

    /// The axis over `page` pixels (from its beginning to its end) around the values; `tight` leaves no room at the ends.
    pub(crate) fn place(&self, values: &[f64], page: [f64; 2], tight: bool) -> Placed {
        let known = values.iter().map(|v| self.measure(*v)).filter(|v| v.is_finite());
        let (mut low, mut high) = known.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if high - low < 1e-12 * high.abs().max(1.0) {
            (low, high) = (low - 0.5, high + 0.5);
        }
        let rim = if tight { 0.0 } else { 0.04 * (high - low) };
        let low = self.low.map_or(low - rim, |v| self.measure(v));
        let high = self.high.map_or(high + rim, |v| self.measure(v));
        let mut placed = Placed { axis: self.clone(), low, high, page, ticks: Vec::new() };
        let ticks = if self.log { log_ticks(low, high) } else { even_ticks(low, high) };
        placed.ticks = ticks.into_iter().map(|(v, label)| (placed.at(v), label)).collect();
        placed
    }
}

impl Placed {
    /// Where a value is on the page, px.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let share = (self.axis.measure(value) - self.low) / (self.high - self.low);
        self.page[0] + share * (self.page[1] - self.page[0])
    }

    /// Draws a vertical axis: lines from `left` to `right` into the grid; into the names those of the ticks and its own.
    pub(crate) fn draw_vertical(&self, [left, right]: [f64; 2], mut grid: Group, mut names: Group) -> [Group; 2] {
        for (at, label) in &self.ticks {
            grid = grid.add(line([left, *at], [right, *at]));
            names = names.add(text(label, left - 9.0, at + 4.0, 12.0).set("text-anchor", "end"));
        }
        [grid, names]
    }

    /// The name of a vertical axis, upright beside it.
    pub(crate) fn vertical_name(&self) -> svg::node::element::Text {
        let middle = 0.5 * (self.page[0] + self.page[1]);
        let turn = format!("rotate(-90 22 {})", px(middle));
        text(&self.axis.label, 22.0, middle, 13.0).set("text-anchor", "middle").set("transform", turn)
    }
}

/// Multiples of 1, 2 or 5 times a power of ten, about six of them.
fn even_ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    let rough = (high - low) / 6.0;
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0, 10.0].iter().map(|f| f * power).find(|s| *s >= rough * 0.999).unwrap_or(10.0 * power);
    ticks(step, low, high)
}

/// Powers of ten; with fewer than three of them their double and fivefold too.
fn log_ticks(low: f64, high: f64) -> Vec<(f64, String)> {
    let of = |factors: &[f64]| -> Vec<(f64, String)> {
        let (first, last) = (libm::floor(low) as i32, libm::ceil(high) as i32);
        (first..=last)
            .flat_map(|power| factors.iter().map(move |factor| (power, *factor)))
            .map(|(power, factor)| (factor * libm::pow(10.0, f64::from(power)), power))
            .filter(|(v, _)| (low - 1e-9..=high + 1e-9).contains(&libm::log10(*v)))
            .map(|(v, power)| (v, number(v, (-power).max(0) as usize)))
            .collect()
    };
    let tens = of(&[1.0]);
    if tens.len() >= 3 { tens } else { of(&[1.0, 2.0, 5.0]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_numbers() {
        let labels = |ticks: Vec<(f64, String)>| ticks.into_iter().map(|(_, label)| label).collect::<Vec<_>>();
        assert_eq!(labels(even_ticks(-0.03, 0.31)), ["0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels(even_ticks(-5.0, 25.0)), ["\u{2212}5", "0", "5", "10", "15", "20", "25"]);
        assert_eq!(labels(log_ticks(-2.0, 1.0)), ["0.01", "0.1", "1", "10"]);
        assert_eq!(labels(log_ticks(-0.5, 0.5)), ["0.5", "1", "2"]);
    }
}
