//! The laws that steer by a homing vector, as a method.

use crate::control::vectors::{VectorLaw, align};
use crate::control::{Controller, Pace};
use crate::geometry::{Twist, angle_of};
use crate::observation::{Briefing, Decision, Method, Observation, Status};

/// A homing vector with a controller, which knows where home is and stops there only at a governed pace. With a compass its heading is used; without one the two bearing sets are aligned by their
/// circular mean difference.
pub(super) struct VectorHoming {
    law: VectorLaw,
    controller: Controller,
    briefing: Briefing,
}

/// An average landmark vector shorter than this is taken for home, whatever the law: unit vectors differ by so little only within
/// about half a hundredth of the landmarks' distance, and noise of 0.3 degrees on ten bearings hides no more.
const AT_HOME: f64 = 0.005;
/// Below this length the robot slows down: the vector grows with the distance in units of the landmarks' own.
const NEAR_HOME: f64 = 0.08;

impl VectorHoming {
    pub(super) fn new(law: VectorLaw, controller: Controller, briefing: Briefing) -> Self {
        Self { law, controller, briefing }
    }
}

impl Method for VectorHoming {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let pairs: Vec<(f64, f64)> = observation
            .bearings
            .iter()
            .filter_map(|now| {
                let home = self.briefing.home.bearings.iter().find(|h| h.id == now.id)?;
                Some((home.azimuth_rad, now.azimuth_rad))
            })
            .collect();
        let idle = Decision { matched: pairs.len(), ..Decision::command(Twist { v: 0.0, omega: 0.6 }) };
        let governed = self.controller.pace() == Pace::Governed;
        if governed && pairs.len() < 2 {
            return idle;
        }
        let heading = observation.compass_rad.unwrap_or_else(|| align(&pairs));
        let pairs: Vec<(f64, f64)> = pairs.into_iter().map(|(home, now)| (home, now + heading)).collect();
        let towards = angle_of(self.law.vector(&pairs)) - heading;
        if !governed {
            return Decision { command: self.controller.follow(towards), ..idle };
        }
        let difference = VectorLaw::Alv.vector(&pairs).norm();
        if difference < AT_HOME {
            return Decision { command: Twist::default(), status: Status::Arrived, ..idle };
        }
        let mut command = self.controller.follow(towards);
        command.v *= (difference / NEAR_HOME).min(1.0);
        Decision { command, ..idle }
    }
}
