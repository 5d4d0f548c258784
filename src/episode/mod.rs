//! Episodes: plant x sensor x method, closed and logged.

pub mod method;
