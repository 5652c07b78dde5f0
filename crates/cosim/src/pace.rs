//! Whether a run comes forward: how far steps and events lead.

use trueup_numerics::Figure;

/// Steps after which it is looked how far they led.
const STEPS: usize = 50_000;
/// The part of the whole run that so many steps have to lead on average each: at a ten-thousand-millionth the rest would
/// take 200 000 times what the steps took that were looked at.
const LEAST: f64 = 1e-10;
/// Events after which it is looked how far they led, and the part of the run below which that is worth a word.
const EVENTS: usize = 10_000;
const STORM: f64 = 1e-2;

/// Counts of steps and events since they were looked at last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pace {
    steps: (usize, f64),
    events: (usize, f64),
    told: bool,
}

impl Pace {
    /// From this time in s on.
    pub(crate) fn at(time: f64) -> Self {
        Self { steps: (0, time), events: (0, time), told: false }
    }

    /// More steps have led to `time`, in a run of `span` s: what is wrong if that is next to nowhere.
    pub(crate) fn steps(&mut self, more: usize, time: f64, span: f64) -> Option<String> {
        let (steps, since) = self.steps;
        let steps = steps + more;
        self.steps = (steps, since);
        if steps < STEPS {
            return None;
        }
        self.steps = (0, time);
        let each = (time - since) / steps as f64;
        (each < LEAST * span).then(|| {
            let (each, left) = (Figure(each), Figure(span / each));
            format!(
                "steps fell below {} s: the last {steps} led {each} s each, and the whole run would take {left} of them; its \
                 derivatives jump or are noise: give what switches an event indicator, or set a fixed step with Co-Simulation",
                Figure(LEAST * span)
            )
        })
    }

    /// There is an event at `time` in a run of `span` s: how many a second, once, if they are very many.
    pub(crate) fn event(&mut self, time: f64, span: f64) -> Option<String> {
        let (events, since) = self.events;
        self.events = (events + 1, since);
        if events + 1 < EVENTS {
            return None;
        }
        self.events = (0, time);
        let gone = time - since;
        let storm = !self.told && gone < STORM * span;
        self.told |= storm;
        storm.then(|| {
            let rate = Figure(EVENTS as f64 / gone);
            format!(
                "{rate} events per s at t = {} s slow the run down: {EVENTS} within {} s",
                Figure(time),
                Figure(gone)
            )
        })
    }
}
