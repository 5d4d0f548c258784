//! `wayhome reproduce`: the paper's tables and figures, its observability, and the audit of its claims, as one page.

use std::path::PathBuf;

use anyhow::Result;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use strum::VariantArray;
use wayhome::Error;
use wayhome::report::paper::{self as page, Target};
use wayhome::storage::OutputFolder;
use wayhome::study::paper::evidence::Evidence;
use wayhome::study::paper::images::ImageSet;

use super::context::{Context, Verdict};
use super::values::{described, named};

/// Arguments of `reproduce`.
#[derive(Debug, clap::Args)]
pub struct ReproduceArgs {
    /// What to reproduce [default: all]
    #[arg(value_name = "TARGET", value_parser = target())]
    pub targets: Vec<Option<Target>>,
    /// Panoramas on disk instead of rendered ones, for table2 and fig5 (`I_J.png` or `.pgm`, 9 x 19 of them) or for fig7 (Vardy's layout,
    /// `I_J.pgm`, 10 x 17)
    #[arg(long, value_name = "DIR")]
    pub dataset: Option<PathBuf>,
    /// Folder of the page; what is not reproduced stays as it is there
    #[arg(long, value_name = "DIR", default_value = "results/paper")]
    pub out: PathBuf,
}

/// A target, or `None` for all of them.
fn target() -> impl TypedValueParser<Value = Option<Target>> {
    let all = PossibleValue::new("all").help("All of these");
    PossibleValuesParser::new(Target::VARIANTS.iter().map(described).chain([all])).map(|name| named(Target::VARIANTS, &name))
}

/// What `--json` prints.
#[derive(Serialize)]
struct Page<'a> {
    sections: Vec<Text<'a>>,
}

/// A section of the page.
#[derive(Serialize)]
struct Text<'a> {
    target: Target,
    markdown: &'a str,
    figures: Vec<&'static str>,
}

pub fn run(args: &ReproduceArgs, context: &Context) -> Result<Verdict> {
    let is_wanted = |t: &Target| args.targets.is_empty() || args.targets.contains(&Some(*t)) || args.targets.contains(&None);
    let wanted: Vec<Target> = Target::VARIANTS.iter().copied().filter(is_wanted).collect();
    check_dataset(args, &wanted)?;
    let folder = OutputFolder::open(&args.out, "reproduce")?;
    let evidence = Evidence::new(args.dataset.as_deref())?;
    let bar = context.progress(Some(wanted.len() as u64))?;
    let mut sections = Vec::new();
    for target in wanted {
        bar.set_message(target.name());
        bar.go_on()?;
        sections.push(page::section(target, &evidence)?);
        bar.inc(1);
    }
    drop(bar);
    page::write(folder, &sections)?;
    let texts = sections.iter().map(|s| Text {
        target: s.target,
        markdown: &s.markdown,
        figures: s.figures.iter().map(|f| f.0).collect(),
    });
    let page = Page { sections: texts.collect() };
    context.print_made(&page, &args.out, || {
        let body: Vec<&str> = sections.iter().map(|s| s.markdown.as_str()).collect();
        format!("{}\nfiles in {}\n", body.join("\n"), args.out.display())
    })?;
    Ok(Verdict::Done)
}

/// A folder of panoramas takes the place of one set, so what is reproduced must be of that set, and the set whole.
fn check_dataset(args: &ReproduceArgs, wanted: &[Target]) -> Result<(), Error> {
    let Some(folder) = &args.dataset else { return Ok(()) };
    let of_one_set = |set: &[Target]| wanted.iter().all(|t| set.contains(t));
    if of_one_set(&[Target::Table2, Target::Fig5]) {
        return ImageSet::Paper.open(folder).map(|_| ());
    }
    if of_one_set(&[Target::Fig7]) {
        return ImageSet::Vardy.open(folder).map(|_| ());
    }
    let names: Vec<&str> = wanted.iter().map(|t| t.name()).collect();
    Err(Error::Invalid {
        what: "targets for --dataset".into(),
        found: names.join(" "),
        allowed: "table2 and fig5, or fig7: they are of one set each".into(),
    })
}
