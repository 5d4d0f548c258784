//! The paper's filter as a method.

use crate::control::Controller;
use crate::estimation::paper::{PaperEkf, PaperSettings};
use crate::geometry::{Pose, Twist, direction};
use crate::observation::{Bearing, Briefing, Decision, LandmarkId, Method, Observation, Status};

/// The paper's filter with a controller, on the three landmarks that surround the robot best.
pub(super) struct PaperHoming {
    controller: Controller,
    briefing: Briefing,
    initial: Pose,
    running: Option<([LandmarkId; 3], PaperEkf)>,
    arrived: bool,
}

impl PaperHoming {
    /// Without a supposed pose the filter starts at R = 50 cm, theta = 0.1, alpha = 0: as good a guess as any.
    pub(super) fn new(controller: Controller, briefing: Briefing, initial: Option<Pose>) -> Self {
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
