//! The paper "Bearing only visual homing: Observer based approach", reproduced and audited.
//!
//! Its simulations run here under its own constants ([`PrintedTable`] has its numbers), and under the conditions that it leaves
//! unsaid. [`trial`] is one run as the paper simulates it, [`course`] the runs of a table: four starts under two laws. The other
//! modules are the paper's parts: [`ideal`] Table I and Fig. 3, [`images`] Table II, Fig. 5 and Fig. 7, [`contest`] Fig. 8,
//! [`claims`] what else the paper says and what of it holds. [`evidence`] has all of them, each made when it is first asked for.

pub mod claims;
pub mod contest;
pub mod course;
pub mod evidence;
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

/// What the paper calls a law.
pub fn law_name(law: Law) -> &'static str {
    match law {
        Law::Proportional => "proportional",
        Law::Lyapunov => "nonlinear",
    }
}
