//! Reports: what a run leaves on disk and on the screen.
//!
//! Reports know results, not how they came about. All files go through an [`OutputFolder`], which writes each of them whole or
//! not at all and refuses to touch a folder that holds anything else.

pub mod bound;
pub mod chart;
pub mod compare;
pub mod dataset;
pub mod drive;
mod folder;
pub mod image;
pub mod map;
pub mod paper;
mod path_plot;
pub mod physics;
pub mod recording;
pub mod render;
pub mod robustness;
pub mod run;
pub mod seeds;
pub mod sheet;
pub mod sweep;
pub mod text;
mod tum;
pub mod vision;

pub use crate::storage::write_atomically;
pub use folder::{GrowingFile, OutputFolder};

/// Indented JSON with a line end.
pub fn json(value: &impl serde::Serialize) -> String {
    // Plain structs with text keys always serialise; NaN becomes null.
    let mut text = serde_json::to_string_pretty(value).unwrap_or_default();
    text.push('\n');
    text
}
