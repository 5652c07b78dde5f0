//! Progress of work that goes through stages, on standard error: what is being done, how far it is, how long it may still
//! take.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar};

use crate::progress::{PARTS, bar};

/// Before this nothing is said of the time left: too little is known.
const FIRST: Duration = Duration::from_secs(2);

/// A bar that moves on a terminal, lines elsewhere.
pub(crate) struct Stages {
    bar: Option<ProgressBar>,
    begun: Instant,
    reached: f64,
}

impl Stages {
    pub(crate) fn new() -> Self {
        let bar = std::io::stderr().is_terminal().then(bar);
        Self { bar, begun: Instant::now(), reached: 0.0 }
    }

    /// `part` of the work (0 to 1) is done, `what` is being done now.
    pub(crate) fn tell(&mut self, part: f64, what: &str) {
        self.reached = reached(self.reached, part);
        let message = message(self.reached, what, self.begun.elapsed());
        match &self.bar {
            Some(bar) => {
                bar.set_position((PARTS * self.reached) as u64);
                bar.set_message(message);
            }
            None => eprintln!("{:3.0} %  {message}", 100.0 * self.reached),
        }
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Never back.
fn reached(before: f64, part: f64) -> f64 {
    if part.is_finite() { part.clamp(before, 1.0) } else { before }
}

fn message(part: f64, what: &str, spent: Duration) -> String {
    if part >= 1.0 || part <= 0.0 || spent < FIRST {
        return what.to_owned();
    }
    let left = spent.mul_f64(((1.0 - part) / part).min(1e4));
    format!("{what}, about {} left", HumanDuration(Duration::from_secs(left.as_secs().max(1))))
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
        assert_eq!(
            [reached(0.7, 0.4), reached(0.4, 0.7), reached(0.4, 7.0), reached(0.4, f64::NAN)],
            [0.7, 0.7, 1.0, 0.4]
        );
    }
}
