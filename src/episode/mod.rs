//! Episodes: a plant, a sensor and a method, closed into a loop and run to the end.
//!
//! An episode is put together from three parts that combine freely. The *plant* ([`Plant`](crate::physics::Plant)) moves when the
//! wheels are commanded, the [`Sensor`](crate::sensor::Sensor) turns the plant's true state into bearings, and the *method*
//! ([`Method`](crate::observation::Method)) turns bearings and odometry into the next command. [`Setup`] names them; any of them may
//! be a caller's own ([`Parts`]).
//!
//! A [`Simulation`] holds plant and sensor and is stepped: command in, observation out. It is the one place that sees both the truth
//! and what a method believes; it writes both into a [`Record`], tells a [`Recorder`] as they happen, and [`Summary`] compares them.
//! The closed loop, the paper's simulations, studies and the [`open_loop`] that drives a table of commands all step one.
//!
//! Knows of: worlds, plants, sensors, methods. Must not know which plant, sensor or method runs, but where a setup names it.

pub mod open_loop;
mod parts;
mod record;
mod recorder;
mod running;
mod setup;
mod simulation;
mod summary;

pub use parts::{Parts, PlantMaker};
pub use record::{Belief, Outcome, Pictures, Record, Step, Timing};
pub use recorder::{Moment, Recorder};
pub use running::Phase;
pub use setup::{Look, PlantKind, SensorKind, Setup, Start, StopRule};
pub use simulation::{Progress, Simulation, Watch};
pub use summary::{BeliefError, CollisionRecord, EstimateErrors, Landmarks, SetupRecord, Summary};
