//! Study files: what a person writes, read and checked as a whole before anything runs; all faults come at once.

use std::ops::RangeInclusive;
use std::path::Path;

use strum::VariantArray;

use super::design::{Design, SOBOL_AXES};
use super::settings;
use super::spec::{Axis, Levels, MOST_EPISODES, Study};
use super::value::Value;
use crate::document::{Node, Value as Read};
use crate::episode::Setup;
use crate::error::{Error, Result};
use crate::fault::Fault;
use crate::render::RendererChoice;
use crate::storage::io_error;
use crate::world::WorldSource;

/// Studies that the program carries with it, as (name, TOML text).
const BUILTIN: [(&str, &str); 6] = [
    ("slip-occlusion", include_str!("../../../worlds/studies/slip-occlusion.toml")),
    ("wet-hall", include_str!("../../../worlds/studies/wet-hall.toml")),
    ("light-camera", include_str!("../../../worlds/studies/light-camera.toml")),
    ("faults-sobol", include_str!("../../../worlds/studies/faults-sobol.toml")),
    ("robustness", include_str!("../../../worlds/studies/robustness.toml")),
    ("rooms", include_str!("../../../worlds/studies/rooms.toml")),
];

impl Study {
    /// Opens a study by what a person typed: the path of a file if there is one, else the name of a built-in study. `seeds`
    /// replaces the file's.
    ///
    /// # Errors
    /// When there is neither, the file cannot be read, or it has faults; all that can be found at once come at once.
    pub fn open(argument: &str, seeds: Option<RangeInclusive<u64>>) -> Result<Self> {
        let path = Path::new(argument);
        if path.is_file() {
            let text = std::fs::read_to_string(path).map_err(io_error("read", path))?;
            return Self::from_toml(&text, path, seeds);
        }
        let bare = argument.strip_prefix("worlds/studies/").unwrap_or(argument);
        let bare = bare.strip_suffix(".toml").unwrap_or(bare);
        match BUILTIN.iter().find(|(name, _)| *name == bare) {
            Some((name, text)) => Self::from_toml(text, Path::new(&format!("builtin:{name}")), seeds),
            None => Err(Error::Invalid {
                what: "study".into(),
                found: format!("{argument}, which is no file"),
                allowed: format!("a study file, or a built-in study: {}", Self::builtin_names().join(", ")),
            }),
        }
    }

    /// Names of the built-in studies.
    pub fn builtin_names() -> Vec<&'static str> {
        BUILTIN.iter().map(|(name, _)| *name).collect()
    }

    /// Checks a study given as text. `source` names it in messages; a world is looked for in its folder, too.
    ///
    /// # Errors
    /// As [`Study::open`].
    pub fn from_toml(text: &str, source: &Path, seeds: Option<RangeInclusive<u64>>) -> Result<Self> {
        let tree = Node::from_toml(text, source)?;
        let study = Reader::new(source).read(&tree, text, seeds)?;
        study.check(&tree, source)?;
        Ok(study)
    }

    /// Sets every level of every axis once, beside the first levels of the others.
    fn check(&self, tree: &Node, source: &Path) -> Result<()> {
        let mut first = self.values(0);
        if self.design == Design::OneAtATime {
            let others = (0..first.len()).filter(|k| Some(*k) != self.compared());
            others.for_each(|k| first[k] = Value::Unset);
        }
        let try_out = |values: &[Value]| self.case(values, *self.seeds.start()).and_then(|(_, setup)| setup.check());
        if let Err(error) = try_out(&first) {
            let line = self.axes.iter().zip(0..).find_map(|(axis, k)| {
                let named = matches!(&error, Error::Invalid { what, .. } if *what == axis.setting);
                named.then(|| tree.locate(&format!("axes[{k}]")).0)
            });
            return Err(at_place(source, "the study's settings", line.flatten(), &error));
        }
        for (k, axis) in self.axes.iter().enumerate() {
            let levels = match &axis.levels {
                Levels::Listed(values) => values.clone(),
                Levels::Between { low, high, .. } => vec![Value::Real(*low), Value::Real(*high)],
            };
            for level in levels {
                let mut values = first.clone();
                values[k] = level.clone();
                if let Err(error) = try_out(&values) {
                    let line = tree.locate(&format!("axes[{k}].values")).0;
                    return Err(at_place(source, &format!("axis {} at {level}", axis.setting), line, &error));
                }
            }
        }
        Ok(())
    }
}

