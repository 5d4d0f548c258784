//! What happens to the robot at given times: kicks, kidnaps, wheels that break.

use crate::geometry::{Pose, Vector2};
use crate::world::World;
use crate::world::robot::{WheelFault, WheelSide};
use crate::world::spec::DisturbanceKind;

/// Something that happens at once.
#[derive(Debug, Clone, Copy)]
pub(super) enum Event {
    /// A blow: impulse on the centre of gravity in the room's frame, N s, and impulse that turns, N m s.
    Kick(Vector2<f64>, f64),
    /// The robot is set down at rest at a pose.
    Kidnap(Pose),
    /// Wheel k breaks.
    Break(usize, WheelFault),
}

/// The events of a world in the order of their times.
#[derive(Debug, Clone)]
pub(super) struct Script {
    events: Vec<(f64, Event)>,
    next: usize,
}

impl Script {
    pub(super) fn new(world: &World) -> Self {
        let disturbances = world.spec.disturbances.iter().map(|d| {
            let event = match d.what {
                DisturbanceKind::Kick { impulse_n_s: [x, y], turn_n_m_s } => Event::Kick(Vector2::new(x, y), turn_n_m_s),
                DisturbanceKind::Kidnap(to) => Event::Kidnap(Pose::new(to.x_m, to.y_m, to.heading_deg.to_radians())),
            };
            (d.at_s, event)
        });
        let faults = world.spec.robot.faults.iter().map(|f| {
            let wheel = match f.wheel {
                WheelSide::Left => 0,
                WheelSide::Right => 1,
            };
            (f.from_s, Event::Break(wheel, f.what))
        });
        let mut events: Vec<_> = faults.chain(disturbances).collect();
        events.sort_by(|a, b| a.0.total_cmp(&b.0)); // stable: events of one time keep the file's order
        Self { events, next: 0 }
    }

    /// The next event that is due at `time_s`. An event that rounding puts a hair after its substep's start still is.
    pub(super) fn due(&mut self, time_s: f64) -> Option<Event> {
        let (at_s, event) = *self.events.get(self.next)?;
        (at_s <= time_s + 1e-9).then(|| {
            self.next += 1;
            event
        })
    }
}
