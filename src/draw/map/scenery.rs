//! The world itself: room, floor zones, bodies, home and starts.

use std::f64::consts::TAU;

use svg::node::element::{ClipPath, Definitions, Group};

use super::MapDrawing;
use super::legend::{Swatch, paint_body, way};
use super::paint::{self, BodyPaint, INK, SEEN_THROUGH, STARTS, WALL, circle, friction_colour, polygon};
use crate::geometry::{Vector2, direction};
use crate::world::polygon::{anticlockwise, bounds};
use crate::world::{Body, Footprint, MotionSpec, World};

/// Thickness of walls, px.
const WALL_PX: f64 = 5.0;
/// Least radius of a disc, so that it can be seen, px.
const LEAST_RADIUS_PX: f64 = 4.0;

impl MapDrawing {
    /// Draws a world from the floor up.
    pub(super) fn draw_world(&mut self, world: &World) {
        self.labels.keep_within(self.page(&world.outline));
        self.draw_floor(world);
        self.floor = std::mem::take(&mut self.scenery);
        self.draw_start_region(world);
        self.draw_inner_walls(world);
        // Ways first, so that bodies stand on them; what hangs last, because it is above.
        for body in &world.bodies {
            self.draw_way(body);
        }
        let hangs = |body: &Body| body.bottom_m >= world.spec.robot.height_m;
        for pass in [false, true] {
            for k in (0..world.bodies.len()).filter(|&k| hangs(&world.bodies[k]) == pass) {
                self.draw_body(world, k, pass);
            }
        }
        self.draw_home(world);
        self.draw_named_starts(world);
        for body in &world.bodies {
            self.labels.add_on(&body.name, INK, self.shape_of(body));
        }
        for (zone, spec) in world.zones.iter().zip(&world.spec.floor.zones) {
            self.labels.add_within(&spec.name, "#33696b", self.page(&zone.polygon));
        }
    }

    fn add(&mut self, node: impl Into<Box<dyn svg::Node>>) {
        let scenery = std::mem::take(&mut self.scenery);
        self.scenery = scenery.add(node);
    }

    fn page(&self, points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        points.iter().map(|&p| self.frame.at(p)).collect()
    }

    /// Outline of a body on the page; a disc's has many corners.
    fn shape_of(&self, body: &Body) -> Vec<Vector2<f64>> {
        let corners: Vec<_> = match &body.footprint {
            Footprint::Disc(radius_m) => (0..32).map(|k| direction(f64::from(k) * TAU / 32.0) * *radius_m).collect(),
            Footprint::Polygon(corners) => corners.clone(),
        };
        self.page(&corners.iter().map(|&c| body.pose.transform(c)).collect::<Vec<_>>())
    }

    fn draw_floor(&mut self, world: &World) {
        // The walls' outline first and the floor on top of it, so that walls lie outside the line that a robot can touch.
        let room = self.page(&world.outline);
        let walls = polygon(&room).set("fill", "none").set("stroke", WALL).set("stroke-width", 2.0 * WALL_PX);
        self.add(walls.set("stroke-linejoin", "miter"));
        self.add(polygon(&room).set("fill", "#fbfaf7"));
        let clip = ClipPath::new().set("id", "room").add(polygon(&room));
        self.add(Definitions::new().add(clip));
        self.add(self.frame.draw_grid().set("clip-path", "url(#room)"));
        for window in &world.windows {
            let pane = polygon(&self.page(&window.footprint)).set("fill", "none");
            self.add(pane.set("stroke", "#74b9ee").set("stroke-width", WALL_PX));
        }
        for (zone, spec) in world.zones.iter().zip(&world.spec.floor.zones) {
            let area = polygon(&self.page(&zone.polygon));
            self.add(area.set("fill", friction_colour(zone.friction)).set("stroke", "#8fa3b5").set("stroke-width", 0.8));
            let name = if spec.name.is_empty() { "zone" } else { &spec.name };
            self.legend.add(Swatch::Zone(zone.friction), &format!("{name}, friction {}", zone.friction));
        }
    }

    fn draw_inner_walls(&mut self, world: &World) {
        for stretch in world.plan_of_walls() {
            let area = polygon(&self.page(&stretch.corners));
            let fill = if stretch.seen_through { SEEN_THROUGH } else { WALL };
            self.add(area.set("fill", fill).set("stroke", WALL).set("stroke-width", 0.8));
        }
    }