fn at_place(source: &Path, place: &str, line: Option<usize>, error: &Error) -> Error {
    let line = line.map_or_else(String::new, |line| format!("line {line}: "));
    let cause = std::error::Error::source(error).map_or_else(String::new, |cause| format!(": {cause}"));
    Error::Parse { path: source.to_owned(), message: format!("{line}{place}: {error}{cause}") }
}

/// Reads the file's tree and gathers its faults.
struct Reader<'a> {
    source: &'a Path,
    faults: Vec<Fault>,
}

/// Fields of the file, and of an axis.
const FIELDS: [&str; 10] = ["name", "description", "world", "seed", "seeds", "design", "points", "settings", "axes", "compare"];
/// The setting that is the world.
const WORLD: &str = "world";
const AXIS_FIELDS: [&str; 6] = ["setting", "label", "values", "from", "to", "scale"];

impl<'a> Reader<'a> {
    fn new(source: &'a Path) -> Self {
        Self { source, faults: Vec::new() }
    }

    /// The study, if it has no faults. Whether its settings go together is not checked.
    ///
    /// # Errors
    /// All faults that can be found at once.
    fn read(mut self, tree: &Node, text: &str, seeds: Option<RangeInclusive<u64>>) -> Result<Study> {
        match self.study(tree, text, seeds) {
            Some(study) if self.faults.is_empty() => Ok(study),
            _ => Err(self.error()),
        }
    }

    fn error(self) -> Error {
        let mut faults = self.faults;
        faults.sort_by_key(|f| f.line);
        Error::World { path: self.source.to_owned(), faults }
    }

    fn fault(&mut self, tree: &Node, place: &str, found: impl Into<String>, allowed: impl Into<String>) {
        let line = tree.locate(place).0;
        let (place, found, allowed) = (place.to_owned(), found.into(), allowed.into());
        self.faults.push(Fault { place, found, allowed, owner: None, line });
    }

