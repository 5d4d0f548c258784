//! Studies: many episodes, and what they say together.
//!
//! Knows of: episodes and what they leave. Must not know how a page shows it.

pub mod bound;
pub mod compare;
pub mod field;
pub mod observability;
pub mod pairs;
pub mod paper;
pub mod pool;
pub mod robustness;
pub mod row;
pub mod seeds;
pub mod sweep;
pub mod tally;
