//! A diagnosis as a process of its own: it sees the case's folder and nothing else of the trial.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use trueup_trials::{CaseFailure, TimeTaken};

use crate::error::CliError;

/// Wall time, in limits of processor time, after which a process that sleeps is stopped as well.
const PATIENCE: f64 = 10.0;
/// Time between two looks at whether it has ended.
const LOOK: Duration = Duration::from_millis(10);

/// How diagnoses are made.
pub(super) struct Child {
    program: PathBuf,
    verdict_only: bool,
    limit: f64,
}

impl Child {
    /// With a limit of processor time, s, which the kernel holds children to where it can.
    pub(super) fn new(program: &Path, verdict_only: bool, limit: f64) -> Result<Self, CliError> {
        hold_children_to(limit)
            .map_err(|e| CliError::Failed(format!("a limit of {limit} s cannot be set: {e}")))?;
        Ok(Self { program: program.to_owned(), verdict_only, limit })
    }

    pub(super) fn diagnose(&self, case: &Path, out: &Path) -> Result<TimeTaken, CaseFailure> {
        let said = |e: std::io::Error| CaseFailure::Said(format!("{}: {e}", self.program.display()));
        let before = processor_time_of_children();
        let mut command = Command::new(&self.program);
        command.arg("diagnose").arg(case).arg("-o").arg(out);
        if self.verdict_only {
            command.arg("--verdict-only");
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let (begun, mut child) = (Instant::now(), command.spawn().map_err(said)?);
        let errors = child.stderr.take();
        let words = thread::spawn(move || {
            let mut bytes = Vec::new();
            // What cannot be read any more is not needed: the exit status is enough.
            let _ = errors.map(|mut e| e.read_to_end(&mut bytes));
            String::from_utf8_lossy(&bytes).into_owned()
        });
        let mut asleep = false;
        let status = loop {
            if let Some(status) = child.try_wait().map_err(said)? {
                break status;
            }
            if begun.elapsed().as_secs_f64() > PATIENCE * self.limit {
                asleep = true;
                child.kill().map_err(said)?;
                break child.wait().map_err(said)?;
            }
            thread::sleep(LOOK);
        };
        let words = words.join().unwrap_or_default();
        if asleep || was_stopped(status) {
            return Err(CaseFailure::Stopped(self.limit));
        }
        if !status.success() {
            let last = words.lines().last().unwrap_or("it ended without a message");
            return Err(CaseFailure::Said(last.to_owned()));
        }
        let processor_seconds =
            processor_time_of_children().zip(before).map(|(after, before)| after - before);
        Ok(TimeTaken { seconds: begun.elapsed().as_secs_f64(), processor_seconds })
    }
}

#[cfg(unix)]
fn hold_children_to(seconds: f64) -> Result<(), nix::Error> {
    use nix::sys::resource::{Resource, getrlimit, setrlimit};
    // Children take it over; this process itself only waits.
    let (_, hard) = getrlimit(Resource::RLIMIT_CPU)?;
    setrlimit(Resource::RLIMIT_CPU, (seconds.ceil() as u64).min(hard), hard)
}

#[cfg(unix)]
fn was_stopped(status: ExitStatus) -> bool {
    use std::os::unix::process::ExitStatusExt;
    status.signal() == Some(nix::sys::signal::Signal::SIGXCPU as i32)
}

/// Of all that have ended, s.
#[cfg(unix)]
fn processor_time_of_children() -> Option<f64> {
    use nix::sys::resource::{UsageWho, getrusage};
    use nix::sys::time::TimeValLike;
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN).ok()?;
    let seconds = |t: nix::sys::time::TimeVal| t.num_microseconds() as f64 * 1e-6;
    Some(seconds(usage.user_time()) + seconds(usage.system_time()))
}

#[cfg(not(unix))]
fn hold_children_to(_: f64) -> Result<(), std::convert::Infallible> {
    Ok(())
}

#[cfg(not(unix))]
fn was_stopped(_: ExitStatus) -> bool {
    false
}

#[cfg(not(unix))]
fn processor_time_of_children() -> Option<f64> {
    None
}
