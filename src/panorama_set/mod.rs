//! Panorama sets on disk: the layouts of the field, written and read back.
//!
//! A [`Layout`] says how a set's files are named, how their pixels are coded and which way azimuth runs over the columns; each has
//! a file of its own in `layouts/` that holds both directions, so that what is written in a layout is read back equal, and a line
//! in the list [`LayoutKind`]. A set that this program wrote carries a [`Document`] (`dataset.json`); real sets have none, and then
//! the layout's own conventions hold.
//!
//! Sets may come from anyone: only plain files inside their folder are opened, links resolved, and no number of theirs asks for more
//! memory than a set of this program does.
//!
//! Whatever a set's own sense of azimuth, [`PanoramaSet::load`] gives a [`Panorama`](crate::panorama::Panorama) whose columns run
//! anti-clockwise. A [`Grid`] says where the places of a set lie about its home.
//!
//! A camera's own pictures are a set as well, with a table of where they were taken; a [`Lens`] says what their pixels look at.
//!
//! Knows of: panoramas and files. Must not know of worlds or renderers.

mod document;
mod encode;
mod entry;
mod grid;
mod layout;
mod layouts;
mod lens;
mod set;
mod source;
mod yaml;

pub use document::{ConditionDocument, DOCUMENT, Document, GridDocument, Instance, MOST_PLACES, SeriesDocument, WorldDocument};
pub use encode::{
    Coding, encode_grey, encode_instance, encode_range, encode_rgb, modes, packed_instance, packed_range, packed_rgb,
};
pub use entry::{Entry, Frame, FramePose, FrameTruth, LandmarkTruth, Names, WorldRef};
pub use grid::{Cell, Grid, Place};
pub use layout::Layout;
pub use layouts::LayoutKind;
pub use lens::{Lens, LensKind, RingModel, elevation_rad};
pub use set::PanoramaSet;
pub use source::mirror;
