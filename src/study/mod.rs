//! Studies: many episodes, and what they say together.

pub mod bound;
pub mod film;
pub mod physics;
pub mod render;
pub mod robustness;
pub mod seeds;
pub mod statistics;
