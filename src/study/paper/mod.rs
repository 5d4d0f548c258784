//! The paper "Bearing only visual homing: Observer based approach", reproduced and audited.
//!
//! Its simulations run here under its own constants ([`PrintedTable`] has its numbers), and under the conditions that it leaves
//! unsaid. [`trial`] is one run as the paper simulates it; the other modules are its parts: [`ideal`] Table I and Fig. 3, [`images`]
//! Table II, Fig. 5 and Fig. 7, [`contest`] Fig. 8, [`claims`] what else the paper says and what of it holds.

pub mod claims;
pub mod contest;
pub mod ideal;
pub mod images;
pub mod objects;
mod printed;
pub mod trial;

pub use printed::{PrintedTable, TABLE_I, TABLE_II};

use crate::control::Law;

/// Both laws, in the order of the paper's tables.
pub const LAWS: [Law; 2] = [Law::Proportional, Law::Lyapunov];
/// Names of the starts in every one of the paper's settings.
pub const STARTS: [&str; 4] = ["P1", "P2", "P3", "P4"];
