//! The anchored filter with a controller: the project's own method.

use crate::control::Controller;
use crate::control::escape::Escape;
use crate::estimation::anchored::FilterSettings;
use crate::estimation::homes::{Homes, Verdict};
use crate::geometry::{Pose, Twist, wrap};
use crate::observation::{Briefing, Decision, Estimate, Method, Observation, RobotSheet, Status};

/// Home counts as reached within this share of the arrival radius, by the estimate.
const STOP_SHARE: f64 = 0.25;
/// ... or so near that braking at once ends there, within this share of the arrival radius ...
const ROLL_SHARE: f64 = 0.8;
/// ... if the position's standard deviation is within this share of the arrival radius.
const STOP_SD_SHARE: f64 = 0.4;
/// ... and the bearings of this many steps in a row bear it out.
const STEADY_STEPS: u32 = 3;
/// Where the robot went by this much more elsewhere in one step than wheels usually make it, the floor is slippery, m ...
const SLIP_M: f64 = 0.003;
/// ... and braking is begun as if the drive could do this share of it, ...
const SLIPPERY_SHARE: f64 = 0.25;
/// ... and home counts as reached only by a robot that moved less than this a step, m, ...
const AT_REST_M: f64 = 0.0015;
/// ... for so many steps in a row: wheels that stand still say nothing of a robot that slides on.
const REST_STEPS: u32 = 5;
/// Creeping speed while the estimate is home but not yet sure, m/s.
const CREEP_M_S: f64 = 0.06;
/// Time for which the robot stays at a home that the view denies, s, ...
const DWELL_S: f64 = 1.5;
/// ... and looks for others before it comes back.
const ELSEWHERE_S: f64 = 7.0;
/// Time for which a robot that sees nothing of home turns on the spot, s.
const LOOK_AROUND_S: f64 = 3.0;
/// Manoeuvres round obstacles on the way to one place after which another one is tried.
const UNREACHABLE: u32 = 8;
/// Speed of a robot that looks for other places, m/s.
const WANDER_M_S: f64 = 0.2;
/// A filter that is home for this long without becoming sure starts again, s.
const UNSURE_S: f64 = 6.0;

/// The anchored filter with a controller.
pub(super) struct AnchoredHoming {
    homes: Homes,
    controller: Controller,
    arrival_radius_m: f64,
    max_acceleration_m_s2: f64,
    /// Speed last commanded.
    speed_m_s: f64,
    unsure_since_s: Option<f64>,
    /// Since when nothing is seen of home, s.
    blind_since_s: Option<f64>,
    /// Where the robot was believed to be at the step before.
    stood: Option<Pose>,
    /// Steps in a row in which it hardly moved.
    rest_steps: u32,
    /// Whether the floor has proved slippery.
    slippery: bool,
    escape: Escape,
    /// Manoeuvres of it when the leading answer was last changed.
    manoeuvres: u32,
    status: Status,
    /// Until when the robot looks for homes elsewhere, s.
    elsewhere_until_s: Option<f64>,
}

impl AnchoredHoming {
    pub fn new(settings: FilterSettings, controller: Controller, briefing: &Briefing) -> Self {
        let RobotSheet { track_m, camera_offset_m, .. } = briefing.robot;
        Self {
            homes: Homes::new(FilterSettings { track_m, camera_offset_m, ..settings }, &briefing.home),
            controller,
            arrival_radius_m: briefing.task.arrival_radius_m,
            max_acceleration_m_s2: briefing.robot.max_acceleration_m_s2,
            speed_m_s: 0.0,
            unsure_since_s: None,
            blind_since_s: None,
            stood: None,
            rest_steps: 0,
            slippery: false,
            escape: Escape::new(briefing.robot, briefing.task),
            manoeuvres: 0,
            status: Status::Running,
            elsewhere_until_s: None,
        }
    }

