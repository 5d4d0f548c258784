//! Studies: many episodes, and what they say together.

pub mod physics;
pub mod seeds;
pub mod statistics;
