//! Many worlds, named in one line: `office:1..500,flat:7,rooms/,worlds/lab.toml`.
//!
//! A source holds names, not worlds: each world is made or loaded when it is asked for, so that memory does not grow with their
//! number. The order is that of the line; within a folder it is that of the files' names.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use super::World;
use super::generate::Kind;
use crate::error::{Error, Result};
use crate::storage::io_error;

/// Most worlds of a source.
const MOST: u64 = 100_000_000;

/// Many worlds.
///
/// ```
/// use wayhome::world::WorldSource;
///
/// let source = WorldSource::parse("office:1..500,lab")?;
/// assert_eq!(source.len(), 501);
/// assert_eq!(source.get(16).map(|w| w.argument), Some("office:17".to_owned()));
/// assert_eq!(source.open(500)?.spec.name, "lab");
/// # Ok::<(), wayhome::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorldSource {
    parts: Vec<Part>,
}

/// What stands between two commas.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Part {
    Generated {
        kind: Kind,
        seeds: RangeInclusive<u64>,
    },
    Files(Vec<PathBuf>),
    /// A file, or the name of a built-in world.
    One(String),
}

/// One world of a source, before it is made or loaded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorldName {
    /// The kind of a generated world, the folder of a file in one, or what was typed: by this, results are grouped.
    pub group: String,
    /// What [`World::open`] takes: `office:17`, a path, or a built-in name.
    pub argument: String,
}

impl WorldSource {
    /// Reads `KIND:SEED`, `KIND:FIRST..LAST` (both included), folders, files and names of built-in worlds, separated by commas. In a
    /// folder those files are meant whose names end in `.toml` or `.json`.
    ///
    /// # Errors
    /// When a part is none of these, a range of seeds falls, a folder cannot be read or holds no world, or there are too many
    /// worlds. Whether a world is sound is not looked at.
    pub fn parse(text: &str) -> Result<Self> {
        let parts: Vec<Part> = text.split(',').map(|part| read(part.trim())).collect::<Result<_>>()?;
        if let Some(k) = (1..parts.len()).find(|&k| parts[..k].contains(&parts[k])) {
            let twice = text.split(',').nth(k).unwrap_or_default().trim();
            return Err(invalid(&format!("{twice} twice"), "each world once"));
        }
        let count: u64 = parts.iter().map(Part::len).fold(0, u64::saturating_add);
        if count > MOST {
            return Err(invalid(&format!("{count} worlds"), &format!("at most {MOST}")));
        }
        Ok(Self { parts })
    }

    /// How many worlds.
    #[must_use]
    pub fn len(&self) -> usize {
        self.parts.iter().map(Part::len).sum::<u64>() as usize // at most `MOST`
    }

    /// Whether there are none; never so after [`WorldSource::parse`].
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// World number `k`, from 0.
    #[must_use]
    pub fn get(&self, k: usize) -> Option<WorldName> {
        let mut k = k as u64;
        for part in &self.parts {
            if k < part.len() {
                return Some(part.get(k));
            }
            k -= part.len();
        }
        None
    }

    /// All worlds in order.
    pub fn iter(&self) -> impl Iterator<Item = WorldName> + '_ {
        self.parts.iter().flat_map(|part| (0..part.len()).map(move |k| part.get(k)))
    }

    /// Makes or loads world number `k`.
    ///
    /// # Errors
    /// When there is no such number, and as [`World::open`].
    pub fn open(&self, k: usize) -> Result<World> {
        let count = self.len();
        let name = self.get(k).ok_or_else(|| invalid(&format!("world number {k}"), &format!("0 to {}", count.max(1) - 1)))?;
        World::open(&name.argument)
    }
}

impl Part {
    fn len(&self) -> u64 {
        match self {
            Self::Generated { seeds, .. } => (seeds.end() - seeds.start()).saturating_add(1),
            Self::Files(files) => files.len() as u64,
            Self::One(_) => 1,
        }
    }

