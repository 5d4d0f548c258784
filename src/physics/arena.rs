//! The room in rapier, with walls, bodies and the robot's round body: what happens where bodies that can be pushed take part.
//!
//! The only file that knows rapier and its vector types. Rapier's world is a top view, so it has no gravity; friction with
//! the floor is not its business (see `chassis`). Everything crosses this border in f64.

use rapier2d::prelude::{
    ColliderBuilder, ColliderHandle, ContactPair, MassProperties, PhysicsWorld, Pose as RapierPose, RigidBody,
    RigidBodyBuilder, RigidBodyHandle, Rotation, Vector,
};

use super::chassis::PlanarVelocity;
use super::hull::{HULL_FRICTION, HULL_RESTITUTION};
use super::movers::is_solid;
use super::slide::SlidingBody;
use super::stretches::Stretches;
use super::{Struck, Touched};
use crate::geometry::{Pose, Vector2, atan2, sin_cos};
use crate::world::polygon::{bounds, contains, edges, segments_cross};
use crate::world::{Boundary, Footprint, MotionSpec, World};

/// Size of what moves, m. Rapier's tolerances scale with it: contacts may sink in by 0.5 mm and are foreseen at `TOUCH_GAP_M`.
const LENGTH_UNIT_M: f32 = 0.1;
/// Depth of a wall behind its face, m, where the room leaves space for it.
const WALL_DEPTH_M: f64 = 0.5;

/// What contact made of a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch {
    /// Displacement of the robot's axle, m.
    pub(super) displacement: Vector2<f64>,
    /// Change of its heading, rad.
    pub(super) turn: f64,
    /// Its velocity at the end.
    pub(super) velocity: PlanarVelocity,
}

/// A body that can be pushed.
struct Loose {
    /// Its index in the world.
    index: usize,
    handle: RigidBodyHandle,
    slide: SlidingBody,
}

/// A body that moves by itself and that the robot can run into.
struct Led {
    /// Its index in the world.
    index: usize,
    handle: RigidBodyHandle,
    /// Whether rapier knows of it now.
    present: bool,
}

/// Rapier's copy of the room.
pub(super) struct Arena {
    physics: PhysicsWorld,
    robot: RigidBodyHandle,
    hull: ColliderHandle,
    /// Bodies that move by themselves and that the robot can run into.
    movers: Vec<Led>,
    /// Bodies that can be pushed.
    loose: Vec<Loose>,
    /// Whether friction holds all of those still.
    settled: bool,
}

impl Arena {
    pub(super) fn new(world: &World, start: Pose, yaw_inertia: f64) -> Self {
        let mut physics = PhysicsWorld { gravity: Vector::ZERO, ..PhysicsWorld::default() };
        physics.integration_parameters.length_unit = LENGTH_UNIT_M;
        // Contacts are computed anew each substep, so that none is decided on a pose of some substeps ago.
        physics.integration_parameters.contact_recycling = false;
        // At a millisecond a step, rapier's four inner steps per step add cost and no accuracy.
        physics.integration_parameters.num_solver_iterations = 1;

        let (friction, restitution) = (HULL_FRICTION as f32, HULL_RESTITUTION as f32);
        let hard = |shape: ColliderBuilder| shape.friction(friction).restitution(restitution).density(0.0);
        for (k, [a, b, apex]) in walls(&world.outline, world.boundary()).enumerate() {
            let wall = hard(ColliderBuilder::triangle(vector(a), vector(b), vector(apex)));
            physics.insert_collider(wall.user_data(mark(Struck::Wall(k))), None);
        }
        for (k, corners) in Stretches::new(world).all {
            let wall = hard(shape(&Footprint::Polygon(corners.to_vec())));
            physics.insert_collider(wall.user_data(mark(Struck::Partition(k))), None);
        }
        let robot_spec = &world.spec.robot;
        let mut movers = Vec::new();
        let mut loose = Vec::new();
        for (index, body) in world.bodies.iter().enumerate().filter(|(_, b)| is_solid(b, robot_spec.height_m)) {
            let shape = hard(shape(&body.footprint)).user_data(mark(Struck::Body(index)));
            if let Some(MotionSpec::Pushed { mass_kg, friction }) = body.motion {
                let dynamic = RigidBodyBuilder::dynamic().pose(rapier_pose(&body.pose)).can_sleep(false);
                let handle = physics.insert(dynamic, shape.mass(mass_kg as f32)).0;
                loose.push(Loose { index, handle, slide: SlidingBody::new(&body.footprint, friction) });
            } else if body.motion.is_some() {
                let kinematic = RigidBodyBuilder::kinematic_position_based().can_sleep(false).enabled(false);
                movers.push(Led { index, handle: physics.insert(kinematic, shape).0, present: false });
            } else {
                physics.insert_collider(shape.position(rapier_pose(&body.pose)), None);
            }
        }
        let centre_of_gravity = Vector::new(robot_spec.centre_of_gravity_m as f32, 0.0);
        let mass = MassProperties::new(centre_of_gravity, robot_spec.mass_kg as f32, yaw_inertia as f32);
        let body =
            RigidBodyBuilder::dynamic().pose(rapier_pose(&start)).additional_mass_properties(mass).can_sleep(false).build();
        let (robot, hull) = physics.insert(body, hard(ColliderBuilder::ball(robot_spec.radius_m as f32)));
        Self { physics, robot, hull, movers, loose, settled: true }
    }

