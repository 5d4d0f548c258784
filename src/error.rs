//! The library's one error type.

use std::ops::ControlFlow;
use std::path::PathBuf;

use crate::fault::Fault;

/// Result of a fallible library call.
pub type Result<T> = std::result::Result<T, Error>;

/// Goes on, or is interrupted, as a watcher says.
pub(crate) fn go_on(flow: ControlFlow<()>) -> Result<()> {
    if flow.is_break() { Err(Error::Interrupted) } else { Ok(()) }
}

/// All that can go wrong in the library.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file or folder could not be read or written.
    #[error("cannot {action} {}", path.display())]
    Io {
        /// What was tried: "read", "write", "remove", "create folder".
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A file is not what its format asks for.
    #[error("{}: {message}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Place, what was found and what is expected.
        message: String,
    },
    /// A world file has faults; all of them are listed.
    #[error("{}", format_faults(path, faults))]
    World {
        /// The file.
        path: PathBuf,
        /// Its faults.
        faults: Vec<Fault>,
    },
    /// A value from the command line or the library's caller is not allowed.
    #[error("{what}: found {found}, allowed is {allowed}")]
    Invalid {
        /// Which value.
        what: String,
        /// What was given.
        found: String,
        /// What is allowed.
        allowed: String,
    },
    /// Something was asked for that this build has not.
    #[error("{what} is not in this build of wayhome; build it with the feature `{feature}`")]
    FeatureOff {
        /// What was asked for.
        what: &'static str,
        /// The Cargo feature that it comes with.
        feature: &'static str,
    },
    /// What a file, a set or a folder holds does not serve what was asked for.
    #[error("{what}: found {found}, needed is {needed}")]
    Unfit {
        /// Which part of it.
        what: String,
        /// What it is.
        found: String,
        /// What would serve.
        needed: String,
    },
    /// The machine has less of something than is needed.
    #[error("{what}: found {found}, needed is {needed}")]
    Lacking {
        /// Of what.
        what: String,
        /// What there is.
        found: String,
        /// How much would do.
        needed: String,
    },
    /// A picture was asked for from inside a body.
    #[error("camera: found ({x_m}, {y_m}, {z_m}) m, inside `{body}`, allowed is a place outside all bodies")]
    CameraInside {
        /// Name of the body.
        body: String,
        /// x of the camera in the room, m.
        x_m: f64,
        /// y, m.
        y_m: f64,
        /// Height above the floor, m.
        z_m: f64,
    },
    /// A folder for results holds something that the command has not written.
    #[error("{} holds {found}, which this command did not write; choose another folder with --out", path.display())]
    OutputTaken {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        found: String,
    },
    /// A file to be written is there and of another make.
    #[error("{} is there, and this program has not written it; choose another name", path.display())]
    FileTaken {
        /// The file.
        path: PathBuf,
    },
    /// No graphics adapter serves the renderer.
    #[error(
        "no graphics adapter for the GPU renderer ({0}); use --renderer cpu, or install a Vulkan driver (on Debian mesa-vulkan-drivers is a software one)"
    )]
    NoAdapter(String),
    /// The graphics device failed while in use.
    #[error("graphics device failed: {0}")]
    Gpu(String),
    /// An image could not be encoded or decoded.
    #[error("image {}", path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// The codec's reason.
        source: image::ImageError,
    },
    /// There is not enough memory.
    #[error("no memory for a picture: {bytes} bytes are not to be had")]
    Memory {
        /// What was asked for.
        bytes: usize,
    },
    /// Worker threads could not be started.
    #[error("cannot start worker threads: {0}")]
    Threads(String),
    /// The run was stopped from outside (Ctrl-C).
    #[error("interrupted")]
    Interrupted,
}

/// What kind of thing went wrong: it says who can do something about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// A value that the caller chose is not allowed; another one may be.
    Usage,
    /// A file, a folder or a set is not what it has to be; the same call succeeds once it is, or on another one.
    Input,
    /// The machine or this build of the program does not give what is needed; the same call may succeed with another one.
    Environment,
    /// The work was stopped from outside.
    Interrupted,
}

impl Error {
    /// Which kind of error it is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        match self {
            Self::Invalid { .. } | Self::CameraInside { .. } => ErrorKind::Usage,
            Self::Parse { .. }
            | Self::World { .. }
            | Self::Unfit { .. }
            | Self::Image { .. }
            | Self::OutputTaken { .. }
            | Self::FileTaken { .. } => ErrorKind::Input,
            Self::Io { .. }
            | Self::Lacking { .. }
            | Self::FeatureOff { .. }
            | Self::NoAdapter(_)
            | Self::Gpu(_)
            | Self::Memory { .. }
            | Self::Threads(_) => ErrorKind::Environment,
            Self::Interrupted => ErrorKind::Interrupted,
        }
    }
}

fn format_faults(path: &std::path::Path, faults: &[Fault]) -> String {
    use std::fmt::Write;
    let mut text = format!("{}: {} fault{}", path.display(), faults.len(), if faults.len() == 1 { "" } else { "s" });
    for f in faults {
        let _ = write!(text, "\n  {f}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a caller tells apart, made by the library itself; tests of the command hold the exit codes to the same.
    #[test]
    fn errors_say_what_kind_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let kind = |error: Error| error.kind();
        let world = |text: &str| crate::world::World::from_toml(text, "world.toml").unwrap_err();
        assert_eq!(kind(crate::world::World::open("no-such-world").unwrap_err()), ErrorKind::Usage);
        assert_eq!(kind(world("name = 1")), ErrorKind::Input);
        std::fs::write(folder.path().join("thesis.tex"), "mine").unwrap();
        let taken = crate::storage::OutputFolder::open(folder.path(), "home").unwrap_err();
        assert_eq!(kind(taken), ErrorKind::Input);
        let below = crate::storage::OutputFolder::open(&folder.path().join("thesis.tex/below"), "home").unwrap_err();
        assert_eq!(kind(below), ErrorKind::Environment);
        if cfg!(unix) {
            assert_eq!(kind(crate::storage::check_room(folder.path(), u64::MAX, "a set").unwrap_err()), ErrorKind::Environment);
        }
        assert_eq!(kind(Error::Interrupted), ErrorKind::Interrupted);
    }
}
