//! Recordings of a run.

use std::path::PathBuf;

use wayhome::record::{Format, Recordings};

/// Files that grow while a run goes on.
#[derive(Debug, Clone, clap::Args)]
pub struct RecordArgs {
    /// Record the run as MCAP with Foxglove's schemas: poses, transforms, panoramas, bearings, estimate, commands, diagnostics
    #[arg(long, value_name = "FILE.mcap", conflicts_with = "seeds", value_parser = mcap)]
    pub record: Option<PathBuf>,
    /// Record the run as an animated GIF: panorama and room
    #[arg(long, value_name = "FILE.gif", conflicts_with = "seeds", value_parser = gif)]
    pub video: Option<PathBuf>,
}

impl RecordArgs {
    /// What to record, and where to.
    pub fn recordings(&self) -> Recordings {
        let asked = [(Format::Mcap, &self.record), (Format::Gif, &self.video)];
        asked.into_iter().filter_map(|(format, path)| Some((format, path.clone()?))).collect()
    }
}

fn mcap(text: &str) -> Result<PathBuf, String> {
    ending(text, "mcap")
}

fn gif(text: &str) -> Result<PathBuf, String> {
    ending(text, "gif")
}

fn ending(text: &str, allowed: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().map(|found| found.to_string_lossy().to_lowercase()) {
        Some(found) if found == allowed => Ok(path),
        Some(found) => Err(format!("found the ending .{found}, allowed is .{allowed}")),
        None => Err(format!("found no ending, allowed is .{allowed}")),
    }
}
