//! Reading maps: the description in YAML and the image that it names, or an image alone.
//!
//! What becomes of a pixel is what `nav2_map_server` makes of it, down to its single precision.

use std::path::{Path, PathBuf};

use strum::{EnumString, VariantNames};
use yaml_rust2::{Yaml, YamlLoader};

use super::{FREE, Map, OCCUPIED, UNKNOWN, UNKNOWN_GREY};
use crate::error::{Error, Result};
use crate::geometry::Pose;
use crate::storage::io_error;
use crate::world::picture::{self, Picture};

/// Least edge of a cell, m: walls of a world are no thinner.
pub const FINEST_M: f64 = 0.005;
/// Greatest edge of a cell, m.
pub const COARSEST_M: f64 = 5.0;
/// Longest description, bytes.
const MOST_BYTES: u64 = 1 << 20;
/// Keys of a description, in the order in which `map_saver` writes them.
const KEYS: [&str; 7] = ["image", "mode", "resolution", "origin", "negate", "occupied_thresh", "free_thresh"];

/// What a pixel says.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, EnumString, VariantNames)]
#[strum(serialize_all = "lowercase")]
enum Mode {
    /// Free, occupied or unknown, by the thresholds.
    #[default]
    Trinary,
    /// The same, with the probability of what lies between the thresholds.
    Scale,
    /// The value of the cell itself.
    Raw,
}

/// A description of a map.
struct Description {
    image: PathBuf,
    mode: Mode,
    resolution_m: f64,
    origin: Pose,
    negate: bool,
    occupied_least: f64,
    free_most: f64,
}

/// Whether a file's name says that it is a description of a map, not an image.
#[must_use]
pub fn is_description(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"))
}

impl Map {
    /// Reads a map as `map_server` of ROS and Nav2 keep it: a description in YAML, which names an image beside it.
    ///
    /// # Errors
    /// When one of the two cannot be read, a key is missing or unknown, or a value is not allowed.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = std::fs::metadata(path).map_err(io_error("read", path))?.len();
        if bytes > MOST_BYTES {
            return Err(fault(
                path,
                "file",
                &format!("{bytes} bytes"),
                &format!("a description of at most {MOST_BYTES} bytes"),
            ));
        }
        let text = std::fs::read_to_string(path).map_err(io_error("read", path))?;
        let about = describe(&text, path)?;
        let image = path.parent().unwrap_or(Path::new("")).join(&about.image);
        let picture = picture_at(&image)?;
        let cells = from_bottom(&picture).map(|pixel| about.cell(pixel)).collect();
        let percent = |share: f64| 100.0 * share;
        let (free_most, occupied_least) = match about.mode {
            Mode::Raw => (percent(about.free_most).floor() as i8, percent(about.occupied_least).ceil() as i8),
            Mode::Trinary | Mode::Scale => (FREE, OCCUPIED),
        };
        let (columns, rows) = (picture.width as usize, picture.height as usize);
        let map = Self::new(columns, rows, about.resolution_m, about.origin, cells);
        Ok(Self { free_most, occupied_least, warnings: about.warnings(&picture), ..map })
    }

    /// Reads a floor plan: dark pixels are walls, all others are free. The plan's lower left corner is the origin.
    ///
    /// # Errors
    /// When the image cannot be read.
    pub fn load_plan(path: &Path, resolution_m: f64) -> Result<Self> {
        let picture = picture_at(path)?;
        // What is transparent shows white paper.
        let is_dark = |[r, g, b, a]: [u8; 4]| (u32::from(grey([r, g, b])) * u32::from(a)) / 255 + 255 - u32::from(a) < 128;
        let cells = from_bottom(&picture).map(|pixel| if is_dark(pixel) { OCCUPIED } else { FREE }).collect();
        let map = Self::new(picture.width as usize, picture.height as usize, resolution_m, Pose::IDENTITY, cells);
        Ok(Self { drawn: true, ..map })
    }
}

impl Description {
    /// The value of a cell whose pixel is this.
    fn cell(&self, [r, g, b, alpha]: [u8; 4]) -> i8 {
        let grey = grey([r, g, b]);
        if self.mode == Mode::Raw {
            return if grey <= OCCUPIED as u8 { grey as i8 } else { UNKNOWN };
        }
        if alpha < u8::MAX {
            return UNKNOWN;
        }
        let share = f32::from(grey) / 255.0;
        let occupancy = if self.negate { share } else { 1.0 - share };
        let (free_most, occupied_least) = (self.free_most as f32, self.occupied_least as f32);
        if occupancy <= free_most {
            FREE
        } else if occupancy >= occupied_least {
            OCCUPIED
        } else if self.mode == Mode::Scale {
            ((occupancy - free_most) / (occupied_least - free_most) * 100.0).round() as i8
        } else {
            UNKNOWN
        }
    }

    /// Greys that `map_saver` writes for the unknown and that the thresholds make free. They come where one program wrote the image
    /// and another the description.
    fn warnings(&self, picture: &Picture) -> Vec<String> {
        let is_unknown = |p: &&[u8]| grey([p[0], p[1], p[2]]) == UNKNOWN_GREY;
        let count = picture.rgba.chunks_exact(4).filter(is_unknown).count();
        let [occupied, free] = [self.occupied_least, self.free_most];
        if self.mode == Mode::Raw || self.cell([UNKNOWN_GREY, UNKNOWN_GREY, UNKNOWN_GREY, 255]) != FREE || count == 0 {
            return Vec::new();
        }
        vec![format!(
            "{count} pixels have the grey {UNKNOWN_GREY}, which map_saver writes for unknown cells; with free_thresh {free} and \
             occupied_thresh {occupied} they are free, in Nav2 too. With free_thresh 0.196 they are unknown"
        )]
    }
}

