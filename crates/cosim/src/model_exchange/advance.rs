//! [`Group::advance`]: steps of the integrator, located events, time events.

use trueup_fmi_import::interrupt;
use trueup_numerics::Figure;
use trueup_numerics::driver::{DriveError, Options, Quantity, Reached as Steps, Stepper as OneStep, System};
use trueup_numerics::event::Direction;

use super::field::{Evaluation, Field};
use super::{Group, Integrator, Reached, Surroundings};
use crate::error::Error;
use crate::node::Node;

/// What an event came from.
#[derive(Clone, Copy)]
enum Cause {
    Indicator(usize),
    Time,
    /// An FMU asked for it when a step was completed.
    Step(usize),
}

/// Events in a row within a nanosecond (at times around 1 s) after which they are held to be without end.
const CHATTER: u32 = 100;
/// h |lambda| at the border of stability of the explicit method, steps beyond it in a row that make a system
/// stiff, steps below it that make it look harmless again (Hairer, Wanner II, IV.2).
const STABLE: f64 = 3.25;
const STIFF: u32 = 15;
const HARMLESS: u32 = 6;

/// Times closer than this are the same.
fn tiny(t: f64) -> f64 {
    4.0 * f64::EPSILON * t.abs()
}

impl Group {
    /// Integrates to `to` (s), never beyond. Events on the way are handled; with `stop` it returns at each of them, with
    /// outputs as before the event, to be handled by [`Self::settle`]. So it does with one at `to` itself, which then
    /// sees the values that other FMUs have by then.
    ///
    /// # Errors
    /// What an FMU returns (a Discard only if it stays however short the step); values that are not finite; events
    /// or event iterations without end; no step that keeps the tolerance.
    pub fn advance(
        &mut self,
        nodes: &mut [Node],
        around: &mut dyn Surroundings,
        to: f64,
        stop: bool,
    ) -> Result<Reached, Error> {
        let ended = Reached { event: false, terminated: true };
        loop {
            if interrupt::requested() {
                return Err(Error::Interrupted { time: self.time });
            }
            if self.close(nodes, around)? {
                return Ok(ended);
            }
            let next = self.next_event();
            if self.time >= to {
                if let Some(next) = next.filter(|next| *next <= to + tiny(to)) {
                    if next > self.time {
                        self.time = next;
                        self.place(nodes, around)?;
                    }
                    self.mode.pending = true;
                }
                break;
            }
            let (end, timed) = match next {
                Some(next) if next < to - tiny(to) => (next.max(self.time), true),
                _ => (to, false),
            };
            let crossed = if end - self.time <= tiny(end) {
                self.time = end;
                None
            } else {
                self.step(nodes, around, end)?
            };
            let (asked, terminated) = self.complete(nodes, around)?;
            if terminated {
                return Ok(ended);
            }
            let time = (timed && self.time == end).then_some(Cause::Time);
            let Some(cause) = crossed.map(Cause::Indicator).or(time).or(asked.map(Cause::Step)) else {
                continue;
            };
            self.guard(nodes, cause)?;
            self.mode.pending = true;
            if stop || self.time >= to {
                break;
            }
            self.open(nodes)?;
        }
        if self.mode.pending || self.settings.opens {
            self.open(nodes)?;
        }
        Ok(Reached { event: self.mode.pending, terminated: false })
    }

    /// Inputs go on from here in another way: the integrator starts anew.
    pub fn interrupt(&mut self) {
        self.mode.fresh = true;
    }

    /// One accepted step; the indicator at whose crossing it ended.
    fn step(
        &mut self,
        nodes: &mut [Node],
        around: &mut dyn Surroundings,
        stop: f64,
    ) -> Result<Option<usize>, Error> {
        let n = self.x.len();
        let detect = self.settings.integrator == Integrator::Automatic && !self.stiff;
        let nominal = self.stepper.nominal_mut().to_vec();
        let mut field = Field {
            nodes,
            members: &self.members,
            around,
            nominal: &nominal,
            within: (self.time, stop),
            directional: !(self.settings.linked || self.distrusted),
            value: None,
            failure: None,
            refused: None,
            trace: detect.then(|| [Evaluation::new(n), Evaluation::new(n)]),
        };
        let directional = field.directional;
        if self.mode.fresh {
            let z = self.stepper.restart();
            field.indicators(self.time, &self.x, z);
            let bad = z.iter().position(|z| z.is_nan());
            if let Some(error) = field.failure.take().or_else(|| field.refused.take()) {
                return Err(error);
            }
            if let Some(i) = bad {
                return Err(self.bad_indicator(field.nodes, i));
            }
            self.mode.fresh = false;
        }
        let mut options = Options { tolerance: self.settings.tolerance, ..Options::default() };
        if let Integrator::Euler(h) = self.settings.integrator {
            options.max_step = h;
        }
        let (before, mut done) = (self.time, Steps::default());
        let result = self.stepper.step(
            &mut field,
            &|_| Direction::Both,
            &mut self.time,
            &mut self.x,
            &mut self.memory,
            stop,
            &options,
            &mut done,
        );
        self.statistics.accepted += done.accepted;
        self.statistics.rejected += done.rejected;
        let steps = done.accepted + done.rejected;
        let looks_stiff = field.stiffness(self.time - before).is_some_and(|hl| hl > STABLE);
        let Field { nodes, value, failure, refused, directional: still, .. } = field;
        if let Some(error) = failure {
            return Err(error);
        }
        if directional && !still {
            self.distrusted = true;
            self.notes.push(format!(
                "directional derivatives of the FMU contradict its derivatives at t = {} s; the Jacobian is made of differences",
                Figure(before)
            ));
        }
        let crossed = result.map_err(|error| self.stuck(nodes, error, value, refused))?;
        if let Some(slow) = self.pace.steps(steps, self.time, self.settings.span) {
            let names: Vec<_> = self.members.iter().map(|m| nodes[m.node].slave.name()).collect();
            let reason = format!("integration of {names:?}: {slow}");
            return Err(Error::Stuck { time: self.time, reason, log: Vec::new() });
        }
        if detect {
            self.suspect(looks_stiff);
        }
        Ok(crossed)
    }

