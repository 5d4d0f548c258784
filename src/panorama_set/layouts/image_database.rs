//! The BrainsOnBoard image database: a table of entries and a file of metadata beside the pictures. Lengths are millimetres,
//! headings degrees.
//!
//! Where the two disagree, as they do in real sets, the table wins and the reader says so.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

use crate::error::Result;
use crate::geometry::Pose;
use crate::panorama_set::document::{Document, GridDocument};
use crate::panorama_set::entry::{Entry, Frame, Names};
use crate::panorama_set::grid::Place;
use crate::panorama_set::layout::{Found, Layout, Search};
use crate::panorama_set::yaml;
use crate::storage::read_within;
use crate::table::{Row, Rows};

/// The table.
const ENTRIES: &str = "database_entries.csv";
/// The metadata.
const METADATA: &str = "database_metadata.yaml";

const POSITION: [&str; 4] = ["X [mm]", "Y [mm]", "Z [mm]", "Heading [degrees]"];
const FILENAME: &str = "Filename";
const GRID: [&str; 3] = ["Grid X", "Grid Y", "Grid Z"];
/// Positions of table and metadata may differ by this, mm.
const SLACK_MM: f64 = 1.0;

/// See [`super::LayoutKind::ImageDatabase`].
pub(super) struct ImageDatabase;

/// The grid of a set that is one in the sense of this layout: one picture a place.
fn grid_of(set: &Document) -> Option<&GridDocument> {
    set.grid.as_ref().filter(|_| set.heading_rad.is_some())
}

/// Name of a frame's picture, without its ending.
fn stem(frame: &Frame, set: &Document) -> String {
    if grid_of(set).is_none() {
        return format!("image_{:06}", frame.spot);
    }
    let mm = |m: f64| (1000.0 * m).round() as i64;
    format!("image_{:+07}_{:+07}_{:+07}", mm(frame.robot.x), mm(frame.robot.y), mm(set.camera_height_m))
}

impl Layout for ImageDatabase {
    fn about_files(&self) -> &'static str {
        "Each condition's folder is an image database: `database_entries.csv` (mm and degrees), `database_metadata.yaml` and the \
         pictures; range and instances of each lie in `truth/CONDITION/`."
    }

    fn refuses(&self, grid: Option<&GridDocument>, _one_heading: bool) -> Option<(String, &'static str)> {
        let close = grid.filter(|g| g.spacing_m < 0.001)?;
        Some((format!("places {} m apart", close.spacing_m), "0.001 m or more: names count millimetres"))
    }

    fn names(&self, frame: &Frame, set: &Document) -> Names {
        let stem = stem(frame, set);
        Names::with_truth_aside(format!("{}/{stem}.png", frame.condition), &frame.condition, &stem)
    }

    fn lists(&self, set: &Document, frames: &dyn Fn(usize) -> Vec<Frame>) -> Vec<(String, String)> {
        let taken = set.conditions.iter().enumerate().filter(|(_, condition)| condition.frames > 0);
        let lists = taken.flat_map(|(k, condition)| {
            let file = |name: &str| format!("{}/{name}", condition.name);
            [(file(ENTRIES), entries_csv(&frames(k), set)), (file(METADATA), metadata_yaml(set))]
        });
        lists.collect()
    }

    fn holds(&self, folder: &Path) -> Result<bool> {
        Ok(folder.join(ENTRIES).is_file())
    }

    fn find(&self, search: &Search<'_>) -> Result<Found> {
        let rows = read_table(search)?;
        let corner = rows.iter().filter_map(|r| r.grid).fold((usize::MAX, 0), |(x, y), [gx, gy, _]| (x.min(gx), y.max(gy)));
        let (x0, y1) = search.grid.map_or(corner, |g| (0, corner.1.max(g.rows - 1)));
        let entry = |row: &Entered| {
            let [x, y, _, heading_deg] = row.numbers;
            let pose = Pose::new(x / 1000.0, y / 1000.0, heading_deg.to_radians());
            Entry {
                place: row.grid.map(|[x, y, _]| Place { i: y1 - y, j: x - x0 }),
                pose: pose.is_finite().then_some(pose),
                ..search.entry_with_truth_aside(search.folder.join(&row.file))
            }
        };
        let mut found = Found::new(rows.iter().map(entry).collect());
        let path = search.folder.join(METADATA);
        if search.grid.is_some() {
            // Our own sets agree with themselves; places that were left out are no disagreement.
        } else if path.exists() {
            found.warnings = disagreements(&rows, &search.text(&path)?, &path);
        } else {
            found.warnings.push(format!("{} is missing", path.display()));
        }
        Ok(found)
    }
}

