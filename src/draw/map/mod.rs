//! Maps: a world from above as SVG, with the layers of a run on top.
//!
//! A [`MapDrawing`] starts with the world (room, floor zones, bodies, home, starts) and takes layers: paths, covariance
//! ellipses, where a run started. Whatever it shows it explains in the legend below the map. y points up, lengths are to
//! scale, and the same input gives the same bytes.
//!
//! ```
//! # use wayhome::{draw::map::{MapDrawing, Stroke}, world::World, geometry::Pose};
//! # fn main() -> wayhome::Result<()> {
//! let world = World::open("lab")?;
//! let start = Pose::new(5.5, 4.0, 3.0);
//! let svg = MapDrawing::new(&world)
//!     .title("One run in the lab")
//!     .path([start.position(), world.home.position()], &Stroke::TRUTH, "true path")
//!     .start(&start)
//!     .to_svg();
//! assert!(svg.starts_with("<svg"));
//! # Ok(())
//! # }
//! ```

mod field;
mod frame;
mod labels;
mod legend;
pub(crate) mod paint;
mod scenery;

use svg::node::element::Group;

pub use crate::draw::shapes::Stroke;
use crate::draw::shapes::{INK, page, px, rectangle, text};
use crate::geometry::{Pose, Vector2, atan2};
use crate::world::World;
use frame::Frame;
use labels::Labels;
use legend::{Legend, Swatch};
use paint::{ellipse, polyline};

/// Width of a drawing, px.
pub const WIDTH_PX: f64 = 900.0;

/// A path through points of the page.
fn path(style: &Stroke, corners: &[Vector2<f64>]) -> svg::node::element::Polyline {
    let dashes = if style.dashes.is_empty() { "none" } else { style.dashes };
    let line = polyline(corners).set("stroke", style.colour).set("stroke-width", px(style.width_px));
    line.set("stroke-dasharray", dashes)
}

/// A map that is being drawn: the world, and layers added one by one.
#[derive(Debug, Clone)]
#[must_use]
pub struct MapDrawing {
    frame: Frame,
    title: Option<String>,
    floor: Group,
    /// Lies on the floor, below all bodies.
    field: Group,
    scenery: Group,
    /// Ellipses lie below paths, whatever the order in which they come.
    ellipses: Group,
    paths: Group,
    markers: Group,
    labels: Labels,
    legend: Legend,
    has_legend: bool,
    robot_radius_m: f64,
}

impl MapDrawing {
    /// A map of a world as it is at time 0.
    pub fn new(world: &World) -> Self {
        let mut drawing = Self {
            frame: Frame::around(&world.outline),
            title: None,
            floor: Group::new(),
            field: Group::new(),
            scenery: Group::new(),
            ellipses: Group::new(),
            paths: Group::new(),
            markers: Group::new(),
            labels: Labels::default(),
            legend: Legend::default(),
            has_legend: true,
            robot_radius_m: world.spec.robot.radius_m,
        };
        drawing.draw_world(world);
        drawing
    }

    /// Sets the line above the map.
    pub fn title(mut self, title: impl Into<String>) -> Self {
        self.title = Some(title.into());
        self
    }

    /// Leaves out the legend, for a small drawing beside words that explain it.
    pub fn without_legend(mut self) -> Self {
        self.has_legend = false;
        self
    }

    /// Adds a path through points of the room frame, m. Points that are not finite break the line.
    pub fn path(mut self, points: impl IntoIterator<Item = Vector2<f64>>, style: &Stroke, label: &str) -> Self {
        let mut piece = Vec::new();
        let mut pieces = Vec::new();
        for point in points {
            if point.x.is_finite() && point.y.is_finite() {
                piece.push(self.frame.at(point));
            } else {
                pieces.push(std::mem::take(&mut piece));
            }
        }
        pieces.push(piece);
        for piece in pieces.iter().filter(|piece| piece.len() > 1) {
            self.paths = self.paths.add(path(style, piece));
        }
        self.legend.add(Swatch::Path(*style), label);
        self
    }

