//! Colours and small shapes of maps, in pixels.

use svg::node::element::{Ellipse, Group, Path, Polygon, Polyline};

pub(crate) use crate::draw::shapes::INK;
pub(super) use crate::draw::shapes::circle;
use crate::draw::shapes::px;
use crate::draw::shapes::{self, blend, line, points};
use crate::geometry::{Vector2, direction};
use crate::world::World;

/// Walls.
pub(crate) const WALL: &str = "#4a4a4a";
/// What the robot does not pass and the camera sees over or through.
pub(crate) const SEEN_THROUGH: &str = "#d9d4c8";
/// Home.
pub(crate) const HOME: &str = "#c0143c";
/// End of a run.
pub(super) const END: &str = "#0072b2";
/// Named starts and the start region.
pub(crate) const STARTS: &str = "#4a7a2c";

/// How a kind of body is filled and outlined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BodyPaint {
    pub kind: &'static str,
    pub fill: &'static str,
    pub line: &'static str,
    /// Drawn see-through with a dashed outline: hangs above the robot.
    pub dashed: bool,
}

impl BodyPaint {
    /// That of the body of this number in `world`.
    pub(crate) fn of(world: &World, k: usize, dashed: bool) -> Self {
        let (kind, fill, line) = match () {
            () if k < world.landmark_count => ("landmark", "#8db4d6", "#2f5d86"),
            () if world.bodies[k].motion.is_some() => ("moving body", "#f2b36b", "#a65c0f"),
            () => ("obstacle", "#cfc6b8", "#7a6c58"),
        };
        Self { kind, fill, line, dashed }
    }
}

/// Colour of a floor zone: green-blue where it slips, sand where it grips, and near-white around the friction of a common
/// floor.
pub(crate) fn friction_colour(friction: f64) -> String {
    const RAMP: [(f64, [f64; 3]); 5] = [
        (0.0, [112.0, 200.0, 200.0]),
        (0.25, [168.0, 222.0, 218.0]),
        (0.5, [212.0, 238.0, 233.0]),
        (0.75, [238.0, 240.0, 234.0]),
        (1.2, [228.0, 209.0, 168.0]),
    ];
    blend(&RAMP, friction)
}

pub(super) fn polygon(corners: &[Vector2<f64>]) -> Polygon {
    Polygon::new().set("points", points(corners.iter().copied())).set("stroke-linejoin", "round")
}

/// An open line without filling, with round ends.
pub(super) fn polyline(corners: &[Vector2<f64>]) -> Polyline {
    shapes::polyline(corners.iter().copied()).set("stroke-linecap", "round")
}

/// An ellipse of an estimate; `angle_rad` is anti-clockwise in the room, whose y points up.
pub(super) fn ellipse(centre: Vector2<f64>, radii: [f64; 2], angle_rad: f64) -> Ellipse {
    let turn = format!("rotate({} {} {})", px(-angle_rad.to_degrees()), px(centre.x), px(centre.y));
    Ellipse::new()
        .set("cx", px(centre.x))
        .set("cy", px(centre.y))
        .set("rx", px(radii[0]))
        .set("ry", px(radii[1]))
        .set("transform", turn)
        .set("fill", "#d55e00")
        .set("fill-opacity", 0.08)
        .set("stroke", "#d55e00")
        .set("stroke-opacity", 0.6)
        .set("stroke-width", 0.8)
}

/// Unit vector on the page of a heading in the room.
pub(super) fn on_page(heading_rad: f64) -> Vector2<f64> {
    let d = direction(heading_rad);
    Vector2::new(d.x, -d.y)
}

/// An arrow from `tail` along `heading_rad`, `length` long with its tip.
pub(super) fn arrow(tail: Vector2<f64>, length: f64, heading_rad: f64, colour: &str, width: f64) -> Group {
    let along = on_page(heading_rad);
    let across = Vector2::new(-along.y, along.x);
    let tip = tail + along * length;
    let head = (3.5 * width).min(0.6 * length);
    let corners = [tip, tip - along * head + across * (0.5 * head), tip - along * head - across * (0.5 * head)];
    Group::new()
        .add(line(tail, tip - along * (0.8 * head)).set("stroke", colour).set("stroke-width", px(width)))
        .add(polygon(&corners).set("fill", colour))
}

/// The robot from above: its round body, a line to the front and a point in the middle.
pub(super) fn robot(centre: Vector2<f64>, radius: f64, heading_rad: f64, colour: &str, middle: &str) -> Group {
    let radius = radius.max(5.0);
    Group::new()
        .add(
            circle(centre, radius)
                .set("fill", "#ffffff")
                .set("fill-opacity", 0.55)
                .set("stroke", colour)
                .set("stroke-width", 1.4),
        )
        .add(line(centre, centre + on_page(heading_rad) * radius).set("stroke", colour).set("stroke-width", 2))
        .add(circle(centre, (0.22 * radius).clamp(2.0, 4.0)).set("fill", middle).set("stroke", colour).set("stroke-width", 1.4))
}

/// A small triangle that points along a heading: a named start.
pub(super) fn pointer(centre: Vector2<f64>, size: f64, heading_rad: f64) -> Path {
    let along = on_page(heading_rad);
    let across = Vector2::new(-along.y, along.x);
    let corners = [
        centre + along * size,
        centre - along * (0.7 * size) + across * (0.62 * size),
        centre - along * (0.35 * size),
        centre - along * (0.7 * size) - across * (0.62 * size),
    ];
    let steps: Vec<_> = corners.iter().map(|p| format!("{} {}", px(p.x), px(p.y))).collect();
    Path::new()
        .set("d", format!("M {} Z", steps.join(" L ")))
        .set("fill", STARTS)
        .set("stroke", "#ffffff")
        .set("stroke-width", 0.8)
}

/// Red, green and blue of `#rrggbb`.
#[cfg(any(feature = "recording", feature = "video"))]
pub(crate) fn rgb(hex: &str) -> [u8; 3] {
    [1, 3, 5].map(|at| hex.get(at..at + 2).and_then(|digits| u8::from_str_radix(digits, 16).ok()).unwrap_or(0))
}
