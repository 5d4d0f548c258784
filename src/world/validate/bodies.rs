//! Landmarks and obstacles: their shapes, where they stand, how they move.

use super::room::{polygon_inside, texture};
use super::{Faults, GREATEST_M, TOLERANCE_M};
use crate::geometry::Vector2;
use crate::world::convex::Convex;
use crate::world::grid::Grid;
use crate::world::polygon::{anticlockwise, contains, contains_within, edges};
use crate::world::spec::{BodySpec, ShapeSpec};
use crate::world::{Body, Footprint, MotionSpec, Piece, World, WorldSpec};

/// Least length of a path's leg, m.
const LEAST_LEG_M: f64 = 0.01;

/// Most walls, bodies and windows together: instance ids have 16 bits, and the first ones are the floor's and the ceiling's.
const MOST_INSTANCES: usize = 65_000;

/// Fields of a body that say where it is and how far it reaches.
pub(super) const GEOMETRY: [&str; 6] = ["shape", "position_m", "heading_deg", "height_m", "elevation_m", "motion"];

/// Places of all bodies in the file, in the order of `World::bodies`.
pub(super) fn places(spec: &WorldSpec) -> impl Iterator<Item = String> + '_ {
    let landmarks = (0..spec.landmarks.len()).map(|k| format!("landmarks[{k}]"));
    landmarks.chain((0..spec.obstacles.len()).map(|k| format!("obstacles[{k}]")))
}

pub(super) fn check_values(spec: &WorldSpec, faults: &mut Faults) {
    let bodies = || places(spec).zip(spec.landmarks.iter().chain(&spec.obstacles));
    for (place, body) in bodies() {
        check_body(&place, body, spec, faults);
    }
    for (k, landmark) in spec.landmarks.iter().enumerate() {
        let allowed = "none, because landmarks stand still; a body that moves belongs to [[obstacles]]";
        faults.unless(landmark.motion.is_none(), format!("landmarks[{k}].motion"), "a motion", allowed);
    }
    let walls = spec.walls.iter().enumerate().filter(|(_, w)| !w.name.is_empty());
    let walls = walls.map(|(k, w)| (format!("walls[{k}]"), w.name.as_str()));
    faults.distinct(bodies().map(|(place, body)| (place, body.name.as_str())).chain(walls));
    // Renderers have a material for each side of a wall.
    let walls = spec.room.outline_m.len() + 2 * spec.walls.len();
    let instances = walls + spec.landmarks.len() + spec.obstacles.len() + spec.light.windows.len();
    let allowed = format!("at most {MOST_INSTANCES}");
    faults.unless(
        instances <= MOST_INSTANCES,
        "obstacles",
        format!("{instances} walls, bodies and windows in all, inner walls counted twice"),
        allowed,
    );
}

fn check_body(place: &str, body: &BodySpec, spec: &WorldSpec, faults: &mut Faults) {
    faults.unless(!body.name.trim().is_empty(), format!("{place}.name"), "an empty name", "a name");
    match &body.shape {
        ShapeSpec::Disc { radius_m } => faults.size(format!("{place}.shape.disc.radius_m"), *radius_m),
        ShapeSpec::Box { size_m } => {
            for (k, size) in size_m.iter().enumerate() {
                faults.size(format!("{place}.shape.box.size_m[{k}]"), *size);
            }
        }
        ShapeSpec::Polygon { corners_m } => {
            let place = format!("{place}.shape.polygon.corners_m");
            faults.polygon(&place, corners_m, true);
            if !faults.touch(&place) && !contains(&anticlockwise(corners_m), Vector2::zeros()) {
                let allowed = "corners around [0, 0], because the body's position is its middle";
                faults.add(place, "a polygon that [0, 0] lies outside of", allowed);
            }
        }
    }
    faults.point(&format!("{place}.position_m"), &body.position_m);
    faults.between(format!("{place}.heading_deg"), body.heading_deg, -3600.0, 3600.0);
    faults.size(format!("{place}.height_m"), body.height_m);
    faults.between(format!("{place}.elevation_m"), body.elevation_m, 0.0, GREATEST_M);
    texture(&format!("{place}.texture"), &body.texture, faults);
    faults.between(format!("{place}.glow"), body.glow, 0.0, 100.0);

    let top = body.elevation_m + body.height_m;
    let heights = [format!("{place}.height_m"), format!("{place}.elevation_m"), "room.height_m".to_owned()];
    if !heights.iter().any(|h| faults.touch(h)) && top > spec.room.height_m + TOLERANCE_M {
        let allowed = format!("a top no higher than the ceiling, which is at {} m", spec.room.height_m);
        faults.add(&heights[0], format!("{}, which puts its top at {top} m", body.height_m), allowed);
    }
    // Something that the robot passes under must clear the camera on top of it too.
    let (robot, camera) = (spec.robot.height_m, spec.camera.height_m);
    if body.elevation_m >= robot && body.elevation_m <= camera {
        let allowed = format!(
            "below {robot} (robot.height_m, so that the robot cannot pass) or above {camera} (camera.height_m, so that the \
             camera clears it)"
        );
        faults.add(format!("{place}.elevation_m"), body.elevation_m.to_string(), allowed);
    }
    match &body.motion {
        None => {}
        Some(MotionSpec::Path { corners_m, speed_m_s, .. }) => {
            let corners = format!("{place}.motion.path.corners_m");
            faults.unless(!corners_m.is_empty(), &corners, "no corner", "at least 1 corner after the body's own position");
            for (k, corner) in corners_m.iter().enumerate() {
                faults.point(&format!("{corners}[{k}]"), corner);
            }
            faults.positive(format!("{place}.motion.path.speed_m_s"), *speed_m_s, 10.0);
        }
        Some(MotionSpec::Walk { region_m, speed_m_s }) => {
            faults.polygon(&format!("{place}.motion.walk.region_m"), region_m, false);
            faults.positive(format!("{place}.motion.walk.speed_m_s"), *speed_m_s, 10.0);
        }
        Some(MotionSpec::Pushed { mass_kg, friction }) => {
            faults.positive(format!("{place}.motion.pushed.mass_kg"), *mass_kg, 1e4);
            faults.between(format!("{place}.motion.pushed.friction"), *friction, 0.0, 10.0);
            let allowed = "0 for a body that can be pushed: it stands on the floor";
            faults.unless(body.elevation_m == 0.0, format!("{place}.elevation_m"), body.elevation_m.to_string(), allowed);
        }
    }
}

