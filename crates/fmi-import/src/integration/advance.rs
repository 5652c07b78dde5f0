//! [`IntegratedGroup::advance`]: steps of the integrator, located events, time events.

use trueup_numerics::ShortNumber;
use trueup_numerics::driver::{
    DriveError, DriverOptions, DriverQuantity, DriverReached as Steps, ErrorControlledStepper, OdeSystem,
};
use trueup_numerics::event::Direction;

use super::field::{IntegrationRates, RateEvaluation, place};
use super::{Failure, Fmus, IntegratedGroup, IntegrationEvent, IntegrationReached, Integrator};
use crate::interrupt;

/// Events in a row within a nanosecond (at times around 1 s) after which they are assumed to be endless.
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

impl IntegratedGroup {
    /// Integrates to `to` (s), never beyond. Events on the way are handled; with `stop` it returns at each of them, with
    /// outputs as before the event, to be handled by [`Self::settle`]. So it does with one at `to` itself, which then
    /// sees the values that other FMUs have by then.
    ///
    /// # Errors
    /// What an FMU returns (a Discard only if it stays however short the step); values that are not finite; events
    /// or event iterations without end; no step that keeps the tolerance.
    pub fn advance<F: Fmus + ?Sized>(
        &mut self,
        fmus: &mut F,
        to: f64,
        stop: bool,
    ) -> Result<IntegrationReached, Failure<F::Error>> {
        let ended = IntegrationReached { event: false, terminated: true };
        let (from, mut events) = (self.time, 0);
        self.steps = Steps::default();
        loop {
            if interrupt::requested() {
                return Err(Failure::Interrupted { time: self.time });
            }
            if self.go_on(fmus)? {
                return Ok(ended);
            }
            let next = self.next_event();
            if self.time >= to {
                if let Some(next) = next.filter(|next| *next <= to + tiny(to)) {
                    if next > self.time {
                        self.time = next;
                        self.place(fmus)?;
                    }
                    self.mode.pending = Some(IntegrationEvent::Time);
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
                self.step(fmus, end)?
            };
            let (asked, terminated) = self.complete(fmus)?;
            if terminated {
                return Ok(ended);
            }
            let time = (timed && self.time == end).then_some(IntegrationEvent::Time);
            let Some(cause) =
                crossed.map(IntegrationEvent::Indicator).or(time).or(asked.map(IntegrationEvent::Step))
            else {
                continue;
            };
            self.guard(fmus, cause)?;
            self.mode.pending = Some(cause);
            if stop || self.time >= to {
                break;
            }
            events += 1;
            if events > self.settings.most_events {
                let reason = format!(
                    "more than {} events between t = {} s and {} s",
                    self.settings.most_events,
                    ShortNumber(from),
                    ShortNumber(to)
                );
                return Err(Failure::Stuck { time: self.time, reason, log: Vec::new() });
            }
        }
        if self.settings.opens {
            self.open(fmus)?;
        }
        Ok(IntegrationReached { event: self.mode.pending.is_some(), terminated: false })
    }

    /// One accepted step; the indicator at whose crossing it ended.
    fn step<F: Fmus + ?Sized>(
        &mut self,
        fmus: &mut F,
        stop: f64,
    ) -> Result<Option<usize>, Failure<F::Error>> {
        let n = self.x.len();
        let detect = self.settings.integrator == Integrator::Automatic && !self.stiff;
        let nominal = self.stepper.nominal_mut().to_vec();
        let mut field = IntegrationRates {
            fmus,
            members: &self.members,
            along: self.along.as_ref(),
            nominal: &nominal,
            within: (self.time, stop),
            directional: !(self.settings.linked || self.distrusted),
            value: None,
            failure: None,
            refused: None,
            trace: detect.then(|| [RateEvaluation::new(n), RateEvaluation::new(n)]),
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
                return Err(self.bad_indicator(field.fmus, i));
            }
            self.mode.fresh = false;
        }
        let Self { settings, .. } = self;
        let mut options = DriverOptions {
            tolerance: settings.tolerance,
            max_steps: settings.most_steps,
            ..DriverOptions::default()
        };
        if let Integrator::Euler(h) = self.settings.integrator {
            options.max_step = h;
        }
        let (before, before_steps) = (self.time, self.steps);
        let result = self.stepper.step(
            &mut field,
            &|_| Direction::Both,
            &mut self.time,
            &mut self.x,
            &mut self.memory,
            stop,
            &options,
            &mut self.steps,
        );
        let accepted = self.steps.accepted - before_steps.accepted;
        let rejected = self.steps.rejected - before_steps.rejected;
        self.statistics.accepted += accepted;
        self.statistics.rejected += rejected;
        let looks_stiff = field.stiffness(self.time - before).is_some_and(|hl| hl > STABLE);
        let IntegrationRates { fmus, value, failure, refused, directional: still, .. } = field;
        if let Some(error) = failure {
            return Err(error);
        }
        if directional && !still {
            self.distrusted = true;
            self.notes.push(format!(
                "directional derivatives of the FMU contradict its derivatives at t = {} s; the Jacobian is made of differences",
                ShortNumber(before)
            ));
        }
        let crossed = result.map_err(|error| self.stuck(fmus, error, value, refused))?;
        if let Some(slow) = self.pace.steps(accepted + rejected, self.time, self.settings.span) {
            let reason = format!("integration of {:?}: {slow}", self.instances(fmus));
            return Err(Failure::Stuck { time: self.time, reason, log: Vec::new() });
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
            self.stepper =
                ErrorControlledStepper::new(self.settings.integrator.solver(true), nominal, self.indicators);
            self.notes.push(format!("stiff from t = {} s on: integrated by RODAS4", ShortNumber(self.time)));
        }
    }