    fn study(&mut self, tree: &Node, text: &str, seeds: Option<RangeInclusive<u64>>) -> Option<Study> {
        self.known(tree, tree, "", &FIELDS);
        let name = self.text(tree, "name")?.to_owned();
        if name.is_empty() || !name.chars().all(|c| c.is_alphanumeric() || "-_".contains(c)) {
            self.fault(tree, "name", format!("\"{name}\""), "letters, digits, - and _");
        }
        let (world, own_seeds, files) = self.world(tree)?;
        let seeds = match (seeds, own_seeds) {
            (Some(seeds), _) => seeds,
            (None, Some(own)) => {
                if tree.get("seeds").is_some() && self.seeds(tree, "seeds")? != own {
                    self.fault(tree, "seeds", "other seeds than those of `world`", "one of the two, or the same");
                }
                own
            }
            (None, None) => self.seeds(tree, "seeds")?,
        };
        let world_sha256 = match settings::open(&world, *seeds.start()).and_then(|draft| draft.world()) {
            Ok(world) => world.sha256,
            Err(error) => {
                self.fault(tree, "world", format!("\"{world}\""), error.to_string());
                return None;
            }
        };
        let design = match tree.get("design") {
            None => Design::Grid,
            Some(node) => match node.text().and_then(|name| name.parse().ok()) {
                Some(design) => design,
                None => {
                    let names: Vec<String> = Design::VARIANTS.iter().map(|design| format!("\"{design}\"")).collect();
                    self.fault(tree, "design", node.describe(), format!("one of {}", names.join(", ")));
                    return None;
                }
            },
        };
        let settings = self.settings(tree);
        let mut axes = if files.is_empty() || tree.get("axes").is_some() { self.axes(tree) } else { Vec::new() };
        if !files.is_empty() {
            if axes.iter().any(|axis| axis.setting == WORLD) {
                self.fault(tree, "world", "a folder beside an axis \"world\"", "one of the two");
            }
            let values = files.into_iter().map(Value::Text).collect();
            axes.insert(0, Axis { setting: WORLD.to_owned(), label: WORLD.to_owned(), levels: Levels::Listed(values) });
        }
        let points = self.points(tree, design, &axes)?;
        let seed = self.whole(tree, "seed", 0)?;
        let compare = tree.get("compare").and_then(Node::text).unwrap_or("method").to_owned();
        if tree.get("compare").is_some() && !axes.iter().any(|axis| axis.setting == compare) {
            self.fault(tree, "compare", format!("\"{compare}\""), "the setting of an axis");
        }
        let description = tree.get("description").and_then(Node::text).unwrap_or_default().to_owned();
        let text = text.to_owned();
        // The CPU, so that rows are the same on a machine with a graphics card.
        let base = Setup { renderer: RendererChoice::Cpu, ..Setup::default() };
        let study =
            Study { name, description, world, world_sha256, seed, seeds, design, points, settings, axes, compare, text, base };
        match study.points.saturating_mul(study.combinations()).saturating_mul(study.episodes_per_cell()) {
            0 if !study.axes.is_empty() => {
                self.fault(tree, "axes", "nothing but the compared axis", "an axis beside it that takes its turn");
                None
            }
            1..=MOST_EPISODES => Some(study),
            _ => {
                self.fault(tree, "axes", "more episodes than that", format!("{MOST_EPISODES} episodes at most"));
                None
            }
        }
    }

    /// Refuses fields that there are not.
    fn known(&mut self, tree: &Node, table: &Node, place: &str, fields: &[&str]) {
        let Read::Table(entries) = &table.value else { return };
        for (key, _) in entries.iter().filter(|(key, _)| !fields.contains(&key.as_str())) {
            let place = if place.is_empty() { key.clone() } else { format!("{place}.{key}") };
            self.fault(tree, &place, "an unknown field", format!("one of {}", fields.join(", ")));
        }
    }