/// Bodies inside the room, apart from one another, on ways that are free. `places` belong to `world.bodies`.
pub(super) fn check_places(world: &World, places: &[String], faults: &mut Faults) {
    let shapes: Vec<Convex> = world.bodies.iter().map(|b| Convex::of_body(b, &b.pose)).collect();
    let mut inside = vec![true; shapes.len()];
    for (k, shape) in shapes.iter().enumerate() {
        let gap_m = gap_to_walls_m(world, shape);
        inside[k] = gap_m >= -TOLERANCE_M;
        if !inside[k] {
            let how = if gap_m.is_finite() { format!("{:.3} m deep in a wall", -gap_m) } else { "outside the room".to_owned() };
            let position = world.bodies[k].pose.position();
            let allowed = "a body inside the room; it may touch a wall";
            faults.add(format!("{}.position_m", places[k]), format!("[{}, {}], {how}", position.x, position.y), allowed);
        }
    }
    let grid = Grid::new(&shapes.iter().map(|shape| shape.bounds(0.0)).collect::<Vec<_>>());
    for k in 0..shapes.len() {
        for l in grid.near(shapes[k].bounds(0.0)).into_iter().take_while(|l| *l < k) {
            let depth_m = -shapes[k].gap_m(&shapes[l]);
            if depth_m > TOLERANCE_M && at_same_height(&world.bodies[k], &world.bodies[l]) {
                let position = world.bodies[k].pose.position();
                let name = &world.bodies[l].name;
                let found = format!("[{}, {}], {depth_m:.3} m deep in \"{name}\"", position.x, position.y);
                faults.add(format!("{}.position_m", places[k]), found, "bodies that don't overlap; they may touch");
            }
        }
    }
    for (k, body) in world.bodies.iter().enumerate() {
        check_partitions(world, body, &shapes[k], &places[k], faults);
    }
    for (k, body) in world.bodies.iter().enumerate() {
        if inside[k] {
            check_motion(world, body, &places[k], faults);
        }
    }
}

/// Asks that a body is in no wall inside the room.
fn check_partitions(world: &World, body: &Body, shape: &Convex, place: &str, faults: &mut Faults) {
    let (low, high) = shape.bounds(0.0);
    let meets = |piece: &&Piece| body.bottom_m + TOLERANCE_M < piece.top_m && piece.bottom_m + TOLERANCE_M < body.top_m;
    for wall in world.partitions_near(low, high).into_iter().map(|k| &world.partitions[k]) {
        let depth_of = |piece: &Piece| -shape.gap_m(&Convex::polygon(&wall.footprint(piece.along_m), 0.0));
        let depth_m = wall.pieces.iter().filter(meets).map(depth_of).fold(0.0, f64::max);
        if depth_m > TOLERANCE_M {
            let position = body.pose.position();
            let found = format!("[{}, {}], {depth_m:.3} m deep in \"{}\"", position.x, position.y, wall.name);
            return faults.add(format!("{place}.position_m"), found, "a body outside all walls; it may touch them");
        }
    }
}

