//! Knobs: what may be asked of a generated world, in which ranges it is drawn, and what was drawn.

use std::collections::BTreeMap;

use strum::{Display, EnumMessage, IntoStaticStr, VariantArray};

use super::dice::{Dice, hundredths, mm};
use super::kind::{Kind, did_you_mean, words};
use super::outline::Outline;
use crate::error::{Error, Result};
use crate::random::Seed;

/// The knob that takes names of outlines instead of numbers.
pub const OUTLINE: &str = "outline";

/// A knob that takes numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Display, EnumMessage, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "snake_case")]
pub enum Knob {
    /// Length of the room along x.
    LengthM,
    /// Width of the room along y; of a corridor, the passage's.
    WidthM,
    /// Height of the ceiling.
    HeightM,
    /// Rooms of a flat, as far as they fit.
    Rooms,
    /// Width of the doorways of a flat.
    DoorM,
    /// Distance from door to door of a corridor.
    DoorSpacingM,
    /// Width of the aisles between rows of shelves.
    AisleM,
    /// How much stands about: 0 nothing, 1 as much as leaves ways for the robot.
    Clutter,
    /// Share of surfaces with a pattern, and its strength: 0 plain, 1 patterns all round.
    Richness,
    /// Share of walls whose pattern repeats along them, and of things that look alike.
    Repetition,
    /// Brightness: ambient light and lamps; about 1 shows a texture's own colour.
    Light,
    /// Windows, fewer where walls have no room for them.
    Windows,
    /// Friction of the floor.
    Friction,
    /// Floor zones of another friction, as far as there is room.
    Zones,
    /// Friction of those zones.
    ZoneFriction,
    /// People who walk about, as far as there is room.
    Walkers,
    /// Height of the camera above the floor.
    CameraHeightM,
    /// Greatest distance of a random start from home.
    StartDistanceM,
}