/// The table of a condition's frames.
fn entries_csv(frames: &[Frame], set: &Document) -> String {
    let mut text = [&POSITION[..], &[FILENAME]].concat().join(", ");
    let grid = grid_of(set);
    if grid.is_some() {
        let _ = write!(text, ", {}", GRID.join(", "));
    }
    text.push('\n');
    for frame in frames {
        let (p, z) = (frame.robot, 1000.0 * set.camera_height_m);
        let numbers = (1000.0 * p.x, 1000.0 * p.y, z, p.heading.to_degrees());
        let _ = write!(text, "{}, {}, {}, {}, {}.png", numbers.0, numbers.1, numbers.2, numbers.3, stem(frame, set));
        if let (Some(grid), Some(place)) = (grid, frame.place) {
            let _ = write!(text, ", {}, {}, 0", place.j, grid.rows - 1 - place.i);
        }
        text.push('\n');
    }
    text
}

/// The metadata of a set; the same for all conditions.
fn metadata_yaml(set: &Document) -> String {
    let mut text = format!(
        "%YAML:1.0\n---\nmetadata:\n   time: \"not recorded: rendered by wayhome {}\"\n   type: {}\n",
        set.version,
        if grid_of(set).is_some() { "grid" } else { "route" }
    );
    if let Some(grid) = grid_of(set) {
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

/// A row of the table.
struct Entered {
    /// x, y, z (mm) and heading (degrees); blank is NaN.
    numbers: [f64; 4],
    file: String,
    grid: Option<[usize; 3]>,
}

fn read_table(search: &Search<'_>) -> Result<Vec<Entered>> {
    let path = search.folder.join(ENTRIES);
    let table = Rows::parse(&read_within(search.root, &path)?, &path, "picture")?;
    let columns = all(POSITION.map(|name| table.needed(&[name])))?;
    let file = table.needed(&[FILENAME])?;
    let grid = match GRID.map(|name| table.column(&[name])) {
        [None, None, None] => None,
        [Some(x), Some(y), Some(z)] => Some([x, y, z]),
        _ => return Err(table.fault(&format!("line 1: expected all of {} or none of them", GRID.join(", ")))),
    };
    let number =
        |cell: &str| if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok().filter(|v: &f64| !v.is_infinite()) };
    let read = |row: Row<'_>| -> Result<Entered> {
        let plain = |name: &str| !name.is_empty() && !name.contains(['/', '\\']) && name != "..";
        let entered = Entered {
            numbers: all(columns.map(|k| row.value(k, "a number or nothing", number)))?,
            file: row.value(file, "the name of a picture beside the table", |name| plain(name).then(|| name.to_owned()))?,
            grid: grid.map(|all_axes| all(all_axes.map(|k| row.value(k, "a whole number", |n| n.parse().ok())))).transpose()?,
        };
        if !search.folder.join(&entered.file).is_file() {
            let found = &entered.file;
            return Err(table.fault(&format!("line {}: found `{found}`, which is no file beside it", row.line())));
        }
        Ok(entered)
    };
    table.rows().map(read).collect()
}

/// All of some values, or the first fault.
fn all<T: Copy + Default, const N: usize>(values: [Result<T>; N]) -> Result<[T; N]> {
    let mut got = [T::default(); N];
    for (slot, value) in got.iter_mut().zip(values) {
        *slot = value?;
    }
    Ok(got)
}

/// What the metadata say otherwise than the table.
fn disagreements(rows: &[Entered], text: &str, path: &Path) -> Vec<String> {
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
        let first = [0, 1].map(|axis| places.iter().map(|(place, _)| place[axis]).min().unwrap_or(0));
        let off = places.iter().find(|(place, at)| {
            (0..2).any(|axis| {
                let (Some(begin), Some(step)) = (begin.get(axis), step.get(axis)) else { return false };
                let told = begin + step * (place[axis] - first[axis]) as f64;
                (told - at[axis]).abs() > SLACK_MM
            })
        });
        if let Some((place, at)) = off {
            warn(format!("beginAtMM {begin:?} and separationMM {step:?} do not lead to place {place:?} at {:?} mm", &at[..2]));
        }
    }
    warnings
}
