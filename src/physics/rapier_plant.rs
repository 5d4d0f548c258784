//! The robot with wheels, slip and collisions in a room.

use super::arena::Arena;
use super::chassis::{Chassis, PlanarVelocity};
use super::drive::{CommandLimiter, Encoders};
use super::gyro::Gyro;
use super::hull::Hull;
use super::motor::WheelDrive;
use super::movers::{Movers, Walkway};
use super::script::{Event, Script};
use super::vicinity::{Near, Scene, Vicinity};
use super::{Collision, FloorContact, Plant, PlantStep, Struck, Touched, WheelState};
use crate::geometry::{Pose, Twist, Vector2, angle_of};
use crate::observation::Bumper;
use crate::random::Seed;
use crate::world::polygon::contains;
use crate::world::robot::WheelFault;
use crate::world::{World, Zone};

/// Longest substep, s. A control interval is cut into equal substeps no longer than this.
pub const SUBSTEP_S: f64 = 1e-3;

/// A differential-drive robot that slips, collides, and knows of its motion only what its encoders count.
///
/// Two plants of the same world, start, seed and commands give the same bytes. The seed enters where the encoders stand
/// between two counts at the start, what the gyro adds, and where walkers go; each has a stream of its own.
///
/// Odometry is that of the encoders. Where the robot has a gyro, the yaw rate is the gyro's: on a floor that slips, wheels know
/// less of turning than the cheapest gyro does, and nothing is gained by mixing the two before an estimator sees them.
pub struct RapierPlant {
    chassis: Chassis,
    limiter: CommandLimiter,
    encoders: Encoders,
    gyro: Option<Gyro>,
    script: Script,
    /// Wheels that no longer turn.
    seized: [bool; 2],
    floor: Floor,
    movers: Movers,
    hull: Hull,
    arena: Arena,
    vicinity: Vicinity,
    /// What had a say in the last substep.
    near: Near,
    /// Whether rapier takes part in each, needed or not.
    always_ask_rapier: bool,
    /// Where bodies were at the start of the substep.
    before: Vec<Pose>,
    /// What the robot came close to in the last substep, and what it is in contact with.
    touched: Vec<Touched>,
    touching: Vec<Struck>,
    radius: f64,
    substep_s: f64,
    /// Time since the start, s.
    clock_s: f64,
    /// What happened in the last interval.
    floor_contact: FloorContact,
    collisions: Vec<Collision>,
    /// What the bumper has felt in the interval.
    bumper: Bumper,
}

impl RapierPlant {
    /// A robot at rest in `world` with the middle of its axle at `start`, which should be clear of walls and bodies: an
    /// overlapping robot is pushed out, in whichever direction is shortest.
    #[must_use]
    pub fn new(world: &World, start: Pose, seed: Seed) -> Self {
        let robot = &world.spec.robot;
        let chassis = Chassis::new(robot, start);
        let floor_contact = FloorContact { load_n: chassis.loads(), ..FloorContact::default() };
        Self {
            hull: Hull::new(world),
            arena: Arena::new(world, start, chassis.yaw_inertia()),
            chassis,
            limiter: CommandLimiter::new(robot),
            encoders: Encoders::new(robot, seed),
            gyro: robot.gyro.as_ref().map(|gyro| Gyro::new(gyro, seed)),
            script: Script::new(world),
            seized: [false; 2],
            floor: Floor { friction: world.spec.floor.friction, zones: world.zones.clone() },
            movers: Movers::new(world, seed),
            vicinity: Vicinity::new(world, start.position()),
            near: Near::Nothing,
            always_ask_rapier: false,
            before: Vec::new(),
            touched: Vec::new(),
            touching: Vec::new(),
            radius: robot.radius_m,
            substep_s: SUBSTEP_S,
            clock_s: 0.0,
            floor_contact,
            collisions: Vec::new(),
            bumper: Bumper::default(),
        }
    }

    /// The same plant with another longest substep, s, for convergence studies; held between 1 microsecond and 10 ms.
    #[must_use]
    pub fn with_substep(mut self, substep_s: f64) -> Self {
        self.substep_s = substep_s.clamp(1e-6, 1e-2);
        self
    }

    /// The same plant with rapier at work in every substep, not only where something can be pushed: for tests, which hold the two
    /// ways against each other, and to measure what rapier costs.
    #[must_use]
    pub fn always_asking_rapier(mut self) -> Self {
        self.always_ask_rapier = true;
        self
    }

    /// The robot's dynamic state.
    #[must_use]
    pub fn chassis(&self) -> &Chassis {
        &self.chassis
    }

    /// What passed between robot and floor during the last control interval.
    #[must_use]
    pub fn floor_contact(&self) -> &FloorContact {
        &self.floor_contact
    }

