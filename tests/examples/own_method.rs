//! A homing method of one's own: the average landmark vector with a compass.
//!
//! A method sees observations only: bearings, odometry, and here a compass. It gets the home snapshot before the run.

use std::error::Error;
use std::ops::ControlFlow;

use wayhome::episode::{Outcome, PlantKind, SensorKind, Setup, Simulation, Summary};
use wayhome::geometry::{Twist, Vector2, angle_of, direction, wrap};
use wayhome::observation::{Bearing, Briefing, Decision, Method, Observation, Status};
use wayhome::world::World;

/// Commanded speed for each unit of difference between the mean vectors, m/s.
const GAIN_M_S: f64 = 4.0;
/// The robot is home where the mean vectors differ by less than this.
const HOME_DIFFERENCE: f64 = 0.003;

/// Drives along the difference of two means: of the unit vectors to all landmarks as seen now, and as seen at home.
struct MeanVector {
    briefing: Briefing,
}

impl MeanVector {
    /// Difference of the means over the landmarks that are seen both now and at home, in the home frame.
    fn difference(&self, seen: &[Bearing], heading_rad: f64) -> Option<Vector2<f64>> {
        let at_home = |now: &Bearing| self.briefing.home.bearings.iter().find(|home| home.id == now.id);
        let pairs = seen.iter().filter_map(|now| Some((now, at_home(now)?)));
        let differences: Vec<Vector2<f64>> =
            pairs.map(|(now, home)| direction(now.azimuth_rad + heading_rad) - direction(home.azimuth_rad)).collect();
        (!differences.is_empty()).then(|| differences.iter().sum::<Vector2<f64>>() / differences.len() as f64)
    }
}

impl Method for MeanVector {
    fn step(&mut self, observation: &Observation<'_>) -> Decision {
        let stop = Decision::command(Twist::default());
        let Some(heading_rad) = observation.compass_rad else { return Decision { status: Status::Lost, ..stop } };
        let Some(way) = self.difference(observation.bearings, heading_rad) else { return stop };
        if way.norm() < HOME_DIFFERENCE {
            return Decision { status: Status::Arrived, ..stop };
        }
        let turn_rad = wrap(angle_of(way) - heading_rad);
        let speed = (GAIN_M_S * way.norm()).min(self.briefing.task.speed_m_s);
        Decision::command(Twist { v: speed * direction(turn_rad).x.max(0.0), omega: 2.0 * turn_rad })
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::open("lab")?;
    let setup = Setup { plant: PlantKind::Unicycle, sensor: SensorKind::Noisy, compass_sd_rad: Some(0.01), ..Setup::default() };
    let mut simulation = Simulation::new(&world, &setup)?;
    let build = |briefing| Ok(Box::new(MeanVector { briefing }) as Box<dyn Method>);
    let record = simulation.run_method(3, build, &mut |_| ControlFlow::Continue(()))?;
    let summary = Summary::new(&record, &world, &setup, 3);
    eprintln!("{} after {:.1} s, {:.1} cm from home", summary.outcome.name(), summary.time_s, 100.0 * summary.final_distance_m);
    if record.outcome == Outcome::Home { Ok(()) } else { Err("the method did not come home".into()) }
}