/// Brightness of a colour, by the weights of television (ITU-R BT.601), which image libraries take for greys.
fn grey([r, g, b]: [u8; 3]) -> u8 {
    ((306 * u32::from(r) + 601 * u32::from(g) + 117 * u32::from(b) + 512) >> 10) as u8
}

/// The pixels of a picture, the lowest row first.
fn from_bottom(picture: &Picture) -> impl Iterator<Item = [u8; 4]> + '_ {
    let rows = picture.rgba.chunks_exact(4 * picture.width as usize).rev();
    rows.flat_map(|row| row.chunks_exact(4).map(|p| [p[0], p[1], p[2], p[3]]))
}

fn picture_at(path: &Path) -> Result<Picture> {
    let bytes = std::fs::metadata(path).map_err(io_error("read", path))?.len();
    if bytes > picture::MOST_BYTES {
        let allowed = format!("a file of at most {} bytes", picture::MOST_BYTES);
        return Err(fault(path, "image", &format!("{bytes} bytes"), &allowed));
    }
    let bytes = std::fs::read(path).map_err(io_error("read", path))?;
    picture::decode(&bytes).map_err(|(found, allowed)| fault(path, "image", &found, &allowed))
}

fn describe(text: &str, path: &Path) -> Result<Description> {
    let documents = YamlLoader::load_from_str(text).map_err(|e| fault(path, "file", &e.to_string(), "YAML"))?;
    let known = KEYS.join(", ");
    let Some(Yaml::Hash(table)) = documents.first() else {
        return Err(fault(path, "file", "no table of keys and values", &known));
    };
    for key in table.keys() {
        if !key.as_str().is_some_and(|key| KEYS.contains(&key)) {
            return Err(fault(path, &shown(key), "an unknown key", &known));
        }
    }
    let value = |key: &str| table.get(&Yaml::String(key.to_owned()));
    let needed = |key: &'static str| value(key).ok_or_else(|| fault(path, key, "nothing", "a value; Nav2 asks for it too"));
    let number = |key: &'static str, low: f64, high: f64| {
        let value = needed(key)?;
        let allowed = format!("{low} to {high}");
        finite(value).filter(|v| (low..=high).contains(v)).ok_or_else(|| fault(path, key, &shown(value), &allowed))
    };
    let image = needed("image")?;
    let image = image.as_str().filter(|s| !s.is_empty()).ok_or_else(|| fault(path, "image", &shown(image), "a file"))?;
    let mode = match value("mode") {
        None => Mode::default(),
        Some(mode) => {
            let named = mode.as_str().and_then(|name| name.parse().ok());
            named.ok_or_else(|| fault(path, "mode", &shown(mode), &Mode::VARIANTS.join(", ")))?
        }
    };
    let origin = needed("origin")?;
    let numbers: Option<Vec<f64>> = origin.as_vec().and_then(|list| list.iter().map(finite).collect());
    let Some([x, y, yaw]) = numbers.and_then(|list| <[f64; 3]>::try_from(list).ok()) else {
        return Err(fault(path, "origin", &shown(origin), "[x, y, yaw]: two numbers in m, one in rad"));
    };
    let negate = needed("negate")?;
    let is_negated = match negate {
        Yaml::Integer(n) => Some(*n != 0),
        Yaml::Boolean(b) => Some(*b),
        _ => None,
    };
    let is_negated = is_negated.ok_or_else(|| fault(path, "negate", &shown(negate), "0, 1, false or true"))?;
    let (occupied_least, free_most) = (number("occupied_thresh", 0.0, 1.0)?, number("free_thresh", 0.0, 1.0)?);
    if free_most >= occupied_least {
        let allowed = format!("less than occupied_thresh, {occupied_least}");
        return Err(fault(path, "free_thresh", &free_most.to_string(), &allowed));
    }
    let resolution_m = number("resolution", FINEST_M, COARSEST_M)?;
    let origin = Pose::new(x, y, yaw);
    Ok(Description { image: image.into(), mode, resolution_m, origin, negate: is_negated, occupied_least, free_most })
}

fn finite(value: &Yaml) -> Option<f64> {
    let number = match value {
        Yaml::Integer(n) => Some(*n as f64),
        other => other.as_f64(),
    };
    number.filter(|v| v.is_finite())
}

/// A value in a few words, for a message.
fn shown(value: &Yaml) -> String {
    match value {
        Yaml::Real(text) => text.clone(),
        Yaml::Integer(n) => n.to_string(),
        Yaml::String(text) => format!("\"{text}\""),
        Yaml::Boolean(b) => b.to_string(),
        Yaml::Array(items) => format!("[{}]", items.iter().map(shown).collect::<Vec<_>>().join(", ")),
        Yaml::Hash(_) => "a table".to_owned(),
        _ => "nothing".to_owned(),
    }
}

fn fault(path: &Path, place: &str, found: &str, allowed: &str) -> Error {
    Error::Parse { path: path.to_owned(), message: format!("{place}: found {found}, allowed is {allowed}") }
}
