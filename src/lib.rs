//! Headless, physics-simulated robot testbed for bearing-only visual homing.

pub mod control;
pub mod episode;
pub mod error;
pub mod estimation;
pub mod geometry;
pub mod observation;
pub mod panorama;
pub mod physics;
pub mod random;
pub mod render;
pub mod report;
pub mod study;
pub mod vision;
pub mod world;

pub use error::{Error, Result};
