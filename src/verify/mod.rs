//! The project held against closed forms, other programs and its own speed.
//!
//! Knows of: physics, renderer, extractor and data sets from outside, and drawing. Must not know of studies.

pub mod dataset;
#[cfg(feature = "rapier")]
mod outside;
#[cfg(feature = "rapier")]
pub mod physics;
pub mod render;
mod speed;
#[cfg(feature = "rapier")]
pub mod vision;