    /// Command for a belief that home is adopted.
    fn approach(&mut self, estimate: &Estimate, time_s: f64) -> (Twist, bool) {
        let range = estimate.range_m();
        // Braking from the speed last commanded takes this far; it may begin before home is reached.
        let rolling = self.speed_m_s * self.speed_m_s / (2.0 * self.max_acceleration_m_s2);
        let moved = self
            .stood
            .replace(estimate.pose)
            .map_or(f64::INFINITY, |before| (estimate.pose.position() - before.position()).norm());
        self.rest_steps = if moved <= AT_REST_M { self.rest_steps + 1 } else { 0 };
        if !self.slippery && self.homes.leader().greatest_slip_m() > SLIP_M {
            self.slippery = true;
            self.controller = self.controller.braking_at(SLIPPERY_SHARE);
        }
        let near = range <= (STOP_SHARE * self.arrival_radius_m).max(rolling.min(ROLL_SHARE * self.arrival_radius_m));
        let passing = range <= 0.8 * self.arrival_radius_m && estimate.home_direction_rad().abs() > 1.4;
        if !(near || passing) {
            return (self.controller.drive(&estimate.pose), false);
        }
        if estimate.position_sd_m() <= STOP_SD_SHARE * self.arrival_radius_m
            && self.homes.leader().steady_steps() >= STEADY_STEPS
        {
            return (Twist::default(), !self.slippery || self.rest_steps >= REST_STEPS);
        }
        // At home by the mean but not sure of it: a slow circle brings parallax.
        let since = *self.unsure_since_s.get_or_insert(time_s);
        if time_s - since > UNSURE_S {
            self.homes.leader_mut().restart();
            self.unsure_since_s = None;
        }
        (Twist { v: CREEP_M_S, omega: 0.8 }, false)
    }
}

impl Method for AnchoredHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let report = self.homes.step(&observation.odometry, observation.bearings, observation.alternatives);
        let leader = self.homes.leader();
        let (estimate, guess) = (leader.estimate(), leader.best_pose());
        if guess.is_some() {
            self.blind_since_s = None;
        }
        let command = match (&estimate, guess) {
            _ if self.status != Status::Running => Twist::default(),
            (Some(estimate), _) => {
                let (command, arrived) = self.approach(estimate, observation.time_s);
                if arrived && !self.escape.is_active() {
                    self.status = match self.homes.judge() {
                        Verdict::Home => Status::Arrived,
                        Verdict::Ambiguous => Status::Lost,
                        Verdict::Doubtful => Status::Running,
                    };
                    self.manoeuvres = self.escape.manoeuvres();
                }
                if self.homes.are_exhausted() && self.status == Status::Running {
                    self.look_elsewhere(arrived, observation.time_s).unwrap_or(command)
                } else {
                    command
                }
            }
            (None, Some(guess)) => self.search(&guess, observation.time_s),
            (None, None) => self.look_around(observation.time_s),
        };
        let command = if self.status == Status::Running {
            self.escape.guard(observation.time_s, &self.homes.leader().map_pose(), observation.bumper, command)
        } else {
            command
        };
        if self.escape.manoeuvres() >= self.manoeuvres + UNREACHABLE {
            // Where another place may be home, this one is not worth the trouble yet.
            self.manoeuvres = self.escape.manoeuvres();
            self.homes.pass_over();
        }
        self.speed_m_s = command.v;
        let nis = if report.matched > 0 { report.nis / report.matched as f64 } else { f64::NAN };
        Decision { command, estimate, status: self.status, matched: report.matched, rejected: report.rejected, nis }
    }
}

impl AnchoredHoming {
    /// Command while home is only guessed: towards the guess, weaving a little for parallax, never stopping at it.
    fn search(&self, guess: &Pose, time_s: f64) -> Twist {
        let towards = wrap(crate::geometry::angle_of(-guess.position()) - guess.heading);
        let weave = 0.25 * libm::sin(2.0 * std::f64::consts::PI * time_s / 3.0);
        self.controller.follow(towards + weave)
    }

    /// Command where the view denies every home that it leads to: people who hide part of it may walk on, so the robot stays a moment,
    /// looks for others elsewhere, and comes back for another look; `None` on that way back.
    fn look_elsewhere(&mut self, arrived: bool, time_s: f64) -> Option<Twist> {
        if arrived && self.elsewhere_until_s.is_none_or(|until_s| time_s >= until_s) {
            self.elsewhere_until_s = Some(time_s + DWELL_S + ELSEWHERE_S);
        }
        let left_s = self.elsewhere_until_s? - time_s;
        if left_s <= 0.0 {
            return None;
        }
        Some(if left_s > ELSEWHERE_S { Twist::default() } else { self.wander(time_s) })
    }

    /// Command where nothing is seen of home: a turn on the spot, then on to another place.
    fn look_around(&mut self, time_s: f64) -> Twist {
        let since = *self.blind_since_s.get_or_insert(time_s);
        if time_s - since < LOOK_AROUND_S { Twist { v: 0.0, omega: 0.6 } } else { self.wander(time_s) }
    }

    /// Command where no known place is home: on, in wide bends, to see the room from elsewhere.
    fn wander(&self, time_s: f64) -> Twist {
        Twist { v: WANDER_M_S, omega: 0.3 * libm::sin(2.0 * std::f64::consts::PI * time_s / 17.0) }
    }
}
