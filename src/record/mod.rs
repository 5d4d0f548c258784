//! What is kept of a run while it goes on, and when it has ended: one [`Recorder`] a format.
//!
//! An [MCAP](https://mcap.dev) file holds all that happens as messages for Foxglove, Rerun and the readers of that format; an animated
//! GIF shows the panorama above the room. Both go straight to disk, so that a long run needs no more memory than a short one,
//! and both appear under their names only when the run has ended. The [`run`] files are written at the end: summary, trajectory as
//! CSV and TUM, map and panoramas. Times are those of the simulation: the same run gives the same bytes.
//!
//! Knows of: episodes, drawing. Must not know what drives them.

pub mod drive;
#[cfg_attr(not(any(feature = "recording", feature = "video")), allow(dead_code, reason = "recordings alone write such files"))]
mod file;
#[cfg(feature = "recording")]
mod mcap_file;
#[cfg(feature = "recording")]
mod messages;
pub mod path_plot;
pub mod run;
#[cfg(feature = "recording")]
mod scene;
mod tum;
#[cfg(feature = "video")]
mod video;

use std::path::Path;

use crate::episode::Recorder;
use crate::error::{Error, Result};
use crate::world::World;

/// Recordings that are files of their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// MCAP with Foxglove's schemas.
    Mcap,
    /// Animated GIF.
    Gif,
}

impl Format {
    /// Checks what can be checked before a run whose other results go to `out`.
    ///
    /// # Errors
    /// When this build has no such recording, the folder of the file is not there, a file is there that no earlier run has recorded, or it would lie among the other
    /// results.
    pub fn check(self, path: &Path, out: &Path) -> Result<()> {
        file::check(path, self.magic()?)?;
        let (own, results) = (file::folder_of(path).canonicalize(), out.canonicalize());
        if own.is_ok_and(|own| results.is_ok_and(|results| own == results)) {
            return Err(Error::Invalid {
                what: "recording".into(),
                found: format!("{}, in the folder of the run's other results", path.display()),
                allowed: "a file in another folder".into(),
            });
        }
        Ok(())
    }

    /// Begins a recording of a run in `world`. One of a run that does not come to its end leaves nothing.
    ///
    /// # Errors
    /// When the file cannot be created, or this build has no such recording.
    pub fn open<'a>(self, path: &Path, world: &'a World) -> Result<Box<dyn Recorder + 'a>> {
        match self {
            #[cfg(feature = "recording")]
            Self::Mcap => Ok(Box::new(mcap_file::McapRecording::create(world, path)?)),
            #[cfg(feature = "video")]
            Self::Gif => Ok(Box::new(video::VideoRecording::create(world, path)?)),
            #[cfg(not(all(feature = "recording", feature = "video")))]
            _ => {
                let _ = (path, world);
                Err(self.off())
            }
        }
    }

    fn magic(self) -> Result<&'static [u8]> {
        match self {
            #[cfg(feature = "recording")]
            Self::Mcap => Ok(mcap_file::MAGIC),
            #[cfg(feature = "video")]
            Self::Gif => Ok(video::MAGIC),
            #[cfg(not(all(feature = "recording", feature = "video")))]
            _ => Err(self.off()),
        }
    }

    /// Why this build has no such recording.
    #[cfg(not(all(feature = "recording", feature = "video")))]
    fn off(self) -> Error {
        match self {
            Self::Mcap => Error::FeatureOff { what: "the recording as MCAP", feature: "recording" },
            Self::Gif => Error::FeatureOff { what: "the recording as GIF", feature: "video" },
        }
    }
}
