//! The robot with wheels, slip and collisions in a room.

use super::arena::Arena;
use super::chassis::{Chassis, PlanarVelocity};
use super::drive::{CommandLimiter, Encoders};
use super::motor::WheelDrive;
use super::movers::{Movers, Walkway};
use super::polygon::contains;
use super::{Plant, PlantStep};
use crate::geometry::{Pose, Twist, Vector2};
use crate::random::Seed;
use crate::world::{World, Zone};

/// Longest substep, s. A control interval is cut into equal substeps no longer than this.
pub const SUBSTEP_S: f64 = 1e-3;

/// A differential-drive robot that slips, collides, and knows of its motion only what its encoders count.
///
/// Two plants of the same world, start, seed and commands give the same bytes. The seed enters where the encoders stand
/// between two counts at the start, and where walkers go.
pub struct RapierPlant {
    chassis: Chassis,
    limiter: CommandLimiter,
    encoders: Encoders,
    floor: Floor,
    movers: Movers,
    arena: Arena,
    radius: f64,
    substep_s: f64,
}

impl RapierPlant {
    /// A robot at rest in `world` with the middle of its axle at `start`, which should be clear of walls and bodies: rapier
    /// pushes an overlapping robot out, in whichever direction is shortest.
    #[must_use]
    pub fn new(world: &World, start: Pose, seed: Seed) -> Self {
        let robot = &world.spec.robot;
        let chassis = Chassis::new(robot, start);
        Self {
            arena: Arena::new(world, start, chassis.yaw_inertia()),
            chassis,
            limiter: CommandLimiter::new(robot),
            encoders: Encoders::new(robot, seed),
            floor: Floor { friction: world.spec.floor.friction, zones: world.zones.clone() },
            movers: Movers::new(world, seed),
            radius: robot.radius_m,
            substep_s: SUBSTEP_S,
        }
    }

    /// The same plant with another longest substep, s, for convergence studies; held between 1 microsecond and 10 ms.
    #[must_use]
    pub fn with_substep(mut self, substep_s: f64) -> Self {
        self.substep_s = substep_s.clamp(1e-6, 1e-2);
        self
    }

    /// The robot's dynamic state.
    #[must_use]
    pub fn chassis(&self) -> &Chassis {
        &self.chassis
    }

    /// Adds to the robot's velocity at once, as a push from outside does. The wheels learn of it through the floor.
    pub fn push(&mut self, change: PlanarVelocity) {
        let v = self.chassis.velocity();
        self.chassis.set_velocity(PlanarVelocity { linear: v.linear + change.linear, yaw_rate: v.yaw_rate + change.yaw_rate });
    }
}

impl Plant for RapierPlant {
    fn step(&mut self, command: Twist, dt_s: f64) -> PlantStep {
        if !(dt_s > 0.0 && dt_s.is_finite()) {
            return PlantStep::default();
        }
        let target = self.limiter.target(command);
        let substeps = libm::ceil(dt_s / self.substep_s - 1e-9).max(1.0);
        let dt = dt_s / substeps;
        let mut slip = [0.0; 2];
        let mut collisions = 0;
        for _ in 0..substeps as u64 {
            let drives = self.limiter.slew(target, dt).map(WheelDrive::Speed);
            self.chassis.kick(drives, |point| self.floor.friction_at(point), dt);
            let pose = self.chassis.pose();
            self.movers.advance(Walkway { robot: pose.position(), radius: self.radius }, dt);
            self.arena.lead_bodies(self.movers.poses());
            let outcome = self.arena.step(&pose, &self.chassis.velocity(), dt);
            match outcome.touch {
                Some(touch) => self.chassis.adopt(touch.displacement, touch.turn, touch.velocity),
                None => self.chassis.drift(dt),
            }
            collisions += outcome.began;
            for (sum, slip) in slip.iter_mut().zip(self.chassis.slip()) {
                *sum += slip.x;
            }
        }
        PlantStep {
            odometry: self.encoders.read(self.chassis.wheel_angles(), dt_s),
            slip_m_s: slip.map(|sum| sum / substeps),
            collisions,
        }
    }

    fn truth(&self) -> Pose {
        self.chassis.pose()
    }

    fn body_poses(&self) -> &[Pose] {
        self.movers.poses()
    }
}

/// Friction over the floor.
struct Floor {
    friction: f64,
    zones: Vec<Zone>,
}

impl Floor {
    /// Friction at a point: that of the last zone in the file that holds it, else the floor's own.
    fn friction_at(&self, point: Vector2<f64>) -> f64 {
        self.zones.iter().rev().find(|zone| contains(&zone.polygon, point)).map_or(self.friction, |zone| zone.friction)
    }
}
