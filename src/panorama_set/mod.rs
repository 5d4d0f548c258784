//! Panorama sets: a panorama at every place of a grid, all taken with the same heading.
//!
//! A [`Grid`] says where the places are, a [`PanoramaSet`] reads the pictures of a set on disk. Whatever a set's own sense of
//! azimuth and elevation, [`PanoramaSet::load`] gives a [`Panorama`](crate::panorama::Panorama) in this project's projection.

mod files;
mod grid;

pub use files::{Layout, PanoramaSet};
pub use grid::{Cell, Grid, Place};
