//! What all subcommands share: where output goes, and whether somebody pressed Ctrl-C.

use std::borrow::Cow;
use std::io::{ErrorKind, IsTerminal, Write};
use std::ops::{ControlFlow, Deref};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result};
use clap::ArgMatches;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use wayhome::Error;
use wayhome::command_line::command_line;
use wayhome::storage::{OutputFolder, write_atomically};
use wayhome::study::pool::Pool;

/// Exit code of a process that is interrupted a second time, and of one that ends in good order after the first.
pub const INTERRUPTED: u8 = 130;

/// Heading of the flags that all subcommands have.
const GENERAL: &str = "General options";

/// What a command that ran to its end came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Done; where the task was to come home, home was reached.
    Done,
    /// The run ended without reaching home.
    NotHome,
}

/// Flags of all subcommands.
#[derive(Debug, clap::Args)]
pub struct CommonArgs {
    /// Print one JSON object on stdout
    #[arg(long, global = true, help_heading = GENERAL)]
    pub json: bool,
    /// No progress and no diagnostics on stderr, errors excepted
    #[arg(long, short, global = true, help_heading = GENERAL)]
    pub quiet: bool,
    /// Worker threads [default: one a processor]; no result depends on their number
    #[arg(long, global = true, help_heading = GENERAL, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// Settings and channels of a command.
pub struct Context {
    json: bool,
    show_progress: bool,
    stopped: Arc<AtomicBool>,
    command: clap::Command,
    matches: ArgMatches,
}

/// What `--json` prints of what was made: its figures and where the files are.
#[derive(Serialize)]
struct Made<'a, T> {
    #[serde(flatten)]
    made: &'a T,
    out: String,
}

impl Context {
    /// Sets up logging, worker threads and the handler of Ctrl-C for a command, which is kept as it was given.
    pub fn new(args: &CommonArgs, command: clap::Command, matches: ArgMatches) -> Result<Self> {
        let filter = env_logger::Env::default().default_filter_or(if args.quiet { "off" } else { "error,wayhome=warn" });
        env_logger::Builder::from_env(filter).init();
        if let Some(threads) = args.threads {
            rayon::ThreadPoolBuilder::new()
                .num_threads(usize::from(threads))
                .build_global()
                .context("cannot start worker threads")?;
        }
        let stopped = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stopped);
        // The first asks the run to end at its next step; who insists gets out at once, as files are written whole.
        ctrlc::set_handler(move || {
            let insists = flag.swap(true, Ordering::Relaxed);
            // Nobody waits for a program under test any longer, and none stays behind.
            wayhome::method::exec::end_all();
            if insists {
                std::process::exit(INTERRUPTED.into());
            }
        })
        .context("cannot watch for Ctrl-C")?;
        let show_progress = !args.quiet && std::io::stderr().is_terminal();
        Ok(Self { json: args.json, show_progress, stopped, command, matches })
    }

    /// The workers of a study, which Ctrl-C stops.
    pub fn pool(&self) -> Pool<'_> {
        Pool { threads: rayon::current_num_threads(), stopped: &self.stopped }
    }

    /// Whether results are printed as JSON.
    pub fn wants_json(&self) -> bool {
        self.json
    }

    /// Prints a result: as one JSON object where the user asked for it, else as text.
    pub fn print(&self, json: &impl Serialize, text: impl FnOnce() -> String) -> Result<()> {
        let text = if self.json { wayhome::storage::json(json) } else { text() };
        print(&text)
    }

    /// As [`Self::print`]; the object also says in which folder the files are.
    pub fn print_made(&self, made: &impl Serialize, out: &Path, text: impl FnOnce() -> String) -> Result<()> {
        self.print(&Made { made, out: out.display().to_string() }, text)
    }

    /// A progress bar on stderr for `length` things, or a spinner; it is silent when nobody watches.
    pub fn progress(&self, length: Option<u64>) -> Result<Progress> {
        self.bar(length, if length.is_some() { "{bar:32} {pos}/{len} {elapsed} {msg}" } else { "{spinner} {elapsed} {msg}" })
    }

    /// A progress bar with rate and time left, for long work of many like things; it is silent when nobody watches.
    pub fn work(&self, length: u64) -> Result<Progress> {
        self.bar(Some(length), "{bar:32} {pos}/{len}, {per_sec}, {eta} left {msg}")
    }

    fn bar(&self, length: Option<u64>, template: &str) -> Result<Progress> {
        let style = ProgressStyle::with_template(template).context("progress template")?;
        let target = if self.show_progress { ProgressDrawTarget::stderr_with_hz(8) } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(length, target).with_style(style);
        bar.tick();
        Ok(Progress { bar, stopped: Arc::clone(&self.stopped) })
    }

    /// The command that makes the same again: all arguments with their values, given or not, but flags of all subcommands and those
    /// named in `without`, on which results do not depend.
    pub fn command_line(&self, without: &[&str]) -> String {
        command_line(words(&self.command, &self.matches, without))
    }
}