    /// Puts all FMUs at the time and the states of the group, in continuous-time mode, with their inputs.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    pub fn place<F: Fmus + ?Sized>(&self, fmus: &mut F) -> Result<(), Failure<F::Error>> {
        place(fmus, &self.members, self.time, &self.x)
    }

    /// Reports to all FMUs that the step is complete: which one requests an event, whether one ends the run.
    fn complete<F: Fmus + ?Sized>(
        &mut self,
        fmus: &mut F,
    ) -> Result<(Option<usize>, bool), Failure<F::Error>> {
        self.place(fmus)?;
        let (mut requested, mut terminated) = (None, false);
        for (at, _) in self.members.iter().enumerate().filter(|(_, m)| m.completed) {
            let done = fmus.instance(at).completed_integrator_step().map_err(self.call())?;
            terminated |= done.terminate;
            if done.event {
                requested = Some(at);
            }
        }
        Ok((requested, terminated))
    }

    /// Counts events that follow each other at once.
    fn guard<F: Fmus + ?Sized>(
        &mut self,
        fmus: &mut F,
        cause: IntegrationEvent,
    ) -> Result<(), Failure<F::Error>> {
        let (t, m) = (self.time, &mut self.memory);
        let same = t - m.event_time <= 1e-9 * t.abs().max(1.0);
        m.chatter = if same { m.chatter + 1 } else { 0 };
        m.event_time = t;
        let storm = self.pace.event(t, self.settings.span);
        if m.chatter <= CHATTER && storm.is_none() {
            return Ok(());
        }
        let without_end = m.chatter > CHATTER;
        let (member, what) = match cause {
            IntegrationEvent::Indicator(i) => self.indicator(fmus, i),
            IntegrationEvent::Time => {
                let at = self.members.iter().position(|m| m.next_event.is_some_and(|next| next <= t));
                (at, "its time event, which is never later than the one before,".into())
            }
            IntegrationEvent::Step(member) => (Some(member), "completedIntegratorStep".into()),
        };
        let name = member.map(|at| fmus.instance(at).name().to_owned()).unwrap_or_default();
        if let Some(storm) = storm.filter(|_| !without_end) {
            self.notes.push(format!("{storm}, the last one by {what} of instance \"{name}\""));
            return Ok(());
        }
        let reason = format!(
            "events do not end: {CHATTER} in a row within a nanosecond, the last one by {what} of instance \"{name}\""
        );
        let log = member.map(|at| fmus.instance(at).log()).unwrap_or_default();
        Err(Failure::Stuck { time: t, reason, log })
    }

    /// Why there is no further step.
    fn stuck<F: Fmus + ?Sized>(
        &self,
        fmus: &mut F,
        error: DriveError,
        value: Option<f64>,
        refused: Option<Failure<F::Error>>,
    ) -> Failure<F::Error> {
        match (error, refused) {
            (DriveError::NotFinite { .. }, Some(Failure::Call { source, .. })) => {
                let reason = format!("{source}, however short the step");
                Failure::Stuck { time: self.time, reason, log: Vec::new() }
            }
            (DriveError::NotFinite { what: DriverQuantity::Indicator(i), .. }, _) => {
                self.bad_indicator(fmus, i)
            }
            (DriveError::NotFinite { what: DriverQuantity::Rate(i), .. }, _) if value.is_some() => {
                self.not_finite(fmus, i, true, value.unwrap_or(f64::NAN))
            }
            (DriveError::NotFinite { what: DriverQuantity::State(i), .. }, _) => {
                self.not_finite(fmus, i, false, f64::NAN)
            }
            (source, _) => Failure::Integrator { time: self.time, instances: self.instances(fmus), source },
        }
    }
}
