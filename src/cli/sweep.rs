//! `wayhome sweep`: stress studies, their shards, and their report.

use std::fmt::Write;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use anyhow::Result;
use serde::Serialize;
use wayhome::Error;
use wayhome::report::sweep as page;
use wayhome::statistics::wilson_95;
use wayhome::study::sweep::store::{Rate, StudyFolder};
use wayhome::study::sweep::{Row, Setting, Study, catalogue, exhibits, run as run_chunks};

use super::context::{Context, Verdict, folder_or, print};
use super::values::{seeds, shard};

/// Shown under `sweep --help`.
const HELP: &str =
    "A study file names a world, settings, axes and seeds; worlds/studies/ has some, which go by their names too.
The same command goes on where a killed one was. The rows in rows.parquet depend on the study alone.

Shards: --shard 2/8 runs every eighth chunk from the second on. Without --shard, an array job of Slurm is a shard by
SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT, and an indexed job of Kubernetes one by JOB_COMPLETION_INDEX and
WAYHOME_SHARDS. Shards may share one folder, or have one each for `sweep merge`. That fails where a row is missing; and a
folder of another study is refused.";

/// Arguments of `sweep`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = HELP)]
pub struct SweepArgs {
    #[command(subcommand)]
    pub command: Option<SweepCommand>,
    /// Study file, or the name of a built-in study
    #[arg(required_unless_present = "settings")]
    pub study: Option<String>,
    /// Run these seeds in each cell instead of the study's, both included
    #[arg(long, value_name = "A..B", value_parser = seeds)]
    pub seeds: Option<RangeInclusive<u64>>,
    /// Run only shard i of n, from 1/n to n/n
    #[arg(long, value_name = "i/n", value_parser = shard)]
    pub shard: Option<[u64; 2]>,
    /// Keep summary, trajectory, path and panoramas of the runs that do not come home
    #[arg(long)]
    pub keep_failures: bool,
    /// Folder for the rows; one that holds rows of the same study is gone on with [default: results/runs/sweep-STUDY]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// List all settings that a study can vary, and leave
    #[arg(long, conflicts_with_all = ["study", "seeds", "shard", "keep_failures", "out"])]
    pub settings: bool,
}

/// The subcommands of `sweep`.
#[derive(Debug, clap::Subcommand)]
pub enum SweepCommand {
    /// Put the rows of shards together
    Merge {
        /// Folders of shards of one study
        #[arg(required = true, value_name = "DIR")]
        shards: Vec<PathBuf>,
        /// Folder for all rows
        #[arg(long, value_name = "DIR")]
        out: PathBuf,
    },
    /// Make the page of a study: heat maps, curves, paired differences, failures, settings
    Report {
        /// Folder of a complete study
        #[arg(value_name = "DIR")]
        study: PathBuf,
        /// Folder for the page, its figures and tables [default: DIR/report]
        #[arg(long, value_name = "DIR")]
        out: Option<PathBuf>,
        /// Leave failed runs with their paths and panoramas out: a page of a quarter of the size, and nothing is run again
        #[arg(long)]
        no_gallery: bool,
    },
}