    /// After substeps without rapier, what it knows of bodies that move by themselves is out of date.
    pub(super) fn resume(&mut self) {
        for mover in self.movers.iter_mut().filter(|mover| mover.present) {
            mover.present = false;
            if let Some(body) = self.physics.bodies.get_mut(mover.handle) {
                body.set_enabled(false);
            }
        }
    }

    /// Lets those moving bodies take part for which `reaches` holds (by their index in the world), from where `poses` has them.
    pub(super) fn admit_bodies(&mut self, poses: &[Pose], reaches: impl Fn(usize) -> bool) {
        for mover in &mut self.movers {
            let wanted = reaches(mover.index);
            if wanted == mover.present {
                continue;
            }
            mover.present = wanted;
            if let Some(body) = self.physics.bodies.get_mut(mover.handle) {
                body.set_enabled(wanted);
                body.set_position(rapier_pose(&poses[mover.index]), false);
            }
        }
    }

    /// Where each moving body that takes part will be at the end of the next substep.
    pub(super) fn lead_bodies(&mut self, poses: &[Pose]) {
        for mover in self.movers.iter().filter(|mover| mover.present) {
            if let Some(body) = self.physics.bodies.get_mut(mover.handle) {
                body.set_next_kinematic_position(rapier_pose(&poses[mover.index]));
            }
        }
    }

    /// Whether the bodies that can be pushed stand still, and would go on doing so if nothing touched them.
    pub(super) fn settled(&self) -> bool {
        self.settled
    }

    /// Steps `dt` seconds with the robot's axle at `pose` and its centre of gravity at `velocity`. What the robot touches or comes
    /// close to goes to `touched`; with nothing there, rapier has no say in its motion and none comes back.
    pub(super) fn step(
        &mut self,
        pose: &Pose,
        velocity: &PlanarVelocity,
        dt: f64,
        touched: &mut Vec<Touched>,
    ) -> Option<Touch> {
        let before = rapier_pose(pose);
        if let Some(robot) = self.physics.bodies.get_mut(self.robot) {
            robot.set_position(before, false);
            robot.set_linvel(vector(velocity.linear), false);
            robot.set_angvel(velocity.yaw_rate as f32, false);
        }
        for loose in &self.loose {
            if let Some(body) = self.physics.bodies.get_mut(loose.handle) {
                let slowed = loose.slide.slowed(&velocity_of(body), dt);
                body.set_linvel(vector(slowed.linear), false);
                body.set_angvel(slowed.yaw_rate as f32, false);
            }
        }
        self.physics.integration_parameters.dt = dt as f32;
        self.physics.step();
        self.settled = self.loose.iter().all(|loose| {
            let velocity = self.physics.bodies.get(loose.handle).map(velocity_of).unwrap_or_default();
            loose.slide.slowed(&velocity, dt) == PlanarVelocity::default()
        });

        let pairs = self.physics.narrow_phase.contact_pairs_with(self.hull).filter(|pair| pair.has_any_active_contact());
        let first = touched.len();
        touched.extend(pairs.map(|pair| {
            let is_first = pair.collider1 == self.hull;
            let other = if is_first { pair.collider2 } else { pair.collider1 };
            // Rapier's normals point from the first collider to the second.
            let normals = pair.solver_manifolds().iter().map(|manifold| from_vector(manifold.data.normal));
            let direction = normals.sum::<Vector2<f64>>() * if is_first { 1.0 } else { -1.0 };
            let mark = self.physics.colliders.get(other).map_or(0, |collider| collider.user_data);
            Touched { with: struck(mark), impulse_n_s: impulse(pair), direction }
        }));
        if touched.len() == first {
            return None;
        }
        let robot = self.physics.bodies.get(self.robot)?;
        let after = robot.position();
        let turn = before.rotation.inverse() * after.rotation;
        Some(Touch {
            displacement: from_vector(after.translation - before.translation),
            turn: atan2(f64::from(turn.im), f64::from(turn.re)),
            velocity: velocity_of(robot),
        })
    }

    /// Where the bodies that can be pushed are now, by their index in the world.
    pub(super) fn loose_poses(&self) -> impl Iterator<Item = (usize, Pose)> + '_ {
        self.loose.iter().filter_map(|loose| {
            let pose = self.physics.bodies.get(loose.handle)?.position();
            let heading = atan2(f64::from(pose.rotation.im), f64::from(pose.rotation.re));
            let position = from_vector(pose.translation);
            Some((loose.index, Pose::new(position.x, position.y, heading)))
        })
    }
}

