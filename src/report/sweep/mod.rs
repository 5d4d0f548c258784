//! The folder of a stress study, and the page that shows what came of it.

mod figures;
mod gallery;
mod heat;
mod page;

use std::path::Path;

use crate::error::Result;
use crate::storage::OutputFolder;
use crate::study::sweep::store::StudyFolder;
use crate::study::sweep::{Exhibit, Row};
use figures::Sums;
use page::Page;

/// Failures that the page has room for.
pub const EXHIBITS: usize = 12;

/// Writes the report of a complete study with these rows: `index.html`, its figures as SVG and its tables as CSV. `exhibits` are failures
/// that were run again, and beside them how many could not be.
///
/// # Errors
/// When the folder cannot be written.
pub fn write(folder: &StudyFolder, rows: &[Row], (exhibits, withheld): (&[Exhibit], usize), out: &Path) -> Result<()> {
    let study = folder.study();
    let sums = Sums::new(study, rows);
    let figures = sums.figures();
    let mut report = OutputFolder::open(out, "sweep report")?;
    let page = Page {
        sums: &sums,
        figures: &figures,
        exhibits,
        withheld,
        rates: &folder.rates()?,
        folder: folder.path().display().to_string(),
        sha256: study.sha256(),
    };
    for figure in &figures {
        report.write(&figure.name, figure.svg.as_bytes())?;
    }
    report.write("cells.csv", sums.cells_csv().as_bytes())?;
    if !sums.duels.is_empty() {
        report.write("pairs.csv", sums.pairs_csv().as_bytes())?;
    }
    report.write("index.html", page.html().as_bytes())?;
    report.finish()
}