/// The shard that a batch system gave this process, if one did.
fn shard_from(variable: impl Fn(&str) -> Option<String>) -> Result<Option<[u64; 2]>, Error> {
    let number = |name: &str| -> Result<Option<u64>, Error> {
        let Some(text) = variable(name) else { return Ok(None) };
        let invalid = || Error::Invalid { what: name.into(), found: text.clone(), allowed: "a whole number from 0".into() };
        text.parse().map(Some).map_err(|_| invalid())
    };
    let (index, index_name, count, count_name) = if let Some(id) = number("SLURM_ARRAY_TASK_ID")? {
        let (least, step) = (number("SLURM_ARRAY_TASK_MIN")?.unwrap_or(0), number("SLURM_ARRAY_TASK_STEP")?.unwrap_or(1));
        let index = id.saturating_sub(least) / step.max(1);
        (index, "SLURM_ARRAY_TASK_ID", number("SLURM_ARRAY_TASK_COUNT")?, "SLURM_ARRAY_TASK_COUNT")
    } else if let Some(index) = number("JOB_COMPLETION_INDEX")? {
        (index, "JOB_COMPLETION_INDEX", number("WAYHOME_SHARDS")?, "WAYHOME_SHARDS")
    } else {
        return Ok(None);
    };
    let invalid = |what: &str, found: String, allowed: String| Error::Invalid { what: what.into(), found, allowed };
    let Some(count) = count else {
        let allowed = format!("the number of shards, as {index_name} is set; or --shard i/n");
        return Err(invalid(count_name, "nothing".into(), allowed));
    };
    if index >= count {
        return Err(invalid(index_name, format!("shard {} of {count}", index + 1), format!("1 to {count} of them")));
    }
    Ok(Some([index + 1, count]))
}

/// What `--json` prints.
#[derive(Serialize)]
struct Swept {
    study: String,
    study_sha256: String,
    shard: [u64; 2],
    /// Episodes of the study, and those whose rows are there.
    episodes: u64,
    episodes_done: u64,
    complete: bool,
    /// Episodes that this call ran, and how fast.
    rate: Rate,
}

pub fn run(args: &SweepArgs, context: &Context) -> Result<Verdict> {
    match (&args.command, &args.study) {
        (Some(SweepCommand::Merge { shards, out }), _) => merge(shards, out, context),
        (Some(SweepCommand::Report { study, out, no_gallery }), _) => report(study, out.as_deref(), !no_gallery, context),
        (None, Some(study)) => sweep(args, study, context),
        (None, None) => {
            let mut text = String::new();
            for Setting { key, unit, default, meaning } in catalogue() {
                let default = if default.is_empty() { String::new() } else { format!("[{default}] ") };
                let _ = writeln!(text, "{}", format!("{key:<40} {unit:<9} {default}{meaning}").trim_end());
            }
            print(&text)?;
            Ok(Verdict::Done)
        }
    }
}

fn sweep(args: &SweepArgs, argument: &str, context: &Context) -> Result<Verdict> {
    let [shard, of] = match args.shard {
        Some(shard) => shard,
        None => shard_from(|name| std::env::var(name).ok())?.unwrap_or([1, 1]),
    };
    let study = Study::open(argument, args.seeds.clone())?;
    let out = folder_or(args.out.as_deref(), &["sweep", &study.name]);
    let folder = StudyFolder::create(&out, study, Path::new(argument), args.keep_failures)?;
    let study = folder.study();
    let done = folder.done()?;
    let chunks: Vec<u64> = (0..study.chunks()).filter(|k| k % of == shard - 1 && !done.contains(k)).collect();
    let episodes: u64 = chunks.iter().map(|&k| study.chunk(k).count).sum();
    let bar = context.work(episodes)?;
    let (began, home) = (Instant::now(), AtomicU64::new(0));
    let watch = |row: &Row| {
        let home = home.fetch_add(u64::from(row.run.is_home()), Ordering::Relaxed) + u64::from(row.run.is_home());
        bar.inc(1);
        bar.set_message(format!("{:.1} % home", 100.0 * home as f64 / bar.position() as f64));
    };
    let pool = context.pool();
    let result = run_chunks(study, &chunks, &pool, &folder, &watch);
    let run = bar.position();
    drop(bar);
    let wall_s = began.elapsed().as_secs_f64();
    let rate = Rate { threads: pool.threads, episodes: run, wall_s, episodes_per_minute: 60.0 * run as f64 / wall_s.max(1e-9) };
    if run > 0 {
        folder.note_rate([shard, of], rate.clone())?;
    }
    result?;
    let complete = folder.complete()?;
    report_end(context, &folder, [shard, of], complete, rate)?;
    Ok(Verdict::Done)
}

