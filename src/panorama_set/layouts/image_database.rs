//! The BrainsOnBoard image database: a table of entries and a file of metadata beside the pictures. Lengths are millimetres,
//! headings degrees.
//!
//! Where the two disagree, as they do in real sets, the table wins and the reader says so.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use super::document::{Document, GridDocument};
use super::entry::{Entry, Frame, Names, Source};
use super::grid::Place;
use super::set::Found;
use super::yaml;
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::storage::io_error;

/// The table.
pub const ENTRIES: &str = "database_entries.csv";
/// The metadata.
pub const METADATA: &str = "database_metadata.yaml";

const POSITION: [&str; 4] = ["X [mm]", "Y [mm]", "Z [mm]", "Heading [degrees]"];
const FILENAME: &str = "Filename";
const GRID: [&str; 3] = ["Grid X", "Grid Y", "Grid Z"];
/// Positions of table and metadata may differ by this, mm.
const SLACK_MM: f64 = 1.0;

/// Whether the set is a grid in the sense of this layout: one picture a place.
fn is_grid(set: &Document) -> bool {
    set.grid.is_some() && set.heading_rad.is_some()
}

pub(super) fn names(frame: &Frame, set: &Document) -> Names {
    let stem = if is_grid(set) {
        let mm = |m: f64| (1000.0 * m).round() as i64;
        format!("image_{:+07}_{:+07}_{:+07}", mm(frame.robot.x), mm(frame.robot.y), mm(set.camera_height_m))
    } else {
        format!("image_{:06}", frame.spot)
    };
    Names::with_truth_aside(format!("{}/{stem}.png", frame.condition), &frame.condition, &stem)
}

/// The table of a condition's frames.
#[must_use]
pub fn entries_csv(frames: &[Frame], set: &Document) -> String {
    let mut text = [&POSITION[..], &[FILENAME]].concat().join(", ");
    let rows = set.grid.as_ref().filter(|_| is_grid(set)).map(|g| g.rows);
    if rows.is_some() {
        let _ = write!(text, ", {}", GRID.join(", "));
    }
    text.push('\n');
    for frame in frames {
        let image = names(frame, set).image;
        let file = image.rsplit_once('/').map_or(image.as_str(), |(_, file)| file);
        let (p, z) = (frame.robot, 1000.0 * set.camera_height_m);
        let _ = write!(text, "{}, {}, {z}, {}, {file}", 1000.0 * p.x, 1000.0 * p.y, p.heading.to_degrees());
        if let (Some(rows), Some(place)) = (rows, frame.place) {
            let _ = write!(text, ", {}, {}, 0", place.j, rows - 1 - place.i);
        }
        text.push('\n');
    }
    text
}

/// The metadata of a set; the same for all conditions.
#[must_use]
pub fn metadata_yaml(set: &Document) -> String {
    let mut text = format!(
        "%YAML:1.0\n---\nmetadata:\n   time: \"not recorded: rendered by wayhome {}\"\n   type: {}\n",
        set.version,
        if is_grid(set) { "grid" } else { "route" }
    );
    if let Some(grid) = set.grid.as_ref().filter(|_| is_grid(set)) {
        let (s, z) = (1000.0 * grid.spacing_m, 1000.0 * set.camera_height_m);
        let (x, y) = (1000.0 * grid.first_m[0], 1000.0 * grid.first_m[1] - s * (grid.rows - 1) as f64);
        let _ = writeln!(text, "   grid:\n      beginAtMM: [ {x}, {y}, {z} ]\n      separationMM: [ {s}, {s}, 0 ]");
        let _ = writeln!(text, "      size: [ {}, {}, 1 ]", grid.columns, grid.rows);
    }
    let p = set.projection;
    let _ = writeln!(
        text,
        "   camera:\n      name: wayhome\n      resolution: [ {}, {} ]\n      isPanoramic: 1",
        p.width, p.height
    );
    text + "   needsUnwrapping: 0\n   isGreyscale: 0\n"
}

/// The panoramas of one condition.
pub(super) fn find(root: &Path, folder: &Path, condition: &str, grid: Option<&GridDocument>) -> Result<Found> {
    let path = folder.join(ENTRIES);
    let rows = read_table(&path)?;
    let (x0, y1) = rows.iter().filter_map(|r| r.grid).fold((usize::MAX, 0), |(x, y), [gx, gy, _]| (x.min(gx), y.max(gy)));
    let (x0, y1) = grid.map_or((x0, y1), |g| (0, g.rows - 1));
    let mut found = Found::new(Vec::new());
    for row in &rows {
        let picture = folder.join(&row.file);
        if !picture.is_file() {
            return Err(Error::Parse {
                path,
                message: format!("line {}: found `{}`, which is no file beside it", row.line, row.file),
            });
        }
        let stem = row.file.rsplit_once('.').map_or(row.file.as_str(), |(stem, _)| stem).to_owned();
        let mut entry = Entry::new(condition, stem.clone(), Source::File(picture));
        entry.place = row.grid.map(|[x, y, _]| Place { i: y1 - y, j: x - x0 });
        let [x, y, _, heading_deg] = row.numbers;
        let pose = Pose::new(x / 1000.0, y / 1000.0, heading_deg.to_radians());
        entry.pose = pose.is_finite().then_some(pose);
        entry.find_truth_aside(root, &stem);
        found.entries.push(entry);
    }
    let path = folder.join(METADATA);
    match std::fs::read_to_string(&path) {
        // Our own sets agree with themselves; places that were left out are no disagreement.
        Ok(_) if grid.is_some() => {}
        Ok(text) => found.warnings = disagreements(&rows, &text, &path),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => found.warnings.push(format!("{} is missing", path.display())),
        Err(e) => return Err(io_error("read", &path)(e)),
    }
    Ok(found)
}

