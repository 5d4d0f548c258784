//! Kinds of generated worlds.

use strum::{Display, EnumMessage, IntoStaticStr, VariantArray};

use crate::error::{Error, Result};

/// What sort of room is generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Display, EnumMessage, IntoStaticStr, VariantArray)]
#[strum(serialize_all = "kebab-case")]
pub enum Kind {
    /// A furnished laboratory with patterns all round.
    Lab,
    /// An office: plain walls, some posters, desks.
    Office,
    /// A flat: several rooms with doorways.
    Flat,
    /// A passage with doors and windows that repeat.
    Corridor,
    /// A hall of 12 to 25 m with few, large things.
    Hall,
    /// A warehouse: rows of equal shelves.
    Warehouse,
    /// A room with few features.
    Bare,
    /// One of the others, drawn by the seed.
    Mixture,
}

impl Kind {
    /// All of them.
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// How it is called in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// What it is, in a few words.
    #[must_use]
    pub fn meaning(self) -> &'static str {
        words(self.get_documentation())
    }

    /// Those that are a sort of room: all but the mixture.
    pub fn rooms() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|k| *k != Self::Mixture)
    }
}

impl std::str::FromStr for Kind {
    type Err = Error;

    /// The kind of this name.
    ///
    /// # Errors
    /// When there is none; the message lists those that there are, and guesses what was meant.
    fn from_str(name: &str) -> Result<Self> {
        let names = || Self::ALL.iter().map(|k| k.name());
        Self::ALL.iter().copied().find(|k| k.name() == name).ok_or_else(|| Error::Invalid {
            what: "kind of world".to_owned(),
            found: format!("{name}{}", did_you_mean(name, names())),
            allowed: names().collect::<Vec<_>>().join(", "),
        })
    }
}

/// What the documentation of an alternative says, without its full stop.
pub(super) fn words(documentation: Option<&'static str>) -> &'static str {
    documentation.unwrap_or_default().trim_end_matches('.')
}

/// ` (did you mean NAME?)` where one of the names is near what was typed, else nothing.
pub(in crate::world) fn did_you_mean<'a>(typed: &str, names: impl Iterator<Item = &'a str>) -> String {
    /// As similar as this, by Jaro and Winkler's measure, is near.
    const NEAR: f64 = 0.8;
    let similar = names.map(|name| (strsim::jaro_winkler(typed, name), name));
    let nearest = similar.filter(|(s, _)| *s >= NEAR).max_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or_else(String::new, |(_, name)| format!(" (did you mean {name}?)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_back_and_slips_are_guessed() {
        for kind in Kind::ALL {
            assert_eq!(kind.name().parse::<Kind>().unwrap(), *kind);
        }
        let message = "ofice".parse::<Kind>().unwrap_err().to_string();
        assert!(message.contains("did you mean office?") && message.contains("lab, office, "), "{message}");
        assert!(!"zzzzzz".parse::<Kind>().unwrap_err().to_string().contains("did you mean"));
    }
}
