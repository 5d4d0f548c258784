//! The homing methods: an estimator or a direct law, joined to a controller, behind the [`Method`] trait.
//!
//! Everything here sees a [`Briefing`] and [`Observation`]s only. The one number a person may add is `initial`, the pose that
//! the paper's filter is started from, because that filter cannot start from nothing.

use serde::Serialize;

use crate::control::{Controller, Law};
use crate::error::{Error, Result};
use crate::estimation::anchored::{AnchoredFilter, FilterSettings};
use crate::estimation::paper::{PaperEkf, PaperSettings};
use crate::geometry::{Pose, Twist, Vector2, atan2, direction, wrap};
use crate::observation::{Bearing, Briefing, Decision, Estimate, LandmarkId, Method, Observation, Status};

/// Homing methods by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum MethodKind {
    /// The anchored filter: nothing known at the start.
    AnchoredEkf,
    /// The paper's six-state EKF on three landmarks, started at a supposed pose.
    PaperEkf,
    /// Average landmark vector, compass-free: the two bearing sets are aligned by their circular mean difference.
    Alv,
}

/// Control laws by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LawKind {
    /// omega proportional to the heading error.
    Proportional,
    /// omega = beta (v / Rc) sgn(theta').
    Lyapunov,
}

/// Builds a method. `initial` is the pose in the home frame that `paper-ekf` is started from; others must not get one.
///
/// # Errors
/// When the method needs more of the home snapshot than there is, or `initial` is given to a method that takes none.
pub fn build(kind: MethodKind, law: LawKind, briefing: Briefing, initial: Option<Pose>) -> Result<Box<dyn Method>> {
    let law = match law {
        LawKind::Proportional => Law::Proportional,
        LawKind::Lyapunov => Law::Lyapunov,
    };
    let controller = Controller::new(law, briefing.robot, briefing.task);
    if initial.is_some() && kind != MethodKind::PaperEkf {
        return Err(Error::Invalid {
            what: "initial estimate".into(),
            found: "one".into(),
            allowed: "none: only paper-ekf is started from a supposed pose".into(),
        });
    }
    let least = if kind == MethodKind::Alv { 2 } else { 3 };
    if briefing.home.bearings.len() < least {
        return Err(Error::Invalid {
            what: "landmarks in the home snapshot".into(),
            found: briefing.home.bearings.len().to_string(),
            allowed: format!("at least {least}"),
        });
    }
    Ok(match kind {
        MethodKind::AnchoredEkf => Box::new(AnchoredHoming::new(FilterSettings::default(), controller, &briefing)),
        MethodKind::PaperEkf => Box::new(PaperHoming::new(controller, briefing, initial)),
        MethodKind::Alv => Box::new(AlvHoming { controller, briefing }),
    })
}

/// Home counts as reached within this share of the arrival radius, by the estimate.
const STOP_SHARE: f64 = 0.25;
/// ... if the position's standard deviation is within this share of the arrival radius.
const STOP_SD_SHARE: f64 = 0.4;
/// Creeping speed while the estimate is home but not yet sure, m/s.
const CREEP_M_S: f64 = 0.06;
/// A filter that is home for this long without becoming sure starts again, s.
const UNSURE_S: f64 = 6.0;

/// The anchored filter with a controller.
struct AnchoredHoming {
    filter: AnchoredFilter,
    controller: Controller,
    arrival_radius_m: f64,
    max_acceleration_m_s2: f64,
    /// Speed last commanded.
    speed_m_s: f64,
    unsure_since_s: Option<f64>,
    arrived: bool,
}

impl AnchoredHoming {
    fn new(settings: FilterSettings, controller: Controller, briefing: &Briefing) -> Self {
        Self {
            filter: AnchoredFilter::new(settings, &briefing.home),
            controller,
            arrival_radius_m: briefing.task.arrival_radius_m,
            max_acceleration_m_s2: briefing.robot.max_acceleration_m_s2,
            speed_m_s: 0.0,
            unsure_since_s: None,
            arrived: false,
        }
    }

    /// Command for a belief that home is adopted.
    fn approach(&mut self, estimate: &Estimate, time_s: f64) -> (Twist, bool) {
        let range = estimate.range_m();
        // Braking from the speed last commanded takes this far; it may begin before home is reached.
        let rolling = self.speed_m_s * self.speed_m_s / (2.0 * self.max_acceleration_m_s2);
        let near = range <= (STOP_SHARE * self.arrival_radius_m).max(rolling.min(0.5 * self.arrival_radius_m));
        let passing = range <= 0.8 * self.arrival_radius_m && estimate.home_direction_rad().abs() > 1.4;
        if !(near || passing) {
            return (self.controller.drive(&estimate.pose), false);
        }
        if estimate.position_sd_m() <= STOP_SD_SHARE * self.arrival_radius_m {
            return (Twist::default(), true);
        }
        // At home by the mean but not sure of it: a slow circle brings parallax.
        let since = *self.unsure_since_s.get_or_insert(time_s);
        if time_s - since > UNSURE_S {
            self.filter.restart();
            self.unsure_since_s = None;
        }
        (Twist { v: CREEP_M_S, omega: 0.8 }, false)
    }
}

impl Method for AnchoredHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let report = self.filter.step(&observation.odometry, observation.bearings);
        let estimate = self.filter.estimate();
        let command = match (&estimate, self.filter.best_pose()) {
            _ if self.arrived => Twist::default(),
            (Some(estimate), _) => {
                let (command, arrived) = self.approach(estimate, observation.time_s);
                self.arrived = arrived;
                command
            }
            (None, Some(guess)) => self.search(&guess, observation.time_s),
            (None, None) => Twist { v: 0.0, omega: 0.6 },
        };
        self.speed_m_s = command.v;
        let status = if self.arrived { Status::Arrived } else { Status::Running };
        let nis = if report.matched > 0 { report.nis / report.matched as f64 } else { f64::NAN };
        Decision { command, estimate, status, matched: report.matched, rejected: report.rejected, nis }
    }
}

