//! Long work that goes through stages: what is being done, how far it is, how long it may still take, on standard error; and its
//! end at a deadline, by Ctrl-C or by SIGTERM, wherever the work is.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar};
use trueup_fmi_import::interrupt;
use trueup_identification::parallel;

use crate::progress::{PARTS, bar, end_by_signal};
use crate::voice;

/// Before this the time left is not reported: too little is known.
const FIRST: Duration = Duration::from_secs(2);
/// ... as it is before this part of the work.
const LEAST: f64 = 0.05;
/// Between two looks at deadline and signals.
const LOOK: Duration = Duration::from_millis(50);
/// Silence after which a line reports that the work goes on: on a terminal, elsewhere.
const SILENCE: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(5)];

/// A bar that moves on a terminal, lines elsewhere. Where the work is watched a thread of its own follows deadline and signals: when
/// either comes the program ends with exit status 1, without waiting for the work, so that no loop can keep it.
pub(crate) struct Stages {
    shared: Arc<SharedStages>,
    watch: Option<JoinHandle<()>>,
}

struct SharedStages {
    begun: Instant,
    deadline: Option<Duration>,
    over: AtomicBool,
    now: Mutex<Now>,
}

/// Where the work is.
struct Now {
    bar: Option<ProgressBar>,
    /// 0 to 1; `None`: not known.
    reached: Option<f64>,
    what: String,
    /// When the first part of it was reported: what was done before is no measure of the rest.
    told: Option<Instant>,
    /// When something was reported.
    said: Instant,
}

impl Stages {
    /// Of work that nothing ends but itself.
    pub(crate) fn new() -> Self {
        Self { shared: Arc::new(SharedStages::new("", None)), watch: None }
    }

    /// Of work that writes nothing, which a deadline in s from now and signals may end; `what` is done first.
    pub(crate) fn watched(what: &str, deadline: Option<f64>) -> Self {
        end_by_signal();
        let shared = Arc::new(SharedStages::new(what, deadline.map(Duration::from_secs_f64)));
        let watched = Arc::clone(&shared);
        // Without a thread there is neither deadline nor word of progress; the work is done all the same.
        let watch = std::thread::Builder::new().name("watch".into()).spawn(move || watched.watch()).ok();
        Self { shared, watch }
    }

    /// `part` of the work (0 to 1) is done, `what` is being done now.
    pub(crate) fn tell(&self, part: f64, what: &str) {
        let mut now = self.shared.now();
        let spent = now.told.get_or_insert_with(Instant::now).elapsed();
        let reached = reached(now.reached.unwrap_or(0.0), part);
        (now.reached, now.what) = (Some(reached), what.to_owned());
        if now.bar.is_none() && std::io::stderr().is_terminal() {
            now.bar = Some(bar());
        }
        now.say(&message(reached, what, spent));
    }

    /// `what` is being done now; its progress is not known.
    pub(crate) fn name(&self, what: &str) {
        let mut now = self.shared.now();
        what.clone_into(&mut now.what);
        now.say(&format!("{what} ..."));
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        self.shared.over.store(true, Ordering::Relaxed);
        if let Some(watch) = self.watch.take() {
            _ = watch.join(); // it has nothing to say
        }
        if let Some(bar) = &self.shared.now().bar {
            bar.finish_and_clear();
        }
    }
}

impl Now {
    fn say(&mut self, message: &str) {
        self.said = Instant::now();
        match (&self.bar, self.reached) {
            (Some(bar), reached) => {
                bar.set_position((PARTS * reached.unwrap_or(0.0)) as u64);
                bar.set_message(message.to_owned());
            }
            (None, Some(reached)) => voice::line(&format!("{:3.0} %  {message}", 100.0 * reached)),
            (None, None) => voice::line(message),
        }
    }
}

impl SharedStages {
    fn new(what: &str, deadline: Option<Duration>) -> Self {
        let begun = Instant::now();
        let now = Now { bar: None, reached: None, what: what.to_owned(), told: None, said: begun };
        Self { begun, deadline, over: AtomicBool::new(false), now: Mutex::new(now) }
    }

