//! A simulation stepped by hand: reset, look, command, look again.
//!
//! The loop stands in the caller's code, as a controller in training wants it. Here a robot that slips drives a circle, and what its
//! wheels tell of the way is held against the truth.

use std::error::Error;

use wayhome::episode::{Phase, PlantKind, SensorKind, Setup, Simulation};
use wayhome::geometry::{Pose, Twist};
use wayhome::world::World;

fn main() -> Result<(), Box<dyn Error>> {
    let world = World::open("slippery")?;
    let setup = Setup { plant: PlantKind::Rapier, sensor: SensorKind::Noisy, ..Setup::default() };
    let mut simulation = Simulation::new(&world, &setup)?;
    let mut ends = Vec::new();
    // Two runs of one seed are the same.
    for _ in 0..2 {
        simulation.reset(5)?;
        let start = simulation.truth();
        let mut told = Pose::IDENTITY;
        for _ in 0..100 {
            let (seen, phase) = simulation.step(Twist { v: 0.15, omega: 0.5 })?;
            told = told.advanced(seen.odometry.twist, seen.odometry.dt_s);
            if phase != Phase::Running {
                break;
            }
        }
        let truth = start.to_local(&simulation.truth());
        let drift_cm = 100.0 * (told.position() - truth.position()).norm();
        eprintln!("odometry is {drift_cm:.2} cm off after {} steps", simulation.steps().len());
        ends.push((simulation.truth(), drift_cm));
    }
    if ends[0] == ends[1] && ends[0].1 > 0.0 { Ok(()) } else { Err("not as expected".into()) }
}
