//! A running program: lines in, lines out, within a time, and never left behind.
//!
//! Pipes block: a program that does not read would hold up whoever writes to it, one that does not write whoever reads. So each
//! of its three pipes has a thread, and the episode waits on a channel, which has a time limit. On Unix the program leads a
//! process group of its own, and the whole group is ended with it: what it has started does not outlive it.

use std::io::{BufRead, BufReader, Read, Write};
use std::process::{self, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use super::command::ExecCommand;

/// Longest line that a program may write, bytes.
const LONGEST_LINE: u64 = 1 << 20;
/// How much of the end of stderr is kept, bytes.
const STDERR_TAIL: usize = 1500;
/// How long a program has to end by itself once its stdin is closed.
const GRACE: Duration = Duration::from_millis(500);
/// How long the rest of the stderr of a program that has ended is waited for.
const LAST_WORDS: Duration = Duration::from_millis(200);

/// Programs that run now, for [`end_all`].
static RUNNING: Mutex<Vec<u32>> = Mutex::new(Vec::new());

/// Ends all programs that run as methods, at once: for the handler of Ctrl-C. The episodes that wait for them go on, see that
/// their method is gone, and come to the place where they see that they are to stop.
pub fn end_all() {
    for id in lock(&RUNNING).iter() {
        kill(*id);
    }
}

/// Why there is no line.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Silence {
    /// It ended, or closed its stdout.
    Ended,
    /// It took longer than allowed.
    TooLong,
    /// It wrote more than a line may have.
    Endless,
    /// It wrote a line before it was asked.
    Unasked,
}

/// A program that was started and will be ended when this is dropped.
pub(super) struct Child {
    process: process::Child,
    to_program: Option<Sender<Vec<u8>>>,
    lines: Receiver<Option<Vec<u8>>>,
    /// The end of what it wrote to stderr.
    stderr: Arc<Mutex<Vec<u8>>>,
    /// Disconnects when stderr ends.
    stderr_open: Receiver<()>,
    status: Option<ExitStatus>,
    patience: Duration,
}

