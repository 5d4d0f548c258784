//! Walls inside a room, with their doors and windows.
//!
//! A wall stands on a segment, half of its thickness on either side. Its openings cut it into upright pieces: what is left between
//! them has the height of the wall, and above and below an opening there may be a lintel and a sill. Nothing is in an opening.
//! Walls may cross one another and reach into the walls of the room. The end of a wall is cut straight, so that two that make a
//! corner fill it when one of them goes on by half the thickness of the other.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::World;
use super::texture::{Texture, TextureSpec};
use crate::geometry::Vector2;

/// A wall inside the room.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WallSpec {
    /// Name, for messages and plots.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Where it begins, in the middle of its thickness, m.
    pub from_m: [f64; 2],
    /// Where it ends, m.
    pub to_m: [f64; 2],
    /// Thickness, m.
    #[serde(default = "WallSpec::default_thickness")]
    pub thickness_m: f64,
    /// Height, m; by default that of the room.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height_m: Option<f64>,
    /// Texture of its sides and of the faces of its openings; by default that of the room's first wall, with a seed of its own. It
    /// runs on along the wall where there are openings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub texture: Option<TextureSpec>,
    /// Doors and windows.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub openings: Vec<OpeningSpec>,
}

/// A door or window of a wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpeningSpec {
    /// What it is; this sets where its sill is unless `sill_m` does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<OpeningKind>,
    /// Where it begins: distance along the wall from `from_m`, m.
    pub from_start_m: f64,
    /// Width along the wall, m.
    pub width_m: f64,
    /// Height of its lower edge above the floor, m; by default 0, and 0.9 for a window.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sill_m: Option<f64>,
    /// Height of its upper edge, the underside of the lintel, m; by default 2, and no more than the height of the wall, at which
    /// there is no lintel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub top_m: Option<f64>,
}

/// Kinds of openings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OpeningKind {
    /// Down to the floor.
    Door,
    /// With a sill.
    Window,
}

impl WallSpec {
    /// A wall of the usual thickness and the room's height, without openings.
    #[must_use]
    pub fn new(from_m: [f64; 2], to_m: [f64; 2]) -> Self {
        let thickness_m = Self::default_thickness();
        Self { name: String::new(), from_m, to_m, thickness_m, height_m: None, texture: None, openings: Vec::new() }
    }

    fn default_thickness() -> f64 {
        0.1
    }

    /// Length, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        let [x, y] = [0, 1].map(|axis| self.to_m[axis] - self.from_m[axis]);
        (x * x + y * y).sqrt()
    }
}

impl OpeningSpec {
    /// Sill of a window that names none, m.
    const WINDOW_SILL_M: f64 = 0.9;
    /// Upper edge of an opening that names none, m.
    const TOP_M: f64 = 2.0;

    /// Height of the lower edge, m.
    #[must_use]
    pub fn bottom_m(&self) -> f64 {
        let usual = if self.kind == Some(OpeningKind::Window) { Self::WINDOW_SILL_M } else { 0.0 };
        self.sill_m.unwrap_or(usual)
    }

    /// Height of the upper edge in a wall of this height, m.
    #[must_use]
    pub fn top_in(&self, wall_height_m: f64) -> f64 {
        self.top_m.unwrap_or(Self::TOP_M.min(wall_height_m))
    }
}

/// A wall inside a checked world.
///
/// Its own frame has the origin at the beginning of the wall in the middle of its thickness, x along the wall and y to the left.
#[derive(Debug, Clone, PartialEq)]
pub struct Partition {
    /// Name from the file, or "inner wall" and its number.
    pub name: String,
    /// Where it begins, m.
    pub from: Vector2<f64>,
    /// Unit vector along it.
    pub along: Vector2<f64>,
    /// Length, m.
    pub length_m: f64,
    /// Thickness, m.
    pub thickness_m: f64,
    /// What it consists of, from its beginning to its end; above one another from the floor up.
    pub pieces: Vec<Piece>,
    /// Texture. u runs along the right side from the beginning of the wall, along the left side from its end, so that whoever stands
    /// before either side sees it run from left to right; v is the height above the floor.
    pub texture: Texture,
    /// Where in its texture the left side begins along u, and how much farther up along v, m, so that the two sides do not look
    /// alike.
    pub left_start_m: f64,
    /// See above.
    pub left_rise_m: f64,
    /// Instance id in panoramas.
    pub instance: u16,
}

/// An upright piece of a wall, as thick as the wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Where it begins and ends along the wall, m.
    pub along_m: [f64; 2],
    /// Height of its underside, m.
    pub bottom_m: f64,
    /// Height of its top, m.
    pub top_m: f64,
}