/// The words of a command after the program's name.
fn words(command: &clap::Command, matches: &ArgMatches, without: &[&str]) -> Vec<String> {
    if let Some((name, matches)) = matches.subcommand() {
        let below = command.find_subcommand(name).map(|command| words(command, matches, without));
        return [name.to_owned()].into_iter().chain(below.into_iter().flatten()).collect();
    }
    let mut all = Vec::new();
    let matter = |arg: &&clap::Arg| !arg.is_global_set() && !without.contains(&arg.get_id().as_str());
    for arg in command.get_arguments().filter(matter) {
        let Ok(Some(raw)) = matches.try_get_raw(arg.get_id().as_str()) else { continue };
        let mut values: Vec<String> = raw.map(|value| value.to_string_lossy().into_owned()).collect();
        if let Some(delimiter) = arg.get_value_delimiter() {
            values = vec![values.join(&delimiter.to_string())];
        }
        for value in values {
            let flag = arg.get_long().map(|long| format!("--{long}"));
            match (flag, arg.get_action().takes_values()) {
                (Some(flag), true) if value.starts_with('-') => all.push(format!("{flag}={value}")),
                (Some(flag), true) => all.extend([flag, value]),
                (Some(flag), false) => all.extend((value == "true").then_some(flag)),
                (None, _) => all.push(value),
            }
        }
    }
    all
}

/// A progress bar, which is gone when it is dropped. What is told it also says whether to go on.
pub struct Progress {
    bar: ProgressBar,
    stopped: Arc<AtomicBool>,
}

impl Progress {
    /// One more thing is done.
    pub fn done(&self, message: impl Into<Cow<'static, str>>) {
        self.bar.set_message(message);
        self.bar.inc(1);
    }

    /// Where the work is.
    pub fn at(&self, message: impl Into<Cow<'static, str>>) -> ControlFlow<()> {
        self.bar.set_message(message);
        self.bar.tick();
        self.flow()
    }

    /// Whether to go on.
    pub fn flow(&self) -> ControlFlow<()> {
        if self.stopped.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Whether to go on, as a result.
    pub fn go_on(&self) -> Result<(), Error> {
        if self.flow().is_break() { Err(Error::Interrupted) } else { Ok(()) }
    }
}

impl Deref for Progress {
    type Target = ProgressBar;

    fn deref(&self) -> &ProgressBar {
        &self.bar
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// Writes to stdout. A reader that has had enough (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to stdout"),
    }
}

/// Where results go: the folder given, or else `results/runs/<parts joined by ->`.
pub fn folder_or(given: Option<&Path>, parts: &[&str]) -> PathBuf {
    let harmless = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    let usual = || PathBuf::from("results/runs").join(parts.join("-").chars().map(harmless).collect::<String>());
    given.map_or_else(usual, Path::to_owned)
}

/// Writes a file that begins with `head`, over one that begins so too but over no other.
pub fn write_own(path: &Path, text: &str, head: &str) -> Result<()> {
    if path.exists() && !std::fs::read(path).is_ok_and(|held| held.starts_with(head.as_bytes())) {
        return Err(Error::FileTaken { path: path.to_owned() }.into());
    }
    Ok(write_atomically(path, text.as_bytes())?)
}

/// Opens the folder for the results of `verb`: the one given, or else that of [`folder_or`].
pub fn open_folder(given: Option<&Path>, parts: &[&str], verb: &str) -> Result<(PathBuf, OutputFolder)> {
    let path = folder_or(given, parts);
    let folder = OutputFolder::open(&path, verb)?;
    Ok((path, folder))
}
