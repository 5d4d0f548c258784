//! What a homing method may know, and what it answers: the border that keeps the truth out.
//!
//! A [`Method`] is built from a [`Briefing`] (the home snapshot, the robot's own data sheet, the task) and then gets one
//! [`Observation`] a control step. None of these types holds a true pose, a true range or anything else of the simulator, so a
//! method cannot look at the truth.
//!
//! Knows of: geometry and pictures. Must not know of any truth.

use serde::Serialize;
use strum::{IntoStaticStr, VariantArray};

use crate::geometry::{Matrix3, Pose, Twist, wrap};
use crate::panorama::{Picture, Projection};

/// Names a landmark (a feature or an object) of the home snapshot, or one met later on the way. Stable over a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct LandmarkId(pub u32);

/// Direction in which a landmark is seen.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bearing {
    /// Which landmark.
    pub id: LandmarkId,
    /// Azimuth from the robot's heading, rad, in (-pi, pi].
    pub azimuth_rad: f64,
    /// Standard deviation of the azimuth as the sensor states it, rad.
    pub sd_rad: f64,
}

/// Motion since the last observation, from wheel encoders (and a gyro, where the robot has one). Never from the true pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Odometry {
    /// Mean twist over the interval.
    pub twist: Twist,
    /// Length of the interval, s. Zero in the first observation.
    pub dt_s: f64,
}

/// A sector of the bumper around the front half of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum BumperSector {
    /// 54 to 90 degrees to the left of straight ahead.
    Left,
    /// 18 to 54 degrees to the left.
    FrontLeft,
    /// Within 18 degrees of straight ahead.
    FrontCentre,
    /// 18 to 54 degrees to the right.
    FrontRight,
    /// 54 to 90 degrees to the right.
    Right,
}

impl BumperSector {
    /// The sector that a contact in `direction_rad` from the robot's heading presses; `None` for one behind, which no bumper feels.
    #[must_use]
    pub fn at(direction_rad: f64) -> Option<Self> {
        let width = std::f64::consts::PI / Self::VARIANTS.len() as f64;
        let share = (std::f64::consts::FRAC_PI_2 - wrap(direction_rad)) / width;
        (share >= 0.0).then(|| Self::VARIANTS.get(share as usize).copied()).flatten()
    }

    /// Direction of its middle from the robot's heading, rad.
    #[must_use]
    pub fn direction_rad(self) -> f64 {
        let width = std::f64::consts::PI / Self::VARIANTS.len() as f64;
        std::f64::consts::FRAC_PI_2 - (f64::from(self as u8) + 0.5) * width
    }
}

/// Which sectors of the bumper were pressed since the last observation, for however short a time. A robot without a bumper, and one
/// that nothing stops, never feels any.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Bumper {
    pressed: [bool; BumperSector::VARIANTS.len()],
}

impl Bumper {
    /// Presses the sector that a contact in `direction_rad` from the robot's heading is in.
    pub fn press(&mut self, direction_rad: f64) {
        if let Some(sector) = BumperSector::at(direction_rad) {
            self.pressed[sector as usize] = true;
        }
    }

    /// The pressed sectors, from left to right.
    pub fn sectors(self) -> impl Iterator<Item = BumperSector> {
        BumperSector::VARIANTS.iter().copied().filter(move |sector| self.pressed[*sector as usize])
    }
}

/// What was seen at home, stored before the run: bearings from the home pose. Their frame is the home frame.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct HomeSnapshot {
    /// Bearings at home, each id once.
    pub bearings: Vec<Bearing>,
}

/// One control step's input.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// Time since the start of the run, s.
    pub time_s: f64,
    /// Motion since the last observation.
    pub odometry: Odometry,
    /// Bearings seen now, each id at most once. May hold wrong matches.
    pub bearings: &'a [Bearing],
    /// What the view may show instead of [`Observation::bearings`]: further sets of them, each explained by another motion from
    /// home, likeliest first. There are some where things look alike. A method may leave them alone.
    pub alternatives: &'a [Vec<Bearing>],
    /// Heading in the home frame as a compass tells it, rad; `None` for a robot without one.
    pub compass_rad: Option<f64>,
    /// What the bumper felt since the last observation.
    pub bumper: Bumper,
    /// What the camera sees now; `None` for a robot that gets bearings without panoramas. The project's own methods go by
    /// bearings alone.
    pub panorama: Option<Picture<'a>>,
}

/// The robot's data sheet, as its maker would state it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RobotSheet {
    /// Distance between the wheels, m.
    pub track_m: f64,
    /// Position of the camera from the middle of the axle, forward and left, m. Bearings are those from there.
    pub camera_offset_m: [f64; 2],
    /// Greatest forward speed, m/s.
    pub max_speed_m_s: f64,
    /// Greatest yaw rate, rad/s.
    pub max_turn_rate_rad_s: f64,
    /// Greatest acceleration that the drive commands, m/s^2.
    pub max_acceleration_m_s2: f64,
}

/// The task: how fast to drive and when it counts as done.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TaskSheet {
    /// Cruising speed, m/s.
    pub speed_m_s: f64,
    /// Time between observations, s.
    pub control_period_s: f64,
    /// Radius around home within which the robot has arrived (the paper's Rc), m.
    pub arrival_radius_m: f64,
}

/// The robot's camera, and what it saw at home.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraSheet {
    /// Size and projection of all panoramas.
    pub projection: Projection,
    /// Colours of the home panorama as in [`Picture::rgba`].
    pub home_rgba: Vec<u8>,
}

impl CameraSheet {
    /// The home panorama.
    #[must_use]
    pub fn home_picture(&self) -> Picture<'_> {
        Picture { projection: self.projection, rgba: &self.home_rgba }
    }
}

