//! Studies: many episodes, and what they say together.

pub mod seeds;
pub mod statistics;