    fn text<'n>(&mut self, tree: &'n Node, field: &str) -> Option<&'n str> {
        let text = tree.get(field).and_then(Node::text);
        if text.is_none() {
            let found = tree.get(field).map_or_else(|| "nothing".to_owned(), Node::describe);
            self.fault(tree, field, found, "a text in quotes, which must be given");
        }
        text
    }

    fn whole(&mut self, tree: &Node, field: &str, usual: u64) -> Option<u64> {
        let Some(node) = tree.get(field) else { return Some(usual) };
        let number = if let Read::Integer(n) = node.value { u64::try_from(n).ok() } else { None };
        if number.is_none() {
            self.fault(tree, field, node.describe(), "a whole number from 0");
        }
        number
    }

    /// A world file beside the study file, or what `World::open` takes; a table that names a kind, of which each seed has a world, and
    /// perhaps the seeds; or one that names a folder, whose files are the levels of an axis.
    fn world(&mut self, tree: &Node) -> Option<(String, Option<RangeInclusive<u64>>, Vec<String>)> {
        let beside = |given: &str| self.source.parent().unwrap_or(Path::new("")).join(given);
        if let Some(node @ Node { value: Read::Table(_), .. }) = tree.get(WORLD) {
            let (kind, folder) = (node.get("generate"), node.get("folder"));
            self.known(tree, node, WORLD, &["generate", "seeds", "folder"]);
            return match (kind.and_then(Node::text), folder.and_then(Node::text)) {
                (Some(kind), None) => {
                    let own = if node.get("seeds").is_some() { Some(self.seeds(tree, "world.seeds")?) } else { None };
                    Some((format!("{kind}:seed"), own, Vec::new()))
                }
                (None, Some(given)) => {
                    let path = beside(given);
                    match WorldSource::parse(&path.to_string_lossy()) {
                        Ok(source) if path.is_dir() => {
                            let files: Vec<String> = source.iter().map(|world| world.argument).collect();
                            Some((files[0].clone(), None, files))
                        }
                        Ok(_) => {
                            self.fault(tree, "world.folder", format!("\"{given}\""), "a folder");
                            None
                        }
                        Err(error) => {
                            self.fault(tree, "world.folder", format!("\"{given}\""), error.to_string());
                            None
                        }
                    }
                }
                _ => {
                    let allowed = "generate = \"KIND\", perhaps with seeds = \"A..B\", or folder = \"FOLDER\"";
                    self.fault(tree, WORLD, node.describe(), allowed);
                    None
                }
            };
        }
        let given = self.text(tree, WORLD)?;
        let file = beside(given);
        Some((if file.is_file() { file.to_string_lossy().into_owned() } else { given.to_owned() }, None, Vec::new()))
    }

    fn seeds(&mut self, tree: &Node, place: &str) -> Option<RangeInclusive<u64>> {
        let node = place.split('.').try_fold(tree, |node, key| node.get(key));
        let range = node.and_then(Node::text).and_then(|text| {
            let (first, last) = text.split_once("..")?;
            let (first, last) = (first.parse::<u64>().ok()?, last.trim_start_matches('=').parse::<u64>().ok()?);
            (first <= last && last - first < MOST_EPISODES && last <= i64::MAX as u64).then_some(first..=last)
        });
        if range.is_none() {
            let found = node.map_or_else(|| "nothing".to_owned(), Node::describe);
            self.fault(tree, place, found, "\"A..B\", both included, the first not above the last, which must be given");
        }
        range
    }

    fn points(&mut self, tree: &Node, design: Design, axes: &[Axis]) -> Option<u64> {
        let sampled = axes.iter().filter(|axis| axis.levels.listed().is_empty()).count();
        if matches!(design, Design::Grid | Design::OneAtATime) {
            if tree.get("points").is_some() {
                self.fault(tree, "points", format!("points of design \"{design}\""), "none: it has its axes' levels");
            }
            if let Some(k) = axes.iter().position(|axis| axis.levels.listed().is_empty()) {
                let (place, found) = (format!("axes[{k}]"), format!("from and to in design \"{design}\""));
                self.fault(tree, &place, found, "values, or design = \"random\" or \"sobol\"");
            }
            return Some(1);
        }
        if sampled == 0 {
            self.fault(tree, "design", "no axis with from and to", "at least one in a random or Sobol design");
        }
        if design == Design::Sobol && sampled > SOBOL_AXES {
            self.fault(tree, "design", format!("{sampled} axes with from and to"), format!("{SOBOL_AXES} at most"));
        }
        let points = self.whole(tree, "points", 0)?;
        if points == 0 || points > 1 << 31 {
            self.fault(tree, "points", points.to_string(), "a whole number from 1 to 2147483648");
        }
        Some(points.max(1))
    }

    fn settings(&mut self, tree: &Node) -> Vec<(String, Value)> {
        let mut found = Vec::new();
        match tree.get("settings").map(|node| &node.value) {
            None => {}
            Some(Read::Table(entries)) => {
                for (key, node) in entries {
                    self.setting(tree, key, node, &mut found);
                }
            }
            Some(_) => self.fault(tree, "settings", "no table", "[settings] with a setting a line"),
        }
        found
    }

    /// A setting, or a table of settings that begin with the same words.
    fn setting(&mut self, tree: &Node, name: &str, node: &Node, found: &mut Vec<(String, Value)>) {
        if let Read::Table(entries) = &node.value {
            let inner = |key: &str| format!("{name}.{key}");
            // A table is a value of its own only in a list's entry, whose shape or texture is set as a whole.
            if !settings::exists(name) || settings::has_parts(name) {
                entries.iter().for_each(|(key, node)| self.setting(tree, &inner(key), node, found));
                return;
            }
        }
        match Value::read(node) {
            _ if !settings::exists(name) => {
                let (found, allowed) = ("no setting".to_owned(), settings::near(name));
                self.faults.push(Fault { place: format!("settings.{name}"), found, allowed, owner: None, line: node.line });
            }
            Some(value) => found.push((name.to_owned(), value)),
            None => self.fault(tree, &format!("settings.{name}"), node.describe(), "a number, a text, a list or a table"),
        }
    }

    fn axes(&mut self, tree: &Node) -> Vec<Axis> {
        let Some(node) = tree.get("axes") else {
            self.fault(tree, "axes", "nothing", "[[axes]], at least one");
            return Vec::new();
        };
        let Read::List(items) = &node.value else {
            self.fault(tree, "axes", node.describe(), "[[axes]], at least one");
            return Vec::new();
        };
        if items.is_empty() {
            self.fault(tree, "axes", "an empty list", "at least one axis");
        }
        let mut axes: Vec<Axis> = Vec::new();
        for (k, item) in items.iter().enumerate() {
            let place = format!("axes[{k}]");
            self.known(tree, item, &place, &AXIS_FIELDS);
            let Some(setting) = item.get("setting").and_then(Node::text) else {
                let found = item.get("setting").map_or_else(|| "nothing".to_owned(), Node::describe);
                self.fault(tree, &format!("{place}.setting"), found, "the name of a setting in quotes");
                continue;
            };
            if !settings::exists(setting) {
                self.fault(tree, &format!("{place}.setting"), format!("\"{setting}\""), settings::near(setting));
            }
            if axes.iter().any(|axis| axis.setting == setting) {
                self.fault(tree, &format!("{place}.setting"), format!("\"{setting}\" again"), "one axis a setting");
            }
            let Some(levels) = self.levels(tree, item, &place, setting) else { continue };
            let label = item.get("label").and_then(Node::text).unwrap_or(setting).to_owned();
            axes.push(Axis { setting: setting.to_owned(), label, levels });
        }
        axes
    }

    fn levels(&mut self, tree: &Node, item: &Node, place: &str, setting: &str) -> Option<Levels> {
        if let Some(node) = item.get("values") {
            let place = format!("{place}.values");
            let Read::List(nodes) = &node.value else {
                self.fault(tree, &place, node.describe(), "a list of values");
                return None;
            };
            if nodes.is_empty() {
                self.fault(tree, &place, format!("an empty list for axis \"{setting}\""), "at least one value");
                return None;
            }
            let mut values = Vec::new();
            for node in nodes {
                match Value::read(node) {
                    Some(value) if values.contains(&value) => {
                        self.fault(tree, &place, format!("{value} twice"), "each value once");
                    }
                    Some(value) => values.push(value),
                    None => self.fault(tree, &place, node.describe(), "numbers, texts, lists or tables"),
                }
            }
            return Some(Levels::Listed(values));
        }
        let number = |field: &str| item.get(field).and_then(Value::read).and_then(|value| value.number());
        let (low, high) = (number("from"), number("to"));
        let log = item.get("scale").and_then(Node::text) == Some("log");
        if let Some(scale) = item.get("scale").filter(|scale| !matches!(scale.text(), Some("log" | "linear"))) {
            self.fault(tree, &format!("{place}.scale"), scale.describe(), "\"linear\" or \"log\"");
        }
        match (low, high) {
            (Some(low), Some(high)) if low < high && (!log || low > 0.0) && (high - low).is_finite() => {
                Some(Levels::Between { low, high, log })
            }
            (Some(low), Some(high)) => {
                let allowed = if log { "from greater than 0 and less than to" } else { "from less than to" };
                self.fault(tree, place, format!("from {low} to {high}"), allowed);
                None
            }
            _ => {
                self.fault(tree, place, format!("an empty axis \"{setting}\""), "values = [...], or from and to as numbers");
                None
            }
        }
    }
}
