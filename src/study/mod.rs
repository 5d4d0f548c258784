//! Studies: many episodes, and what they say together.

pub mod bound;
pub mod compare;
pub mod dataset;
pub mod film;
pub mod observability;
pub mod paper;
pub mod physics;
pub mod render;
pub mod robustness;
pub mod seeds;
pub mod statistics;
pub mod sweep;
pub mod vision;
