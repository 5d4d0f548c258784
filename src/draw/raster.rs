//! The room from above as pixels: what the map of a run shows, at one moment of it.

use image::RgbImage;
use tiny_skia::{Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke as Pen, StrokeDash, Transform};

use super::map::paint::{BodyPaint, HOME, SEEN_THROUGH, STARTS, WALL, friction_colour, rgb};
use super::map::{Stroke, ellipse_axes};
use super::shapes::INK;
use crate::geometry::{Pose, Vector2, direction};
use crate::world::polygon::bounds;
use crate::world::{Body, Footprint, World};

/// Room around the walls, px.
const MARGIN_PX: f64 = 14.0;
/// Thickness of walls, px.
const WALL_PX: f32 = 8.0;
/// Least radius of a disc, so that it can be seen, px.
const LEAST_RADIUS_PX: f32 = 3.5;
/// Windows.
const WINDOW: &str = "#56b4e9";
/// Standard deviations that an ellipse covers.
const K_SIGMA: f64 = 2.0;

/// What changes from frame to frame.
pub(crate) struct Sight<'a> {
    /// True path so far.
    pub truth: &'a [Pose],
    /// Estimated path so far in the room; what is not finite breaks the line.
    pub estimate: &'a [Pose],
    /// Covariance of the estimate's x and y in the room, m^2, where there is an estimate now.
    pub covariance: Option<[[f64; 2]; 2]>,
    /// Where the bodies are.
    pub bodies: &'a [Pose],
}

/// A room, ready to be drawn again and again.
pub(crate) struct RoomRaster<'a> {
    world: &'a World,
    px_per_m: f64,
    /// Corner of the room's bounds with the least x and the greatest y, and where it is in the picture.
    corner: Vector2<f64>,
    offset: Vector2<f64>,
    /// Floor, home and all that nothing moves.
    still: Pixmap,
}

impl<'a> RoomRaster<'a> {
    /// A picture `width_px` wide and at most `height_px` high, as high as the room needs; `None` where there is no room for one.
    pub(crate) fn new(world: &'a World, width_px: u32, height_px: u32) -> Option<Self> {
        let (low, high) = bounds(&world.outline);
        let size = high - low;
        let free = |px: u32| f64::from(px) - 2.0 * MARGIN_PX;
        let px_per_m = (free(width_px) / size.x).min(free(height_px) / size.y);
        let used = size * px_per_m;
        let height = (used.y + 2.0 * MARGIN_PX).ceil() as u32;
        let offset = Vector2::new(0.5 * (f64::from(width_px) - used.x), MARGIN_PX);
        let still = Pixmap::new(width_px, height)?;
        let mut raster = Self { world, px_per_m, corner: Vector2::new(low.x, high.y), offset, still };
        raster.draw_still();
        Some(raster)
    }

    pub(crate) fn height_px(&self) -> u32 {
        self.still.height()
    }

    fn at(&self, point: Vector2<f64>) -> (f32, f32) {
        let d = point - self.corner;
        ((self.offset.x + d.x * self.px_per_m) as f32, (self.offset.y - d.y * self.px_per_m) as f32)
    }

    fn px(&self, metres: f64) -> f32 {
        (metres * self.px_per_m) as f32
    }

    fn draw_still(&mut self) {
        let mut still = self.still.clone();
        still.fill(Color::WHITE);
        let room = self.polygon(&self.world.outline, &Pose::IDENTITY);
        stroke(&mut still, room.as_ref(), WALL, WALL_PX, &[]);
        fill(&mut still, room.as_ref(), "#fbfaf7", 1.0);
        for zone in &self.world.zones {
            let area = self.polygon(&zone.polygon, &Pose::IDENTITY);
            fill(&mut still, area.as_ref(), &friction_colour(zone.friction), 1.0);
        }
        for stretch in self.world.plan_of_walls() {
            let area = self.polygon(&stretch.corners, &Pose::IDENTITY);
            fill(&mut still, area.as_ref(), if stretch.seen_through { SEEN_THROUGH } else { WALL }, 1.0);
        }
        let home = &self.world.home;
        let centre = self.at(home.position());
        let arrival = disc(centre, self.px(self.world.spec.task.arrival_radius_m).max(5.0));
        fill(&mut still, arrival.as_ref(), HOME, 0.25);
        stroke(&mut still, arrival.as_ref(), HOME, 1.5, &[]);
        let tip = direction(home.heading) * (26.0 / self.px_per_m);
        stroke(&mut still, polyline(&[centre, self.at(home.position() + tip)]).as_ref(), HOME, 2.5, &[]);
        // What hangs last, because it is above.
        for hangs in [false, true] {
            for (k, body) in self.world.bodies.iter().enumerate().filter(|(_, b)| b.motion.is_none() && self.hangs(b) == hangs)
            {
                self.draw_body(&mut still, k, body, &body.pose);
            }
        }
        self.still = still;
    }

    fn hangs(&self, body: &Body) -> bool {
        body.bottom_m >= self.world.spec.robot.height_m
    }

