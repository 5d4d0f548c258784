//! Who has a say in a substep: nobody, the hull's own contacts, or rapier.
//!
//! Most of the time the robot is farther than [`MARGIN_M`] from walls and bodies, and nothing can touch it. What cannot give way
//! is the hull's business (`hull`). Rapier costs many times what all the rest does, and is asked where bodies move one another:
//! while the robot, or something that moves by itself, is near a body that can be pushed, and until all of those stand still
//! again. Then moving bodies far from the robot and from what can be pushed are kept from it: they touch nothing.
//!
//! Distances are not measured in every substep either: a gap of 1 m stays a gap until robot and bodies together have gone 1 m.

use super::movers::is_solid;
use super::stretches::Stretches;
use crate::geometry::{Pose, Vector2};
use crate::world::{Body, Boundary, Footprint, MotionSpec, World};

/// Gap below which rapier is asked, m: ten times the distance at which it foresees contacts.
const MARGIN_M: f64 = 0.02;

/// What could be near the robot.
#[derive(Debug, Clone)]
pub(super) struct Vicinity {
    boundary: Boundary,
    partitions: Stretches,
    /// Bodies that do not give way, with their index in the world.
    bodies: Vec<(usize, Footprint)>,
    /// Those of them that move by themselves.
    movers: Vec<Round>,
    /// Bodies that can be pushed.
    loose: Vec<Round>,
    robot_radius: f64,
    /// Greatest speed of a body that moves by itself, m/s.
    fastest_body: f64,
    /// Where the robot was last.
    last: Vector2<f64>,
    /// The gap when it was last measured, m, and how far robot and bodies have gone since.
    gap: f64,
    gone: f64,
}

/// What could touch what during a substep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Near {
    /// Nothing.
    Nothing,
    /// The robot and something that does not give way.
    Unyielding,
    /// Something and a body that can be pushed.
    Loose,
}

/// A body as its circumscribed circle.
#[derive(Debug, Clone, Copy)]
struct Round {
    /// Index in the world.
    body: usize,
    radius: f64,
}

/// Robot and bodies at the start of a substep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    /// Middle of the axle.
    pub(super) robot: Vector2<f64>,
    /// Greatest speed of the robot, m/s.
    pub(super) speed: f64,
    /// Poses of all bodies.
    pub(super) poses: &'a [Pose],
    /// Length of the substep, s.
    pub(super) dt: f64,
}

impl Vicinity {
    pub(super) fn new(world: &World, robot: Vector2<f64>) -> Self {
        let height = world.spec.robot.height_m;
        let solid = || world.bodies.iter().enumerate().filter(|(_, body)| is_solid(body, height));
        let (mut movers, mut loose, mut fastest_body) = (Vec::new(), Vec::new(), 0.0_f64);
        for (body, Body { footprint, motion, .. }) in solid() {
            let round = Round { body, radius: footprint.bounding_radius() };
            match motion {
                None => {}
                Some(MotionSpec::Pushed { .. }) => loose.push(round),
                Some(MotionSpec::Path { speed_m_s, .. } | MotionSpec::Walk { speed_m_s, .. }) => {
                    movers.push(round);
                    fastest_body = fastest_body.max(*speed_m_s);
                }
            }
        }
        Self {
            boundary: world.boundary().clone(),
            partitions: Stretches::new(world),
            bodies: solid().filter(|(_, b)| !b.can_be_pushed()).map(|(k, b)| (k, b.footprint.clone())).collect(),
            robot_radius: world.spec.robot.radius_m,
            movers,
            loose,
            fastest_body,
            last: robot,
            gap: 0.0,
            gone: f64::INFINITY,
        }
    }

    /// What could touch what during the substep that begins with `scene`. `settled` says that the bodies that can be pushed stand
    /// still.
    pub(super) fn look(&mut self, scene: &Scene<'_>, settled: bool) -> Near {
        self.gone += (scene.robot - self.last).norm() + self.fastest_body * scene.dt;
        self.last = scene.robot;
        let loose_near = |place: Vector2<f64>, radius: f64| self.is_loose_near(place, radius, scene);
        if !settled
            || loose_near(scene.robot, self.robot_radius)
            || self.movers.iter().any(|mover| loose_near(scene.poses[mover.body].position(), mover.radius))
        {
            return Near::Loose;
        }
        let margin = self.margin(scene);
        if (self.gap - margin).abs() <= self.gone {
            self.gap = self.measure(scene.robot, scene.poses);
            self.gone = 0.0;
        }
        if self.gap > margin { Near::Nothing } else { Near::Unyielding }
    }

    /// Whether a body that moves by itself could touch the robot or a body that can be pushed during the substep.
    pub(super) fn reaches(&self, body: usize, scene: &Scene<'_>) -> bool {
        self.movers.iter().filter(|mover| mover.body == body).any(|mover| {
            let place = scene.poses[body].position();
            let gap = (place - scene.robot).norm() - mover.radius - self.robot_radius;
            gap <= self.margin(scene) || self.is_loose_near(place, mover.radius, scene)
        })
    }

    /// Whether a disc could touch a body that can be pushed.
    fn is_loose_near(&self, place: Vector2<f64>, radius: f64, scene: &Scene<'_>) -> bool {
        let gap = |loose: &Round| (place - scene.poses[loose.body].position()).norm() - radius - loose.radius;
        self.loose.iter().any(|loose| gap(loose) <= self.margin(scene))
    }

    /// Gap that nothing closes during the substep, m.
    fn margin(&self, scene: &Scene<'_>) -> f64 {
        MARGIN_M + 2.0 * (scene.speed + self.fastest_body) * scene.dt
    }

    /// Free space around the robot's hull, m.
    fn measure(&self, robot: Vector2<f64>, poses: &[Pose]) -> f64 {
        let bodies = self.bodies.iter().map(|(k, footprint)| footprint.distance_to(poses[*k].inverse_transform(robot)));
        let walls = [self.boundary.distance(robot), self.partitions.distance(robot)];
        walls.into_iter().chain(bodies).fold(f64::INFINITY, f64::min) - self.robot_radius
    }
}