fn report_end(context: &Context, folder: &StudyFolder, shard: [u64; 2], complete: bool, rate: Rate) -> Result<()> {
    let study = folder.study();
    let rows = folder.parts()?;
    let swept = Swept {
        study: study.name.clone(),
        study_sha256: study.sha256(),
        shard,
        episodes: study.episodes(),
        episodes_done: rows.len() as u64,
        complete,
        rate,
    };
    context.print_made(&swept, folder.path(), || {
        let home = rows.iter().filter(|row| row.run.is_home()).count();
        let [low, high] = wilson_95(home, rows.len());
        let rate = &swept.rate;
        format!(
            "study   {}, {} cells of {} seeds\nrows    {} of {}{}\nhome    {home} of {} (95 % Wilson {:.1} to {:.1} %)\nrate    {} episodes in {:.1} s on {} threads, {:.1} a minute\nfiles   {}\n",
            swept.study,
            study.cells(),
            study.episodes_per_cell(),
            rows.len(),
            swept.episodes,
            if swept.complete { ", all of them" } else { "" },
            rows.len(),
            100.0 * low,
            100.0 * high,
            rate.episodes,
            rate.wall_s,
            rate.threads,
            rate.episodes_per_minute,
            folder.path().display(),
        )
    })
}

fn merge(shards: &[PathBuf], out: &Path, context: &Context) -> Result<Verdict> {
    let first = StudyFolder::open(&shards[0])?;
    let folder = StudyFolder::create(out, first.study().clone(), first.source(), false)?;
    for shard in shards.iter().filter(|shard| shard.as_path() != out) {
        folder.take(shard)?;
    }
    folder.rows()?; // tells what is missing
    let complete = folder.complete()?;
    let rate = Rate { threads: 0, episodes: 0, wall_s: 0.0, episodes_per_minute: 0.0 };
    report_end(context, &folder, [1, 1], complete, rate)?;
    Ok(Verdict::Done)
}

fn report(study: &Path, out: Option<&Path>, gallery: bool, context: &Context) -> Result<Verdict> {
    let folder = StudyFolder::open(study)?;
    let out = out.map_or_else(|| study.join("report"), Path::to_owned);
    let bar = context.progress(None)?;
    let rows = folder.rows()?;
    let (shown, withheld) =
        exhibits(folder.study(), &rows, if gallery { page::EXHIBITS } else { 0 }, &mut || bar.at("running failures again"))?;
    drop(bar);
    page::write(&folder, &rows, (&shown, withheld), &out)?;
    let page = out.join("index.html").display().to_string();
    context.print(&serde_json::json!({ "page": page }), || format!("page    {page}\n"))?;
    Ok(Verdict::Done)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batch_systems_say_which_shard_it_is() {
        let given = |pairs: &'static [(&str, &str)]| {
            shard_from(|name| pairs.iter().find(|(key, _)| *key == name).map(|(_, value)| (*value).to_owned()))
        };
        assert_eq!(given(&[]).unwrap(), None);
        let slurm: &[_] = &[("SLURM_ARRAY_TASK_ID", "7"), ("SLURM_ARRAY_TASK_MIN", "1"), ("SLURM_ARRAY_TASK_COUNT", "8")];
        assert_eq!(given(slurm).unwrap(), Some([7, 8]));
        assert_eq!(given(&[("JOB_COMPLETION_INDEX", "0"), ("WAYHOME_SHARDS", "4")]).unwrap(), Some([1, 4]));
        assert!(given(&[("JOB_COMPLETION_INDEX", "0")]).unwrap_err().to_string().contains("WAYHOME_SHARDS"));
        assert!(given(&[("JOB_COMPLETION_INDEX", "4"), ("WAYHOME_SHARDS", "4")]).unwrap_err().to_string().contains("1 to 4"));
        assert!(given(&[("JOB_COMPLETION_INDEX", "x"), ("WAYHOME_SHARDS", "4")]).is_err());
    }
}
