//! Lines of sight in the plane of the camera's height.

use crate::geometry::{Pose, Vector2, cross};
use crate::world::polygon::{bounds, edges};
use crate::world::{Footprint, Partition, World};

/// Whether something stands between `camera` and the centre of body `target`, with the bodies at `bodies`.
pub(super) fn hidden(world: &World, bodies: &[Pose], camera: Vector2<f64>, target: usize) -> bool {
    let goal = bodies[target].position();
    let height_m = world.spec.camera.height_m;
    let by_a_body = world.bodies.iter().zip(bodies).enumerate().any(|(k, (body, pose))| {
        k != target
            && body.bottom_m <= height_m
            && height_m < body.top_m
            && blocks(&body.footprint, pose.inverse_transform(camera), pose.inverse_transform(goal))
    });
    by_a_body || by_a_partition(world, camera, goal) || behind_a_wall(world, camera, goal, &world.bodies[target].footprint)
}

/// Whether a wall inside the room stands between `camera` and `goal`; doors and windows at the camera's height are seen through.
fn by_a_partition(world: &World, camera: Vector2<f64>, goal: Vector2<f64>) -> bool {
    let height_m = world.spec.camera.height_m;
    let meets = |wall: &Partition| {
        let pieces = wall.pieces.iter().filter(|piece| piece.bottom_m <= height_m && height_m < piece.top_m);
        let mut footprints = pieces.map(|piece| wall.footprint(piece.along_m));
        footprints.any(|corners| edges(&corners).any(|(p, q)| crossing(camera, goal, p, q).is_some()))
    };
    let (low, high) = bounds(&[camera, goal]);
    world.partitions_near(low, high).into_iter().any(|k| meets(&world.partitions[k]))
}

/// Whether the segment from `a` to `b`, both in the footprint's own frame, meets the footprint.
fn blocks(footprint: &Footprint, a: Vector2<f64>, b: Vector2<f64>) -> bool {
    match footprint {
        Footprint::Disc(radius_m) => distance_to_origin(a, b) < *radius_m,
        Footprint::Polygon(corners) => edges(corners).any(|(p, q)| crossing(a, b, p, q).is_some()),
    }
}

/// Whether a wall cuts the segment from `camera` to `goal` before it comes to the body there. A body may reach into its wall.
fn behind_a_wall(world: &World, camera: Vector2<f64>, goal: Vector2<f64>, footprint: &Footprint) -> bool {
    let reach_m = match footprint {
        Footprint::Disc(radius_m) => *radius_m,
        Footprint::Polygon(corners) => corners.iter().map(|c| c.norm()).fold(0.0, f64::max),
    };
    let range_m = (goal - camera).norm();
    let (low, high) = bounds(&[camera, goal]);
    let mut walls = world.boundary().walls_near(low, high).into_iter().map(|k| world.wall(k));
    walls.any(|(p, q)| crossing(camera, goal, p, q).is_some_and(|share| share * range_m < range_m - reach_m))
}

/// Distance of the segment from `a` to `b` to the origin.
fn distance_to_origin(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    let along = b - a;
    let length_squared = along.norm_squared();
    let share = if length_squared > 0.0 { (-a.dot(&along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (a + along * share).norm()
}

/// Share of the way from `a` to `b` at which that segment crosses the one from `p` to `q`. Parallel segments never cross.
fn crossing(a: Vector2<f64>, b: Vector2<f64>, p: Vector2<f64>, q: Vector2<f64>) -> Option<f64> {
    let (ab, pq, ap) = (b - a, q - p, p - a);
    let denominator = cross(ab, pq);
    if denominator == 0.0 {
        return None;
    }
    let (share, along_edge) = (cross(ap, pq) / denominator, cross(ap, ab) / denominator);
    ((0.0..=1.0).contains(&share) && (0.0..=1.0).contains(&along_edge)).then_some(share)
}
