//! The robot's own dynamics in f64: a rigid body on two driven wheels and a caster, and the floor's friction under them.
//!
//! A substep first kicks, then drifts. [`Chassis::kick`] finds the friction impulses at the three contacts such that the
//! velocities at the *end* of the substep obey the friction law (see `contact`), by projected Gauss-Seidel over the
//! contacts, started from the last substep's impulses. Implicit friction has no stiffness limit: creep of a millimetre a
//! second is as stable as a skid. [`Chassis::drift`] moves with the mean of the velocities before and after, which is exact
//! for constant deceleration.
//!
//! Loads follow from the centre of gravity: the caster carries cog/caster of the weight, the wheels the rest in equal parts.
//! Where the height of the centre of gravity is given, the floor's forces shift load: with acceleration (a_x, a_y) in the
//! body's frame the caster carries m a_x h/caster less, and m a_y h/track moves from the left wheel to the right one. Loads
//! follow that with a lag of [`LOAD_LAG_S`], which stands for what tyres and suspension do, and never fall below zero.

use super::contact::{InverseMass, friction_impulse};
use super::motor::{WheelDrive, WheelSpec, WheelState, flushed};
use crate::geometry::{Pose, Vector2, cross, sin_cos};
use crate::world::RobotSpec;

/// Gravity that presses the wheels on the floor, m/s^2.
pub const STANDARD_GRAVITY_M_S2: f64 = 9.81;

/// Gauss-Seidel sweeps at most. Ordinary driving takes three to five.
const MAX_SWEEPS: usize = 50;
/// A sweep that changes no impulse by more than this share of its friction limit is the last.
const CONVERGED: f64 = 1e-9;

/// Time constant of load transfer, s.
const LOAD_LAG_S: f64 = 0.01;

/// Velocity of the centre of gravity in the room's frame, m/s, and yaw rate, rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlanarVelocity {
    /// Velocity of the centre of gravity, m/s.
    pub linear: Vector2<f64>,
    /// Yaw rate, rad/s.
    pub yaw_rate: f64,
}

/// A contact with the floor: the left wheel, the right wheel, the caster.
#[derive(Debug, Clone)]
struct Foot {
    /// Place from the centre of gravity in the body's frame, m.
    place: Vector2<f64>,
    /// Load, N.
    load: f64,
    /// Load of the robot at rest, N.
    rest_load: f64,
    /// Friction as a share of the floor's.
    friction_share: f64,
    /// Friction impulse of the last substep in the body's frame, N s: where the next search starts.
    impulse: Vector2<f64>,
    /// The friction solver's multiplier at that impulse, 1/kg.
    lambda: f64,
    /// The body's inverse mass as felt here, 1/kg.
    body: InverseMass,
}

/// The robot: rigid body, wheels, motors and their contacts with the floor.
#[derive(Debug, Clone)]
pub struct Chassis {
    mass: f64,
    yaw_inertia: f64,
    inertia: Inertia,
    cog_ahead: f64,
    cog_height: f64,
    rolling_resistance: f64,
    creep: f64,
    feet: [Foot; 3],
    wheels: [WheelSpec; 2],
    wheel_states: [WheelState; 2],
    /// Slip at the wheels' contacts after the last kick, body frame, m/s.
    slip: [Vector2<f64>; 2],
    /// Force of the floor on each foot during the last kick, body frame, N.
    forces: [Vector2<f64>; 3],
    /// Position of the centre of gravity, m.
    position: Vector2<f64>,
    /// Heading, rad, not wrapped.
    heading: f64,
    /// Angle turned since the start, rad.
    turned: f64,
    velocity: PlanarVelocity,
    /// Velocity before the last kick.
    velocity_before: PlanarVelocity,
}

