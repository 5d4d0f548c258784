//! Drawing: charts, maps of rooms, contact sheets, and the coding of pictures.

pub mod chart;
pub mod image;
pub mod map;
pub mod markdown;
pub mod sheet;
