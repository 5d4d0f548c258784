//! Recordings: files that grow while a run goes on.
//!
//! An [MCAP](https://mcap.dev) file holds all that happens as messages for Foxglove, Rerun and the readers of that format; an animated
//! GIF shows the panorama above the room. Both go straight to disk, so that a long run needs no more memory than a short one,
//! and both appear under their names only when the run has ended. Times are those of the simulation: the same run gives the
//! same bytes.

pub mod drive;
mod file;
mod mcap_file;
mod messages;
pub mod path_plot;
mod raster;
pub mod run;
mod scene;
pub mod tum;
mod video;

use std::path::{Path, PathBuf};

use crate::episode::{Moment, Record, Recorder, Summary};
use crate::error::{Error, Result};
use crate::observation::HomeSnapshot;
use crate::panorama::Panorama;
use crate::world::World;
use mcap_file::McapRecording;
use video::VideoRecording;

/// Where to record to.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct RecordingPaths {
    /// MCAP file.
    pub mcap: Option<PathBuf>,
    /// GIF file.
    pub video: Option<PathBuf>,
}

impl RecordingPaths {
    /// Checks what can be checked before a run whose other results go to `out`.
    ///
    /// # Errors
    /// When the folder of a file is not there, a file is there that no earlier run has recorded, or it would lie among the other
    /// results.
    pub fn check(&self, out: &Path) -> Result<()> {
        let kinds = [(&self.mcap, &mcap_file::KIND), (&self.video, &video::KIND)];
        for (path, kind) in kinds.iter().filter_map(|(path, kind)| Some((path.as_ref()?, kind))) {
            file::check(path, kind)?;
            let (own, results) = (file::folder_of(path).canonicalize(), out.canonicalize());
            if own.is_ok_and(|own| results.is_ok_and(|results| own == results)) {
                return Err(Error::Invalid {
                    what: "recording".into(),
                    found: format!("{}, in the folder of the run's other results", path.display()),
                    allowed: "a file in another folder".into(),
                });
            }
        }
        Ok(())
    }
}

/// The recordings of a run. Those of a run that does not come to its end leave nothing.
pub struct Recordings<'a> {
    mcap: Option<McapRecording<'a>>,
    video: Option<VideoRecording<'a>>,
}

impl<'a> Recordings<'a> {
    /// Begins them.
    ///
    /// # Errors
    /// When a file cannot be created.
    pub fn open(world: &'a World, paths: &RecordingPaths) -> Result<Self> {
        Ok(Self {
            mcap: paths.mcap.as_deref().map(|path| McapRecording::create(world, path)).transpose()?,
            video: paths.video.as_deref().map(|path| VideoRecording::create(world, path)).transpose()?,
        })
    }
}

impl Recorder for Recordings<'_> {
    fn begin(&mut self, home: &HomeSnapshot, panorama: Option<&Panorama>) -> Result<()> {
        if let Some(mcap) = &mut self.mcap {
            mcap.begin(home, panorama)?;
        }
        self.video.as_mut().map_or(Ok(()), |video| video.begin(home, panorama))
    }

    fn record(&mut self, moment: &Moment<'_>) -> Result<()> {
        if let Some(mcap) = &mut self.mcap {
            mcap.record(moment)?;
        }
        self.video.as_mut().map_or(Ok(()), |video| video.record(moment))
    }

    fn finish(&mut self, _record: &Record, summary: &Summary) -> Result<()> {
        if let Some(mcap) = self.mcap.take() {
            mcap.finish(summary)?;
        }
        self.video.take().map_or(Ok(()), VideoRecording::finish)
    }
}