impl Chassis {
    /// A robot at rest with the middle of its axle at `start`.
    #[must_use]
    pub fn new(robot: &RobotSpec, start: Pose) -> Self {
        let cog = robot.centre_of_gravity_m;
        let weight = robot.mass_kg * STANDARD_GRAVITY_M_S2;
        let caster_share = if robot.caster_m == 0.0 { 0.0 } else { (cog / robot.caster_m).clamp(0.0, 1.0) };
        let yaw_inertia = robot.yaw_inertia_kg_m2.unwrap_or(0.5 * robot.mass_kg * robot.radius_m * robot.radius_m);
        let inertia = Inertia { inverse_mass: 1.0 / robot.mass_kg, inverse_yaw_inertia: 1.0 / yaw_inertia };
        let foot = |x: f64, y: f64, share: f64, friction_share: f64| {
            let place = Vector2::new(x - cog, y);
            Foot {
                place,
                load: weight * share,
                rest_load: weight * share,
                friction_share,
                impulse: Vector2::zeros(),
                lambda: 0.0,
                body: inertia.felt_at(place),
            }
        };
        let wheel_share = 0.5 * (1.0 - caster_share);
        let half_track = 0.5 * robot.track_m;
        Self {
            mass: robot.mass_kg,
            yaw_inertia,
            inertia,
            cog_ahead: cog,
            cog_height: robot.centre_of_gravity_height_m,
            rolling_resistance: robot.rolling_resistance,
            creep: robot.creep_m_s,
            feet: [
                foot(0.0, half_track, wheel_share, 1.0),
                foot(0.0, -half_track, wheel_share, 1.0),
                foot(robot.caster_m, 0.0, caster_share, robot.caster_friction),
            ],
            wheels: robot.wheel_radius_error.map(|error| WheelSpec::new(robot, robot.wheel_radius_m * (1.0 + error))),
            wheel_states: Default::default(),
            slip: [Vector2::zeros(); 2],
            forces: [Vector2::zeros(); 3],
            position: start.transform(Vector2::new(cog, 0.0)),
            heading: start.heading,
            turned: 0.0,
            velocity: PlanarVelocity::default(),
            velocity_before: PlanarVelocity::default(),
        }
    }

    /// Pose of the middle of the axle.
    #[must_use]
    pub fn pose(&self) -> Pose {
        let (s, c) = sin_cos(self.heading);
        Pose::new(self.position.x - c * self.cog_ahead, self.position.y - s * self.cog_ahead, self.heading)
    }

    /// Velocity of the centre of gravity, and yaw rate.
    #[must_use]
    pub fn velocity(&self) -> PlanarVelocity {
        self.velocity
    }

    /// Sets the robot in motion, as a push would; wheels stay as they are.
    pub fn set_velocity(&mut self, velocity: PlanarVelocity) {
        self.velocity = velocity;
        self.velocity_before = velocity;
    }

    /// Forward and leftward speed of the middle of the axle, m/s.
    #[must_use]
    pub fn axle_velocity(&self) -> Vector2<f64> {
        let v = turned_back(self.velocity.linear, sin_cos(self.heading));
        Vector2::new(v.x, v.y - self.velocity.yaw_rate * self.cog_ahead)
    }

    /// Speeds of the left and right wheel, rad/s.
    #[must_use]
    pub fn wheel_speeds(&self) -> [f64; 2] {
        [self.wheel_states[0].speed, self.wheel_states[1].speed]
    }

    /// Sets the speeds of the left and right wheel, rad/s.
    pub fn set_wheel_speeds(&mut self, speeds: [f64; 2]) {
        for (state, speed) in self.wheel_states.iter_mut().zip(speeds) {
            state.speed = speed;
        }
    }

    /// Angles that the left and right wheel have turned since the start, rad.
    #[must_use]
    pub fn wheel_angles(&self) -> [f64; 2] {
        [self.wheel_states[0].angle, self.wheel_states[1].angle]
    }

    /// True rolling radii of the left and right wheel, m.
    #[must_use]
    pub fn wheel_radii(&self) -> [f64; 2] {
        [self.wheels[0].radius_m, self.wheels[1].radius_m]
    }

    /// Slip velocity (forward, leftward) of the left and right wheel's contact after the last substep, m/s: the hub's speed
    /// over ground less the wheel's rolling speed.
    #[must_use]
    pub fn slip(&self) -> [Vector2<f64>; 2] {
        self.slip
    }

    /// Force (forward, leftward) of the floor on the left wheel, the right wheel and the caster in the last substep, N; never
    /// more than friction times [load](Self::loads).
    #[must_use]
    pub fn forces(&self) -> [Vector2<f64>; 3] {
        self.forces
    }

    /// Load on the left wheel, the right wheel and the caster, N.
    #[must_use]
    pub fn loads(&self) -> [f64; 3] {
        [self.feet[0].load, self.feet[1].load, self.feet[2].load]
    }

    /// Changes the tyre of wheel `k` (0 left, 1 right): its friction and its radius become these shares of what they are.
    pub fn wear_tyre(&mut self, k: usize, friction_factor: f64, radius_factor: f64) {
        self.feet[k].friction_share *= friction_factor;
        self.wheels[k].radius_m *= radius_factor;
    }

    /// Sets the robot down at rest with the middle of its axle at `pose`; the wheels turn on as they did.
    pub fn place(&mut self, pose: Pose) {
        self.position = pose.transform(Vector2::new(self.cog_ahead, 0.0));
        self.heading = pose.heading;
        self.set_velocity(PlanarVelocity::default());
    }

    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Yaw inertia about the centre of gravity, kg m^2.
    #[must_use]
    pub fn yaw_inertia(&self) -> f64 {
        self.yaw_inertia
    }

