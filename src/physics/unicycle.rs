//! The perfect robot of the homing papers.

use super::movers::{Movers, Walkway};
use super::script::{Event, Script};
use super::{Plant, PlantStep, finite_or_stop};
use crate::geometry::{Pose, Twist};
use crate::observation::Odometry;
use crate::random::Seed;
use crate::world::World;

/// Moving bodies advance in steps of at most this, s.
const BODY_STEP_S: f64 = 0.01;

/// Kinematics of the unicycle: x' = v cos, y' = v sin, heading' = omega, with the command taken as it is, odometry equal to it,
/// and nothing in the way.
///
/// The command is held over a control interval, and for a held twist the exact solution is an arc ([`Pose::advanced`]); a
/// numerical integrator such as Dormand-Prince would only approach it. There are no limits on speed or acceleration, as the
/// papers have none. Moving bodies move as they do for [`RapierPlant`](super::RapierPlant) and wait for the robot; where the
/// robot drives through a body, nothing happens. Of a world's disturbances it knows kidnaps, at the end of the interval in which they
/// fall; of wheel faults and gyros nothing.
#[derive(Debug, Clone)]
pub struct UnicyclePlant {
    pose: Pose,
    movers: Movers,
    radius: f64,
    script: Script,
    /// Time since the start, s.
    clock_s: f64,
}

impl UnicyclePlant {
    /// A robot in `world` at `start`. The seed says where walkers go.
    #[must_use]
    pub fn new(world: &World, start: Pose, seed: Seed) -> Self {
        Self {
            pose: start,
            movers: Movers::new(world, seed),
            radius: world.spec.robot.radius_m,
            script: Script::new(world),
            clock_s: 0.0,
        }
    }
}

impl Plant for UnicyclePlant {
    fn step(&mut self, command: Twist, dt_s: f64) -> PlantStep {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return PlantStep::default();
        }
        let twist = finite_or_stop(command);
        let start = self.pose;
        let body_steps = libm::ceil(dt_s / BODY_STEP_S - 1e-9).max(1.0);
        for k in 1..=body_steps as u64 {
            let robot = start.advanced(twist, dt_s * (k as f64 / body_steps)).position();
            self.movers.advance(Walkway { robot, radius: self.radius }, dt_s / body_steps);
        }
        self.pose = start.advanced(twist, dt_s);
        self.clock_s += dt_s;
        while let Some(event) = self.script.due(self.clock_s) {
            if let Event::Kidnap(pose) = event {
                self.pose = pose;
            }
        }
        PlantStep { odometry: Odometry { twist, dt_s }, ..PlantStep::default() }
    }

    fn truth(&self) -> Pose {
        self.pose
    }

    fn body_poses(&self) -> &[Pose] {
        self.movers.poses()
    }
}
