//! Progress of a run on standard error, and its end by Ctrl-C or SIGTERM.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};
use trueup_cosim::{CosimError, ResultColumn, ResultRow, ResultSink};
use trueup_fmi_import::interrupt;

use crate::isolate::{self, ONCE};
use crate::voice;

/// Divisions of the bar.
pub(crate) const PARTS: f64 = 1000.0;

/// A sink that shows how far the run is, and ends it when the user does: what was computed is then kept as partial.
pub(crate) struct Progress {
    shown: ProgressOutput,
    start: f64,
    stop: f64,
    begun: Instant,
    next: Instant,
}

enum ProgressOutput {
    /// On a terminal: one line that moves.
    Bar(ProgressBar),
    /// Into a file or a pipe, if requested: a line now and then.
    Lines,
    Nothing,
}

impl Progress {
    /// Of a run from `start` to `stop` in s.
    pub(crate) fn new(start: f64, stop: f64, asked_for: bool) -> Self {
        let shown = match std::io::stderr().is_terminal() {
            true => ProgressOutput::Bar(bar()),
            false if asked_for => ProgressOutput::Lines,
            false => ProgressOutput::Nothing,
        };
        end_by_signal();
        let now = Instant::now();
        Self { shown, start, stop, begun: now, next: now + FIRST }
    }

    fn show(&mut self, time: f64, now: Instant) {
        let part = ((time - self.start) / (self.stop - self.start)).clamp(0.0, 1.0);
        let message = message(time, part, now - self.begun);
        match &self.shown {
            ProgressOutput::Bar(bar) => {
                bar.set_position((PARTS * part) as u64);
                bar.set_message(message);
                self.next = now + Duration::from_millis(100);
            }
            ProgressOutput::Lines => {
                voice::line(&format!("{:3.0} %  {message}", 100.0 * part));
                self.next = now + Duration::from_secs(2);
            }
            ProgressOutput::Nothing => self.next = now + Duration::from_secs(3600),
        }
    }
}

/// At `time` (s), with this part of the run done in that time: the rest is taken to go on at the same pace.
fn message(time: f64, part: f64, spent: Duration) -> String {
    let left = spent.mul_f64((1.0 - part) / part.max(1e-9));
    let left = HumanDuration(Duration::from_secs(left.as_secs()));
    format!("t = {time:.6} s, {left:#} left")
}

/// Ctrl-C and SIGTERM alike request the end of the work. The second one ends the program at once. Where no handler can be set, the first one
/// does.
pub(crate) fn end_by_signal() {
    let mut first = None;
    let _ = ctrlc::set_handler(move || {
        let begun = *first.get_or_insert_with(Instant::now);
        if interrupt::request() && begun.elapsed() >= ONCE {
            trueup_fmi_import::exit::expect();
            isolate::say(130);
            std::process::exit(130);
        }
    });
}

/// A short run shows nothing.
const FIRST: Duration = Duration::from_millis(500);

/// An empty bar.
pub(crate) fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}");
    ProgressBar::new(PARTS as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let ProgressOutput::Bar(bar) = &self.shown {
            bar.finish_and_clear();
        }
    }
}

impl ResultSink for Progress {
    fn begin(&mut self, _: &[ResultColumn]) -> Result<(), CosimError> {
        Ok(())
    }

    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        if interrupt::requested() {
            return Err(CosimError::Interrupted { time: row.time });
        }
        let now = Instant::now();
        if now >= self.next {
            self.show(row.time, now);
        }
        Ok(())
    }
}

/// Where hanging up shall not end the program (`nohup`), it shall not end a run either; a program that handles SIGTERM handles
/// it too.
#[cfg(unix)]
pub(crate) fn keep_hangup_ignored() {
    use nix::sys::signal::{SigSet, Signal};
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    if mask >> (Signal::SIGHUP as u32 - 1) & 1 == 1 {
        // For all threads, which take it over from this first one.
        let _ = SigSet::from(Signal::SIGHUP).thread_block();
    }
}

#[cfg(not(unix))]
pub(crate) fn keep_hangup_ignored() {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_goes_on_at_the_same_pace() {
        for (part, spent, expected) in [
            (0.25, 10, "t = 3.500000 s, 30s left"),
            (0.25, 100, "t = 3.500000 s, 5m left"),
            (0.5, 7200, "t = 3.500000 s, 2h left"),
            (1.0, 5, "t = 3.500000 s, 0s left"),
        ] {
            assert_eq!(message(3.5, part, Duration::from_secs(spent)), expected);
        }
        // Nothing done yet: long, but no failure.
        assert!(message(0.0, 0.0, Duration::from_secs(1)).ends_with(" left"));
    }
}