    fn draw_start_region(&mut self, world: &World) {
        let Some(region) = &world.spec.start.region_m else { return };
        let outline = polygon(&self.page(&anticlockwise(region)));
        let outline = outline.set("fill", "none").set("stroke", STARTS).set("stroke-width", 1.2);
        self.add(outline.set("stroke-dasharray", "2 3"));
        self.legend.add(Swatch::Region, "region of random starts");
    }

    fn draw_way(&mut self, body: &Body) {
        let mut corners = match &body.motion {
            None | Some(MotionSpec::Pushed { .. }) => return,
            Some(MotionSpec::Path { corners_m, closed, .. }) => {
                let start = body.pose.position();
                let mut corners = vec![start];
                corners.extend(corners_m.iter().map(|&[x, y]| Vector2::new(x, y)));
                corners.extend(closed.then_some(start));
                corners
            }
            Some(MotionSpec::Walk { region_m, .. }) => anticlockwise(region_m),
        };
        if matches!(body.motion, Some(MotionSpec::Walk { .. })) {
            let region = polygon(&self.page(&corners)).set("fill", "#f2b36b").set("fill-opacity", 0.1);
            self.add(region);
            corners.extend(corners.first().copied());
        }
        let line = way(&self.page(&corners));
        self.add(line);
        self.legend.add(Swatch::Way, "way or region of a moving body");
    }

    fn draw_body(&mut self, world: &World, k: usize, hangs: bool) {
        let body = &world.bodies[k];
        let at = self.frame.at(body.pose.position());
        let radius = match &body.footprint {
            Footprint::Disc(radius_m) => Some(radius_m * self.frame.px_per_m),
            Footprint::Polygon(_) => None,
        };
        // Dashes around a dot would be all that is left of it.
        let dashed = hangs && radius.is_none_or(|radius| radius > LEAST_RADIUS_PX);
        let paint = BodyPaint::of(world, k, dashed);
        let shape: Box<dyn svg::Node> = match radius {
            Some(radius) => Box::new(paint_body(circle(at, radius.max(LEAST_RADIUS_PX)), paint)),
            None => Box::new(paint_body(polygon(&self.shape_of(body)), paint)),
        };
        self.add(shape);
        let (low, high) = bounds(&self.shape_of(body));
        self.labels.avoid([low.x, low.y, high.x, high.y]);
        let label = if hangs { format!("{} above the robot", paint.kind) } else { paint.kind.to_owned() };
        self.legend.add(Swatch::Body(paint), &label);
    }

    fn draw_home(&mut self, world: &World) {
        let at = self.frame.at(world.home.position());
        let radius_m = world.spec.task.arrival_radius_m;
        let group = Group::new()
            .add(
                circle(at, (radius_m * self.frame.px_per_m).max(4.0))
                    .set("fill", paint::HOME)
                    .set("fill-opacity", 0.18)
                    .set("stroke", paint::HOME)
                    .set("stroke-width", 1.2),
            )
            .add(paint::arrow(at, 30.0, world.home.heading, paint::HOME, 2.2))
            .add(circle(at, 2.6).set("fill", paint::HOME));
        self.markers = std::mem::take(&mut self.markers).add(group);
        self.legend.add(Swatch::Home, &format!("home, arrival within {radius_m} m"));
        let area = [at.x - 8.0, at.y - 8.0, at.x + 8.0, at.y + 8.0];
        let tip = at + paint::on_page(world.home.heading) * 30.0;
        self.labels.avoid([at.x.min(tip.x) - 6.0, at.y.min(tip.y) - 6.0, at.x.max(tip.x) + 6.0, at.y.max(tip.y) + 6.0]);
        self.labels.add_beside("home", paint::HOME, area);
    }

    fn draw_named_starts(&mut self, world: &World) {
        for named in &world.spec.start.named {
            let at = self.frame.at(Vector2::new(named.x_m, named.y_m));
            let pointer = paint::pointer(at, 9.0, named.heading_deg.to_radians());
            self.markers = std::mem::take(&mut self.markers).add(pointer);
            let area = [at.x - 9.0, at.y - 9.0, at.x + 9.0, at.y + 9.0];
            self.labels.avoid(area);
            self.labels.add_beside(&named.name, STARTS, area);
            self.legend.add(Swatch::NamedStart, "named start");
        }
    }
}
