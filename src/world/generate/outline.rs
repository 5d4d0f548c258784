//! Outlines of rooms.

use std::f64::consts::TAU;

use strum::{Display, IntoStaticStr, VariantArray};

use super::dice::{Dice, mm};
use crate::geometry::direction;

/// Shape of a room seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Outline {
    /// Four right angles.
    Rectangle,
    /// A rectangle without one corner.
    L,
    /// A rectangle without two neighbouring corners.
    T,
    /// A rectangle with one to four corners cut off.
    Chamfered,
    /// A convex polygon of five to eight corners.
    Polygon,
}

impl Outline {
    /// All of them.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// How it is called in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Corners of a room within `length_m` x `width_m`, anti-clockwise, in whole millimetres. Where `arm_m` is given, an L and a T
    /// consist of arms of that width, as passages do.
    pub(super) fn corners(self, length_m: f64, width_m: f64, arm_m: Option<f64>, dice: &mut Dice) -> Vec<[f64; 2]> {
        let (l, w) = (length_m, width_m);
        let corners = match self {
            Self::Rectangle => vec![[0.0, 0.0], [l, 0.0], [l, w], [0.0, w]],
            Self::L => {
                let x = arm_m.unwrap_or_else(|| l * dice.between(0.45, 0.7));
                let y = arm_m.unwrap_or_else(|| w * dice.between(0.45, 0.7));
                vec![[0.0, 0.0], [l, 0.0], [l, y], [x, y], [x, w], [0.0, w]]
            }
            Self::T => {
                let stem = arm_m.unwrap_or_else(|| l * dice.between(0.4, 0.6));
                let from = (l - stem) * dice.between(0.3, 0.7);
                let y = arm_m.unwrap_or_else(|| w * dice.between(0.45, 0.65));
                let (a, b) = (from, from + stem);
                vec![[0.0, 0.0], [l, 0.0], [l, y], [b, y], [b, w], [a, w], [a, y], [0.0, y]]
            }
            Self::Chamfered => chamfered(l, w, dice),
            Self::Polygon => polygon(l, w, dice),
        };
        let mut corners: Vec<[f64; 2]> = corners.into_iter().map(|c| c.map(mm)).collect();
        if matches!(self, Self::L | Self::T) {
            // Each of the four ways round is as likely.
            let (mirror_x, mirror_y) = (dice.chance(0.5), dice.chance(0.5));
            for [x, y] in &mut corners {
                *x = if mirror_x { mm(l - *x) } else { *x };
                *y = if mirror_y { mm(w - *y) } else { *y };
            }
            if mirror_x != mirror_y {
                corners.reverse();
            }
        }
        corners
    }
}

fn chamfered(l: f64, w: f64, dice: &mut Dice) -> Vec<[f64; 2]> {
    let most = 0.35 * l.min(w);
    let kept = dice.below(4); // at least this corner is cut
    let mut corners = Vec::new();
    for (k, [x, y, along_x, along_y]) in
        [[0.0, 0.0, 0.0, 1.0], [l, 0.0, -1.0, 0.0], [l, w, 0.0, -1.0], [0.0, w, 1.0, 0.0]].into_iter().enumerate()
    {
        let (before, after) = (dice.between(0.4 * most, most), dice.between(0.4 * most, most));
        if k == kept || dice.chance(0.4) {
            // The way into the corner runs along (along_x, along_y) backwards, the way out turns to its left.
            corners.push([x + along_x * before, y + along_y * before]);
            let (out_x, out_y) = (along_y, -along_x);
            corners.push([x + out_x * after, y + out_y * after]);
        } else {
            corners.push([x, y]);
        }
    }
    corners
}

/// Corners on an ellipse, stretched so that the room is as long and wide as it was to be.
fn polygon(l: f64, w: f64, dice: &mut Dice) -> Vec<[f64; 2]> {
    let count = 5 + dice.below(4);
    let first = dice.unit();
    let points: Vec<_> =
        (0..count).map(|k| direction(TAU * (first + k as f64 + dice.between(-0.22, 0.22)) / count as f64)).collect();
    let span = |of: fn(f64, f64) -> f64, start: f64| points.iter().fold([start; 2], |[x, y], p| [of(x, p.x), of(y, p.y)]);
    let (low, high) = (span(f64::min, f64::INFINITY), span(f64::max, f64::NEG_INFINITY));
    points.iter().map(|p| [l * (p.x - low[0]) / (high[0] - low[0]), w * (p.y - low[1]) / (high[1] - low[1])]).collect()
}