/// A row of the table.
struct Row {
    line: u64,
    /// x, y, z (mm) and heading (degrees); blank is NaN.
    numbers: [f64; 4],
    file: String,
    grid: Option<[usize; 3]>,
}

fn read_table(path: &Path) -> Result<Vec<Row>> {
    let text = std::fs::read(path).map_err(io_error("read", path))?;
    let fault = |message: String| Error::Parse { path: path.to_owned(), message };
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(text.as_slice());
    let header = table.headers().map_err(|e| fault(e.to_string()))?.clone();
    let position = |name: &str| header.iter().position(|h| h == name);
    let column = |name: &str| {
        let found = header.iter().collect::<Vec<_>>().join(", ");
        position(name).ok_or_else(|| fault(format!("line 1: found `{found}`, expected a column `{name}` too")))
    };
    let numbers = POSITION.map(column);
    let [Ok(x), Ok(y), Ok(z), Ok(heading)] = numbers else {
        return Err(numbers.into_iter().find_map(Result::err).unwrap_or_else(|| fault("no header".to_owned())));
    };
    let file = column(FILENAME)?;
    let grid = match GRID.map(position) {
        [None, None, None] => None,
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => return Err(fault(format!("line 1: expected all of {} or none of them", GRID.join(", ")))),
    };
    let mut rows = Vec::new();
    for record in table.records() {
        let record = record.map_err(|e| fault(e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |k: usize| record.get(k).unwrap_or_default();
        let unread = |k: usize, expected: &str| {
            fault(format!("line {line}, {}: found `{}`, expected {expected}", header.get(k).unwrap_or_default(), cell(k)))
        };
        let number = |k: usize| -> Result<f64> {
            if cell(k).is_empty() {
                return Ok(f64::NAN);
            }
            cell(k).parse().ok().filter(|v: &f64| !v.is_infinite()).ok_or_else(|| unread(k, "a number or nothing"))
        };
        let index = |k: usize| cell(k).parse::<usize>().map_err(|_| unread(k, "a whole number"));
        let name = cell(file);
        let plain = !name.is_empty() && !name.contains(['/', '\\']) && name != "..";
        rows.push(Row {
            line,
            numbers: [number(x)?, number(y)?, number(z)?, number(heading)?],
            file: if plain { name.to_owned() } else { return Err(unread(file, "the name of a picture beside the table")) },
            grid: grid.map(|[x, y, z]| Ok::<_, Error>([index(x)?, index(y)?, index(z)?])).transpose()?,
        });
    }
    if rows.is_empty() {
        return Err(fault("found no row, expected one for each picture".to_owned()));
    }
    Ok(rows)
}

/// What the metadata say otherwise than the table.
fn disagreements(rows: &[Row], text: &str, path: &Path) -> Vec<String> {
    let values = yaml::flatten(text);
    let numbers =
        |key: &str| -> Option<Vec<f64>> { values.get(&format!("metadata.{key}"))?.iter().map(|v| v.parse().ok()).collect() };
    let mut warnings = Vec::new();
    let mut warn = |what: String| warnings.push(format!("{}: {what}; the table {ENTRIES} is right", path.display()));
    let kind = values.get("metadata.type").and_then(|v| v.first()).map(String::as_str);
    let places: Vec<([usize; 3], [f64; 4])> = rows.iter().filter_map(|r| Some((r.grid?, r.numbers))).collect();
    match kind {
        Some("grid") if places.is_empty() => warn(format!("type is grid, but there is no {}", GRID.join(", "))),
        Some("route") if !places.is_empty() => warn("type is route, but places of a grid are given".to_owned()),
        Some("grid" | "route") => {}
        other => warn(format!("type is `{}`, neither grid nor route", other.unwrap_or_default())),
    }
    if places.is_empty() {
        return warnings;
    }
    let size = numbers("grid.size");
    let counted: [usize; 3] =
        std::array::from_fn(|axis| places.iter().map(|(place, _)| place[axis]).collect::<BTreeSet<usize>>().len());
    if let Some(size) = size.filter(|size| size.iter().zip(counted).any(|(told, counted)| *told as usize != counted)) {
        warn(format!("grid.size is {size:?}, but there are {counted:?} places along the axes"));
    }
    if let (Some(begin), Some(step)) = (numbers("grid.beginAtMM"), numbers("grid.separationMM")) {
        let first = |axis: usize| places.iter().map(|(place, _)| place[axis]).min().unwrap_or(0);
        let off = places.iter().find(|(place, at)| {
            (0..2).any(|axis| {
                let (Some(begin), Some(step)) = (begin.get(axis), step.get(axis)) else { return false };
                let told = begin + step * (place[axis] - first(axis)) as f64;
                (told - at[axis]).abs() > SLACK_MM
            })
        });
        if let Some((place, at)) = off {
            warn(format!("beginAtMM {begin:?} and separationMM {step:?} do not lead to place {place:?} at {:?} mm", &at[..2]));
        }
    }
    warnings
}
