//! The page on the paper: its tables and figures rebuilt beside the printed numbers, and the audit of its claims.
//!
//! Each [`Target`] is a [`Section`] of one page with drawings of its own. A section that is rebuilt alone takes its place in the page
//! that is there; the others stay. The prose of a section stands in a Markdown file beside its code, with the names of what is measured
//! in braces.

mod audit;
mod contest;
mod observability;
mod tables;

use std::fs;
use std::io;

use strum::{EnumMessage, IntoStaticStr, VariantArray};

use crate::error::{Error, Result};
use crate::storage::OutputFolder;
use crate::study::paper::evidence::Evidence;

pub use observability::{map_csv, map_svg, summary as map_summary};

/// What can be reproduced, in the order of the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, EnumMessage, IntoStaticStr, VariantArray)]
#[serde(rename_all = "kebab-case")]
#[strum(serialize_all = "kebab-case")]
pub enum Target {
    /// Table I: errors with accurate bearings.
    Table1,
    /// Fig. 3: paths with accurate bearings.
    Fig3,
    /// Table II: errors with bearings from images, the paper's own set.
    Table2,
    /// Fig. 5: paths on that set.
    Fig5,
    /// Fig. 7: paths on Vardy's set.
    Fig7,
    /// Fig. 8: time home beside other methods.
    Fig8,
    /// Rank and condition of the matrix O of (14).
    Observability,
    /// A row for each claim: what holds, from which start, under which noise.
    Audit,
}

impl Target {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Names of its drawings.
    fn figures(self) -> &'static [&'static str] {
        match self {
            Self::Table1 => &[],
            Self::Fig3 => &["fig3-proportional.svg", "fig3-nonlinear.svg"],
            Self::Table2 => &["fig4-objects.png"],
            Self::Fig5 => &["fig5-proportional.svg", "fig5-nonlinear.svg"],
            Self::Fig7 => &["fig7-proportional.svg", "fig7-nonlinear.svg", "fig6-objects.png"],
            Self::Fig8 => &["fig8a.svg", "fig8b.svg"],
            Self::Observability => &["observability-homeward.svg", "observability-east.svg", "observability-paths.svg"],
            Self::Audit => &["beta.svg"],
        }
    }
}

/// One part of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    /// Which.
    pub target: Target,
    /// Its text.
    pub markdown: String,
    /// Its drawings by name.
    pub figures: Vec<(&'static str, Vec<u8>)>,
}

impl Section {
    /// With drawings in the order of [`Target::figures`].
    fn new(target: Target, markdown: impl Into<String>, drawings: impl IntoIterator<Item = Vec<u8>>) -> Self {
        let figures = target.figures().iter().copied().zip(drawings).collect();
        Self { target, markdown: markdown.into(), figures }
    }
}

/// One section, from evidence.
///
/// # Errors
/// When the evidence for it cannot be had, or a picture cannot be encoded.
pub fn section(target: Target, evidence: &Evidence) -> Result<Section> {
    match target {
        Target::Table1 => tables::table_one(evidence),
        Target::Fig3 => tables::fig_three(evidence),
        Target::Table2 => tables::table_two(evidence),
        Target::Fig5 => tables::fig_five(evidence),
        Target::Fig7 => tables::fig_seven(evidence),
        Target::Fig8 => contest::fig_eight(evidence),
        Target::Observability => observability::observability(evidence),
        Target::Audit => audit::audit(evidence),
    }
}

/// Writes sections with their drawings; those of the page that are not among them stay as they are, unless all are given.
///
/// # Errors
/// When a file cannot be read or written.
pub fn write(mut folder: OutputFolder, sections: &[Section]) -> Result<()> {
    let path = folder.path().join("README.md");
    let before = match fs::read_to_string(&path) {
        Ok(text) => text,
        Err(e) if e.kind() == io::ErrorKind::NotFound => String::new(),
        Err(source) => return Err(Error::Io { action: "read", path, source }),
    };
    for (name, bytes) in sections.iter().flat_map(|s| &s.figures) {
        folder.write(name, bytes)?;
    }
    folder.write("README.md", page(&before, sections).as_bytes())?;
    if Target::VARIANTS.iter().all(|t| sections.iter().any(|s| s.target == *t)) { folder.finish() } else { Ok(()) }
}

/// The page with its sections in order: new ones as given, others as in the page `before`.
fn page(before: &str, sections: &[Section]) -> String {
    let mut text = include_str!("title.md").to_owned();
    for target in Target::VARIANTS {
        let [begin, end] = ["begin", "end"].map(|edge| format!("<!-- {edge} {} -->\n", target.name()));
        let body = match sections.iter().find(|s| s.target == *target) {
            Some(section) => &format!("{}\nMade with wayhome {}.\n", section.markdown, crate::VERSION),
            None => match before.split_once(&begin).and_then(|(_, rest)| rest.split_once(&end)) {
                Some((body, _)) => body,
                None => continue,
            },
        };
        text += &format!("\n{begin}{body}{end}");
    }
    text
}

/// A small or large number in two digits: 3.7e-5.
fn short(value: f64) -> String {
    if value == 0.0 {
        "0".to_owned()
    } else if value.is_infinite() {
        "infinite".to_owned()
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_takes_its_place_and_others_stay() {
        let section = |target, text: &str| Section { target, markdown: format!("{text}\n"), figures: Vec::new() };
        let first = page("", &[section(Target::Fig3, "old three"), section(Target::Audit, "old audit")]);
        let second = page(&first, &[section(Target::Fig3, "new three"), section(Target::Table1, "table")]);
        let at = |text: &str| second.find(text);
        assert!(at("table\n") < at("new three") && at("new three") < at("old audit") && at("old three").is_none());
        assert_eq!(page(&second, &[]), second);
    }
}
