//! Layouts, and what a frame's files are called in each.

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, IntoStaticStr, VariantArray};

use super::document::Document;
use super::entry::{Frame, Names};
use super::{folder, image_database, moeller, vardy, webdataset};
use crate::panorama::{Projection, ProjectionKind};

/// How a set's files are named and what their pixels mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Layout {
    /// Vardy's panoramic image database: CONDITION/I_J.pgm, grey, clockwise.
    ///
    /// Also `cv_<rows-1-i>_<j>_bw<bw>.pgm`.
    Vardy,
    /// Moeller's: a .db line about the grid, and folders with cv_X_Y_bwBW.pgm, grey, clockwise.
    Moeller,
    /// BrainsOnBoard: database_entries.csv, database_metadata.yaml, PNG.
    ImageDatabase,
    /// Tar shards for training with `webdataset`.
    Webdataset,
    /// A folder a condition; colours, range, instances and truth of each frame.
    Folder,
    /// The paper's own set, read only: `<i>_<j>.png` or `.pgm`.
    Paper,
}

impl Layout {
    /// Those that are written.
    pub const WRITTEN: [Self; 5] = [Self::Vardy, Self::Moeller, Self::ImageDatabase, Self::Webdataset, Self::Folder];

    /// What files and the command line call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Whether its pictures are grey.
    #[must_use]
    pub fn is_grey(self) -> bool {
        matches!(self, Self::Vardy | Self::Moeller)
    }

    /// Whether azimuth falls as the column grows.
    #[must_use]
    pub fn is_clockwise(self) -> bool {
        matches!(self, Self::Vardy | Self::Moeller)
    }

    /// Whether it can only hold one picture a place of a grid.
    #[must_use]
    pub fn needs_grid(self) -> bool {
        matches!(self, Self::Vardy | Self::Moeller)
    }

    /// The projection in which pictures are rendered for it: a camera's own, or the layout's where that leaves no choice.
    #[must_use]
    pub fn projection(self, camera: Projection) -> Projection {
        match self {
            Self::Vardy | Self::Moeller => equal_angle(camera.width, camera.height),
            _ => camera,
        }
    }

    /// What a frame's files are called.
    #[must_use]
    pub fn names(self, frame: &Frame, set: &Document) -> Names {
        match self {
            Self::Vardy | Self::Paper => vardy::names(frame),
            Self::Moeller => moeller::names(frame, set),
            Self::ImageDatabase => image_database::names(frame, set),
            Self::Webdataset => webdataset::names(frame),
            Self::Folder => folder::names(frame),
        }
    }
}

/// Column 0 ahead, horizon in the middle, rows even in elevation.
pub(super) fn equal_angle(width: u32, height: u32) -> Projection {
    Projection { kind: ProjectionKind::EqualAngle, ..Projection::new(width, height) }
}