    /// Adds the ellipse of `k_sigma` standard deviations around a position of the room frame. `covariance` is that of x and y
    /// in the room frame, row by row, m^2. One that is not finite is left out.
    pub fn ellipse(mut self, centre: &Pose, covariance: [[f64; 2]; 2], k_sigma: f64) -> Self {
        let (radii_m, angle_rad) = ellipse_axes(covariance, k_sigma);
        if centre.is_finite() && radii_m[0].is_finite() && angle_rad.is_finite() {
            let radii_px = radii_m.map(|radius| radius * self.frame.px_per_m);
            let shape = ellipse(self.frame.at(centre.position()), radii_px, angle_rad);
            self.ellipses = self.ellipses.add(shape);
            self.legend.add(Swatch::Ellipse, &format!("{k_sigma}-sigma ellipse of the estimate"));
        }
        self
    }

    /// Marks where a run started: the robot's outline and heading.
    pub fn start(self, pose: &Pose) -> Self {
        self.robot(pose, INK, INK, "start of the run")
    }

    /// Marks where a run ended: the robot's outline and heading.
    pub fn end(self, pose: &Pose) -> Self {
        self.robot(pose, paint::END, "#ffffff", "end of the run")
    }

    fn robot(mut self, pose: &Pose, colour: &'static str, middle: &str, label: &str) -> Self {
        let (at, radius) = (self.frame.at(pose.position()), self.robot_radius_m * self.frame.px_per_m);
        self.markers = self.markers.add(paint::robot(at, radius, pose.heading, colour, middle));
        self.legend.add(Swatch::Robot(colour), label);
        self
    }

    /// The drawing as SVG text.
    pub fn to_svg(&self) -> String {
        let top = if self.title.is_some() { 44.0 } else { 16.0 };
        let unexplained = Legend::default();
        let legend = if self.has_legend { &self.legend } else { &unexplained };
        let (legend, bottom_px) = legend.draw(top + self.frame.height_px() + frame::AXIS_PX, WIDTH_PX);
        let map = Group::new()
            .set("transform", format!("translate(0 {top})"))
            .add(self.floor.clone())
            .add(self.field.clone())
            .add(self.scenery.clone())
            .add(self.ellipses.clone())
            .add(self.paths.clone())
            .add(self.markers.clone())
            .add(self.labels.draw())
            .add(self.frame.draw_axes());
        let white = rectangle([0.0, 0.0, WIDTH_PX, bottom_px]).set("fill", "#ffffff");
        let mut document = page(WIDTH_PX, bottom_px).add(white);
        if let Some(title) = &self.title {
            let text = text(title, frame::LEFT_PX, 26.0, 16.0).set("font-weight", "bold").set("fill", INK);
            document = document.add(text);
        }
        document.add(map).add(legend).to_string() + "\n"
    }
}

/// Long and short half axis, m, of the ellipse of `k_sigma` standard deviations, and the long one's angle, rad. `covariance` is
/// that of x and y, row by row, m^2.
pub(crate) fn ellipse_axes(covariance: [[f64; 2]; 2], k_sigma: f64) -> ([f64; 2], f64) {
    let [[xx, xy], [yx, yy]] = covariance;
    let xy = 0.5 * (xy + yx);
    // Eigenvalues of a symmetric 2 x 2 matrix, and the angle of the larger one's axis.
    let (mean, half_difference) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let spread = (half_difference * half_difference + xy * xy).sqrt();
    let radii = [mean + spread, mean - spread].map(|variance| k_sigma * variance.max(0.0).sqrt());
    (radii, 0.5 * atan2(xy, half_difference))
}

/// A world's map with its name as title.
pub fn world_svg(world: &World) -> String {
    MapDrawing::new(world).title(world.spec.name.clone()).to_svg()
}
