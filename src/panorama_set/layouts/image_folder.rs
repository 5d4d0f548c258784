//! ImageFolder, as Hugging Face's `datasets` loads it: pictures and a `metadata.jsonl` with a line for each of them.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::panorama_set::document::Document;
use crate::panorama_set::entry::{Entry, Frame, FramePose, Names, WorldRef};
use crate::panorama_set::grid::Place;
use crate::panorama_set::layout::{Found, Layout, Search};
use crate::storage::read_within;

/// The lines about the pictures beside it.
const METADATA: &str = "metadata.jsonl";

/// See [`super::LayoutKind::ImageFolder`].
pub(super) struct ImageFolder;

/// A line of the metadata. Sets of others need no more than the name of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    file_name: String,
    #[serde(default)]
    condition: String,
    #[serde(default)]
    row: Option<usize>,
    #[serde(default)]
    column: Option<usize>,
    #[serde(default)]
    t_s: Option<f64>,
    #[serde(flatten)]
    pose: Option<FramePose>,
    #[serde(flatten, default, skip_serializing_if = "Option::is_none")]
    world: Option<WorldRef>,
}

fn stem(frame: &Frame) -> String {
    format!("{:06}", frame.spot)
}

impl Layout for ImageFolder {
    fn about_files(&self) -> &'static str {
        "Each condition's folder is an ImageFolder: pictures `N.png` and `metadata.jsonl`, which `datasets.load_dataset(\"imagefolder\", \
         data_dir=\"CONDITION\")` loads; range and instances of each lie in `truth/CONDITION/`."
    }

    fn holds_worlds(&self) -> bool {
        true
    }

    fn names(&self, frame: &Frame, _set: &Document) -> Names {
        let stem = stem(frame);
        Names::with_truth_aside(format!("{}/{stem}.png", frame.condition), &frame.condition, &stem)
    }

    fn lists(&self, set: &Document, frames: &dyn Fn(usize) -> Vec<Frame>) -> Vec<(String, String)> {
        let line = |frame: Frame| {
            let line = Line {
                file_name: format!("{}.png", stem(&frame)),
                row: frame.place.map(|p| p.i),
                column: frame.place.map(|p| p.j),
                t_s: frame.time_s,
                pose: Some(frame.robot.into()),
                world: frame.world,
                condition: frame.condition,
            };
            // Plain structs with text keys always serialise.
            serde_json::to_string(&line).unwrap_or_default() + "\n"
        };
        let taken = set.conditions.iter().enumerate().filter(|(_, condition)| condition.frames > 0);
        let list = |(k, name): (usize, &String)| (format!("{name}/{METADATA}"), frames(k).into_iter().map(line).collect());
        taken.map(|(k, condition)| list((k, &condition.name))).collect()
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(folder.join(METADATA).is_file())
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        let path = search.folder.join(METADATA);
        let bytes = read_within(search.root, &path)?;
        let fault =
            |k: usize, message: String| Error::Parse { path: path.clone(), message: format!("line {}: {message}", k + 1) };
        let entry = |(k, text): (usize, &[u8])| {
            let line: Line = serde_json::from_slice(text).map_err(|e| fault(k, e.to_string()))?;
            let picture = search.folder.join(&line.file_name);
            if !picture.is_file() {
                return Err(fault(k, format!("found `{}`, which is no file beside it", line.file_name)));
            }
            let place = line.row.zip(line.column).map(|(i, j)| Place { i, j });
            Ok(Entry { place, pose: line.pose.map(Into::into), world: line.world, ..search.entry_with_truth_aside(picture) })
        };
        let lines = bytes.split(|byte| *byte == b'\n').enumerate().filter(|(_, text)| !text.trim_ascii().is_empty());
        lines.map(entry).collect::<Result<_>>().map(Found::new)
    }
}
