//! Whether a run advances: progress in time per number of steps and events.

use trueup_numerics::ShortNumber;

/// Steps after which their progress is checked.
const STEPS: usize = 100_000;
/// The part of the whole run that each step has to advance on average: below it the rest would take more than ten
/// thousand times what the steps took that were looked at (decision 0035).
const LEAST: f64 = 1e-9;
/// Events after which their progress is checked, and the part of the run below which it is reported.
const EVENTS: usize = 10_000;
const STORM: f64 = 1e-2;

/// Counts of steps and events since they were looked at last.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    steps: (usize, f64),
    events: (usize, f64),
    /// Very many events have been reported.
    reported: bool,
}

impl Pace {
    /// From this time in s on.
    pub fn at(time: f64) -> Self {
        Self { steps: (0, time), events: (0, time), reported: false }
    }

    /// More steps have reached `time` in a run of `span` s: a message if that is almost no progress.
    pub fn steps(&mut self, more: usize, time: f64, span: f64) -> Option<String> {
        let (steps, since) = self.steps;
        let steps = steps + more;
        self.steps = (steps, since);
        if steps < STEPS {
            return None;
        }
        self.steps = (0, time);
        let each = (time - since) / steps as f64;
        (each < LEAST * span).then(|| {
            let (each, left) = (ShortNumber(each), ShortNumber(span / each));
            format!(
                "steps fell below {} s: the last {steps} advanced {each} s each, and the whole run would take {left} of them; its \
                 derivatives jump or are noise: give what switches an event indicator, or set a fixed step with Co-Simulation",
                ShortNumber(LEAST * span)
            )
        })
    }

    /// There is an event at `time` in a run of `span` s: how many a second, once, if they are very many.
    pub fn event(&mut self, time: f64, span: f64) -> Option<String> {
        let (events, since) = self.events;
        self.events = (events + 1, since);
        if events + 1 < EVENTS {
            return None;
        }
        self.events = (0, time);
        let gone = time - since;
        let storm = !self.reported && gone < STORM * span;
        self.reported |= storm;
        storm.then(|| {
            let rate = ShortNumber(EVENTS as f64 / gone);
            format!(
                "{rate} events per s at t = {} s slow the run down: {EVENTS} within {} s",
                ShortNumber(time),
                ShortNumber(gone)
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of these parts of a run of `span` s, one by one: after how many the lack of progress is reported.
    fn stops(span: f64, parts: impl IntoIterator<Item = f64>) -> Option<usize> {
        let (mut pace, mut time) = (Pace::at(0.0), 0.0);
        parts.into_iter().position(|part| {
            time += part * span;
            pace.steps(1, time, span).is_some()
        })
    }

    #[test]
    fn steps_without_progress_are_found_at_any_length_of_run_and_others_never() {
        for span in [1e-3, 1.0, 3600.0] {
            let many = 3 * STEPS;
            assert_eq!(stops(span, std::iter::repeat_n(0.5 * LEAST, many)), Some(STEPS - 1));
            assert_eq!(stops(span, std::iter::repeat_n(2.0 * LEAST, many)), None);
            // Short steps that are followed by longer ones, as after a start or a switch.
            let switches = (0..many).map(|k| if k % STEPS < STEPS - 10 { 1e-15 } else { 1e-4 });
            assert_eq!(stops(span, switches), None);
        }
        // A run whose length is not known has no limit.
        assert_eq!(stops(0.0, std::iter::repeat_n(1.0, 2 * STEPS)), None);
    }

    #[test]
    fn many_events_are_reported_once_with_their_rate() {
        for (each, reported) in [(5e-7, 1), (1e-4, 0)] {
            let mut pace = Pace::at(0.0);
            let messages: Vec<_> =
                (1..=30_000).filter_map(|k| pace.event(f64::from(k) * each, 1.0)).collect();
            assert_eq!(messages.len(), reported, "{messages:?}");
            assert!(messages.iter().all(|s| s.starts_with("2000000 events per s")), "{messages:?}");
        }
    }
}