impl AnchoredHoming {
    /// Command while home is only guessed: towards the guess, weaving a little for parallax, never stopping at it.
    fn search(&self, guess: &Pose, time_s: f64) -> Twist {
        let towards = wrap(crate::geometry::angle_of(-guess.position()) - guess.heading);
        let weave = 0.25 * libm::sin(2.0 * std::f64::consts::PI * time_s / 3.0);
        self.controller.follow(towards + weave)
    }
}

/// The paper's filter with a controller, on the three landmarks that surround the robot best.
struct PaperHoming {
    controller: Controller,
    briefing: Briefing,
    initial: Pose,
    running: Option<([LandmarkId; 3], PaperEkf)>,
    arrived: bool,
}

impl PaperHoming {
    /// Without a supposed pose the filter starts at R = 50 cm, theta = 0.1, alpha = 0: as good a guess as any.
    fn new(controller: Controller, briefing: Briefing, initial: Option<Pose>) -> Self {
        let unknown = direction(0.1) * 0.5;
        let initial = initial.unwrap_or(Pose::new(unknown.x, unknown.y, 0.0));
        Self { controller, briefing, initial, running: None, arrived: false }
    }

    /// The visible landmarks whose home bearings leave the smallest largest gap.
    fn choose(&self, seen: &[Bearing]) -> Option<[(LandmarkId, f64, f64); 3]> {
        let known: Vec<_> = seen
            .iter()
            .filter_map(|now| {
                let home = self.briefing.home.bearings.iter().find(|h| h.id == now.id)?;
                Some((now.id, home.azimuth_rad, now.azimuth_rad))
            })
            .take(60)
            .collect();
        let mut best = None;
        let mut smallest_gap = f64::INFINITY;
        for a in 0..known.len() {
            for b in (a + 1)..known.len() {
                for c in (b + 1)..known.len() {
                    let mut angles = [known[a].1, known[b].1, known[c].1];
                    angles.sort_by(f64::total_cmp);
                    let gaps = [angles[1] - angles[0], angles[2] - angles[1]];
                    let around = std::f64::consts::TAU - gaps[0] - gaps[1];
                    let gap = gaps[0].max(gaps[1]).max(around);
                    if gap < smallest_gap {
                        smallest_gap = gap;
                        best = Some([known[a], known[b], known[c]]);
                    }
                }
            }
        }
        best
    }
}

impl Method for PaperHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let mut decision = Decision {
            command: Twist::default(),
            estimate: None,
            status: Status::Running,
            matched: 0,
            rejected: 0,
            nis: f64::NAN,
        };
        if self.running.is_none() {
            let Some(chosen) = self.choose(observation.bearings) else { return decision };
            let ekf = PaperEkf::new(PaperSettings::default(), chosen.map(|c| c.1), chosen.map(|c| c.2), self.initial);
            self.running = Some((chosen.map(|c| c.0), ekf));
        }
        let Some((ids, ekf)) = &mut self.running else { return decision };
        if observation.odometry.dt_s > 0.0 {
            ekf.predict(observation.odometry.twist, observation.odometry.dt_s);
        }
        let seen = ids.map(|id| observation.bearings.iter().find(|b| b.id == id).map(|b| b.azimuth_rad));
        let (nis, matched) = ekf.update(seen);
        let estimate = ekf.estimate();
        self.arrived |= estimate.range_m() <= self.briefing.task.arrival_radius_m;
        decision.matched = matched;
        decision.nis = if matched > 0 { nis / matched as f64 } else { f64::NAN };
        if self.arrived {
            decision.status = Status::Arrived;
        } else {
            decision.command = self.controller.drive(&estimate.pose);
        }
        decision.estimate = Some(estimate);
        decision
    }
}

/// Average landmark vector without a compass.
struct AlvHoming {
    controller: Controller,
    briefing: Briefing,
}

/// An average landmark vector shorter than this is taken for home: unit vectors differ by so little only within about a
/// hundredth of the landmarks' distance.
const ALV_HOME: f64 = 0.012;

impl Method for AlvHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let pairs: Vec<(f64, f64)> = observation
            .bearings
            .iter()
            .filter_map(|now| {
                let home = self.briefing.home.bearings.iter().find(|h| h.id == now.id)?;
                Some((home.azimuth_rad, now.azimuth_rad))
            })
            .collect();
        let matched = pairs.len();
        let idle = Decision {
            command: Twist { v: 0.0, omega: 0.6 },
            estimate: None,
            status: Status::Running,
            matched,
            rejected: 0,
            nis: f64::NAN,
        };
        if matched < 2 {
            return idle;
        }
        // alpha = mean of (home bearing - current bearing), on the circle.
        let sum: Vector2<f64> = pairs.iter().map(|&(home, now)| direction(home - now)).sum();
        let alpha = atan2(sum.y, sum.x);
        let vector: Vector2<f64> =
            pairs.iter().map(|&(home, now)| direction(now + alpha) - direction(home)).sum::<Vector2<f64>>() / matched as f64;
        if vector.norm() < ALV_HOME {
            return Decision { command: Twist::default(), status: Status::Arrived, ..idle };
        }
        let mut command = self.controller.follow(atan2(vector.y, vector.x) - alpha);
        // The vector's length grows with the distance in units of the landmarks' own: slow down as it vanishes.
        command.v *= (vector.norm() / 0.08).min(1.0);
        Decision { command, ..idle }
    }
}
