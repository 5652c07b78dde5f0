//! [`Driver::advance_to`]: steps, located events, observer.

use super::frozen::{FrozenModel, InputSignals};
use super::step::tiny;
use super::{
    DriveError, Driver, DriverMoment, DriverQuantity, DriverReached, DriverState, DriverView, EventCause,
    Flow, StepInputs,
};
use crate::hybrid::Hybrid;

/// What has to be done before integration goes on.
enum Due {
    Nothing,
    /// Inputs, parameters or states may have jumped.
    Jump,
    Event(EventCause),
}

impl Driver {
    /// Simulates up to `t_end`, never beyond.
    ///
    /// * An event iteration runs first (inputs, parameters or states may have been changed by the caller).
    /// * State events are located and handled, time events hit exactly. A time event at `t_end` itself is left
    ///   for the start of the next call, so that it sees the inputs that are valid from then on.
    /// * With `stop_at_event` the call returns at an event, state and time just behind it, before handling it;
    ///   a time event at `t_end` is then reported too, and what the caller has changed, if it is an event, at the start. A state event that follows another within 1e-9 of the time (1e-9 s
    ///   below 1 s) is handled here: for the handler it is the same one.
    /// * `observer` is called after every accepted step and every event handled.
    ///
    /// # Errors
    /// [`DriveError`]; the state is then that of the last time reached.
    pub fn advance_to<M: Hybrid>(
        &mut self,
        model: &M,
        s: &mut DriverState,
        t_end: f64,
        inputs: StepInputs,
        observer: &mut dyn FnMut(DriverView) -> Flow,
    ) -> Result<DriverReached, DriveError> {
        if !(t_end >= *s.t && t_end.is_finite()) {
            return Err(DriveError::Backwards { t: *s.t, t_end });
        }
        self.check(s)?;
        let mut done = DriverReached::default();
        let mut base = *s.t;
        self.u0.copy_from_slice(s.u);
        if let Some(next) = model.next_event(s.p, s.modes)
            && next > *s.t
            && next - *s.t <= tiny(next)
            && next <= t_end
        {
            *s.t = next;
        }
        self.set_inputs(s, inputs, base);
        let mut due = Due::Jump;
        if self.options.stop_at_event && self.is_event(model, s)? {
            (done.t, done.pending) = (*s.t, Some(EventCause::Jump));
            return Ok(done);
        }
        loop {
            if !matches!(due, Due::Nothing) {
                let event = if let Due::Event(cause) = due {
                    let same = self.guard(s, cause)? && matches!(cause, EventCause::Indicator(_));
                    if self.options.stop_at_event && !same {
                        done.pending = Some(cause);
                        break;
                    }
                    true
                } else {
                    false
                };
                let changed = self.handle_event(model, s)?;
                due = Due::Nothing;
                if changed {
                    after_change(s);
                }
                if event || changed {
                    done.events += 1;
                    match tell(observer, s, DriverMoment::Event) {
                        Flow::Continue => {}
                        Flow::InputsChanged => {
                            base = self.rebase(s, inputs);
                            due = Due::Jump;
                            continue;
                        }
                        Flow::Return => break,
                    }
                }
                self.restart(model, s)?;
            }
            let next = model.next_event(s.p, s.modes);
            if *s.t >= t_end {
                if self.options.stop_at_event && next.is_some_and(|next| next <= *s.t) {
                    done.pending = Some(EventCause::Time);
                }
                break;
            }
            let (stop, timed) = match next {
                Some(next) if next < t_end - tiny(t_end) => (next.max(*s.t), true),
                _ => (t_end, false),
            };
            let crossed = if stop - *s.t <= tiny(stop) {
                *s.t = stop;
                None
            } else {
                let signal = InputSignals { inputs, base };
                let Self { options, stepper, work, u0, .. } = self;
                let mut frozen = FrozenModel { model, p: s.p, modes: s.modes, signal, u0, work };
                let direction = |i| model.direction(i);
                stepper.step(&mut frozen, &direction, s.t, s.x, s.memory, stop, options, &mut done)?
            };
            self.set_inputs(s, inputs, base);
            if let Some(i) = crossed {
                due = Due::Event(EventCause::Indicator(i));
            } else if timed && *s.t == stop {
                due = Due::Event(EventCause::Time);
            }
            match tell(observer, s, DriverMoment::Step) {
                Flow::Continue => {}
                Flow::InputsChanged => {
                    base = self.rebase(s, inputs);
                    if matches!(due, Due::Nothing) {
                        due = Due::Jump;
                    }
                }
                Flow::Return => {
                    if let Due::Event(cause) = due {
                        done.pending = self.options.stop_at_event.then_some(cause);
                    }
                    break;
                }
            }
        }
        done.t = *s.t;
        Ok(done)
    }

    /// Writes the inputs at `DriverState::t`.
    fn set_inputs(&self, s: &mut DriverState, inputs: StepInputs, base: f64) {
        InputSignals { inputs, base }.at(*s.t, &self.u0, s.u);
    }

    /// Whether an event iteration would change anything here; it does not.
    fn is_event<M: Hybrid>(&mut self, model: &M, s: &mut DriverState) -> Result<bool, DriveError> {
        self.kept.0.copy_from_slice(s.x);
        self.kept.1.copy_from_slice(s.modes);
        let changed = self.handle_event(model, s)?;
        if changed {
            s.x.copy_from_slice(&self.kept.0);
            s.modes.copy_from_slice(&self.kept.1);
        }
        Ok(changed)
    }

    /// The observer has changed the inputs: they go on from here.
    fn rebase(&mut self, s: &mut DriverState, inputs: StepInputs) -> f64 {
        self.u0.copy_from_slice(s.u);
        self.set_inputs(s, inputs, *s.t);
        *s.t
    }

    /// Counts events that follow each other within a nanosecond (at times around 1 s). Is this one such?
    fn guard(&self, s: &mut DriverState, cause: EventCause) -> Result<bool, DriveError> {
        let (t, m) = (*s.t, &mut *s.memory);
        let stands = t - m.event_time <= 1e-9 * t.abs().max(1.0);
        m.chatter = if stands { m.chatter.saturating_add(1) } else { 0 };
        m.event_time = t;
        if m.chatter > self.options.max_chatter {
            return Err(DriveError::Chattering { t, cause });
        }
        Ok(stands)
    }

    /// Forgets what belongs to the states, modes and inputs before an event.
    fn restart<M: Hybrid>(&mut self, model: &M, s: &DriverState) -> Result<(), DriveError> {
        let z = self.stepper.restart();
        model.indicators(s.at(), z);
        match z.iter().position(|z| z.is_nan()) {
            Some(i) => Err(DriveError::NotFinite { t: *s.t, what: DriverQuantity::Indicator(i) }),
            None => Ok(()),
        }
    }
}

/// Events that come ever faster (a ball that comes to rest) must not slip through between the samples of a
/// long step: the step follows their distance, at a length that costs nothing otherwise.
fn after_change(s: &mut DriverState) {
    let since = *s.t - s.memory.change_time;
    if since > 0.0 {
        s.memory.step = s.memory.step.min(1e4 * since);
        s.memory.change_time = *s.t;
    }
}

fn tell(observer: &mut dyn FnMut(DriverView) -> Flow, s: &mut DriverState, moment: DriverMoment) -> Flow {
    observer(DriverView { moment, t: *s.t, x: s.x, u: s.u, modes: s.modes })
}
