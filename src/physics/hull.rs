//! The robot's round hull against what does not give way: walls, standing bodies, and bodies that move by themselves.
//!
//! Only the robot's motion is unknown there, three numbers, so this needs no physics engine: a disc touches a wall or a convex
//! body in one point, and impulses at the few points in reach are found by projected Gauss-Seidel until they no longer change.
//! It is all in f64 and costs a tenth of a step of rapier, which serves where a touched body can give way (`arena`).
//!
//! At each point, with the gap g and the hull's velocity v relative to the body there (n points from the body to the hull):
//! - the hull does not pass: v_n >= -g/dt, which only makes it touch at the end of the substep, however fast it comes;
//! - a hit gives back a share of the speed of approach: v_n = -e v_n before (Newton), unless it is slower than
//!   [`SLOWEST_BOUNCE_M_S`], which is pressing and no hit;
//! - friction opposes sliding with up to mu times the normal impulse (Coulomb), and turns the robot by its lever.
//!
//! A hull that starts inside something is moved out at [`PUSH_OUT_M_S`] at most, without gaining speed.

use super::chassis::{Chassis, PlanarVelocity};
use super::movers::is_solid;
use super::stretches::Stretches;
use super::{Struck, TOUCH_GAP_M, Touched};
use crate::geometry::{Pose, Vector2, cross};
use crate::world::grid::bounds_of;
use crate::world::polygon::{closest_on_segment, contains, edges};
use crate::world::{Boundary, Footprint, World};

/// Coulomb friction of the robot's hull on walls and bodies.
pub(super) const HULL_FRICTION: f64 = 0.3;
/// Share of the speed of approach that a hit gives back.
pub(super) const HULL_RESTITUTION: f64 = 0.1;
/// Speed of approach below which nothing is given back, m/s: motors that press against a wall gain a few mm/s each substep.
const SLOWEST_BOUNCE_M_S: f64 = 0.01;
/// Greatest speed at which an overlap is undone, m/s.
const PUSH_OUT_M_S: f64 = 0.3;
/// Gauss-Seidel sweeps at most. One contact takes two, a corner some ten.
const MAX_SWEEPS: usize = 100;
/// A sweep that changes no velocity by more than this, m/s, is the last.
const CONVERGED_M_S: f64 = 1e-12;

/// All that the hull can run into and that does not give way.
#[derive(Debug, Clone)]
pub(super) struct Hull {
    radius: f64,
    boundary: Boundary,
    /// For each corner of the outline whether it juts into the room.
    juts: Vec<bool>,
    /// Index in the world, footprint, and a circle around its origin that holds it.
    bodies: Vec<(usize, Footprint, f64)>,
    partitions: Stretches,
}

/// A place where the hull touches, or may within the substep.
#[derive(Debug, Clone, Copy)]
struct Contact {
    with: Struck,
    /// From the body to the hull.
    normal: Vector2<f64>,
    gap: f64,
    /// Velocity of the body, m/s.
    surface: Vector2<f64>,
    /// The contact point from the centre of gravity, m.
    arm: Vector2<f64>,
    /// Least normal velocity that the contact allows, m/s.
    target: f64,
    /// Impulses along the normal and along the tangent (a quarter turn anti-clockwise from it), N s.
    impulse: Vector2<f64>,
}

impl Hull {
    pub(super) fn new(world: &World) -> Self {
        let robot = &world.spec.robot;
        let bodies = world.bodies.iter().enumerate().filter(|(_, b)| is_solid(b, robot.height_m) && !b.can_be_pushed());
        Self {
            radius: robot.radius_m,
            juts: jutting(&world.outline),
            boundary: world.boundary().clone(),
            bodies: bodies.map(|(k, b)| (k, b.footprint.clone(), b.footprint.bounding_radius())).collect(),
            partitions: Stretches::new(world),
        }
    }