    /// Energy of motion of body and wheels, J.
    #[must_use]
    pub fn kinetic_energy(&self) -> f64 {
        let wheels: f64 = self.wheels.iter().zip(&self.wheel_states).map(|(w, s)| w.energy(s)).sum();
        let v = &self.velocity;
        0.5 * self.mass * v.linear.norm_squared() + 0.5 * self.yaw_inertia * v.yaw_rate * v.yaw_rate + wheels
    }

    /// One substep on an open floor: [`kick`](Self::kick), then [`drift`](Self::drift).
    pub fn advance(&mut self, drives: [WheelDrive; 2], friction: impl Fn(Vector2<f64>) -> f64, dt: f64) {
        self.kick(drives, friction, dt);
        self.drift(dt);
    }

    /// Finds the velocities after `dt` seconds under motors and friction. `friction` is the floor's coefficient at a point
    /// of the room.
    pub fn kick(&mut self, drives: [WheelDrive; 2], friction: impl Fn(Vector2<f64>) -> f64, dt: f64) {
        if self.cog_height > 0.0 {
            self.shift_load(dt);
        }
        // Contacts as they will stand at the end of the substep, where the friction law has to hold.
        let heading = self.heading + self.velocity.yaw_rate * dt;
        let (sin, cos) = sin_cos(heading);
        let to_room = |v: Vector2<f64>| Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y);
        let ahead = self.position + self.velocity.linear * dt;

        let resistance: [f64; 2] =
            std::array::from_fn(|k| self.rolling_resistance * self.feet[k].load * self.wheels[k].radius_m * dt);
        let respond = |k: usize, along: f64| {
            let wheel = &self.wheels[k];
            let r = wheel.respond(&self.wheel_states[k], drives[k], along * wheel.radius_m, resistance[k], dt);
            (r.speed * wheel.radius_m, r.inverse_inertia * wheel.radius_m * wheel.radius_m)
        };
        // Slip at contact k of a body that moves so, under the impulse `along` the wheel; and the wheel's inverse mass there.
        let slip_at = |k: usize, motion: &Motion, place: Vector2<f64>, along: f64| {
            let over_ground = motion.at(place);
            let (rolling, inverse_mass) = if k < 2 { respond(k, along) } else { (0.0, 0.0) };
            (Vector2::new(over_ground.x - rolling, over_ground.y), inverse_mass)
        };

        let free = Motion { linear: turned_back(self.velocity.linear, (sin, cos)), yaw_rate: self.velocity.yaw_rate };
        let mut motion = free;
        let mut limits = [0.0; 3];
        for (foot, limit) in self.feet.iter_mut().zip(&mut limits) {
            let mu = friction(ahead + to_room(foot.place)) * foot.friction_share;
            *limit = mu * foot.load * dt;
            let length = foot.impulse.norm();
            if length > *limit {
                foot.impulse *= *limit / length;
            }
            motion.push(foot.place, foot.impulse, &self.inertia);
        }
        // The dissipation at last substep's impulses, relative to that at none.
        let mut dissipation = 0.0;
        for (k, (foot, &limit)) in self.feet.iter().zip(&limits).enumerate().filter(|(_, (_, limit))| **limit > 0.0) {
            let without = slip_at(k, &free, foot.place, 0.0).0;
            let with = slip_at(k, &motion, foot.place, foot.impulse.x).0 + foot.impulse * (self.creep / limit);
            dissipation += foot.impulse.dot(&(without + with));
        }
        if dissipation > 0.0 {
            motion = free;
            self.feet.iter_mut().for_each(|foot| foot.impulse = Vector2::zeros());
        }

        for _ in 0..MAX_SWEEPS {
            let mut change: f64 = 0.0;
            for (k, (foot, &limit)) in self.feet.iter_mut().zip(&limits).enumerate() {
                if limit <= 0.0 {
                    continue;
                }
                let (slip, wheel_inverse_mass) = slip_at(k, &motion, foot.place, foot.impulse.x);
                let a = InverseMass { xx: foot.body.xx + wheel_inverse_mass, ..foot.body };
                let b = a.apply(foot.impulse) - slip;
                let impulse = friction_impulse(&a, b, self.creep / limit, limit, &mut foot.lambda);
                let delta = impulse - foot.impulse;
                foot.impulse = impulse;
                motion.push(foot.place, delta, &self.inertia);
                change = change.max(delta.x.abs().max(delta.y.abs()) / limit);
            }
            if change <= CONVERGED {
                break;
            }
        }