    fn draw_body(&self, onto: &mut Pixmap, k: usize, body: &Body, at: &Pose) {
        let hangs = self.hangs(body);
        let paint = BodyPaint::of(self.world, k, hangs);
        let shape = match &body.footprint {
            Footprint::Disc(radius) => disc(self.at(at.position()), self.px(*radius).max(LEAST_RADIUS_PX)),
            Footprint::Polygon(corners) => self.polygon(corners, at),
        };
        fill(onto, shape.as_ref(), paint.fill, if hangs { 0.4 } else { 1.0 });
        stroke(onto, shape.as_ref(), paint.line, 1.2, if hangs { &[4.0, 3.0] } else { &[] });
    }

    /// The room at time 0, with its windows and named starts.
    pub(crate) fn at_rest(&self) -> Pixmap {
        let mut picture = self.draw(&Sight { truth: &[], estimate: &[], covariance: None, bodies: &self.world.body_poses() });
        for window in &self.world.windows {
            if let [a, b, ..] = window.footprint[..] {
                stroke(&mut picture, polyline(&[self.at(a), self.at(b)]).as_ref(), WINDOW, 3.0, &[]);
            }
        }
        for start in &self.world.spec.start.named {
            let at = self.at(Vector2::new(start.x_m, start.y_m));
            stroke(&mut picture, disc(at, LEAST_RADIUS_PX).as_ref(), STARTS, 1.5, &[]);
        }
        picture
    }

    /// The room at one moment.
    pub(crate) fn draw(&self, sight: &Sight<'_>) -> Pixmap {
        let mut picture = self.still.clone();
        for (k, (body, at)) in self.world.bodies.iter().zip(sight.bodies).enumerate().filter(|(_, (b, _))| b.motion.is_some()) {
            self.draw_body(&mut picture, k, body, at);
        }
        for (path, style) in [(sight.truth, Stroke::TRUTH), (sight.estimate, Stroke::ESTIMATE)] {
            for piece in path.split(|pose| !pose.is_finite()).filter(|piece| piece.len() > 1) {
                let points: Vec<_> = piece.iter().map(|pose| self.at(pose.position())).collect();
                stroke(&mut picture, polyline(&points).as_ref(), style.colour, style.width_px as f32, &[]);
            }
        }
        let radius_m = self.world.spec.robot.radius_m;
        if let (Some(believed), Some(covariance)) = (sight.estimate.last().filter(|pose| pose.is_finite()), sight.covariance) {
            let (radii, angle) = ellipse_axes(covariance, K_SIGMA);
            let along = Pose::new(believed.x, believed.y, angle);
            let corner = |k: u32| direction(f64::from(k) * std::f64::consts::TAU / 48.0);
            let corners: Vec<_> = (0..48).map(corner).map(|d| Vector2::new(radii[0] * d.x, radii[1] * d.y)).collect();
            if radii[0].is_finite() {
                let shape = self.polygon(&corners, &along);
                fill(&mut picture, shape.as_ref(), Stroke::ESTIMATE.colour, 0.2);
                stroke(&mut picture, shape.as_ref(), Stroke::ESTIMATE.colour, 1.2, &[]);
            }
            let outline = disc(self.at(believed.position()), self.px(radius_m).max(5.0));
            stroke(&mut picture, outline.as_ref(), Stroke::ESTIMATE.colour, 1.5, &[4.0, 3.0]);
        }
        if let Some(robot) = sight.truth.last() {
            let body = disc(self.at(robot.position()), self.px(radius_m).max(5.0));
            fill(&mut picture, body.as_ref(), "#ffffff", 0.6);
            stroke(&mut picture, body.as_ref(), INK, 1.6, &[]);
            let front = robot.position() + direction(robot.heading) * radius_m.max(5.0 / self.px_per_m);
            stroke(&mut picture, polyline(&[self.at(robot.position()), self.at(front)]).as_ref(), INK, 2.2, &[]);
        }
        picture
    }

    fn polygon(&self, corners: &[Vector2<f64>], at: &Pose) -> Option<Path> {
        let mut path = PathBuilder::new();
        for (k, &corner) in corners.iter().enumerate() {
            let (x, y) = self.at(at.transform(corner));
            if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        path.close();
        path.finish()
    }
}

/// A picture of a room as others have pictures: all of it lies on white paper, no pixel is see-through.
pub(crate) fn opaque(room: &Pixmap) -> Option<RgbImage> {
    let rgb = room.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    RgbImage::from_raw(room.width(), room.height(), rgb)
}

fn disc((x, y): (f32, f32), radius: f32) -> Option<Path> {
    PathBuilder::from_circle(x, y, radius)
}

fn polyline(points: &[(f32, f32)]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (k, &(x, y)) in points.iter().enumerate() {
        if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    path.finish()
}

fn paint(colour: &str, opacity: f32) -> Paint<'static> {
    let [r, g, b] = rgb(colour);
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity) as u8);
    paint
}

/// A shape that is too small to be one is left out.
fn fill(onto: &mut Pixmap, shape: Option<&Path>, colour: &str, opacity: f32) {
    if let Some(shape) = shape {
        onto.fill_path(shape, &paint(colour, opacity), FillRule::Winding, Transform::identity(), None);
    }
}

fn stroke(onto: &mut Pixmap, shape: Option<&Path>, colour: &str, width: f32, dashes: &[f32]) {
    if let Some(shape) = shape {
        let dash = if dashes.is_empty() { None } else { StrokeDash::new(dashes.to_vec(), 0.0) };
        let pen = Pen { width, dash, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Pen::default() };
        onto.stroke_path(shape, &paint(colour, 1.0), &pen, Transform::identity(), None);
    }
}