impl Knob {
    /// All of them.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// How it is called on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Its unit; empty where it has none.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::LengthM
            | Self::WidthM
            | Self::HeightM
            | Self::DoorM
            | Self::DoorSpacingM
            | Self::AisleM
            | Self::CameraHeightM
            | Self::StartDistanceM => "m",
            _ => "",
        }
    }

    /// What it means, in a line.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        words(self.get_documentation())
    }

    /// Whether only whole numbers make sense.
    #[must_use]
    pub fn is_whole(self) -> bool {
        matches!(self, Self::Rooms | Self::Windows | Self::Zones | Self::Walkers)
    }

    /// The range that a room of a kind is drawn from, and the one that `--set` may ask for; `None` where the kind has no such knob.
    /// A mixture has none of its own.
    #[must_use]
    pub fn ranges(self, kind: Kind) -> Option<Ranges> {
        use Kind::{Bare, Corridor, Flat, Hall, Lab, Mixture, Office, Warehouse};
        let (low, high, least, most) = match (self, kind) {
            (_, Mixture) => return None,
            (Self::LengthM, Lab) => (5.5, 9.0, 3.5, 40.0),
            (Self::LengthM, Office) => (6.0, 11.0, 3.5, 60.0),
            (Self::LengthM, Flat) => (7.5, 12.0, 5.0, 40.0),
            (Self::LengthM, Corridor) => (12.0, 30.0, 5.0, 200.0),
            (Self::LengthM, Hall) => (12.0, 25.0, 8.0, 80.0),
            (Self::LengthM, Warehouse) => (14.0, 25.0, 8.0, 100.0),
            (Self::LengthM, Bare) => (4.5, 8.0, 3.0, 40.0),
            (Self::WidthM, Lab) => (4.5, 7.0, 3.0, 40.0),
            (Self::WidthM, Office) => (4.5, 8.0, 3.0, 40.0),
            (Self::WidthM, Flat) => (6.0, 9.0, 4.0, 30.0),
            (Self::WidthM, Corridor) => (1.6, 2.6, 1.3, 6.0),
            (Self::WidthM, Hall) => (12.0, 20.0, 8.0, 60.0),
            (Self::WidthM, Warehouse) => (10.0, 18.0, 7.0, 60.0),
            (Self::WidthM, Bare) => (4.0, 6.0, 3.0, 40.0),
            (Self::HeightM, Hall) => (4.0, 8.0, 2.4, 20.0),
            (Self::HeightM, Warehouse) => (4.5, 7.0, 2.4, 20.0),
            (Self::HeightM, _) => (2.5, 3.0, 2.4, 20.0),
            (Self::Rooms, Flat) => (3.0, 6.0, 2.0, 12.0),
            (Self::DoorM, Flat) => (0.8, 1.0, 0.6, 2.0),
            (Self::DoorSpacingM, Corridor) => (2.8, 4.5, 1.4, 20.0),
            (Self::AisleM, Warehouse) => (1.6, 2.8, 0.9, 6.0),
            (Self::Rooms | Self::DoorM | Self::DoorSpacingM | Self::AisleM, _) => return None,
            (Self::Clutter, Lab) => (0.35, 0.8, 0.0, 1.0),
            (Self::Clutter, Bare) => (0.1, 0.3, 0.0, 1.0),
            (Self::Clutter, _) => (0.25, 0.75, 0.0, 1.0),
            (Self::Richness, Lab) => (0.65, 1.0, 0.0, 1.0),
            (Self::Richness, Office) => (0.15, 0.45, 0.0, 1.0),
            (Self::Richness, Flat) => (0.3, 0.7, 0.0, 1.0),
            (Self::Richness, Corridor) => (0.1, 0.4, 0.0, 1.0),
            (Self::Richness, Hall) => (0.4, 0.8, 0.0, 1.0),
            (Self::Richness, Warehouse) => (0.4, 0.8, 0.0, 1.0),
            (Self::Richness, Bare) => (0.0, 0.15, 0.0, 1.0),
            (Self::Repetition, Lab | Bare) => (0.0, 0.1, 0.0, 1.0),
            (Self::Repetition, Office | Flat) => (0.1, 0.5, 0.0, 1.0),
            (Self::Repetition, Corridor) => (0.6, 1.0, 0.0, 1.0),
            (Self::Repetition, Hall) => (0.0, 0.3, 0.0, 1.0),
            (Self::Repetition, Warehouse) => (0.7, 1.0, 0.0, 1.0),
            (Self::Light, _) => (0.75, 1.1, 0.05, 3.0),
            (Self::Windows, Flat) => (2.0, 6.0, 0.0, 30.0),
            (Self::Windows, Office) => (1.0, 4.0, 0.0, 30.0),
            (Self::Windows, Corridor) => (2.0, 8.0, 0.0, 60.0),
            (Self::Windows, Hall) => (2.0, 8.0, 0.0, 60.0),
            (Self::Windows, Warehouse) => (0.0, 2.0, 0.0, 60.0),
            (Self::Windows, _) => (0.0, 2.0, 0.0, 30.0),
            (Self::Friction, _) => (0.5, 0.9, 0.02, 2.0),
            (Self::Zones, _) => (0.0, 2.0, 0.0, 12.0),
            (Self::ZoneFriction, _) => (0.15, 0.6, 0.02, 2.0),
            (Self::Walkers, Hall | Warehouse) => (0.0, 3.0, 0.0, 20.0),
            (Self::Walkers, Bare) => (0.0, 0.0, 0.0, 20.0),
            (Self::Walkers, _) => (0.0, 1.0, 0.0, 20.0),
            (Self::CameraHeightM, _) => (0.25, 0.6, 0.1, 1.8),
            (Self::StartDistanceM, Hall) => (8.0, 8.0, 1.0, 60.0),
            (Self::StartDistanceM, Corridor | Warehouse) => (5.0, 5.0, 1.0, 60.0),
            (Self::StartDistanceM, _) => (3.0, 3.0, 1.0, 60.0),
        };
        Some(Ranges { usual: [low, high], allowed: [least, most] })
    }
}

/// Ranges of a knob, low to high.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ranges {
    /// What a world is drawn from where nothing is asked for.
    pub usual: [f64; 2],
    /// What may be asked for.
    pub allowed: [f64; 2],
}

