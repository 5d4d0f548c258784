//! Repeating: a robot that knows a route follows it.

use std::fmt;
use std::str::FromStr;

use crate::control::escape::Escape;
use crate::error::{Error, Result};
use crate::geometry::{Pose, Twist};
use crate::method::MethodKind;
use crate::observation::{Observation, RobotSheet, Status, TaskSheet};
use crate::panorama::{Panorama, Picture};
use crate::vision::ExtractorSettings;
use crate::vision::view::ViewFinder;

use super::chart::{Line, Route};
use super::learn::FEATURES;
use super::legs::{Doubts, Leg, Seen, is_over};
use super::locate::{Locator, Looked};
use super::steer::{progress, steer};

/// Which way a route is driven.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Way {
    /// As it was taught.
    #[default]
    Forwards,
    /// From its end to its start, facing there.
    Backwards,
}

/// What drives the legs.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Engine {
    /// A map around each snapshot of its features' bearings and ranges, in which the robot finds its pose.
    #[default]
    LocalMap,
    /// Odometry alone, as if it were true: the floor that everything has to beat.
    Odometry,
    /// A homing method, to which each snapshot is home for a while.
    Method(MethodKind),
}

impl fmt::Display for Engine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::LocalMap => f.write_str("local-map"),
            Self::Odometry => f.write_str("odometry"),
            Self::Method(kind) => kind.fmt(f),
        }
    }
}

impl FromStr for Engine {
    type Err = Error;

    /// `local-map`, `odometry` or the name of a homing method.
    fn from_str(text: &str) -> Result<Self> {
        Ok(match text {
            "local-map" => Self::LocalMap,
            "odometry" => Self::Odometry,
            other => Self::Method(other.parse()?),
        })
    }
}

/// Where the robot starts, as far as it is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Begin {
    /// About where the route begins, about as the robot stood there.
    #[default]
    AtStart,
    /// Anywhere along it.
    Anywhere,
}

/// How long a robot that is lost looks for its way, s.
const LOST_S: f64 = 25.0;
/// Time between two looks at all snapshots, s.
const SEARCH_S: f64 = 0.8;
/// How near to the end of the route it stops, m.
const END_M: f64 = 0.012;
/// How well its place has to be known there, m.
const END_SD_M: f64 = 0.03;
/// How long it waits there for its place to become known, s.
const END_WAIT_S: f64 = 8.0;
/// A homing method is sent to a snapshot that lies so far ahead, m, ...
const AIM_M: f64 = 0.45;
/// ... and on to the next when odometry says that this one was passed by so much, m.
const MISSED_M: f64 = 0.5;
/// How long it stands before something in its way at the end or tries to get round elsewhere, s.
const BLOCKED_S: f64 = 60.0;

/// What a step of a repeat comes to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Command until the next observation.
    pub command: Twist,
    /// Whether the robot is on its way, at the end, or has given up.
    pub status: Status,
    /// What the last picture said; `None` in a step without one.
    pub looked: Option<Looked>,
}

/// A robot that repeats a route.
pub struct Follower<'r> {
    route: &'r Route,
    engine: Engine,
    way: Way,
    locator: Locator<'r>,
    finder: ViewFinder,
    picture: Panorama,
    line: Line,
    /// Distance along the line of each snapshot, in the order of the route.
    at_m: Vec<f64>,
    along_m: f64,
    laps_left: u32,
    /// Pose of the last snapshot in the frame of the first, of a loop.
    closing: Option<Pose>,
    escape: Escape,
    robot: RobotSheet,
    task: TaskSheet,
    lost_since_s: Option<f64>,
    searched_s: f64,
    waits_since_s: Option<f64>,
    progressed: (f64, f64),
    status: Status,
    /// Of a homing method: the leg under way and its snapshot, what the last picture told, and what pictures have not told.
    leg: Option<(usize, Leg)>,
    seen: Option<Seen>,
    doubts: Doubts,
}

