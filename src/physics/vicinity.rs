//! Whether anything is near enough to the robot for rapier to have a say.
//!
//! Rapier changes nothing for a robot that touches nothing, yet its step costs several times what all the rest does. So it is
//! left out while the robot is farther than [`MARGIN_M`] from walls and bodies. Distances are not measured in every substep
//! either: a gap of 1 m stays a gap until robot and bodies together have gone 1 m.

use super::movers::is_solid;
use super::polygon::{distance_to_footprint, distance_to_segment, edges};
use crate::geometry::{Pose, Vector2};
use crate::world::{Footprint, MotionSpec, World};

/// Gap below which rapier is asked, m: ten times the distance at which it foresees contacts.
const MARGIN_M: f64 = 0.02;

/// What could be near the robot.
#[derive(Debug, Clone)]
pub(super) struct Vicinity {
    walls: Vec<(Vector2<f64>, Vector2<f64>)>,
    /// Bodies that the robot can run into, with their index in the world.
    bodies: Vec<(usize, Footprint)>,
    robot_radius: f64,
    /// Greatest speed of a body that moves by itself, m/s.
    fastest_body: f64,
    /// Where things may move although the robot is far: never clear.
    always_near: bool,
    /// Where the robot was last.
    last: Vector2<f64>,
    /// The gap when it was last measured, m, and how far robot and bodies have gone since.
    gap: f64,
    gone: f64,
}

impl Vicinity {
    pub(super) fn new(world: &World, robot: Vector2<f64>) -> Self {
        let height = world.spec.robot.height_m;
        let speed = |motion: &MotionSpec| match motion {
            MotionSpec::Path { speed_m_s, .. } | MotionSpec::Walk { speed_m_s, .. } => *speed_m_s,
            MotionSpec::Pushed { .. } => 0.0,
        };
        let solid = world.bodies.iter().enumerate().filter(|(_, body)| is_solid(body, height));
        Self {
            walls: edges(&world.outline).collect(),
            bodies: solid.map(|(k, body)| (k, body.footprint.clone())).collect(),
            robot_radius: world.spec.robot.radius_m,
            fastest_body: world.bodies.iter().filter_map(|b| b.motion.as_ref()).map(speed).fold(0.0, f64::max),
            always_near: world.bodies.iter().any(|b| matches!(b.motion, Some(MotionSpec::Pushed { .. }))),
            last: robot,
            gap: 0.0,
            gone: f64::INFINITY,
        }
    }

    /// Whether the robot, now at `robot`, meets nothing in the next `dt` seconds at up to `speed` (m/s), with the bodies at
    /// `poses` before they move on.
    pub(super) fn is_clear(&mut self, robot: Vector2<f64>, speed: f64, poses: &[Pose], dt: f64) -> bool {
        if self.always_near {
            return false;
        }
        self.gone += (robot - self.last).norm() + self.fastest_body * dt;
        self.last = robot;
        let margin = MARGIN_M + 2.0 * (speed + self.fastest_body) * dt;
        if (self.gap - margin).abs() <= self.gone {
            self.gap = self.measure(robot, poses);
            self.gone = 0.0;
        }
        self.gap > margin
    }

    /// Free space around the robot's hull, m.
    fn measure(&self, robot: Vector2<f64>, poses: &[Pose]) -> f64 {
        let walls = self.walls.iter().map(|(a, b)| distance_to_segment(robot, *a, *b));
        let bodies =
            self.bodies.iter().map(|(k, footprint)| distance_to_footprint(footprint, poses[*k].inverse_transform(robot)));
        walls.chain(bodies).fold(f64::INFINITY, f64::min) - self.robot_radius
    }
}
