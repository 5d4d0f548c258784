//! The project held against closed forms, other programs and its own speed.

pub mod dataset;
#[cfg(feature = "rapier")]
pub mod physics;
pub mod render;
#[cfg(feature = "rapier")]
pub mod vision;
