//! The legend below a map: one entry for each kind of thing that the map shows.

use svg::node::element::Group;

use super::Stroke;
use super::paint::{self, BodyPaint, STARTS, polyline};
use crate::draw::chart::Ramp;
use crate::draw::shapes::{INK, circle, rectangle, text};
use crate::geometry::Vector2;

/// The picture in front of an entry's text.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Swatch {
    Body(BodyPaint),
    Way,
    Zone(f64),
    Home,
    Region,
    NamedStart,
    Robot(&'static str),
    Path(Stroke),
    Ellipse,
    Field(Ramp),
    Arrow,
    Spot(&'static str),
}

/// What the map explains.
#[derive(Debug, Clone, Default)]
pub(super) struct Legend {
    entries: Vec<(Swatch, String)>,
}

/// Size of the text, px.
const SIZE_PX: f64 = 12.0;
/// Height of a row, px.
const ROW_PX: f64 = 21.0;
/// Width of a swatch with the space behind it, px.
const SWATCH_PX: f64 = 34.0;
const LEFT_PX: f64 = super::frame::LEFT_PX;

impl Legend {
    /// Adds an entry, unless there is one with the same text.
    pub(super) fn add(&mut self, swatch: Swatch, label: &str) {
        if !label.is_empty() && !self.entries.iter().any(|(_, have)| have == label) {
            self.entries.push((swatch, label.to_owned()));
        }
    }

    /// The legend in columns from `top` px down, and where it ends, px.
    pub(super) fn draw(&self, top: f64, page_width: f64) -> (Group, f64) {
        // As many equal columns as the longest entry allows, filled row by row.
        let width_of = |label: &str| SWATCH_PX + 0.6 * SIZE_PX * label.chars().count() as f64 + 18.0;
        let widest = self.entries.iter().map(|(_, label)| width_of(label)).fold(1.0, f64::max);
        let columns = ((page_width - LEFT_PX) / widest).floor().clamp(1.0, 5.0) as usize;
        let column_px = (page_width - LEFT_PX) / columns as f64;
        let mut group = Group::new();
        let rows = self.entries.len().div_ceil(columns);
        let mut entries: Vec<_> = self.entries.iter().collect();
        entries.sort_by_key(|(swatch, _)| swatch.rank()); // stable: within a rank as they came
        for (k, (swatch, label)) in entries.into_iter().enumerate() {
            let x = LEFT_PX + (k % columns) as f64 * column_px;
            let y = top + ((k / columns) as f64 + 0.5) * ROW_PX + 6.0;
            group = group.add(swatch.draw(x, y)).add(text(label, x + SWATCH_PX, y + 4.0, SIZE_PX).set("fill", INK));
        }
        (group, top + rows as f64 * ROW_PX + 16.0)
    }
}

impl Swatch {
    /// Place in the legend: the run first, then the task, then the scenery.
    fn rank(&self) -> u8 {
        match self {
            Self::Path(_) => 0,
            Self::Ellipse | Self::Field(_) | Self::Arrow | Self::Spot(_) => 1,
            Self::Robot(_) => 2,
            Self::Home => 3,
            Self::NamedStart => 4,
            Self::Region => 5,
            Self::Body(_) => 6,
            Self::Way => 7,
            Self::Zone(_) => 8,
        }
    }

    /// Draws into a box of 26 x 14 px, centred on `y`.
    fn draw(&self, x: f64, y: f64) -> Group {
        let (left, right) = (Vector2::new(x, y), Vector2::new(x + 26.0, y));
        let middle = 0.5 * (left + right);
        let area = || rectangle([x + 1.0, y - 6.0, x + 25.0, y + 6.0]).set("rx", 1);
        let group = Group::new();
        match self {
            Self::Body(paint) => group.add(paint_body(area(), *paint)),
            Self::Way => group.add(way(&[left, right])),
            Self::Zone(friction) => group
                .add(area().set("fill", paint::friction_colour(*friction)).set("stroke", "#8fa3b5").set("stroke-width", 0.8)),
            Self::Home => group
                .add(circle(middle, 6.0).set("fill", paint::HOME).set("fill-opacity", 0.18).set("stroke", paint::HOME))
                .add(paint::arrow(middle, 14.0, 0.0, paint::HOME, 2.0))
                .add(circle(middle, 2.2).set("fill", paint::HOME)),
            Self::Region => group
                .add(area().set("fill", "none").set("stroke", STARTS).set("stroke-width", 1.2).set("stroke-dasharray", "2 3")),
            Self::NamedStart => group.add(paint::pointer(middle, 8.0, 0.0)),
            Self::Robot(colour) => {
                let inner = if *colour == INK { INK } else { "#ffffff" };
                group.add(paint::robot(middle, 7.0, 0.0, colour, inner))
            }
            Self::Path(style) => group.add(super::path(style, &[left, right])),
            Self::Ellipse => group.add(paint::ellipse(middle, [11.0, 5.5], 0.0)),
            Self::Field(ramp) => (0..6).fold(group, |group, k| {
                let colour = ramp.colour(ramp.low + f64::from(k) / 5.0 * (ramp.high - ramp.low)).0;
                let left = x + 1.0 + 4.0 * f64::from(k);
                group.add(rectangle([left, y - 6.0, left + 4.3, y + 6.0]).set("fill", colour))
            }),
            Self::Arrow => group.add(paint::arrow(left, 26.0, 0.0, INK, 1.2)),
            Self::Spot(colour) => group.add(circle(middle, 5.0).set("fill", *colour)),
        }
    }
}

/// Gives a shape the looks of a body.
pub(super) fn paint_body<N>(mut shape: N, paint: BodyPaint) -> N
where
    N: svg::Node,
{
    shape.assign("fill", paint.fill);
    shape.assign("fill-opacity", if paint.dashed { 0.3 } else { 1.0 });
    shape.assign("stroke", paint.line);
    shape.assign("stroke-width", if paint.dashed { 1.0 } else { 1.2 });
    if paint.dashed {
        shape.assign("stroke-dasharray", "4 2");
    }
    shape
}

/// The way of a moving body.
pub(super) fn way(corners: &[Vector2<f64>]) -> svg::node::element::Polyline {
    polyline(corners).set("stroke", "#c9812f").set("stroke-width", 1.1).set("stroke-dasharray", "1 4")
}
