//! The room, the bearings and the estimate as three-dimensional scenes.

use std::f64::consts::TAU;

use foxglove::messages::{
    Color, CylinderPrimitive, LinePrimitive, Point3, SceneEntity, SceneUpdate, TriangleListPrimitive, line_primitive,
};

use super::messages::{colour, point, pose, timestamp, vector};
use crate::draw::map::paint::{BodyPaint, HOME, INK, friction_colour};
use crate::geometry::{Pose, Vector2, direction};
use crate::observation::{Bearing, Estimate};
use crate::world::{Body, Footprint, World};

/// Length of the line along a bearing, m: long enough to tell where it points, short of most things.
const BEARING_M: f64 = 1.5;
/// Standard deviations that an ellipse covers, and its corners.
const K_SIGMA: f64 = 2.0;
const ELLIPSE_CORNERS: u32 = 48;

fn entity(id: &str, frame: &str, time_ns: u64) -> SceneEntity {
    SceneEntity { id: id.to_owned(), frame_id: frame.to_owned(), timestamp: Some(timestamp(time_ns)), ..SceneEntity::default() }
}

fn line(points: Vec<Point3>, kind: line_primitive::Type, thickness: f64, color: Color) -> LinePrimitive {
    LinePrimitive {
        r#type: kind as i32,
        pose: Some(pose(&Pose::IDENTITY, 0.0)),
        thickness,
        points,
        color: Some(color),
        ..LinePrimitive::default()
    }
}

/// What stands: floor, walls, zones, home and all bodies as they are at time 0.
pub(super) fn room(world: &World) -> SceneUpdate {
    let mut floor = entity("room", "map", 0);
    let top = world.spec.room.height_m;
    for z in [0.0, top] {
        let corners = world.outline.iter().map(|&p| point(p, z)).collect();
        floor.lines.push(line(corners, line_primitive::Type::LineLoop, 0.02, colour(INK, 1.0)));
    }
    let posts = world.outline.iter().flat_map(|&p| [point(p, 0.0), point(p, top)]).collect();
    floor.lines.push(line(posts, line_primitive::Type::LineList, 0.02, colour(INK, 1.0)));
    for zone in &world.zones {
        floor.triangles.push(lid(&zone.polygon, &Pose::IDENTITY, 0.002, colour(&friction_colour(zone.friction), 1.0)));
    }
    for (wall, piece) in world.partitions.iter().flat_map(|wall| wall.pieces.iter().map(move |piece| (wall, piece))) {
        let corners = wall.footprint(piece.along_m);
        for z in [piece.bottom_m, piece.top_m] {
            let corners = corners.map(|p| point(p, z)).to_vec();
            floor.lines.push(line(corners, line_primitive::Type::LineLoop, 0.02, colour(INK, 1.0)));
        }
        let posts = corners.iter().flat_map(|&p| [point(p, piece.bottom_m), point(p, piece.top_m)]).collect();
        floor.lines.push(line(posts, line_primitive::Type::LineList, 0.02, colour(INK, 1.0)));
    }
    let mut home = entity("home", "home", 0);
    let radius = world.spec.task.arrival_radius_m;
    home.lines.push(line(circle([radius, radius], 0.0), line_primitive::Type::LineLoop, 0.01, colour(HOME, 1.0)));
    let ahead = [Vector2::zeros(), Vector2::new(0.3, 0.0)].map(|p| point(p, 0.0)).to_vec();
    home.lines.push(line(ahead, line_primitive::Type::LineStrip, 0.02, colour(HOME, 1.0)));
    let bodies = world.bodies.iter().enumerate().map(|(k, body)| body_entity(world, k, body, &body.pose, 0));
    SceneUpdate { entities: [floor, home].into_iter().chain(bodies).collect(), ..SceneUpdate::default() }
}

/// The bodies that are no longer where they were; `None` where all are.
pub(super) fn moved(world: &World, before: &[Pose], now: &[Pose], time_ns: u64) -> Option<SceneUpdate> {
    let bodies = world.bodies.iter().zip(before.iter().zip(now)).enumerate();
    let moved = bodies.filter(|(_, (_, (before, now)))| before != now);
    let entities: Vec<_> = moved.map(|(k, (body, (_, now)))| body_entity(world, k, body, now, time_ns)).collect();
    (!entities.is_empty()).then(|| SceneUpdate { entities, ..SceneUpdate::default() })
}