impl Child {
    /// Starts the program.
    ///
    /// # Errors
    /// When the system does not start it.
    pub(super) fn start(command: &ExecCommand) -> std::io::Result<Self> {
        let mut starting = Command::new(command.program());
        starting.args(command.arguments()).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut starting, 0);
        let mut process = {
            // Under the lock, so that no program starts unseen while all are being ended.
            let mut running = lock(&RUNNING);
            let process = starting.spawn()?;
            running.push(process.id());
            process
        };
        let (stdin, stdout, stderr_pipe) = (process.stdin.take(), process.stdout.take(), process.stderr.take());
        let (to_program, to_write) = channel::<Vec<u8>>();
        thread::spawn(move || {
            let Some(mut stdin) = stdin else { return };
            // A program that no longer reads is found out by its silence.
            while let Ok(line) = to_write.recv() {
                if stdin.write_all(&line).and_then(|()| stdin.flush()).is_err() {
                    return;
                }
            }
        });
        // Room for one line: a program that floods its stdout is held up by the pipe and fills no memory here.
        let (line_read, lines) = sync_channel(1);
        thread::spawn(move || {
            let Some(stdout) = stdout else { return };
            let mut stdout = BufReader::new(stdout);
            loop {
                let mut line = Vec::new();
                let read = stdout.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line);
                if !matches!(read, Ok(count) if count > 0) {
                    return;
                }
                let whole = line.ends_with(b"\n") || (line.len() as u64) < LONGEST_LINE;
                if line_read.send(whole.then_some(line)).is_err() || !whole {
                    return;
                }
            }
        });
        let stderr = Arc::<Mutex<Vec<u8>>>::default();
        let (stderr_ends, stderr_open) = channel();
        let tail = Arc::clone(&stderr);
        thread::spawn(move || {
            let _ends_here: Sender<()> = stderr_ends;
            let Some(mut pipe) = stderr_pipe else { return };
            let mut block = [0; 4096];
            while let Ok(count @ 1..) = pipe.read(&mut block) {
                let mut tail = lock(&tail);
                tail.extend_from_slice(&block[..count]);
                let surplus = tail.len().saturating_sub(STDERR_TAIL);
                tail.drain(..surplus);
            }
        });
        Ok(Self { process, to_program: Some(to_program), lines, stderr, stderr_open, status: None, patience: GRACE })
    }

    /// Sends a line and waits for the next one that comes back.
    pub(super) fn ask(&mut self, line: Vec<u8>, limit: Duration) -> Result<Vec<u8>, Silence> {
        match self.lines.try_recv() {
            Ok(_) => return Err(self.given_up(Silence::Unasked)),
            Err(TryRecvError::Disconnected) => return Err(self.given_up(Silence::Ended)),
            Err(TryRecvError::Empty) => {}
        }
        // Nobody takes the line where the program no longer reads; then none comes back either.
        let _ = self.to_program.as_ref().is_some_and(|sender| sender.send(line).is_ok());
        match self.lines.recv_timeout(limit) {
            Ok(Some(line)) => Ok(line),
            Ok(None) => Err(self.given_up(Silence::Endless)),
            Err(RecvTimeoutError::Disconnected) => Err(self.given_up(Silence::Ended)),
            Err(RecvTimeoutError::Timeout) => Err(self.given_up(Silence::TooLong)),
        }
    }

    /// Ends a program that did not do what it has to; one that has ended by itself keeps its own exit status.
    fn given_up(&mut self, silence: Silence) -> Silence {
        self.patience = if silence == Silence::Ended { LAST_WORDS } else { Duration::ZERO };
        self.end();
        silence
    }

    /// Closes stdin, gives the program its time to end by itself, and ends it.
    pub(super) fn end(&mut self) {
        if self.to_program.take().is_none() {
            return; // ended before
        }
        let deadline = Instant::now() + self.patience;
        // Its stdout ends when it does, unless something that it has started holds it.
        while self.lines.recv_timeout(deadline.saturating_duration_since(Instant::now())).is_ok() {}
        while !has_exited(&mut self.process) && Instant::now() < deadline {
            thread::sleep(Duration::from_millis(1));
        }
        // What has exited keeps its number until it is waited for, so that this ends its own group and no other one; the lock keeps
        // `end_all` from a number that is free again. Its exit status stays what it is.
        let mut running = lock(&RUNNING);
        kill(self.process.id());
        self.status = self.process.wait().ok();
        running.retain(|other| *other != self.process.id());
    }

    /// How it ended, and the last that it wrote to stderr.
    pub(super) fn last_words(&self) -> (Option<ExitStatus>, String) {
        let _ends_or_times_out = self.stderr_open.recv_timeout(LAST_WORDS);
        let tail = lock(&self.stderr);
        (self.status, String::from_utf8_lossy(&tail).trim().to_owned())
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        self.end();
    }
}

/// A lock, also where a thread has panicked with it: what it guards is whole at any time.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether a process has exited. It is not waited for, so that its number stays its own.
#[cfg(unix)]
fn has_exited(process: &mut process::Child) -> bool {
    use rustix::process::{Pid, WaitId, WaitIdOptions, waitid};
    let Some(id) = i32::try_from(process.id()).ok().and_then(Pid::from_raw) else { return true };
    let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    // An error means that there is nothing to wait for.
    waitid(WaitId::Pid(id), look).map_or(true, |status| status.is_some())
}

#[cfg(not(unix))]
fn has_exited(process: &mut process::Child) -> bool {
    !matches!(process.try_wait(), Ok(None))
}

/// Ends a process and its group.
#[cfg(unix)]
fn kill(id: u32) {
    use rustix::process::{Pid, Signal, kill_process_group};
    if let Some(group) = i32::try_from(id).ok().and_then(Pid::from_raw) {
        // It fails for a group that has just ended, which is as good.
        let _ = kill_process_group(group, Signal::KILL);
    }
}

/// Ends a process and what it has started.
#[cfg(not(unix))]
fn kill(id: u32) {
    let _ = Command::new("taskkill").args(["/F", "/T", "/PID", &id.to_string()]).output();
}
