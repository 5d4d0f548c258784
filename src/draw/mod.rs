//! Drawing: charts, maps of rooms, contact sheets, and the coding of pictures.
//!
//! Knows of: worlds, panoramas and numbers. Must not know of episodes or studies.

pub mod chart;
pub mod image;
pub mod map;
pub mod markdown;
#[cfg(feature = "video")]
pub(crate) mod raster;
pub(crate) mod shapes;
pub mod sheet;
#[cfg(feature = "video")]
pub mod worlds;
