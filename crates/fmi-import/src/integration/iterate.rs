//! Events: all FMUs of a group iterate until none of them, and nothing that they exchange, changes any more.

use super::{EventSettled, Failure, Fmus, IntegratedGroup};
use crate::{EventInfo, MOST_PASSES, iterate_events};

impl IntegratedGroup {
    /// At the end of an interval, once inputs have been set from outside: an event iteration if an event waits or an
    /// input has another value than before.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    pub fn settle<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<EventSettled, Failure<F::Error>> {
        let pending = self.mode.pending.is_some();
        if pending {
            self.open(fmus)?;
        }
        if !self.mode.open || !(self.changed(fmus)? || pending) {
            return Ok(EventSettled::default());
        }
        let events = u64::from(pending);
        let terminated = self.iterate(fmus)?;
        Ok(EventSettled { changed: true, events, terminated })
    }

    /// Enters continuous-time mode, after what waits in event mode. Returns whether an FMU ended the run.
    ///
    /// # Errors
    /// As [`IntegratedGroup::settle`].
    pub fn go_on<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<bool, Failure<F::Error>> {
        if self.mode.pending.is_some() {
            self.open(fmus)?;
        }
        self.close(fmus)
    }

    /// Inputs jump here, which is an event: handles it, and one that waits. Returns whether an FMU ended the run.
    ///
    /// # Errors
    /// As [`IntegratedGroup::settle`].
    pub fn jump<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<bool, Failure<F::Error>> {
        self.open(fmus)?;
        self.mode.fresh = true;
        self.go_on(fmus)
    }

    /// Enters event mode.
    pub(super) fn open<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<(), Failure<F::Error>> {
        if !self.mode.open {
            if !self.depart(fmus)? {
                let call = self.call();
                (0..self.members.len())
                    .try_for_each(|at| fmus.instance(at).enter_event_mode())
                    .map_err(call)?;
            }
            (self.mode.open, self.mode.updated) = (true, false);
            self.changed(fmus)?;
        }
        Ok(())
    }

    fn changed<F: Fmus + ?Sized>(&self, fmus: &mut F) -> Result<bool, Failure<F::Error>> {
        fmus.inputs_changed().map_err(self.call())
    }

    /// Enters continuous-time mode; the standard requires one update of discrete states before. Returns whether an FMU
    /// ended the run.
    fn close<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<bool, Failure<F::Error>> {
        if !self.mode.open {
            return Ok(false);
        }
        let cause = self.mode.pending.is_some() || self.changed(fmus)?;
        if cause || !self.mode.updated {
            let fresh = self.mode.fresh || cause;
            if self.iterate(fmus)? {
                return Ok(true);
            }
            // Without an event there was nothing to update.
            self.mode.fresh = fresh || self.mode.states || self.mode.nominals;
        }
        let call = self.call();
        for (at, member) in self.members.iter().enumerate() {
            let instance = fmus.instance(at);
            instance.enter_continuous_time_mode().map_err(&call)?;
            let states = member.states.clone();
            if self.mode.states && !states.is_empty() {
                instance.get_states(&mut self.x[states.clone()]).map_err(&call)?;
            }
            if self.mode.nominals && !states.is_empty() {
                let nominal = &mut self.stepper.nominal_mut()[states];
                instance.nominals(nominal).map_err(&call)?;
                // One that is not known counts as 1; 0 would require exact zeros.
                nominal.iter_mut().for_each(|x| *x = if x.is_finite() && *x != 0.0 { x.abs() } else { 1.0 });
            }
        }
        (self.mode.open, self.mode.states, self.mode.nominals) = (false, false, false);
        match self.x.iter().position(|x| !x.is_finite()) {
            Some(at) => Err(self.not_finite(fmus, at, false, self.x[at])),
            None => self.arrive(fmus).map(|()| false),
        }
    }

    /// In event mode: updates the discrete states of every FMU, and hands values on, until none of them changes. Returns
    /// whether an FMU ended the run.
    pub(super) fn iterate<F: Fmus + ?Sized>(&mut self, fmus: &mut F) -> Result<bool, Failure<F::Error>> {
        let call = self.call();
        if self.mode.pending.is_some() {
            self.statistics.events += 1;
            // Events that come ever faster must not slip through between the samples of a long step: the step follows
            // their distance, at a length that costs nothing otherwise.
            let since = self.time - self.memory.change_time;
            if since > 0.0 {
                self.memory.step = self.memory.step.min(1e4 * since);
                self.memory.change_time = self.time;
            }
        }
        (self.mode.pending, self.mode.updated, self.mode.fresh) = (None, true, true);
        fmus.exchange(self.time, true).map_err(Failure::Exchange)?;
        self.changed(fmus)?;
        let mut waits = None;
        let settled = iterate_events(|| {
            let mut all = EventInfo::default();
            waits = None;
            for (at, member) in self.members.iter_mut().enumerate() {
                let info = fmus.instance(at).update_discrete_states().map_err(&call)?;
                member.next_event = info.next_event.filter(|t| t.is_finite());
                all.states_changed |= info.states_changed;
                all.nominals_changed |= info.nominals_changed;
                all.terminate |= info.terminate;
                if info.again {
                    waits = Some(at);
                }
            }
            fmus.exchange(self.time, true).map_err(Failure::Exchange)?;
            all.again = !all.terminate && (self.changed(fmus)? || waits.is_some());
            Ok(all)
        })?;
        let Some(info) = settled else {
            return Err(match waits {
                Some(at) => call(fmus.instance(at).endless_iteration()),
                None => {
                    let reason = format!(
                        "event iteration does not end: values that FMUs exchange still changed after {MOST_PASSES} passes"
                    );
                    Failure::Stuck { time: self.time, reason, log: Vec::new() }
                }
            });
        };
        self.mode.states |= info.states_changed;
        self.mode.nominals |= info.nominals_changed;
        Ok(info.terminate)
    }

    /// The next time event of all FMUs in s.
    pub fn next_event(&self) -> Option<f64> {
        self.members.iter().filter_map(|m| m.next_event).min_by(f64::total_cmp)
    }
}
