//! A camera's pictures and a table of where they were taken.

use std::path::Path;

use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::panorama_set::document::Document;
use crate::panorama_set::entry::{Entry, Frame, Names, WorldRef};
use crate::panorama_set::layout::{Found, Layout, Search};
use crate::panorama_set::source::Source;
use crate::storage::{io_error, read_piece};

/// The table, where no other is named.
pub(in crate::panorama_set) const POSES: &str = "poses.csv";
/// Most bytes of a table.
const MOST_BYTES: u64 = 1 << 28;

/// See [`super::LayoutKind::Pictures`].
pub(super) struct Pictures;

impl Layout for Pictures {
    fn about_files(&self) -> &'static str {
        "A camera's pictures, and `poses.csv` with the columns file, x_m, y_m, heading_deg and, where there are several, room."
    }

    fn is_written(&self) -> bool {
        false
    }

    fn is_one_folder(&self) -> bool {
        true
    }

    fn names(&self, frame: &Frame, _set: &Document) -> Names {
        Names::side_by_side(&format!("{:06}", frame.spot))
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(folder.join(POSES).is_file())
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        read_poses(search.folder, &search.folder.join(POSES)).map(Found::new)
    }
}

/// The pictures that a table of poses lists, in its order. Their names are relative to `folder`.
///
/// # Errors
/// When the table cannot be read, lacks a column or a number, lists a picture twice or one that is not there: with its line.
pub(in crate::panorama_set) fn read_poses(folder: &Path, table: &Path) -> Result<Vec<Entry>> {
    let file = std::fs::File::open(table).map_err(io_error("read", table))?;
    let bytes = file.metadata().map_err(io_error("read", table))?.len();
    let fault = |message: String| Error::Parse { path: table.to_owned(), message };
    if bytes > MOST_BYTES {
        return Err(fault(format!("found {bytes} bytes, expected a table of at most {MOST_BYTES}")));
    }
    let text = read_piece(file, bytes, table)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_slice());
    let header = reader.headers().map_err(|e| fault(e.to_string()))?.clone();
    let column = |name: &str| header.iter().position(|h| h == name);
    let needed = |name: &str| {
        let found = header.iter().collect::<Vec<_>>().join(", ");
        column(name).ok_or_else(|| {
            fault(format!("found the columns {found}, expected file, x_m, y_m, heading_deg and, if you like, room; no {name}"))
        })
    };
    let [picture, x, y, heading] = [needed("file")?, needed("x_m")?, needed("y_m")?, needed("heading_deg")?];
    let room = column("room");
    let mut entries: Vec<Entry> = Vec::new();
    let mut seen = std::collections::BTreeMap::new();
    for record in reader.records() {
        let record = record.map_err(|e| fault(e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |k: usize, name: &str| {
            let text = record.get(k).unwrap_or_default();
            text.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| {
                let found = if text.is_empty() { "nothing".to_owned() } else { format!("`{text}`") };
                fault(format!("line {line}: {name}: found {found}, expected a number"))
            })
        };
        let name = record.get(picture).unwrap_or_default();
        let path = folder.join(name);
        if name.is_empty() || !path.is_file() {
            return Err(fault(format!("line {line}: found `{name}`, which is no file in {}", folder.display())));
        }
        if let Some(before) = seen.insert(name.to_owned(), line) {
            return Err(fault(format!("line {line}: found `{name}` again, which line {before} has")));
        }
        let pose = Pose::new(number(x, "x_m")?, number(y, "y_m")?, number(heading, "heading_deg")?.to_radians());
        let of = room.and_then(|k| record.get(k)).filter(|name| !name.is_empty());
        let world = of.map(|room| WorldRef { world: room.to_owned(), kind: "room".to_owned() });
        entries.push(Entry { pose: Some(pose), world, ..Entry::new("", name, Source::File(path)) });
    }
    if entries.is_empty() {
        return Err(fault("found no picture, expected a line for each".to_owned()));
    }
    Ok(entries)
}
