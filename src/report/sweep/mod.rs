//! The folder of a stress study, and the page that shows what came of it.

mod curves;
mod figures;
mod gallery;
mod heat;
mod page;

use std::ops::ControlFlow;
use std::path::Path;

use crate::error::Result;
use crate::storage::OutputFolder;
use crate::study::sweep::duels;
use crate::study::sweep::store::StudyFolder;
use figures::Sums;
use page::Page;

/// Failures that the page shows.
const EXHIBITS: usize = 12;

/// Writes the report of a complete study: `index.html`, its figures as SVG and its tables as CSV. `watch` is called before each
/// failure that is run again for the gallery.
///
/// # Errors
/// When rows are missing, the folder cannot be written, or `watch` breaks.
pub fn write(folder: &StudyFolder, out: &Path, watch: &mut dyn FnMut() -> ControlFlow<()>) -> Result<()> {
    let rows = folder.rows()?;
    let study = folder.study();
    let sums = Sums::new(study, &rows);
    let figures = sums.figures();
    let mut report = OutputFolder::open(out, "sweep report", &["index.html", "cells.csv", "pairs.csv", "README.md", "*.svg"])?;
    let (mut exhibits, mut withheld) = (Vec::new(), 0);
    for row in duels::failures(study, &rows, EXHIBITS) {
        if watch().is_break() {
            return Err(crate::error::Error::Interrupted);
        }
        match gallery::exhibit(folder, row)? {
            Some(exhibit) => exhibits.push(exhibit),
            None => withheld += 1,
        }
    }
    let page = Page {
        sums: &sums,
        figures: &figures,
        exhibits: &exhibits,
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
