//! Plants: what moves when the wheels are commanded.
//!
//! A [`Plant`] holds a commanded twist for one control interval and says what the encoders make of it. Two plants share
//! that interface:
//!
//! - [`RapierPlant`]: a robot with mass on two driven wheels and a caster. Motors turn the wheels, the floor's friction
//!   moves the robot, contact keeps it out of walls and bodies and pushes cartons, and quantised encoders tell what the wheels
//!   did.
//! - [`UnicyclePlant`]: the kinematics that homing papers assume. What is commanded happens, and odometry is exact.
//!
//! # How the wheels meet the floor
//! The truth is kept here in f64, by [`Chassis`], which knows nothing of rapier. A control interval is cut into substeps of
//! at most [`SUBSTEP_S`]. Each substep
//! 0. lets happen what the world has in store (`script`: kicks, kidnaps, wheels that break),
//! 1. clamps and slews the commanded twist into wheel-speed references (`drive`),
//! 2. solves motors, wheels and floor friction together for the velocity at its end (`chassis`, `motor`, `contact`),
//! 3. looks at what is near (`vicinity`) and moves on: freely where nothing is; kept out of walls and of bodies that do not give
//!    way (`hull`); or, where something that can be pushed is near or on the move, by rapier (`arena`), which changes the
//!    robot's motion only where it touches something.
//!
//! Rapier works in f32. At 7 m from the origin a substep's 0.3 mm is 630 units in the last place, so rounding alone would
//! bend and stretch paths by up to 0.1 %. Asking it only where bodies move one another keeps that out, makes the closed forms
//! of friction and of hits hold in the full plant to f64 accuracy, and is some five times as fast.
//!
//! Knows of: worlds. Must not know of rendering, vision or estimation; `arena` alone knows rapier.

#[cfg(feature = "rapier")]
mod arena;
mod chassis;
mod contact;
#[cfg(feature = "rapier")]
mod drive;
#[cfg(feature = "rapier")]
mod gyro;
#[cfg(feature = "rapier")]
mod hull;
mod motor;
mod movers;
#[cfg(feature = "rapier")]
mod rapier_plant;
mod script;
#[cfg(feature = "rapier")]
mod slide;
#[cfg(feature = "rapier")]
mod stretches;
mod unicycle;
#[cfg(feature = "rapier")]
mod vicinity;

use crate::geometry::{Pose, Twist, Vector2};
use crate::observation::{Bumper, Odometry};
use crate::world::World;

pub use chassis::{Chassis, PlanarVelocity, STANDARD_GRAVITY_M_S2};
pub use motor::WheelDrive;
#[cfg(feature = "rapier")]
pub use rapier_plant::{RapierPlant, SUBSTEP_S};
pub use unicycle::UnicyclePlant;

/// What happened during one control interval.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlantStep {
    /// Motion as the encoders tell it.
    pub odometry: Odometry,
    /// Mean slip speed at the left and right wheel's contact along the wheel's rolling direction, m/s: the ground speed
    /// of the wheel's hub less the wheel's rolling speed, so negative for a wheel that spins. For the record, never for a
    /// method.
    pub slip_m_s: [f64; 2],
    /// Contacts with walls and bodies that began during the interval.
    pub collisions: u32,
}

/// What the robot ran into, or what ran into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Struck {
    /// Wall k of the room.
    Wall(usize),
    /// The body with this index in `World::bodies`.
    Body(usize),
    /// The wall inside the room with this index in `World::partitions`.
    Partition(usize),
}

impl Struck {
    /// Its name in `world`: `wall 2`, `desk`, `inner wall 0`.
    #[must_use]
    pub fn name(self, world: &World) -> String {
        match self {
            Self::Wall(k) => format!("wall {k}"),
            Self::Body(k) => world.bodies.get(k).map_or_else(|| format!("body {k}"), |body| body.name.clone()),
            Self::Partition(k) => world.partitions.get(k).map_or_else(|| format!("inner wall {k}"), |wall| wall.name.clone()),
        }
    }
}

/// Gap up to which a contact once made counts as one, m: a robot that rattles along a wall runs into it once. Also the gap
/// at which rapier foresees contacts.
const TOUCH_GAP_M: f64 = 0.002;

/// Something that the robot's hull touched in a substep, or came as close to as [`TOUCH_GAP_M`].
#[derive(Debug, Clone, Copy)]
struct Touched {
    with: Struck,
    /// Impulse on the robot, N s, friction included; zero where the two are merely close.
    impulse_n_s: f64,
    /// Where on the hull, as a direction in the room from its middle.
    direction: Vector2<f64>,
}

/// A contact between the robot's hull and a wall or body, as it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Collision {
    /// Time since the plant began, s.
    pub time_s: f64,
    /// With what.
    pub with: Struck,
    /// Impulse of the hit on the robot, N s, the hull's friction included.
    pub impulse_n_s: f64,
}

/// A robot in a room: commanded twists in, motion out.
pub trait Plant: Send {
    /// Holds `command` for `dt_s` seconds. A command that is not finite counts as a stop; an interval that is not a
    /// positive finite number changes nothing.
    fn step(&mut self, command: Twist, dt_s: f64) -> PlantStep;

    /// True pose of the robot (middle of the axle) in the room.
    fn truth(&self) -> Pose;

    /// True current pose of every body, in the order of `World::bodies`.
    fn body_poses(&self) -> &[Pose];

    /// The contacts that began during the last interval. A plant in whose way nothing stands has none.
    fn collisions(&self) -> &[Collision] {
        &[]
    }

    /// What the bumper felt during the last interval.
    fn bumper(&self) -> Bumper {
        Bumper::default()
    }

    /// What wheels and floor do; `None` for a plant without wheels.
    fn wheels(&self) -> Option<WheelState> {
        None
    }
}

/// Motion of a robot and of its wheels, and what passes between them and the floor. For the record, never for a method.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelState {
    /// True velocity of the middle of the axle, forward and leftward, m/s.
    pub velocity_m_s: Vector2<f64>,
    /// True yaw rate, rad/s.
    pub yaw_rate_rad_s: f64,
    /// True speeds of the left and right wheel, rad/s.
    pub wheel_speeds_rad_s: [f64; 2],
    /// Slip, forces and loads, means over the last interval.
    pub floor: FloorContact,
}

/// What passed between the robot and the floor during a control interval: means over its substeps. For the record, never for a
/// method.
///
/// Vectors are (forward, leftward) in the robot's frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FloorContact {
    /// Slip of the left and right wheel, m/s: the hub's speed over ground less the wheel's rolling speed.
    pub slip_m_s: [Vector2<f64>; 2],
    /// Force of the floor on the left wheel, the right wheel and the caster, N.
    pub force_n: [Vector2<f64>; 3],
    /// Load on the left wheel, the right wheel and the caster, N.
    pub load_n: [f64; 3],
}

/// The command as a plant takes it: a command that is not finite is a stop.
fn finite_or_stop(command: Twist) -> Twist {
    if command.v.is_finite() && command.omega.is_finite() { command } else { Twist::default() }
}