/// Impulse of a contact, N s, friction included.
fn impulse(pair: &ContactPair) -> f64 {
    let points = pair.solver_manifolds().iter().flat_map(|manifold| &manifold.points);
    let [normal, along] = points.fold([0.0, 0.0], |[normal, along], point| {
        [normal + f64::from(point.data.impulse), along + f64::from(point.data.tangent_impulse[0])]
    });
    (normal * normal + along * along).sqrt()
}

/// What a collider stands for, as the number that rapier carries for us: three kinds by turns.
fn mark(struck: Struck) -> u128 {
    match struck {
        Struck::Wall(k) => 3 * k as u128,
        Struck::Body(k) => 3 * k as u128 + 1,
        Struck::Partition(k) => 3 * k as u128 + 2,
    }
}

/// The inverse of [`mark`].
fn struck(mark: u128) -> Struck {
    let k = (mark / 3) as usize;
    match mark % 3 {
        0 => Struck::Wall(k),
        1 => Struck::Body(k),
        _ => Struck::Partition(k),
    }
}

/// Solid walls: a triangle behind each edge of the room, its apex outside. Triangles have no overhang, so with an apex close
/// enough they fit behind any edge, beside sharp reflex corners and in thin partitions too.
fn walls<'a>(outline: &'a [Vector2<f64>], boundary: &'a Boundary) -> impl Iterator<Item = [Vector2<f64>; 3]> + 'a {
    edges(outline).map(|(a, b)| {
        let along = b - a;
        let outwards = Vector2::new(along.y, -along.x) / along.norm();
        let middle = (a + b) * 0.5;
        let mut depth = WALL_DEPTH_M;
        // Halving ends at a tenth of a micrometre at the latest, which is as good as a plane.
        while depth > 1e-7 && !fits([a, b, middle + outwards * depth], boundary) {
            depth *= 0.5;
        }
        [a, b, middle + outwards * depth]
    })
}

/// Whether the triangle stays out of the room.
fn fits(triangle: [Vector2<f64>; 3], boundary: &Boundary) -> bool {
    let [a, b, apex] = triangle;
    let (low, high) = bounds(&triangle);
    let near: Vec<_> = boundary.walls_near(low, high).into_iter().map(|k| boundary.wall(k)).collect();
    let holds_corner = near.iter().any(|&(c, _)| c != a && c != b && contains(&triangle, c));
    let crosses = near.iter().any(|&(c, d)| segments_cross(a, apex, c, d) || segments_cross(b, apex, c, d));
    !holds_corner && !crosses && !boundary.contains(apex)
}

fn shape(footprint: &Footprint) -> ColliderBuilder {
    match footprint {
        Footprint::Disc(radius) => ColliderBuilder::ball(*radius as f32),
        Footprint::Polygon(corners) => {
            let corners: Vec<_> = corners.iter().copied().map(vector).collect();
            // A polygon too thin for f32 has no hull; its outline serves.
            ColliderBuilder::convex_hull(&corners).unwrap_or_else(|| ColliderBuilder::polyline(corners, None))
        }
    }
}

fn velocity_of(body: &RigidBody) -> PlanarVelocity {
    PlanarVelocity { linear: from_vector(body.linvel()), yaw_rate: f64::from(body.angvel()) }
}

fn vector(v: Vector2<f64>) -> Vector {
    Vector::new(v.x as f32, v.y as f32)
}

fn from_vector(v: Vector) -> Vector2<f64> {
    Vector2::new(f64::from(v.x), f64::from(v.y))
}

fn rapier_pose(pose: &Pose) -> RapierPose {
    let (sin, cos) = sin_cos(pose.heading);
    RapierPose::from_parts(vector(pose.position()), Rotation::from_cos_sin_unchecked(cos as f32, sin as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::cross;

    /// A room with a thin partition and a sharp reflex corner: no wall may reach into it.
    #[test]
    fn walls_stay_out_of_a_room_that_is_not_convex() {
        let corners =
            [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [2.1, 3.0], [2.05, 0.5], [2.0, 3.0], [1.0, 3.0], [0.9, 2.0], [0.0, 2.1]];
        let outline: Vec<_> = corners.iter().map(|c| Vector2::new(c[0], c[1])).collect();
        let mut deepest: f64 = 0.0;
        let world = format!("name = \"test\"\nroom = {{ outline_m = {corners:?} }}\nhome = {{ x_m = 0.5, y_m = 0.5 }}");
        let world = World::from_toml(&world, "test").unwrap();
        for [a, b, apex] in walls(&outline, world.boundary()) {
            assert!(cross(b - a, apex - a) < 0.0);
            deepest = deepest.max(-cross(b - a, apex - a) / (b - a).norm());
            for k in 1..20 {
                for l in 1..20 {
                    let (s, t) = (f64::from(k) / 20.0, f64::from(l) / 20.0);
                    let point = (a * (1.0 - s) + b * s) * (1.0 - t) + apex * t;
                    assert!(!contains(&outline, point), "{a} {b} {apex} {point}");
                }
            }
        }
        assert!((deepest - WALL_DEPTH_M).abs() < 1e-9);
    }
}
