//! The paper's filter as a method.

use super::MethodOptions;
use crate::control::{BETA, Controller, Pace};
use crate::estimation::paper::{PaperEkf, PaperSettings};
use crate::geometry::{Pose, Twist, direction};
use crate::observation::{Bearing, Briefing, Decision, LandmarkId, Method, Observation, Status};

/// Where a filter starts that is told nothing: R = 50 cm, theta = 0.1, alpha = 0, as good a guess as any.
pub fn untold() -> Pose {
    let place = direction(0.1) * 0.5;
    Pose::new(place.x, place.y, 0.0)
}

/// The paper's filter steered by the paper's laws, on the three landmarks that surround the robot best.
///
/// It holds itself to be home, and stops, where its estimate comes within the arrival radius; or never, where the paper's own rule
/// holds, by which a run ends when the robot truly is there.
pub(super) struct PaperHoming {
    controller: Controller,
    settings: PaperSettings,
    briefing: Briefing,
    initial: Pose,
    stops: bool,
    running: Option<([LandmarkId; 3], PaperEkf)>,
    arrived: bool,
}

impl PaperHoming {
    pub(super) fn new(options: &MethodOptions, briefing: Briefing) -> Self {
        let beta = if let Pace::Constant { beta } = options.pace { beta } else { BETA };
        Self {
            controller: Controller::new(options.law, Pace::Constant { beta }, briefing.robot, briefing.task),
            settings: options.paper,
            briefing,
            initial: options.initial.unwrap_or_else(untold),
            stops: options.stops,
            running: None,
            arrived: false,
        }
    }

    /// The three landmarks with their bearings at home and now; `None` while fewer are seen. Of a snapshot of three there is no choice: one
    /// that is hidden at the start is supposed to be where a landmark far away would be.
    fn start(&self, seen: &[Bearing]) -> Option<[(LandmarkId, f64, f64); 3]> {
        if let [a, b, c] = self.briefing.home.bearings[..] {
            return Some([a, b, c].map(|home| {
                let now = seen.iter().find(|now| now.id == home.id);
                (home.id, home.azimuth_rad, now.map_or(home.azimuth_rad - self.initial.heading, |now| now.azimuth_rad))
            }));
        }
        self.choose(seen)
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
        if self.running.is_none() {
            let Some(chosen) = self.start(observation.bearings) else { return Decision::command(Twist::default()) };
            let ekf = PaperEkf::new(self.settings, chosen.map(|c| c.1), chosen.map(|c| c.2), self.initial);
            self.running = Some((chosen.map(|c| c.0), ekf));
        }
        let Some((ids, ekf)) = &mut self.running else { return Decision::command(Twist::default()) };
        let seen = ids.map(|id| observation.bearings.iter().find(|b| b.id == id).map(|b| b.azimuth_rad));
        // The filter's state begins with the first bearings; as a measurement they would count twice.
        let (mut nis, mut matched) = (f64::NAN, 0);
        if observation.odometry.dt_s > 0.0 {
            ekf.predict(observation.odometry.twist, observation.odometry.dt_s);
            (nis, matched) = ekf.update(seen);
        }
        let estimate = ekf.estimate();
        self.arrived |= self.stops && estimate.range_m() <= self.briefing.task.arrival_radius_m;
        let nis = if matched > 0 { nis / matched as f64 } else { f64::NAN };
        let decision = Decision { estimate: Some(estimate), matched, nis, ..Decision::command(Twist::default()) };
        if self.arrived {
            return Decision { status: Status::Arrived, ..decision };
        }
        Decision { command: self.controller.drive(&estimate.pose), ..decision }
    }
}