/// Gap between a shape and the nearest wall of the room, m, as [`crate::world::convex::gap_to_walls_m`] tells it where it is not positive; some
/// positive number elsewhere.
fn gap_to_walls_m(world: &World, shape: &Convex) -> f64 {
    if !world.boundary().contains(shape.middle()) {
        return f64::NEG_INFINITY;
    }
    let (low, high) = shape.bounds(0.0);
    let walls = world.boundary().walls_near(low, high).into_iter().map(|k| world.wall(k));
    walls.map(|(a, b)| shape.gap_m(&Convex::corridor(a, b, 0.0))).fold(f64::MAX, f64::min)
}

fn at_same_height(a: &Body, b: &Body) -> bool {
    a.bottom_m + TOLERANCE_M < b.top_m && b.bottom_m + TOLERANCE_M < a.top_m
}

fn check_motion(world: &World, body: &Body, place: &str, faults: &mut Faults) {
    // Whichever way it walks, what it sweeps is bounded by that of a disc around its position.
    let reach_m = match &body.footprint {
        Footprint::Disc(radius_m) => *radius_m,
        Footprint::Polygon(corners) => corners.iter().map(|c| c.dot(c).sqrt()).fold(0.0, f64::max),
    };
    let standing: Vec<_> = world.bodies.iter().filter(|b| b.stands() && at_same_height(b, body)).collect();
    let in_the_way = |a, b| {
        let swept = Convex::corridor(a, b, reach_m);
        if gap_to_walls_m(world, &swept) < -TOLERANCE_M {
            return Some("a wall".to_owned());
        }
        let (low, high) = swept.bounds(0.0);
        let partition = world.partitions_near(low, high).into_iter().map(|k| &world.partitions[k]).find(|p| {
            let mut stretches = p.stretches(body.bottom_m, body.top_m).into_iter();
            stretches.any(|s| swept.gap_m(&Convex::polygon(&p.footprint(s), 0.0)) < -TOLERANCE_M)
        });
        if let Some(partition) = partition {
            return Some(format!("\"{}\"", partition.name));
        }
        let hit = standing.iter().find(|b| swept.gap_m(&Convex::of_body(b, &b.pose)) < -TOLERANCE_M);
        hit.map(|b| format!("\"{}\"", b.name))
    };
    match &body.motion {
        None | Some(MotionSpec::Pushed { .. }) => {}
        Some(MotionSpec::Path { corners_m, closed, .. }) => {
            let mut at = body.pose.position();
            let start = at;
            let corners = corners_m.iter().map(|&[x, y]| Vector2::new(x, y));
            for (k, next) in corners.chain(closed.then_some(start)).enumerate() {
                let place = format!("{place}.motion.path.corners_m[{}]", k.min(corners_m.len() - 1));
                let way = if k < corners_m.len() { "to" } else { "from" };
                if (next - at).norm() < LEAST_LEG_M {
                    faults.add(&place, format!("a leg {way} this corner of no length"), "corners at least 1 cm apart");
                } else if let Some(what) = in_the_way(at, next) {
                    let allowed = format!("legs that keep {reach_m:.3} m, the body's reach, from walls and standing bodies");
                    faults.add(&place, format!("a leg {way} this corner that runs into {what}"), allowed);
                }
                at = next;
            }
        }
        Some(MotionSpec::Walk { region_m, .. }) => {
            let region = anticlockwise(region_m);
            let place = format!("{place}.motion.walk.region_m");
            polygon_inside(world, &region, &place, faults);
            if faults.touch(&place) {
                return;
            }
            if !contains_within(&region, body.pose.position(), TOLERANCE_M) {
                let [x, y] = [body.pose.x, body.pose.y];
                faults.add(&place, format!("a region without the body's own position [{x}, {y}]"), "a region around it");
                return;
            }
            // What lies in the way of walks inside lies in the region or within reach of its edge.
            let enclosed = standing.iter().find(|b| contains(&region, b.pose.position())).map(|b| format!("\"{}\"", b.name));
            let walls = world.partitions.iter().filter(|p| !p.stretches(body.bottom_m, body.top_m).is_empty());
            let wall = walls.into_iter().find(|p| contains(&region, p.from)).map(|p| format!("\"{}\"", p.name));
            let enclosed = enclosed.or(wall);
            if let Some(what) = enclosed.or_else(|| edges(&region).find_map(|(a, b)| in_the_way(a, b))) {
                let allowed = format!("a region that keeps {reach_m:.3} m, the body's reach, from walls and standing bodies");
                faults.add(&place, format!("a region too close to {what}"), allowed);
            }
        }
    }
}
