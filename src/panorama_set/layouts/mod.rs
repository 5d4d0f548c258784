//! The list of layouts. A new one is a file here, a line of [`LayoutKind`] and one of [`LayoutKind::layout`].
//!
//! | layout | pictures | columns | rows |
//! |---|---|---|---|
//! | `vardy` | `CONDITION/I_J.pgm`, grey | azimuth falls | even in elevation, horizon in the middle |
//! | `moeller` | `DATA2/BASE_SUFFIX.db`, `DATA2/BASECONDITIONSUFFIX/cv_X_Y_bwBW.pgm`, grey, X counts backwards | azimuth falls | even in elevation, horizon as the `.db` says |
//! | `image-database` | `CONDITION/database_entries.csv`, `database_metadata.yaml`, PNG | azimuth grows | even in its tangent |
//! | `image-folder` | `CONDITION/N.png`, `metadata.jsonl` | azimuth grows | even in its tangent |
//! | `webdataset` | `shards/CONDITION-N.tar` with `KEY.rgb.png`, `.range.png`, `.instance.png`, `.json` | azimuth grows | even in its tangent |
//! | `folder` | `CONDITION/N.rgb.png`, `.range.png`, `.instance.png`, `.json` | azimuth grows | even in its tangent |
//! | `pictures` (read only) | a camera's, listed in `poses.csv` | azimuth falls, or as the lens says | as the lens says |
//! | `paper` (read only) | `I_J.png` or `.pgm` | azimuth grows | even in its tangent |
//!
//! Where a layout has no place for range and instances, they lie in `truth/CONDITION/`, where none of its readers looks.

mod folder;
mod image_database;
mod image_folder;
mod moeller;
pub(super) mod pictures;
mod vardy;
mod webdataset;

use serde::{Deserialize, Serialize};
use strum::{EnumMessage, EnumString, IntoStaticStr, VariantArray};

use super::layout::Layout;

/// The layouts, in the order in which a folder is tried. The first line of each is the command line's help.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, EnumMessage, EnumString, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum LayoutKind {
    /// BrainsOnBoard: database_entries.csv, database_metadata.yaml, PNG.
    ImageDatabase,
    /// ImageFolder, as Hugging Face's `datasets` loads it: CONDITION/N.png and metadata.jsonl.
    ImageFolder,
    /// Moeller's: a .db line about the grid, and folders with cv_X_Y_bwBW.pgm, grey, clockwise.
    Moeller,
    /// Tar shards for training with `webdataset`.
    Webdataset,
    /// Vardy's panoramic image database: CONDITION/I_J.pgm, grey, clockwise.
    ///
    /// Also `cv_<rows-1-i>_<j>_bw<bw>.pgm`.
    Vardy,
    /// A camera's pictures and a table of their poses, `poses.csv`; read only.
    Pictures,
    /// The paper's own set, read only: `<i>_<j>.png` or `.pgm`.
    Paper,
    /// A folder a condition; colours, range, instances and truth of each frame.
    Folder,
}

impl LayoutKind {
    /// The layout itself.
    #[must_use]
    pub fn layout(self) -> &'static dyn Layout {
        match self {
            Self::ImageDatabase => &image_database::ImageDatabase,
            Self::ImageFolder => &image_folder::ImageFolder,
            Self::Moeller => &moeller::Moeller,
            Self::Webdataset => &webdataset::Webdataset,
            Self::Vardy => &vardy::VARDY,
            Self::Pictures => &pictures::Pictures,
            Self::Paper => &vardy::PAPER,
            Self::Folder => &folder::Folder,
        }
    }

    /// Those in which sets are written.
    pub fn written() -> impl Iterator<Item = Self> {
        Self::VARIANTS.iter().copied().filter(|kind| kind.layout().is_written())
    }

    /// What files and the command line call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Their names, for messages.
    #[must_use]
    pub fn names() -> String {
        Self::VARIANTS.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ")
    }
}
