//! report

pub mod map;
