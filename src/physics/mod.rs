//! Plants: what moves when the wheels are commanded.

use crate::geometry::{Pose, Twist};
use crate::observation::Odometry;

/// What happened during one control interval.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PlantStep {
    /// Motion as the encoders tell it.
    pub odometry: Odometry,
    /// Mean slip speed at the left and right wheel's contact along the wheel's rolling direction, m/s; for the record, never for a method.
    pub slip_m_s: [f64; 2],
    /// Contacts with walls and bodies that began during the interval.
    pub collisions: u32,
}

/// A robot in a room: commanded twists in, motion out.
pub trait Plant: Send {
    /// Holds `command` for `dt_s` seconds.
    fn step(&mut self, command: Twist, dt_s: f64) -> PlantStep;

    /// True pose of the robot (middle of the axle) in the room.
    fn truth(&self) -> Pose;

    /// True current pose of every body, in the order of `World::bodies`.
    fn body_poses(&self) -> &[Pose];
}
