//! `wayhome render --bench`: how fast this machine renders.

use anyhow::Result;
use wayhome::verify::render::page as render_report;
use wayhome::verify::render::{Effort, Findings, measure};

use crate::cli::context::{Context, Verdict};

pub fn run(context: &Context) -> Result<Verdict> {
    let findings = measured(context, Effort { seconds: 1.0 })?;
    context.print(&findings, || render_report::text(&findings))?;
    Ok(Verdict::Done)
}

/// Measures, with what has been found so far as progress.
pub fn measured(context: &Context, effort: Effort) -> Result<Findings> {
    let bar = context.progress(None)?;
    let findings = measure(effort, &mut |speed| {
        bar.println(render_report::line(speed));
        bar.tick();
        bar.go_on()
    })?;
    drop(bar);
    Ok(findings)
}