/// Outlines that a kind is drawn from, as often as they are listed.
#[must_use]
pub fn usual_outlines(kind: Kind) -> &'static [Outline] {
    use Outline::{Chamfered, L, Polygon, Rectangle, T};
    match kind {
        Kind::Lab => &[Rectangle, Rectangle, Rectangle, L, L, T, Chamfered, Polygon],
        Kind::Office => &[Rectangle, Rectangle, Rectangle, L, L, T, Chamfered],
        Kind::Flat => &[Rectangle, Rectangle, L, Chamfered],
        Kind::Corridor => &[Rectangle, Rectangle, L, T],
        Kind::Hall => &[Rectangle, Rectangle, L, T, Chamfered, Polygon],
        Kind::Warehouse => &[Rectangle, Rectangle, L],
        Kind::Bare | Kind::Mixture => &[Rectangle, Rectangle, L, Chamfered, Polygon],
    }
}

/// Outlines that a kind may be asked for.
fn allowed_outlines(kind: Kind) -> &'static [Outline] {
    match kind {
        Kind::Corridor => &[Outline::Rectangle, Outline::L, Outline::T],
        _ => Outline::ALL,
    }
}

/// What is asked of a generated world; what is not asked for is drawn from its usual range.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Knobs {
    ranges: BTreeMap<Knob, [f64; 2]>,
    outlines: Vec<Outline>,
}

impl Knobs {
    /// Asks for `text` as a person writes it: `clutter=0.5`, `length_m=6..8`, `outline=l,t`.
    ///
    /// # Errors
    /// When there is no such knob, the value is none, or the range is upside down. Whether a kind allows it is checked when a
    /// world is generated.
    pub fn set(&mut self, text: &str) -> Result<()> {
        let names = || Knob::ALL.iter().map(|k| k.name()).chain([OUTLINE]);
        let Some((name, value)) = text.split_once('=').map(|(name, value)| (name.trim(), value.trim())) else {
            return Err(invalid("--set", text, "KNOB=VALUE or KNOB=LOW..HIGH"));
        };
        if name == OUTLINE {
            let named = |word: &str| Outline::ALL.iter().copied().find(|o| o.name() == word.trim());
            let all = Outline::ALL.iter().map(|o| o.name()).collect::<Vec<_>>().join(", ");
            self.outlines = value
                .split(',')
                .map(|word| named(word).ok_or_else(|| invalid(OUTLINE, word, &format!("one or several of {all}"))))
                .collect::<Result<_>>()?;
            return Ok(());
        }
        let Some(&knob) = Knob::ALL.iter().find(|k| k.name() == name) else {
            let found = format!("{name}{}", did_you_mean(name, names()));
            return Err(invalid("knob", &found, &names().collect::<Vec<_>>().join(", ")));
        };
        let number = |word: &str| word.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let ends = match value.split_once("..") {
            Some((low, high)) => number(low).zip(number(high)),
            None => number(value).map(|x| (x, x)),
        };
        let Some((low, high)) = ends else {
            return Err(invalid(name, value, "a number, or two of them as low..high"));
        };
        if low > high {
            return Err(invalid(name, value, &format!("a range that rises: {high}..{low}")));
        }
        let (low, high) = if knob.is_whole() { (low.ceil(), high.floor()) } else { (low, high) };
        if low > high {
            return Err(invalid(name, value, "a range with a whole number in it"));
        }
        self.ranges.insert(knob, [low, high]);
        Ok(())
    }

    /// Whether everything is drawn from its usual range.
    #[must_use]
    pub fn is_usual(&self) -> bool {
        self.ranges.is_empty() && self.outlines.is_empty()
    }

    /// What was asked for, as a person writes it.
    #[must_use]
    pub fn settings(&self) -> Vec<String> {
        let ranges = self
            .ranges
            .iter()
            .map(|(knob, [low, high])| if low == high { format!("{knob}={low}") } else { format!("{knob}={low}..{high}") });
        let names: Vec<_> = self.outlines.iter().map(|o| o.name()).collect();
        ranges.chain((!names.is_empty()).then(|| format!("{OUTLINE}={}", names.join(",")))).collect()
    }