impl<'r> Follower<'r> {
    /// One that drives a route `laps` times round where it is a loop.
    #[must_use]
    pub fn new(route: &'r Route, engine: Engine, way: Way, begin: Begin, laps: u32, sheets: (RobotSheet, TaskSheet)) -> Self {
        let forwards = Line::new(route.path.iter().map(Pose::position));
        let at_m: Vec<f64> = route.snapshots.iter().map(|snapshot| forwards.along_m(snapshot.node)).collect();
        let length_m = forwards.length_m();
        let (line, at_m, first) = match way {
            Way::Forwards => (forwards, at_m, 0),
            Way::Backwards => (forwards.reversed(), at_m.iter().map(|m| length_m - m).collect(), route.snapshots.len() - 1),
        };
        // Who drives backwards has turned round.
        let facing = if way == Way::Backwards { std::f64::consts::PI } else { 0.0 };
        let mut locator = Locator::new(route, first, Pose::new(0.0, 0.0, facing), (0.1, 0.15));
        let mut finder = ViewFinder::new(ExtractorSettings::default(), FEATURES);
        if begin == Begin::Anywhere {
            locator.forget();
        }
        let closing = (laps > 1).then(|| locator.closing(&mut finder)).flatten();
        Self {
            route,
            engine,
            way,
            locator,
            finder,
            picture: Panorama::empty(),
            line,
            at_m,
            along_m: 0.0,
            laps_left: if closing.is_some() { laps.saturating_sub(1) } else { 0 },
            closing,
            escape: Escape::new(sheets.0, sheets.1),
            robot: sheets.0,
            task: sheets.1,
            lost_since_s: None,
            searched_s: f64::NEG_INFINITY,
            waits_since_s: None,
            progressed: (0.0, 0.0),
            status: Status::Running,
            leg: None,
            seen: None,
            doubts: Doubts::default(),
        }
    }