/// Least height or length of a piece, m: what is smaller is left out.
const LEAST_PIECE_M: f64 = 1e-6;

impl Partition {
    /// Corners of the stretch of the wall between two distances along it, anti-clockwise from the beginning of its right side, m.
    #[must_use]
    pub fn footprint(&self, [from_m, to_m]: [f64; 2]) -> [Vector2<f64>; 4] {
        let left = Vector2::new(-self.along.y, self.along.x) * (0.5 * self.thickness_m);
        let [a, b] = [from_m, to_m].map(|s| self.from + self.along * s);
        [a - left, b - left, b + left, a + left]
    }

    /// The stretches along the wall that something meets which reaches from `bottom_m` to `top_m`, m. Pieces that join make one.
    #[must_use]
    pub fn stretches(&self, bottom_m: f64, top_m: f64) -> Vec<[f64; 2]> {
        let mut stretches: Vec<[f64; 2]> = Vec::new();
        for piece in self.pieces.iter().filter(|p| p.bottom_m < top_m && bottom_m < p.top_m) {
            match stretches.last_mut() {
                Some([_, end]) if piece.along_m[0] <= *end + LEAST_PIECE_M => *end = end.max(piece.along_m[1]),
                _ => stretches.push(piece.along_m),
            }
        }
        stretches
    }
}

/// A stretch of a wall inside the room on a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanStretch {
    /// Corners, anti-clockwise, m.
    pub corners: [Vector2<f64>; 4],
    /// Whether the camera looks over it or through it; the robot does not pass it either way.
    pub seen_through: bool,
}

impl World {
    /// The walls inside the room as a plan shows them: what the robot does not pass, and over that what the camera does not see
    /// through.
    #[must_use]
    pub fn plan_of_walls(&self) -> Vec<PlanStretch> {
        let (robot_m, eye_m) = (self.spec.robot.height_m, self.spec.camera.height_m);
        let stretches = |bottom_m, top_m, seen_through| {
            let of_wall = move |wall: &Partition| -> Vec<_> {
                let stretches = wall.stretches(bottom_m, top_m).into_iter();
                stretches.map(|s| PlanStretch { corners: wall.footprint(s), seen_through }).collect()
            };
            self.partitions.iter().flat_map(of_wall)
        };
        stretches(0.0, robot_m, true).chain(stretches(eye_m, eye_m, false)).collect()
    }
}

/// The pieces that the openings of a wall leave, from its beginning to its end.
pub(super) fn pieces(wall: &WallSpec, height_m: f64) -> Vec<Piece> {
    let length_m = wall.length_m();
    let mut openings: Vec<&OpeningSpec> = wall.openings.iter().collect();
    openings.sort_by(|a, b| a.from_start_m.total_cmp(&b.from_start_m));
    let mut pieces = Vec::new();
    let mut add = |along_m: [f64; 2], bottom_m: f64, top_m: f64| {
        if along_m[1] - along_m[0] > LEAST_PIECE_M && top_m - bottom_m > LEAST_PIECE_M {
            pieces.push(Piece { along_m, bottom_m, top_m });
        }
    };
    let mut at = 0.0;
    for opening in openings {
        let jambs = [opening.from_start_m, (opening.from_start_m + opening.width_m).min(length_m)];
        add([at, jambs[0]], 0.0, height_m);
        add(jambs, 0.0, opening.bottom_m());
        add(jambs, opening.top_in(height_m), height_m);
        at = jambs[1];
    }
    add([at, length_m], 0.0, height_m);
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn openings_leave_jambs_sills_and_lintels() {
        let opening = |kind, from_start_m, width_m| OpeningSpec { kind, from_start_m, width_m, sill_m: None, top_m: None };
        let mut wall = WallSpec::new([1.0, 0.0], [1.0, 6.0]);
        // The window comes first along the wall, and a gap as high as the wall ends it.
        let gap = OpeningSpec { top_m: Some(2.4), ..opening(None, 5.0, 1.0) };
        wall.openings = vec![opening(Some(OpeningKind::Door), 3.0, 0.9), opening(Some(OpeningKind::Window), 1.0, 1.5), gap];
        let found: Vec<_> = pieces(&wall, 2.4).iter().map(|p| (p.along_m, p.bottom_m, p.top_m)).collect();
        let wanted = [
            ([0.0, 1.0], 0.0, 2.4),
            ([1.0, 2.5], 0.0, 0.9),
            ([1.0, 2.5], 2.0, 2.4),
            ([2.5, 3.0], 0.0, 2.4),
            ([3.0, 3.9], 2.0, 2.4),
            ([3.9, 5.0], 0.0, 2.4),
        ];
        assert_eq!(found, wanted);
    }
}
