//! A sensor of one's own: a camera that does not see what is behind the robot.
//!
//! A sensor belongs to the simulator. It sees the truth and tells bearings; here it takes those of the built-in sensor with
//! noise and keeps the ones in its field of view.

use std::error::Error;
use std::ops::ControlFlow;

use wayhome::episode::{Outcome, Parts, PlantKind, Setup, Simulation};
use wayhome::geometry::Pose;
use wayhome::observation::{Bearing, HomeSnapshot};
use wayhome::random::Seed;
use wayhome::sensor::{IdealSensor, Noise, NoisySensor, Sensor};
use wayhome::world::World;

/// Sees what lies within this angle of the robot's heading, rad.
struct LimitedView<S> {
    inner: S,
    half_angle_rad: f64,
}

impl<S: Sensor> Sensor for LimitedView<S> {
    fn reset(&mut self, seed: Seed) -> wayhome::Result<()> {
        self.inner.reset(seed)
    }

    /// The home snapshot stays whole: the robot turned around once when it was taken.
    fn home(&self) -> &HomeSnapshot {
        self.inner.home()
    }

    fn observe(&mut self, truth: Pose, bodies: &[Pose]) -> wayhome::Result<Vec<Bearing>> {
        let mut seen = self.inner.observe(truth, bodies)?;
        seen.retain(|bearing| bearing.azimuth_rad.abs() <= self.half_angle_rad);
        Ok(seen)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::open("lab")?;
    let noisy = NoisySensor::new(IdealSensor::new(&world), world.landmark_count, Noise::default(), Seed(0));
    let sensor = LimitedView { inner: noisy, half_angle_rad: 120_f64.to_radians() };
    let setup = Setup { plant: PlantKind::Unicycle, ..Setup::default() };
    let parts = Parts::with_sensor(&world, setup.plant, Box::new(sensor))?;
    let mut simulation = Simulation::from_parts(&world, &setup, parts);
    let record = simulation.run(3, &mut |_| ControlFlow::Continue(()))?;
    let seen = record.steps.iter().filter_map(|step| step.seen);
    let most = seen.max().unwrap_or(0);
    eprintln!(
        "{} after {:.1} s; {most} of {} landmarks in view at most",
        record.outcome.name(),
        record.time_s,
        record.home_bearings
    );
    if record.outcome == Outcome::Home && most < record.home_bearings { Ok(()) } else { Err("not as expected".into()) }
}