    /// What it believes about its place.
    #[must_use]
    pub fn locator(&self) -> &Locator<'r> {
        &self.locator
    }

    /// The same, to be changed.
    pub fn locator_mut(&mut self) -> &mut Locator<'r> {
        &mut self.locator
    }

    /// How far along the route it believes to be, m, from the end that it comes from.
    #[must_use]
    pub fn along_m(&self) -> f64 {
        self.along_m
    }

    /// Takes one observation and says how to drive until the next.
    pub fn step(&mut self, observation: &Observation<'_>) -> Step {
        self.locator.advance(&observation.odometry);
        if let Engine::Method(kind) = &self.engine {
            let kind = kind.clone();
            return self.guided(&kind, observation);
        }
        let looked = match observation.panorama {
            Some(picture) if self.engine == Engine::LocalMap => {
                self.take(picture);
                Some(self.look(observation.time_s))
            }
            _ => None,
        };
        let command = self.drive(observation);
        Step { command, status: self.status, looked }
    }

    /// Finds the features of a picture.
    fn take(&mut self, picture: Picture<'_>) {
        self.picture.projection = picture.projection;
        self.picture.rgba.clear();
        self.picture.rgba.extend_from_slice(picture.rgba);
        self.finder.look(&self.picture);
    }

    /// The snapshot to steer for from here: the first that lies far enough ahead.
    fn target(&self) -> usize {
        let ahead = |k: &usize| self.at_m[*k] >= self.along_m + AIM_M;
        let all = 0..self.at_m.len();
        match self.way {
            Way::Forwards => all.clone().find(ahead).unwrap_or(all.end - 1),
            Way::Backwards => all.rev().find(ahead).unwrap_or(0),
        }
    }

    /// One step with a homing method.
    fn guided(&mut self, kind: &MethodKind, observation: &Observation<'_>) -> Step {
        if self.leg.is_none() {
            let target = self.target();
            let travel_rad = self.line.direction_rad(self.at_m[target]) - self.route.pose(target).heading;
            match Leg::new(kind, self.locator.features(target), travel_rad, (self.robot, self.task)) {
                Ok(leg) => self.leg = Some((target, leg)),
                Err(_) => self.status = Status::Failed,
            }
        }
        let Some((target, mut leg)) = self.leg.take() else {
            return Step { command: Twist::default(), status: self.status, looked: None };
        };
        let is_new = observation.panorama.is_some();
        if let Some(picture) = observation.panorama {
            self.take(picture);
            self.seen = leg.look(&self.finder, &self.route.pose(target).to_local(&self.locator.pose()));
            if self.doubts.count(self.seen.as_ref()) {
                self.status = Status::Lost;
            }
        }
        let decision = leg.decide(observation, is_new);
        let pose = self.locator.pose();
        self.along_m = progress(&self.line, self.along_m, &pose).along_m;
        if self.along_m > self.progressed.0 + 0.1 {
            self.progressed = (self.along_m, observation.time_s);
        } else if observation.time_s - self.progressed.1 > BLOCKED_S {
            self.status = Status::Lost;
        }
        let is_last = self.line.length_m() - self.at_m[target] < 1e-6;
        let over = is_over(&decision, self.seen.as_ref().filter(|_| is_new));
        let missed = self.along_m > self.at_m[target] + MISSED_M;
        if over || missed {
            if let Some(seen) = self.seen.filter(|_| over) {
                self.locator.stand_at(target, seen.heading_rad);
            }
            self.along_m = self.at_m[target].max(self.along_m);
            if is_last && self.status == Status::Running {
                self.status = if over { Status::Arrived } else { Status::Lost };
            }
        } else {
            self.leg = Some((target, leg));
        }
        let matched = self.seen.map_or(0, |seen| seen.matched);
        let looked = is_new.then_some(Looked { expected: self.locator.count(target), matched, rejected: 0 });
        let command = if self.status == Status::Running {
            self.escape.guard(observation.time_s, &pose, observation.bumper, decision.command)
        } else {
            Twist::default()
        };
        Step { command, status: self.status, looked }
    }

    fn look(&mut self, time_s: f64) -> Looked {
        if !self.locator.is_lost() {
            let looked = self.locator.look(&self.finder);
            if !self.locator.is_lost() {
                self.lost_since_s = None;
                return looked;
            }
        }
        let since = *self.lost_since_s.get_or_insert(time_s);
        if time_s - self.searched_s >= SEARCH_S {
            self.searched_s = time_s;
            if self.locator.search(&self.finder) {
                self.lost_since_s = None;
                let at_m = self.at_m[self.locator.snapshot()];
                self.along_m = self.line.nearest(self.locator.pose().position(), at_m - 1.5, at_m + 1.5).along_m;
                self.progressed = (self.along_m, time_s);
            }
        }
        if time_s - since > LOST_S {
            self.status = Status::Lost;
        }
        Looked::default()
    }

    fn drive(&mut self, observation: &Observation<'_>) -> Twist {
        let time_s = observation.time_s;
        if self.status != Status::Running || self.locator.is_lost() {
            return Twist::default();
        }
        let pose = self.locator.pose();
        let beside = progress(&self.line, self.along_m, &pose);
        self.along_m = beside.along_m;
        if self.along_m > self.progressed.0 + 0.1 {
            self.progressed = (self.along_m, time_s);
        }
        if time_s - self.progressed.1 > BLOCKED_S {
            self.status = Status::Lost;
            return Twist::default();
        }
        self.change_snapshot();
        if self.line.length_m() - self.along_m <= END_M {
            return self.arrive(time_s);
        }
        let command = steer(&self.line, &beside, &pose, &self.robot, &self.task);
        self.escape.guard(time_s, &pose, observation.bumper, command)
    }

    /// Hands the pose over to the snapshot that is nearest along the line.
    fn change_snapshot(&mut self) {
        if self.engine == Engine::Odometry {
            return;
        }
        let off = |k: usize| (self.at_m[k] - self.along_m).abs();
        let here = self.locator.snapshot();
        let first = here.saturating_sub(3);
        let near = first..(here + 4).min(self.at_m.len());
        if let Some(next) = near.min_by(|a, b| off(*a).total_cmp(&off(*b))) {
            self.locator.hand_over(next);
        }
    }

    /// At the end of the line: round again, or stop once that is certain.
    fn arrive(&mut self, time_s: f64) -> Twist {
        if let Some(closing) = self.closing.filter(|_| self.laps_left > 0) {
            self.laps_left -= 1;
            let (last, first) = (self.at_m.len() - 1, 0);
            match self.way {
                Way::Forwards => {
                    self.locator.hand_over(last);
                    self.locator.change_frame(first, closing);
                }
                Way::Backwards => {
                    self.locator.hand_over(first);
                    self.locator.change_frame(last, closing.to_local(&Pose::IDENTITY));
                }
            }
            self.along_m = self.line.nearest(self.locator.pose().position(), 0.0, 1.0).along_m;
            self.progressed = (self.along_m, time_s);
            let pose = self.locator.pose();
            let beside = progress(&self.line, self.along_m, &pose);
            return steer(&self.line, &beside, &pose, &self.robot, &self.task);
        }
        let since = *self.waits_since_s.get_or_insert(time_s);
        let is_certain =
            self.engine == Engine::Odometry || (self.locator.position_sd_m() <= END_SD_M && self.locator.doubts() == 0);
        if is_certain && time_s - since > 0.3 {
            self.status = Status::Arrived;
        } else if time_s - since > END_WAIT_S {
            self.status = Status::Lost;
        }
        Twist::default()
    }

    /// Distance along `line`, which has the nodes of the route in the order in which they are driven, of the place that the robot
    /// believes to be at.
    #[must_use]
    pub fn true_along(&self, line: &Line) -> f64 {
        self.line.share_along(self.along_m, line)
    }

    /// The route.
    #[must_use]
    pub fn route(&self) -> &'r Route {
        self.route
    }
}