    /// Ends a substep of `chassis` that began with a kick: moves it, and keeps it out of everything. Bodies go from `before` to
    /// `after`. What the hull touches or comes close to goes to `touched`; with nothing in reach the robot drifts freely.
    pub(super) fn advance(&self, chassis: &mut Chassis, before: &[Pose], after: &[Pose], dt: f64, touched: &mut Vec<Touched>) {
        let mut contacts = self.contacts(chassis, before, after, dt);
        if contacts.is_empty() {
            return chassis.drift(dt);
        }
        let (inverse_mass, inverse_inertia) = (1.0 / chassis.mass(), 1.0 / chassis.yaw_inertia());
        let mut motion = chassis.velocity();
        for contact in &mut contacts {
            let approach = -contact.velocity(&motion).dot(&contact.normal);
            let hits = approach * dt > contact.gap && approach > SLOWEST_BOUNCE_M_S;
            contact.target = if hits { HULL_RESTITUTION * approach } else { -contact.gap.max(0.0) / dt };
        }
        for _ in 0..MAX_SWEEPS {
            let mut change = 0.0_f64;
            for contact in &mut contacts {
                change = change.max(contact.solve(&mut motion, inverse_mass, inverse_inertia));
            }
            if change <= CONVERGED_M_S {
                break;
            }
        }
        let close = contacts.iter().filter(|contact| contact.gap <= TOUCH_GAP_M || contact.impulse.x > 0.0);
        touched.extend(close.map(|contact| Touched {
            with: contact.with,
            impulse_n_s: contact.impulse.norm(),
            direction: -contact.normal,
        }));
        if contacts.iter().all(|contact| contact.impulse.x == 0.0 && contact.gap >= 0.0) {
            return chassis.drift(dt);
        }
        let out: Vector2<f64> = contacts.iter().map(|c| c.normal * (-c.gap).clamp(0.0, PUSH_OUT_M_S * dt)).sum();
        chassis.rebound(motion, out, dt);
    }

    /// The places that the hull can touch within the substep, and those close enough to count as touched still.
    fn contacts(&self, chassis: &Chassis, before: &[Pose], after: &[Pose], dt: f64) -> Vec<Contact> {
        let (velocity, centre) = (chassis.velocity(), chassis.pose().position());
        let axle = centre - chassis.centre_of_gravity();
        let reach = |surface: Vector2<f64>| {
            let speed = velocity.linear.norm() + velocity.yaw_rate.abs() * axle.norm() + surface.norm();
            TOUCH_GAP_M + 2.0 * speed * dt
        };
        let contact = |with: Struck, surface: Vector2<f64>, (normal, distance): (Vector2<f64>, f64)| {
            let gap = distance - self.radius;
            let arm = axle - normal * self.radius;
            (gap <= reach(surface)).then(|| Contact { with, normal, gap, surface, arm, target: 0.0, impulse: Vector2::zeros() })
        };
        let still = reach(Vector2::zeros()) + self.radius;
        let walls =
            self.walls_at(centre, still).into_iter().filter_map(|(k, at)| contact(Struck::Wall(k), Vector2::zeros(), at));
        let bodies = self.bodies.iter().filter_map(|(k, footprint, bound)| {
            let surface = (after[*k].position() - before[*k].position()) / dt;
            if (before[*k].position() - centre).norm() - bound - self.radius > reach(surface) {
                return None;
            }
            let (normal, distance) = footprint_at(footprint, before[*k].inverse_transform(centre));
            contact(Struck::Body(*k), surface, (before[*k].transform(normal) - before[*k].position(), distance))
        });
        let partitions = self.partitions.near(centre, still);
        let partitions =
            partitions.filter_map(|(k, corners)| contact(Struck::Partition(*k), Vector2::zeros(), polygon_at(corners, centre)));
        walls.chain(bodies).chain(partitions).collect()
    }

    /// Normal and distance of `point` from each wall that faces it, those at least that are within `reach`. Outside the room, where
    /// only a bad start can put the robot, the nearest wall alone counts, with the distance negative.
    fn walls_at(&self, point: Vector2<f64>, reach: f64) -> Vec<(usize, (Vector2<f64>, f64))> {
        if self.boundary.contains(point) {
            let (low, high) = bounds_of(&[point], reach);
            let walls = self.boundary.walls_near(low, high).into_iter().map(|k| (k, self.boundary.wall(k)));
            return walls.filter_map(|(k, (a, b))| Some((k, wall(a, b, self.juts[k], point)?))).collect();
        }
        let walls = (0..self.juts.len()).map(|k| (k, self.boundary.wall(k)));
        let nearest = walls.map(|(k, (a, b))| (k, closest_on_segment(point, a, b).0 - point));
        let nearest = nearest.min_by(|(_, a), (_, b)| a.norm_squared().total_cmp(&b.norm_squared()));
        let way_back = nearest.filter(|(_, way)| way.norm() > 0.0).map(|(k, way)| (k, (way / way.norm(), -way.norm())));
        way_back.into_iter().collect()
    }
}

