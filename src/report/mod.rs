//! Reports: pages and tables of finished work, on disk and on the screen.
//!
//! Reports know results, not how they came about. All files go through an [`OutputFolder`](crate::storage::OutputFolder), which
//! writes each of them whole or not at all and refuses to touch a folder that holds anything else.
//!
//! Knows of: finished studies, recordings and drawing. Must not know how the results came about.

pub mod bound;
pub mod compare;
mod curves;
pub mod dataset;
pub mod pairs;
pub mod paper;
pub mod robustness;
pub mod route;
pub mod seeds;
pub mod sweep;
pub mod text;