    /// World number `k`, which there is.
    fn get(&self, k: u64) -> WorldName {
        match self {
            Self::Generated { kind, seeds } => {
                WorldName { group: kind.name().to_owned(), argument: format!("{kind}:{}", seeds.start() + k) }
            }
            Self::Files(files) => {
                let path = &files[k as usize];
                let folder = path.parent().map(|p| p.display().to_string()).unwrap_or_default();
                WorldName { group: folder, argument: path.display().to_string() }
            }
            Self::One(argument) => WorldName { group: argument.clone(), argument: argument.clone() },
        }
    }
}

fn read(part: &str) -> Result<Part> {
    let path = Path::new(part);
    if path.is_dir() {
        return folder(path).map(Part::Files);
    }
    if path.is_file() || World::builtin_names().contains(&part) {
        return Ok(Part::One(part.to_owned()));
    }
    let Some((kind, seeds)) = part.split_once(':') else {
        let allowed = "KIND:SEED, KIND:FIRST..LAST, a folder or file of worlds, or a built-in world";
        return Err(invalid(part, &format!("{allowed}: {}", World::builtin_names().join(", "))));
    };
    let kind: Kind = kind.parse()?;
    let number = |text: &str| text.trim().parse::<u64>().ok();
    let ends = match seeds.split_once("..") {
        Some((first, last)) => number(first).zip(number(last)),
        None => number(seeds).map(|seed| (seed, seed)),
    };
    match ends {
        Some((first, last)) if first <= last => Ok(Part::Generated { kind, seeds: first..=last }),
        Some((first, last)) => Err(invalid(part, &format!("seeds that rise: {kind}:{last}..{first}"))),
        None => Err(invalid(part, &format!("a seed or a range of them: {kind}:7, {kind}:1..500"))),
    }
}

/// World files of a folder, by their names.
fn folder(path: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(path).map_err(io_error("read folder", path))? {
        let file = entry.map_err(io_error("read folder", path))?.path();
        let is_world = file.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml") || e.eq_ignore_ascii_case("json"));
        if is_world && file.is_file() {
            files.push(file);
        }
    }
    files.sort();
    if files.is_empty() {
        return Err(invalid(&format!("{}, without a world", path.display()), "a folder with world files (.toml, .json)"));
    }
    Ok(files)
}

fn invalid(found: &str, allowed: &str) -> Error {
    Error::Invalid { what: "worlds".to_owned(), found: found.to_owned(), allowed: allowed.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worlds_come_in_order_one_at_a_time() {
        let base = tempfile::tempdir().unwrap();
        let lab = World::open("lab").unwrap().spec.to_toml();
        for name in ["b.toml", "a.toml", "notes.md"] {
            std::fs::write(base.path().join(name), &lab).unwrap();
        }
        let source = WorldSource::parse(&format!("bare:3..5, {},crowd", base.path().display())).unwrap();
        let arguments: Vec<String> = source.iter().map(|w| w.argument).collect();
        let file = |name: &str| base.path().join(name).display().to_string();
        assert_eq!(arguments, ["bare:3", "bare:4", "bare:5", &file("a.toml"), &file("b.toml"), "crowd"]);
        for (k, argument) in arguments.iter().enumerate() {
            assert_eq!(&source.get(k).unwrap().argument, argument);
        }
        let names: Vec<String> = [0, 3, 5].map(|k| source.open(k).unwrap().spec.name).into();
        assert_eq!((source.len(), names), (6, vec!["bare-3".to_owned(), "lab".to_owned(), "crowd".to_owned()]));
        assert!(source.get(6).is_none() && source.open(6).unwrap_err().to_string().contains("0 to 5"));
    }

    #[test]
    fn what_is_no_source_is_named() {
        let base = tempfile::tempdir().unwrap();
        let empty = base.path().display().to_string();
        for (text, wanted) in [
            ("office:9..3", "office:3..9"),
            ("office:x", "office:7"),
            ("ofice:1..3", "did you mean office?"),
            ("nowhere", "KIND:FIRST..LAST"),
            ("lab,lab", "lab twice"),
            ("bare:0..18446744073709551615", "at most 100000000"),
            (empty.as_str(), "without a world"),
            ("", "KIND:SEED"),
        ] {
            let message = WorldSource::parse(text).unwrap_err().to_string();
            assert!(message.contains(wanted), "{text}: {message}");
        }
    }
}