impl Contact {
    /// Velocity of the hull at the contact relative to the body.
    fn velocity(&self, motion: &PlanarVelocity) -> Vector2<f64> {
        motion.linear + quarter_turn(self.arm) * motion.yaw_rate - self.surface
    }

    /// Corrects the contact's impulse for the others', and the robot's motion with it; by how much the velocity here changed.
    fn solve(&mut self, motion: &mut PlanarVelocity, inverse_mass: f64, inverse_inertia: f64) -> f64 {
        let tangent = quarter_turn(self.normal);
        let felt = |along: Vector2<f64>| {
            let lever = cross(self.arm, along);
            inverse_mass + inverse_inertia * lever * lever
        };
        let normal_change = {
            let wanted = self.impulse.x + (self.target - self.velocity(motion).dot(&self.normal)) / felt(self.normal);
            wanted.max(0.0) - self.impulse.x
        };
        self.apply(motion, self.normal * normal_change, inverse_mass, inverse_inertia);
        self.impulse.x += normal_change;
        let limit = HULL_FRICTION * self.impulse.x;
        let wanted = self.impulse.y - self.velocity(motion).dot(&tangent) / felt(tangent);
        let tangent_change = wanted.clamp(-limit, limit) - self.impulse.y;
        self.apply(motion, tangent * tangent_change, inverse_mass, inverse_inertia);
        self.impulse.y += tangent_change;
        (normal_change.abs() + tangent_change.abs()) * inverse_mass
    }

    fn apply(&self, motion: &mut PlanarVelocity, impulse: Vector2<f64>, inverse_mass: f64, inverse_inertia: f64) {
        motion.linear += impulse * inverse_mass;
        motion.yaw_rate += cross(self.arm, impulse) * inverse_inertia;
    }
}

/// For each corner of an anticlockwise outline whether it juts into the room.
fn jutting(outline: &[Vector2<f64>]) -> Vec<bool> {
    let n = outline.len();
    (0..n).map(|k| cross(outline[k] - outline[(k + n - 1) % n], outline[(k + 1) % n] - outline[k]) < 0.0).collect()
}

/// Normal and distance of `point` from the wall from `a` to `b` of a room to its left. Nothing where the wall does not face the
/// point: from behind, beyond its end `b`, which is the next wall's, and beyond its start unless that `juts` into the room.
fn wall(a: Vector2<f64>, b: Vector2<f64>, juts: bool, point: Vector2<f64>) -> Option<(Vector2<f64>, f64)> {
    let (nearest, share) = closest_on_segment(point, a, b);
    let away = point - nearest;
    if share <= 0.0 {
        let distance = away.norm();
        return (juts && distance > 0.0).then(|| (away / distance, distance));
    }
    let inwards = quarter_turn(b - a) / (b - a).norm();
    let distance = away.dot(&inwards);
    (share < 1.0 && distance >= 0.0).then_some((inwards, distance))
}

/// Normal and distance of `point` from a footprint, in the footprint's frame. Inside, the distance is negative and the normal
/// the shortest way out.
fn footprint_at(footprint: &Footprint, point: Vector2<f64>) -> (Vector2<f64>, f64) {
    match footprint {
        Footprint::Disc(radius) => {
            let distance = point.norm();
            (if distance > 0.0 { point / distance } else { Vector2::x() }, distance - radius)
        }
        Footprint::Polygon(corners) => polygon_at(corners, point),
    }
}

/// The same for a convex polygon, corners anti-clockwise.
fn polygon_at(corners: &[Vector2<f64>], point: Vector2<f64>) -> (Vector2<f64>, f64) {
    let inside = contains(corners, point);
    let nearest = edges(corners).map(|(a, b)| {
        let away = point - closest_on_segment(point, a, b).0;
        let distance = away.norm();
        let outwards = -quarter_turn(b - a) / (b - a).norm();
        if inside || distance == 0.0 { (outwards, distance) } else { (away / distance, distance) }
    });
    let (normal, distance) = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((Vector2::x(), f64::INFINITY));
    (normal, if inside { -distance } else { distance })
}

/// `v` turned by 90 degrees anti-clockwise.
fn quarter_turn(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}
