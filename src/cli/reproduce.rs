//! `wayhome reproduce`: the paper's tables and figures, its observability, and the audit of its claims, as one page.

use std::cell::OnceCell;
use std::path::PathBuf;

use anyhow::Result;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use strum::VariantArray;
use wayhome::Error;
use wayhome::estimation::paper::{PaperSettings, Transition};
use wayhome::report::paper::{self as page, Evidence, Section, Target};
use wayhome::storage::OutputFolder;
use wayhome::study::observability::{Facing, map};
use wayhome::study::paper::claims::{ImageClaims, claims, image_claims};
use wayhome::study::paper::contest::{Contest, Source, contest};
use wayhome::study::paper::ideal::{Ideal, Run, Twists};
use wayhome::study::paper::images::{ImageCase, ImageSet, image_settings};
use wayhome::world::World;

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

/// Distance between places of the page's observability maps, m.
const MAP_SPACING_M: f64 = 0.05;

pub fn run(args: &ReproduceArgs, context: &Context) -> Result<Verdict> {
    let is_wanted = |t: &Target| args.targets.is_empty() || args.targets.contains(&Some(*t)) || args.targets.contains(&None);
    let wanted: Vec<Target> = Target::VARIANTS.iter().copied().filter(is_wanted).collect();
    check_dataset(args, &wanted)?;
    let folder = OutputFolder::open(&args.out, "reproduce", page::FILES)?;
    let workshop = Workshop::new(args)?;
    let bar = context.progress(Some(wanted.len() as u64))?;
    let mut sections = Vec::new();
    for target in wanted {
        bar.set_message(target.name());
        bar.go_on()?;
        sections.push(workshop.section(target)?);
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

/// What several sections need is made once.
struct Workshop<'a> {
    args: &'a ReproduceArgs,
    ideal: Ideal,
    table_one: OnceCell<Vec<Run>>,
    cases: [OnceCell<ImageCase>; 2],
    runs: [OnceCell<Vec<Run>>; 2],
    image_claims: [OnceCell<ImageClaims>; 2],
    contests: [OnceCell<[Contest; 2]>; 2],
}

impl<'a> Workshop<'a> {
    fn new(args: &'a ReproduceArgs) -> Result<Self, Error> {
        Ok(Self {
            args,
            ideal: Ideal::of(&World::open("paper-ideal")?)?,
            table_one: OnceCell::new(),
            cases: [const { OnceCell::new() }; 2],
            runs: [const { OnceCell::new() }; 2],
            image_claims: [const { OnceCell::new() }; 2],
            contests: [const { OnceCell::new() }; 2],
        })
    }

    fn section(&self, target: Target) -> Result<Section, Error> {
        let [own, vardy] = [0, 1];
        Ok(match target {
            Target::Table1 => {
                let settings = PaperSettings { transition: Transition::Printed, ..PaperSettings::default() };
                let printed = self.ideal.runs(&Twists { settings, ..Twists::default() }, |start| *start)?;
                page::table_one(self.table_one()?, &printed)
            }
            Target::Fig3 => page::fig_three(self.table_one()?)?,
            Target::Table2 => page::table_two(self.case(own)?, self.runs(own)?, self.image_claims(own)?)?,
            Target::Fig5 => page::fig_five(self.case(own)?, self.runs(own)?)?,
            Target::Fig7 => page::fig_seven(self.case(vardy)?, self.runs(vardy)?, self.image_claims(vardy)?)?,
            Target::Fig8 => {
                page::contest(&[(self.case(own)?, self.contests(own)?), (self.case(vardy)?, self.contests(vardy)?)])
            }
            Target::Observability => {
                let world = World::open("paper-ideal")?;
                let homeward = map(&world, Facing::Homeward, MAP_SPACING_M)?;
                let east = map(&world, Facing::Heading(0.0), MAP_SPACING_M)?;
                page::observability(&self.ideal, self.table_one()?, &homeward, &east)?
            }
            Target::Audit => page::audit(&Evidence {
                ideal: self.table_one()?,
                images: self.runs(own)?,
                claims: &claims(&self.ideal)?,
                image_claims: [self.image_claims(own)?, self.image_claims(vardy)?],
                contests: [&self.contests(own)?[0], &self.contests(vardy)?[0]],
                homeward: &map(&World::open("paper-ideal")?, Facing::Homeward, MAP_SPACING_M)?,
            }),
        })
    }

    fn table_one(&self) -> Result<&Vec<Run>, Error> {
        made(&self.table_one, || self.ideal.table_one())
    }

    fn case(&self, k: usize) -> Result<&ImageCase, Error> {
        made(&self.cases[k], || ImageCase::new(ImageSet::ALL[k], self.args.dataset.as_deref()))
    }

    fn runs(&self, k: usize) -> Result<&Vec<Run>, Error> {
        let case = self.case(k)?;
        made(&self.runs[k], || case.runs(image_settings(), |start| *start))
    }

    fn image_claims(&self, k: usize) -> Result<&ImageClaims, Error> {
        let case = self.case(k)?;
        made(&self.image_claims[k], || image_claims(case))
    }

    fn contests(&self, k: usize) -> Result<&[Contest; 2], Error> {
        let case = self.case(k)?;
        made(&self.contests[k], || Ok([contest(case, Source::Images)?, contest(case, Source::Points)?]))
    }
}

/// The value of a cell, made if it is not there yet.
fn made<T>(cell: &OnceCell<T>, make: impl FnOnce() -> Result<T, Error>) -> Result<&T, Error> {
    if let Some(value) = cell.get() {
        return Ok(value);
    }
    let value = make()?;
    Ok(cell.get_or_init(|| value))
}
