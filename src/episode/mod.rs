//! Episodes: a plant, a sensor and a method, closed into a loop and run to the end.
//!
//! An episode is put together from three parts that combine freely. The *plant* ([`crate::physics::Plant`]) moves when the
//! wheels are commanded, the [`Sensor`](crate::sensor::Sensor) turns the plant's true state into bearings, and the *method*
//! ([`crate::observation::Method`]) turns bearings and odometry into the next command. Only the loop in this module sees both
//! the truth and the method's belief; it writes both into a [`Record`], and [`Summary`] compares them.
//!
//! [`open_loop`] drives the plant by a table of commands, without sensor and method.
//!
//! [`Setup`] says which parts to take, and a [`Bench`] builds them for one world and runs seeds on it.

pub mod open_loop;
mod record;
mod recorder;
mod run;
mod setup;
mod summary;

pub use record::{Belief, Outcome, Pictures, Record, Step, Timing};
pub use recorder::{Moment, Recorder};
pub use run::{Parts, Progress, run, run_recorded};
pub use setup::{Bearings, Bench, Look, PlantKind, Setup, Start};
pub use summary::{BeliefError, CollisionRecord, EstimateErrors, Landmarks, PoseRecord, SetupRecord, Summary};
