//! Stress studies: Monte-Carlo sweeps over any settings, in pieces that can be run anywhere and put together again.
//!
//! A [`Study`] is read from a file and checked as a whole: settings that all episodes share, axes whose levels make
//! cells ([`Design`]), and seeds, the same ones in every cell. Its episodes are numbered; what an episode does follows from its
//! number alone. [`run()`] takes chunks of them, in parallel and in any order, and hands out [`Row`]s; [`merge`] puts the rows of
//! all chunks into one table, whose bytes depend on the study alone. [`duels`] holds levels side by side.

mod design;
pub mod duels;
pub mod merge;
mod read;
pub mod rows;
mod run;
pub mod settings;
mod spec;
pub mod store;
mod value;

pub use design::{Design, SOBOL_AXES};
pub use rows::Row;
pub use run::{Exhibit, Store, exhibits, replay, run};
pub use settings::{Setting, catalogue};
pub use spec::{Axis, Chunk, Levels, MOST_EPISODES, Study};
pub use value::Value;
