//! Colours and small shapes, in pixels.

use svg::node::element::{Circle, Ellipse, Group, Line, Path, Polygon, Polyline, Rectangle, Text};

use crate::geometry::{Vector2, direction};

/// Text and lines in front.
pub(crate) const INK: &str = "#1a1a1a";
/// Text and lines behind.
pub(super) const FAINT_INK: &str = "#6b6b6b";
/// Home.
pub(crate) const HOME: &str = "#c0143c";
/// End of a run.
pub(super) const END: &str = "#0072b2";
/// Named starts and the start region.
pub(super) const STARTS: &str = "#4a7a2c";

/// How a kind of body is filled and outlined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BodyPaint {
    pub fill: &'static str,
    pub line: &'static str,
    /// Drawn see-through with a dashed outline: hangs above the robot.
    pub dashed: bool,
}

impl BodyPaint {
    pub(crate) fn landmark(dashed: bool) -> Self {
        Self { fill: "#8db4d6", line: "#2f5d86", dashed }
    }
    pub(crate) fn obstacle(dashed: bool) -> Self {
        Self { fill: "#cfc6b8", line: "#7a6c58", dashed }
    }
    pub(crate) fn mover(dashed: bool) -> Self {
        Self { fill: "#f2b36b", line: "#a65c0f", dashed }
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
    let after = RAMP.iter().position(|(mu, _)| *mu >= friction).unwrap_or(RAMP.len() - 1).max(1);
    let ((low, from), (high, to)) = (RAMP[after - 1], RAMP[after]);
    let t = ((friction - low) / (high - low)).clamp(0.0, 1.0);
    let [r, g, b] = [0, 1, 2].map(|k| (from[k] + t * (to[k] - from[k])).round() as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A length with two decimals, without a needless tail.
pub(super) fn px(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

fn points(points: &[Vector2<f64>]) -> String {
    points.iter().map(|p| format!("{},{}", px(p.x), px(p.y))).collect::<Vec<_>>().join(" ")
}

pub(super) fn polygon(corners: &[Vector2<f64>]) -> Polygon {
    Polygon::new().set("points", points(corners)).set("stroke-linejoin", "round")
}

/// An open line without filling.
pub(super) fn polyline(corners: &[Vector2<f64>]) -> Polyline {
    Polyline::new()
        .set("points", points(corners))
        .set("fill", "none")
        .set("stroke-linejoin", "round")
        .set("stroke-linecap", "round")
}

pub(super) fn line(a: Vector2<f64>, b: Vector2<f64>) -> Line {
    Line::new().set("x1", px(a.x)).set("y1", px(a.y)).set("x2", px(b.x)).set("y2", px(b.y))
}

pub(super) fn circle(centre: Vector2<f64>, radius: f64) -> Circle {
    Circle::new().set("cx", px(centre.x)).set("cy", px(centre.y)).set("r", px(radius))
}

pub(super) fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Rectangle {
    Rectangle::new().set("x", px(x)).set("y", px(y)).set("width", px(width)).set("height", px(height))
}

/// Text from its left end on its baseline.
pub(super) fn text(content: &str, x: f64, y: f64, size: f64) -> Text {
    Text::new(content).set("x", px(x)).set("y", px(y)).set("font-size", px(size))
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