    /// Moves everything from `time_s` on for `dt` seconds. `target` are rim speeds, m/s.
    fn substep(&mut self, target: [f64; 2], time_s: f64, dt: f64) {
        while let Some(event) = self.script.due(time_s) {
            self.suffer(event);
        }
        let mut drives = self.limiter.slew(target, dt).map(WheelDrive::Speed);
        for (drive, _) in drives.iter_mut().zip(self.seized).filter(|(_, seized)| *seized) {
            *drive = WheelDrive::Locked;
        }
        self.chassis.kick(drives, |point| self.floor.friction_at(point), dt);

        let (pose, velocity) = (self.chassis.pose(), self.chassis.velocity());
        let scene = Scene { robot: pose.position(), speed: velocity.linear.norm(), poses: self.movers.poses(), dt };
        let near = if self.always_ask_rapier { Near::Loose } else { self.vicinity.look(&scene, self.arena.settled()) };
        if near == Near::Loose {
            if self.near != Near::Loose {
                self.arena.resume();
            }
            self.arena.admit_bodies(scene.poses, |body| self.vicinity.reaches(body, &scene));
        }
        self.near = near;
        let walkway = Walkway { robot: pose.position(), radius: self.radius };
        self.touched.clear();
        match near {
            Near::Nothing => {
                self.movers.advance(walkway, dt);
                self.chassis.drift(dt);
            }
            Near::Unyielding => {
                self.before.clear();
                self.before.extend_from_slice(self.movers.poses());
                self.movers.advance(walkway, dt);
                self.hull.advance(&mut self.chassis, &self.before, self.movers.poses(), dt, &mut self.touched);
            }
            Near::Loose => {
                self.movers.advance(walkway, dt);
                self.arena.lead_bodies(self.movers.poses());
                match self.arena.step(&pose, &velocity, dt, &mut self.touched) {
                    Some(touch) => self.chassis.adopt(touch.displacement, touch.turn, touch.velocity),
                    None => self.chassis.drift(dt),
                }
                for (index, pose) in self.arena.loose_poses() {
                    self.movers.place(index, pose);
                }
            }
        }
        self.watch_contacts(time_s + dt);
    }

    /// Reports the contacts that began. A contact begins when it first carries an impulse and ends when the gap has grown beyond
    /// [`super::TOUCH_GAP_M`], so that a robot that rattles along a wall counts once.
    fn watch_contacts(&mut self, time_s: f64) {
        let touching = &mut self.touching;
        touching.retain(|known| self.touched.iter().any(|touched| touched.with == *known));
        let heading = self.chassis.pose().heading;
        for &Touched { with, impulse_n_s, direction } in self.touched.iter().filter(|touched| touched.impulse_n_s > 0.0) {
            self.bumper.press(angle_of(direction) - heading);
            if !touching.contains(&with) {
                touching.push(with);
                self.collisions.push(Collision { time_s, with, impulse_n_s });
            }
        }
    }

    fn suffer(&mut self, event: Event) {
        match event {
            Event::Kick(impulse, turn) => {
                let yaw_rate = turn / self.chassis.yaw_inertia();
                self.push(PlanarVelocity { linear: impulse / self.chassis.mass(), yaw_rate });
            }
            Event::Kidnap(pose) => self.chassis.place(pose),
            Event::Break(wheel, WheelFault::SeizedMotor) => self.seized[wheel] = true,
            Event::Break(wheel, WheelFault::DeadEncoder) => self.encoders.kill(wheel),
            Event::Break(wheel, WheelFault::WornTyre { friction_factor, radius_factor }) => {
                self.wear_tyre(wheel, friction_factor, radius_factor);
            }
        }
    }

    /// Changes the tyre of wheel `k` (0 left, 1 right); see [`Chassis::wear_tyre`].
    pub fn wear_tyre(&mut self, k: usize, friction_factor: f64, radius_factor: f64) {
        self.chassis.wear_tyre(k, friction_factor, radius_factor);
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
        let mut mean = FloorContact::default();
        self.collisions.clear();
        self.bumper = Bumper::default();
        for k in 0..substeps as u64 {
            self.substep(target, self.clock_s + k as f64 * dt, dt);
            mean.add(&self.chassis);
        }
        self.clock_s += dt_s;
        mean.divide(substeps);
        self.floor_contact = mean;
        let mut odometry = self.encoders.read(self.chassis.wheel_angles(), dt_s);
        if let Some(gyro) = &mut self.gyro {
            odometry.twist.omega = gyro.read(self.chassis.turned(), dt_s);
        }
        PlantStep { odometry, slip_m_s: mean.slip_m_s.map(|slip| slip.x), collisions: self.collisions.len() as u32 }
    }

    fn truth(&self) -> Pose {
        self.chassis.pose()
    }

    fn body_poses(&self) -> &[Pose] {
        self.movers.poses()
    }

    fn collisions(&self) -> &[Collision] {
        &self.collisions
    }

    fn bumper(&self) -> Bumper {
        self.bumper
    }

    fn wheels(&self) -> Option<WheelState> {
        Some(WheelState {
            velocity_m_s: self.chassis.axle_velocity(),
            yaw_rate_rad_s: self.chassis.velocity().yaw_rate,
            wheel_speeds_rad_s: self.chassis.wheel_speeds(),
            floor: self.floor_contact,
        })
    }
}

impl FloorContact {
    fn add(&mut self, chassis: &Chassis) {
        self.slip_m_s.iter_mut().zip(chassis.slip()).for_each(|(sum, slip)| *sum += slip);
        self.force_n.iter_mut().zip(chassis.forces()).for_each(|(sum, force)| *sum += force);
        self.load_n.iter_mut().zip(chassis.loads()).for_each(|(sum, load)| *sum += load);
    }

    fn divide(&mut self, count: f64) {
        self.slip_m_s = self.slip_m_s.map(|sum| sum / count);
        self.force_n = self.force_n.map(|sum| sum / count);
        self.load_n = self.load_n.map(|sum| sum / count);
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
