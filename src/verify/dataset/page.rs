//! The page on how fast data sets are made.

use std::fmt::Write;

use super::DatasetSpeeds;
use crate::draw::markdown::table;
use crate::error::Result;
use crate::storage::{OutputFolder, json};

/// Writes the page.
///
/// # Errors
/// When a file cannot be written.
pub fn write(mut folder: OutputFolder, found: &DatasetSpeeds) -> Result<()> {
    folder.write("README.md", page(found).as_bytes())?;
    folder.write("speed.json", json(found).as_bytes())?;
    folder.finish()
}

fn page(found: &DatasetSpeeds) -> String {
    let rates = found.rates.iter().map(|r| {
        let (per_s, percent) = (|rate: f64| format!("{rate:.0}"), |share: f64| format!("{:.0} %", 100.0 * share));
        [
            format!("{} x {}", r.width, r.height),
            format!("`{}`", r.layout.name()),
            r.threads.to_string(),
            per_s(r.render_per_s),
            per_s(r.encode_per_s),
            per_s(r.pipeline_per_s),
            percent(r.share_of_slower()),
            percent(r.bound_of_slower()),
            per_s(r.render_one_per_s),
            per_s(r.encode_one_per_s),
            percent(r.share_of_slower_one()),
        ]
    });
    let rates = table(
        "size | layout | threads | rendering alone | encoding alone | the whole | of the slower alone | most that is possible | \
         rendering, one thread | encoding, one thread | the whole of the slower of these",
        rates,
    );
    let codings = found
        .codings
        .iter()
        .map(|c| [c.channel.to_owned(), c.coding.clone(), format!("{:.2}", c.ms), format!("{:.3}", c.share)]);
    let codings = table("channel | coding | ms | length", codings);
    format!(
        include_str!("page.md"),
        rates = rates,
        codings = codings,
        width = found.codings_px[0],
        height = found.codings_px[1],
        frames = found.rates.first().map_or(0, |r| r.frames),
        version = crate::VERSION,
        processor = found.processor,
        world = found.world,
    )
}

/// The rates, for a terminal.
pub fn text(found: &DatasetSpeeds) -> String {
    let mut text = String::new();
    for r in &found.rates {
        let _ = writeln!(
            text,
            "{} x {}, {}, {} threads: rendering {:.0}/s, encoding {:.0}/s, whole {:.0}/s: {:.0} % of the slower, of {:.0} % possible; \
             {:.0} % of the slower on one thread each ({:.0}/s, {:.0}/s)",
            r.width,
            r.height,
            r.layout.name(),
            r.threads,
            r.render_per_s,
            r.encode_per_s,
            r.pipeline_per_s,
            100.0 * r.share_of_slower(),
            100.0 * r.bound_of_slower(),
            100.0 * r.share_of_slower_one(),
            r.render_one_per_s,
            r.encode_one_per_s
        );
    }
    for c in &found.codings {
        let _ = writeln!(text, "{:8} {:20} {:7.2} ms {:.3}", c.channel, c.coding, c.ms, c.share);
    }
    text
}