    /// Checks what was asked for against a kind; for a mixture, against all of them.
    ///
    /// # Errors
    /// When a kind has no such knob, or does not allow such values.
    pub fn check(&self, kind: Kind) -> Result<()> {
        if kind == Kind::Mixture {
            // A knob may be one of a few kinds only, but then it must suit those.
            for &knob in self.ranges.keys() {
                if Kind::rooms().all(|k| knob.ranges(k).is_none()) {
                    return Err(unknown(knob, kind));
                }
            }
            return Kind::rooms().try_for_each(|k| self.for_kind(k).check(k));
        }
        for (&knob, &[low, high]) in &self.ranges {
            let Some(Ranges { allowed: [least, most], .. }) = knob.ranges(kind) else { return Err(unknown(knob, kind)) };
            if low < least || high > most {
                let unit = knob.unit();
                let found = if low == high { low.to_string() } else { format!("{low}..{high}") };
                return Err(invalid(&format!("{knob} of kind {kind}"), &found, format!("{least} to {most} {unit}").trim_end()));
            }
        }
        if let Some(odd) = self.outlines.iter().find(|o| !allowed_outlines(kind).contains(o)) {
            let allowed = allowed_outlines(kind).iter().map(|o| o.name()).collect::<Vec<_>>().join(", ");
            return Err(invalid(&format!("{OUTLINE} of kind {kind}"), odd.name(), &allowed));
        }
        Ok(())
    }

    /// The range that a knob of a kind is drawn from.
    pub(super) fn range(&self, knob: Knob, kind: Kind) -> [f64; 2] {
        self.ranges.get(&knob).copied().or(knob.ranges(kind).map(|r| r.usual)).unwrap_or_default()
    }

    /// The outlines that a kind is drawn from, in words.
    pub(super) fn outlines_of(&self, kind: Kind) -> String {
        let drawn_from = if self.outlines.is_empty() { usual_outlines(kind) } else { &self.outlines };
        let names = Outline::ALL.iter().filter(|o| drawn_from.contains(o)).map(|o| o.name());
        names.collect::<Vec<_>>().join(", ")
    }

    /// Those that a kind has.
    pub(super) fn for_kind(&self, kind: Kind) -> Self {
        let ranges = self.ranges.iter().filter(|(knob, _)| knob.ranges(kind).is_some()).map(|(k, r)| (*k, *r)).collect();
        Self { ranges, outlines: self.outlines.clone() }
    }

    /// Draws a value for each knob of a kind. Each has a stream of its own, so that asking for one never changes another.
    pub(super) fn draw(&self, kind: Kind, seed: Seed) -> Drawn {
        let mut values = BTreeMap::new();
        for &knob in Knob::ALL {
            if knob.ranges(kind).is_none() {
                continue;
            }
            let [low, high] = self.range(knob, kind);
            let mut dice = Dice::new(seed, knob.name());
            let value = match knob {
                _ if knob.is_whole() => low + dice.below((high - low) as usize + 1) as f64,
                _ if knob.unit() == "m" => mm(dice.between(low, high)),
                _ => hundredths(dice.between(low, high)),
            };
            // Rounding must not leave the range that was asked for.
            values.insert(knob, value.clamp(low, high));
        }
        let outlines = if self.outlines.is_empty() { usual_outlines(kind) } else { &self.outlines };
        Drawn { values, outline: *Dice::new(seed, OUTLINE).pick(outlines) }
    }
}

/// What was drawn for a world.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    /// A value for each knob that the kind has, in SI units.
    pub values: BTreeMap<Knob, f64>,
    /// Shape of the room.
    pub outline: Outline,
}

impl Drawn {
    /// What was drawn for a knob; 0 where the kind has no such knob.
    #[must_use]
    pub fn get(&self, knob: Knob) -> f64 {
        self.values.get(&knob).copied().unwrap_or(0.0)
    }

    pub(super) fn count(&self, knob: Knob) -> usize {
        self.get(knob) as usize
    }
}

fn unknown(knob: Knob, kind: Kind) -> Error {
    let has = |k: &&Knob| kind == Kind::Mixture || k.ranges(kind).is_some();
    let names: Vec<_> = Knob::ALL.iter().filter(has).map(|k| k.name()).chain([OUTLINE]).collect();
    invalid(&format!("knob of kind {kind}"), knob.name(), &names.join(", "))
}

fn invalid(what: &str, found: &str, allowed: &str) -> Error {
    Error::Invalid { what: what.to_owned(), found: found.to_owned(), allowed: allowed.to_owned() }
}