    /// Counts steps that look stiff; changes to the stiff method after enough of them.
    fn suspect(&mut self, stiff: bool) {
        let (bad, good) = self.suspicion;
        self.suspicion = match stiff {
            true => (bad + 1, 0),
            false if good + 1 >= HARMLESS => (0, 0),
            false => (bad, good + 1),
        };
        if self.suspicion.0 >= STIFF {
            self.stiff = true;
            self.mode.fresh = true;
            let nominal = self.stepper.nominal_mut().to_vec();
            self.stepper = OneStep::new(self.settings.integrator.solver(true), nominal, self.indicators);
            self.notes.push(format!("stiff from t = {} s on: integrated by RODAS4", Figure(self.time)));
        }
    }

    /// Puts all FMUs at the time and the states of the group.
    fn place(&self, nodes: &mut [Node], around: &mut dyn Surroundings) -> Result<(), Error> {
        let mut field = Field {
            nodes,
            members: &self.members,
            around,
            nominal: &[],
            within: (self.time, self.time),
            directional: false,
            value: None,
            failure: None,
            refused: None,
            trace: None,
        };
        field.place(self.time, &self.x)
    }

    /// Tells all FMUs that the step is complete: which one asks for an event, whether one ends the run.
    fn complete(
        &mut self,
        nodes: &mut [Node],
        around: &mut dyn Surroundings,
    ) -> Result<(Option<usize>, bool), Error> {
        self.place(nodes, around)?;
        let (mut asked, mut terminated) = (None, false);
        for member in self.members.iter().filter(|m| m.completed) {
            let done = nodes[member.node].slave.completed_integrator_step(true).map_err(self.call())?;
            terminated |= done.terminate;
            if done.event {
                asked = Some(member.node);
            }
        }
        Ok((asked, terminated))
    }

    /// Counts events that follow each other at once.
    fn guard(&mut self, nodes: &[Node], cause: Cause) -> Result<(), Error> {
        let (t, m) = (self.time, &mut self.memory);
        let stands = t - m.event_time <= 1e-9 * t.abs().max(1.0);
        m.chatter = if stands { m.chatter + 1 } else { 0 };
        m.event_time = t;
        let storm = self.pace.event(t, self.settings.span);
        if m.chatter <= CHATTER && storm.is_none() {
            return Ok(());
        }
        let without_end = m.chatter > CHATTER;
        let (node, what) = match cause {
            Cause::Indicator(i) => self.indicator(nodes, i),
            Cause::Time => {
                let at = self.members.iter().find(|m| m.next_event.is_some_and(|next| next <= t));
                (at.map(|m| m.node), "its time event, which is never later than the one before,".into())
            }
            Cause::Step(node) => (Some(node), "completedIntegratorStep".into()),
        };
        let name = node.map(|n| nodes[n].slave.name().to_owned()).unwrap_or_default();
        if let Some(storm) = storm.filter(|_| !without_end) {
            self.notes.push(format!("{storm}, the last one by {what} of instance \"{name}\""));
            return Ok(());
        }
        let reason = format!(
            "events do not end: {CHATTER} in a row within a nanosecond, the last one by {what} of instance \"{name}\""
        );
        Err(Error::Stuck { time: t, reason, log: node.map(|n| nodes[n].slave.log()).unwrap_or_default() })
    }

    /// The FMU and the name of an indicator.
    fn indicator(&self, nodes: &[Node], i: usize) -> (Option<usize>, String) {
        let member = self.members.iter().find(|m| m.indicators.contains(&i));
        let name = member.map(|m| nodes[m.node].indicator_name(i - m.indicators.start));
        (member.map(|m| m.node), name.unwrap_or_default())
    }

    fn bad_indicator(&self, nodes: &[Node], i: usize) -> Error {
        let (node, variable) = self.indicator(nodes, i);
        let instance = node.map(|n| nodes[n].slave.name().to_owned()).unwrap_or_default();
        let log = node.map(|n| nodes[n].slave.log()).unwrap_or_default();
        Error::NotFinite { time: self.time, instance, variable, value: f64::NAN, log }
    }

    /// Why there is no further step.
    fn stuck(&self, nodes: &[Node], error: DriveError, value: Option<f64>, refused: Option<Error>) -> Error {
        let stuck = |reason: String| Error::Stuck { time: self.time, reason, log: Vec::new() };
        match (error, refused) {
            (DriveError::NotFinite { .. }, Some(Error::Call { source, .. })) => {
                stuck(format!("{source}, however short the step"))
            }
            (DriveError::NotFinite { what: Quantity::Indicator(i), .. }, _) => self.bad_indicator(nodes, i),
            (DriveError::NotFinite { what: Quantity::Rate(i), .. }, _) if value.is_some() => {
                self.not_finite(nodes, i, true, value.unwrap_or(f64::NAN))
            }
            (DriveError::NotFinite { what: Quantity::State(i), .. }, _) => {
                self.not_finite(nodes, i, false, f64::NAN)
            }
            (error, _) => {
                let names: Vec<_> = self.members.iter().map(|m| nodes[m.node].slave.name()).collect();
                stuck(format!("integration of {names:?} fails: {error}"))
            }
        }
    }
}
