//! Faults of a file that a person writes, each with its place: worlds and studies report all of theirs at once.

/// One fault of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Where in the file, as a path of fields: `landmarks[2].height_m`.
    pub place: String,
    /// What stands there.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
    /// Name of the body, zone or start that the place belongs to.
    pub owner: Option<String>,
    /// Line of the place, from 1, where the file's format tells it.
    pub line: Option<usize>,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        write!(f, "{}", self.place)?;
        if let Some(owner) = &self.owner {
            write!(f, " (\"{owner}\")")?;
        }
        write!(f, ": found {}, allowed is {}", self.found, self.allowed)
    }
}

/// Something in a file that is allowed and may still not be meant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// Where in the file, as a path of fields.
    pub place: String,
    /// What it leads to.
    pub message: String,
    /// Name of the body, zone or start that the place belongs to.
    pub owner: Option<String>,
    /// Line of the place, from 1, where the file's format tells it.
    pub line: Option<usize>,
}

impl std::fmt::Display for Warning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        write!(f, "{}", self.place)?;
        if let Some(owner) = &self.owner {
            write!(f, " (\"{owner}\")")?;
        }
        write!(f, ": {}", self.message)
    }
}
