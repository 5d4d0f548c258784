//! The project held against closed forms, other programs and its own speed.

pub mod dataset;
pub mod physics;
pub mod render;
pub mod vision;
