//! What all subcommands share: where output goes, and whether somebody pressed Ctrl-C.

use std::io::{ErrorKind, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use wayhome::study::pool::Pool;

use super::args::CommonArgs;

/// Exit code of a process that is interrupted a second time, and of one that ends in good order after the first.
const INTERRUPTED: i32 = 130;

/// Settings and channels of a command.
pub struct Context {
    json: bool,
    show_progress: bool,
    stopped: Arc<AtomicBool>,
}

impl Context {
    /// Sets up logging, worker threads and the handler of Ctrl-C.
    pub fn new(args: &CommonArgs) -> Result<Self> {
        let filter = env_logger::Env::default().default_filter_or(if args.quiet { "off" } else { "error,wayhome=warn" });
        env_logger::Builder::from_env(filter).format_timestamp(None).init();
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
                std::process::exit(INTERRUPTED);
            }
        })
        .context("cannot watch for Ctrl-C")?;
        Ok(Self { json: args.json, show_progress: !args.quiet && std::io::stderr().is_terminal(), stopped })
    }

    /// Whether the user asked the command to stop.
    pub fn is_stopped(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    /// The workers of a study, which Ctrl-C stops.
    pub fn pool(&self) -> Pool<'_> {
        Pool { threads: rayon::current_num_threads(), stopped: &self.stopped }
    }

    /// Prints a result: as one JSON object where the user asked for it, else as text.
    pub fn print(&self, json: &impl Serialize, text: impl FnOnce() -> String) -> Result<()> {
        let text = if self.json { wayhome::storage::json(json) } else { text() };
        print(&text)
    }

    /// A progress bar on stderr for `length` things, or a spinner; it is silent when nobody watches.
    pub fn progress(&self, length: Option<u64>) -> Result<ProgressBar> {
        if !self.show_progress {
            return Ok(ProgressBar::hidden());
        }
        let template = if length.is_some() { "{bar:32} {pos}/{len} {elapsed} {msg}" } else { "{spinner} {elapsed} {msg}" };
        styled(length, template)
    }

    /// A progress bar with rate and time left, for long work of many like things; it is silent when nobody watches.
    pub fn work(&self, length: u64) -> Result<ProgressBar> {
        if !self.show_progress {
            return Ok(ProgressBar::hidden());
        }
        styled(Some(length), "{bar:32} {pos}/{len}, {per_sec}, {eta} left")
    }
}

fn styled(length: Option<u64>, template: &str) -> Result<ProgressBar> {
    let style = ProgressStyle::with_template(template).context("progress template")?;
    let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::stderr_with_hz(8));
    Ok(bar.with_style(style))
}

/// Writes to stdout. A reader that has had enough (`| head`) is no error.
pub fn print(text: &str) -> Result<()> {
    let mut stdout = std::io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to stdout"),
    }
}

/// Where results go without `--out`: `results/runs/<parts joined by ->`.
pub fn default_folder(parts: &[&str]) -> PathBuf {
    let harmless = |c: char| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' };
    PathBuf::from("results/runs").join(parts.join("-").chars().map(harmless).collect::<String>())
}