    fn now(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn watch(&self) {
        while !self.over.load(Ordering::Relaxed) {
            std::thread::sleep(LOOK);
            let spent = self.begun.elapsed();
            if interrupt::requested() {
                self.end("interrupted", spent);
            }
            if let Some(deadline) = self.deadline.filter(|d| spent >= *d) {
                self.end(&format!("not done within --deadline {} s", deadline.as_secs_f64()), spent);
            }
            let mut now = self.now();
            let silence = SILENCE[usize::from(now.bar.is_none())];
            if now.said.elapsed() >= silence {
                let worked = now.told.map_or(spent, |t| t.elapsed());
                let message = still(now.reached, &now.what, worked, parallel::tasks_done());
                now.say(&message);
            }
        }
    }

    /// Ends the program, unless the work has just ended itself.
    fn end(&self, why: &str, spent: Duration) {
        let now = self.now();
        if self.over.load(Ordering::Relaxed) {
            return;
        }
        if let Some(bar) = &now.bar {
            bar.finish_and_clear();
        }
        voice::error(&ended(why, now.reached, &now.what, spent));
        trueup_fmi_import::exit::expect();
        crate::isolate::say(1);
        std::process::exit(1);
    }
}

/// Never back.
fn reached(before: f64, part: f64) -> f64 {
    if part.is_finite() { part.clamp(before, 1.0) } else { before }
}

fn message(part: f64, what: &str, spent: Duration) -> String {
    if !(LEAST..1.0).contains(&part) || spent < FIRST {
        return what.to_owned();
    }
    let left = spent.mul_f64(((1.0 - part) / part).min(1e4));
    format!("{what}, about {} left", HumanDuration(Duration::from_secs(left.as_secs().max(1))))
}

/// What is reported after a silence: simulations, fits and parts of them are counted, so that it is seen that the work goes on.
fn still(reached: Option<f64>, what: &str, spent: Duration, done: u64) -> String {
    let so_far = format!("still {what}: {done} simulations and fits, {} s so far", spent.as_secs());
    reached.map_or_else(|| so_far.clone(), |part| message(part, &so_far, spent))
}

fn ended(why: &str, reached: Option<f64>, what: &str, spent: Duration) -> String {
    let part = reached.map_or_else(String::new, |part| format!(", at {:.0} %", 100.0 * part));
    format!("{why}: after {:.1} s{part} it was {what}; nothing is written", spent.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_says_what_is_left_once_it_knows_and_never_goes_back() {
        let at = |part, seconds| message(part, "fitting", Duration::from_secs(seconds));
        assert_eq!(at(0.25, 10), "fitting, about 30 seconds left");
        assert_eq!(at(0.25, 1), "fitting");
        assert_eq!(at(0.999, 10), "fitting, about 1 second left");
        assert_eq!(at(1.0, 10), "fitting");
        assert_eq!(at(0.0, 10), "fitting");
        assert_eq!(at(0.01, 10), "fitting");
        assert_eq!(
            [reached(0.7, 0.4), reached(0.4, 0.7), reached(0.4, 7.0), reached(0.4, f64::NAN)],
            [0.7, 0.7, 1.0, 0.4]
        );
    }

    #[test]
    fn silence_ends_with_what_is_done_and_a_forecast_that_moves() {
        let at = |reached, seconds| still(reached, "fitting", Duration::from_secs(seconds), 12);
        assert_eq!(
            at(Some(0.25), 10),
            "still fitting: 12 simulations and fits, 10 s so far, about 30 seconds left"
        );
        assert_eq!(
            at(Some(0.25), 15),
            "still fitting: 12 simulations and fits, 15 s so far, about 45 seconds left"
        );
        assert_eq!(at(None, 15), "still fitting: 12 simulations and fits, 15 s so far");
    }

    #[test]
    fn an_end_names_what_was_done_and_how_far_it_was() {
        let spent = Duration::from_millis(2040);
        assert_eq!(
            ended("interrupted", Some(0.35), "fitting", spent),
            "interrupted: after 2.0 s, at 35 % it was fitting; nothing is written"
        );
        assert_eq!(
            ended("interrupted", None, "reading", spent),
            "interrupted: after 2.0 s it was reading; nothing is written"
        );
    }
}