fn body_entity(world: &World, k: usize, body: &Body, at: &Pose, time_ns: u64) -> SceneEntity {
    let paint = BodyPaint::of(world, k, false);
    let color = colour(paint.fill, 1.0);
    // The number keeps bodies of one name apart.
    let mut entity = entity(&format!("{k} {}", body.name), "map", time_ns);
    match &body.footprint {
        Footprint::Disc(radius) => entity.cylinders.push(CylinderPrimitive {
            pose: Some(pose(at, 0.5 * (body.bottom_m + body.top_m))),
            size: Some(vector(2.0 * radius, 2.0 * radius, body.top_m - body.bottom_m)),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(color),
        }),
        Footprint::Polygon(corners) => {
            entity.triangles.push(lid(corners, at, body.top_m, color));
            entity.triangles.push(sides(corners, at, body.bottom_m, body.top_m, color));
        }
    }
    entity
}

/// A convex polygon that lies.
fn lid(corners: &[Vector2<f64>], at: &Pose, z: f64, color: Color) -> TriangleListPrimitive {
    let fan = corners.windows(2).skip(1).flat_map(|pair| [corners[0], pair[0], pair[1]]);
    triangles(fan.map(|p| point(p, z)).collect(), at, color)
}

/// The sides of an upright prism.
fn sides(corners: &[Vector2<f64>], at: &Pose, bottom: f64, top: f64, color: Color) -> TriangleListPrimitive {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let faces = edges.flat_map(|(&a, &b)| [(a, bottom), (b, bottom), (b, top), (a, bottom), (b, top), (a, top)]);
    triangles(faces.map(|(p, z)| point(p, z)).collect(), at, color)
}

fn triangles(points: Vec<Point3>, at: &Pose, color: Color) -> TriangleListPrimitive {
    TriangleListPrimitive { pose: Some(pose(at, 0.0)), points, color: Some(color), ..TriangleListPrimitive::default() }
}

/// Lines along the bearings, from the camera: those of home's landmarks blue, others grey.
pub(super) fn bearings(bearings: &[Bearing], is_home: impl Fn(&Bearing) -> bool, time_ns: u64) -> SceneUpdate {
    let mut entity = entity("bearings", "camera", time_ns);
    entity.frame_locked = true;
    for (of_home, color) in [(true, colour("#0072b2", 0.6)), (false, colour("#6b6b6b", 0.4))] {
        let chosen = bearings.iter().filter(|b| is_home(b) == of_home);
        let points: Vec<_> =
            chosen.flat_map(|b| [Vector2::zeros(), direction(b.azimuth_rad) * BEARING_M]).map(|p| point(p, 0.0)).collect();
        if !points.is_empty() {
            entity.lines.push(line(points, line_primitive::Type::LineList, 0.004, color));
        }
    }
    SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }
}

/// The ellipse of the estimate's position in the home frame; without an estimate nothing, which takes the last one away.
pub(super) fn ellipse(estimate: Option<&Estimate>, time_ns: u64) -> SceneUpdate {
    let mut entity = entity("estimate", "home", time_ns);
    if let Some(estimate) = estimate {
        let c = &estimate.covariance;
        let (radii, angle) = crate::draw::map::ellipse_axes([[c[(0, 0)], c[(0, 1)]], [c[(1, 0)], c[(1, 1)]]], K_SIGMA);
        let mut outline = line(circle(radii, 0.01), line_primitive::Type::LineLoop, 0.01, colour("#d55e00", 1.0));
        outline.pose = Some(pose(&Pose::new(estimate.pose.x, estimate.pose.y, angle), 0.0));
        entity.lines.push(outline);
    }
    SceneUpdate { entities: vec![entity], ..SceneUpdate::default() }
}

/// Corners of an ellipse with these half axes around the origin.
fn circle([long, short]: [f64; 2], z: f64) -> Vec<Point3> {
    let corner = |k: u32| direction(f64::from(k) * TAU / f64::from(ELLIPSE_CORNERS));
    (0..ELLIPSE_CORNERS).map(corner).map(|d| point(Vector2::new(long * d.x, short * d.y), z)).collect()
}