        let rolling: [f64; 2] = std::array::from_fn(|k| respond(k, self.feet[k].impulse.x).0);
        for k in 0..2 {
            let over_ground = motion.at(self.feet[k].place);
            self.slip[k] = Vector2::new(over_ground.x - rolling[k], over_ground.y).map(flushed);
            self.wheels[k].finish(&mut self.wheel_states[k], drives[k], rolling[k] / self.wheels[k].radius_m, dt);
        }
        for (foot, force) in self.feet.iter_mut().zip(&mut self.forces) {
            foot.impulse = foot.impulse.map(flushed);
            *force = foot.impulse / dt;
        }
        self.velocity_before = self.velocity;
        self.velocity = PlanarVelocity { linear: to_room(motion.linear.map(flushed)), yaw_rate: flushed(motion.yaw_rate) };
    }

    /// Moves loads towards what the last substep's forces ask for.
    fn shift_load(&mut self, dt: f64) {
        let force: Vector2<f64> = self.forces.iter().sum();
        let [left, right, caster] = &self.feet;
        let weight = left.rest_load + right.rest_load + caster.rest_load;
        let arm = caster.place.x - left.place.x; // from the axle to the caster
        let leaves_caster = if arm == 0.0 { 0.0 } else { force.x * self.cog_height / arm };
        let on_caster = (caster.rest_load - leaves_caster).clamp(0.0, weight);
        let on_wheels = weight - on_caster;
        let track = left.place.y - right.place.y;
        let aside = (force.y * self.cog_height / track).clamp(-0.5 * on_wheels, 0.5 * on_wheels);
        let wanted = [0.5 * on_wheels - aside, 0.5 * on_wheels + aside, on_caster];
        for (foot, wanted) in self.feet.iter_mut().zip(wanted) {
            foot.load += (wanted - foot.load) * (dt / (dt + LOAD_LAG_S));
        }
    }

    /// Moves for `dt` seconds with the mean of the velocities before and after the last kick.
    pub fn drift(&mut self, dt: f64) {
        self.position += (self.velocity_before.linear + self.velocity.linear) * (0.5 * dt);
        self.turn_by(0.5 * (self.velocity_before.yaw_rate + self.velocity.yaw_rate) * dt);
    }

    /// Angle that the robot has turned since the start, rad; being set down elsewhere is no turn.
    #[must_use]
    pub fn turned(&self) -> f64 {
        self.turned
    }

    fn turn_by(&mut self, angle: f64) {
        self.heading += angle;
        self.turned += angle;
    }

    /// The centre of gravity in the room, m.
    pub(super) fn centre_of_gravity(&self) -> Vector2<f64> {
        self.position
    }

    /// Ends a substep whose kick contact turned into `velocity`: moves with it for `dt` seconds, and by `out` besides.
    pub(super) fn rebound(&mut self, velocity: PlanarVelocity, out: Vector2<f64>, dt: f64) {
        self.velocity = velocity;
        self.position += velocity.linear * dt + out;
        self.turn_by(velocity.yaw_rate * dt);
    }

    /// Takes over what contact with a wall or body made of the substep: the displacement of the axle's middle, the change of
    /// heading, and the velocity.
    pub(super) fn adopt(&mut self, displacement: Vector2<f64>, turn: f64, velocity: PlanarVelocity) {
        let axle = self.pose().position() + displacement;
        self.turn_by(turn);
        let (s, c) = sin_cos(self.heading);
        self.position = axle + Vector2::new(c, s) * self.cog_ahead;
        self.velocity = velocity;
    }
}

/// How hard the body is to move: 1/kg and 1/(kg m^2).
#[derive(Debug, Clone, Copy)]
struct Inertia {
    inverse_mass: f64,
    inverse_yaw_inertia: f64,
}

impl Inertia {
    /// The velocity at a place of the body per impulse there.
    fn felt_at(&self, r: Vector2<f64>) -> InverseMass {
        let (m, i) = (self.inverse_mass, self.inverse_yaw_inertia);
        InverseMass { xx: m + i * r.y * r.y, xy: -i * r.x * r.y, yy: m + i * r.x * r.x }
    }
}

/// Motion of the body in its own frame: velocity of the centre of gravity, and yaw rate.
#[derive(Debug, Clone, Copy)]
struct Motion {
    linear: Vector2<f64>,
    yaw_rate: f64,
}

impl Motion {
    /// Velocity at a place of the body.
    fn at(&self, place: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.linear.x - self.yaw_rate * place.y, self.linear.y + self.yaw_rate * place.x)
    }

    /// Changes the motion by an impulse at a place of the body.
    fn push(&mut self, place: Vector2<f64>, impulse: Vector2<f64>, inertia: &Inertia) {
        self.linear += impulse * inertia.inverse_mass;
        self.yaw_rate += cross(place, impulse) * inertia.inverse_yaw_inertia;
    }
}

/// A vector of the room in a frame whose heading has this sine and cosine.
fn turned_back(v: Vector2<f64>, (sin, cos): (f64, f64)) -> Vector2<f64> {
    Vector2::new(cos * v.x + sin * v.y, cos * v.y - sin * v.x)
}