/// All that a method is told before the run.
#[derive(Debug, Clone)]
pub struct Briefing {
    /// The stored snapshot.
    pub home: HomeSnapshot,
    /// The robot.
    pub robot: RobotSheet,
    /// The task.
    pub task: TaskSheet,
    /// Whether observations come with the reading of a compass.
    pub compass: bool,
    /// The camera; `None` for a robot that gets bearings without panoramas.
    pub camera: Option<CameraSheet>,
}

/// Where the robot believes that it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Pose of the robot in the home frame: R and theta of the paper are the polar form of its position, alpha its heading.
    pub pose: Pose,
    /// Covariance of (x, y, heading), m^2, m rad, rad^2.
    pub covariance: Matrix3<f64>,
}

impl Estimate {
    /// Range to home, m (the paper's R).
    #[must_use]
    pub fn range_m(&self) -> f64 {
        self.pose.position().norm()
    }

    /// Bearing of the robot from home in the home frame, rad (the paper's theta).
    #[must_use]
    pub fn bearing_rad(&self) -> f64 {
        crate::geometry::angle_of(self.pose.position())
    }

    /// Direction in which home lies from the robot's heading, rad.
    #[must_use]
    pub fn home_direction_rad(&self) -> f64 {
        wrap(crate::geometry::angle_of(-self.pose.position()) - self.pose.heading)
    }

    /// Standard deviation of the range to home, m, to first order.
    #[must_use]
    pub fn range_sd_m(&self) -> f64 {
        let (s, c) = crate::geometry::sin_cos(self.bearing_rad());
        self.variance_along(c, s).max(0.0).sqrt()
    }

    /// Standard deviation of the robot's bearing from home, rad, to first order; it grows without bound towards home.
    #[must_use]
    pub fn bearing_sd_rad(&self) -> f64 {
        let (s, c) = crate::geometry::sin_cos(self.bearing_rad());
        self.variance_along(-s, c).max(0.0).sqrt() / self.range_m()
    }

    /// Standard deviation of the heading, rad.
    #[must_use]
    pub fn heading_sd_rad(&self) -> f64 {
        self.covariance[(2, 2)].max(0.0).sqrt()
    }

    /// Variance of the position along the unit vector (x, y), m^2.
    fn variance_along(&self, x: f64, y: f64) -> f64 {
        let c = &self.covariance;
        x * x * c[(0, 0)] + 2.0 * x * y * c[(0, 1)] + y * y * c[(1, 1)]
    }

    /// Larger standard deviation of the position, along the long axis of its ellipse, m.
    #[must_use]
    pub fn position_sd_m(&self) -> f64 {
        let c = &self.covariance;
        let mean = 0.5 * (c[(0, 0)] + c[(1, 1)]);
        let half_difference = 0.5 * (c[(0, 0)] - c[(1, 1)]);
        let largest = mean + libm::hypot(half_difference, c[(0, 1)]);
        largest.max(0.0).sqrt()
    }
}

/// What a method thinks of its own run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// On the way.
    Running,
    /// Claims to be home and has stopped.
    Arrived,
    /// What it sees no longer fits what it believes, and it cannot recover.
    Lost,
    /// It is broken: [`Method::failure`] says how.
    Failed,
}

/// One control step's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Commanded twist until the next observation.
    pub command: Twist,
    /// Belief about the pose, for methods that have one, once they have one.
    pub estimate: Option<Estimate>,
    /// State of the run in the method's own view.
    pub status: Status,
    /// Bearings used in this step.
    pub matched: usize,
    /// Bearings seen in this step and refused as wrong.
    pub rejected: usize,
    /// Normalised innovation squared per used bearing, 1 on average for a consistent filter; NaN where there is none.
    pub nis: f64,
}

impl Decision {
    /// A command of a method on its way that tells nothing of what it believes.
    ///
    /// ```
    /// use wayhome::geometry::Twist;
    /// use wayhome::observation::{Decision, Status};
    ///
    /// let ahead = Twist { v: 0.2, omega: 0.0 };
    /// let stop = Decision { status: Status::Arrived, ..Decision::command(Twist::default()) };
    /// assert_eq!((Decision::command(ahead).status, stop.status), (Status::Running, Status::Arrived));
    /// ```
    #[must_use]
    pub fn command(command: Twist) -> Self {
        Self { command, estimate: None, status: Status::Running, matched: 0, rejected: 0, nis: f64::NAN }
    }
}

/// A homing method: observations in, wheel commands out.
pub trait Method: Send {
    /// Takes one observation and returns the command to hold until the next.
    fn step(&mut self, observation: &Observation<'_>) -> Decision;

    /// Why it is broken, after a step with [`Status::Failed`].
    fn failure(&self) -> Option<&str> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bumper_feels_the_front_half_in_five_sectors() {
        let at = |degrees: f64| BumperSector::at(degrees.to_radians());
        let seen = [89.0, 55.0, 53.0, 19.0, 17.0, -17.0, -19.0, -53.0, -55.0, -89.0].map(|degrees| at(degrees).unwrap() as u8);
        assert_eq!(seen, [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]);
        assert!([91.0, -91.0, 180.0, -180.0].iter().all(|degrees| at(*degrees).is_none()));
        assert!(BumperSector::VARIANTS.iter().all(|sector| BumperSector::at(sector.direction_rad()) == Some(*sector)));
        let mut bumper = Bumper::default();
        [0.1, 3.0, 1.5].into_iter().for_each(|direction| bumper.press(direction));
        assert!(bumper.sectors().eq([BumperSector::Left, BumperSector::FrontCentre]));
    }
}
