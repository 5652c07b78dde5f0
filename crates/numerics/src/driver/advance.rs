//! [`Driver::advance_to`]: steps, located events, observer.

use super::frozen::{Frozen, Signal};
use super::{Cause, DriveError, Driver, Flow, Inputs, Moment, Quantity, Reached, State, View};
use crate::hybrid::{At, Hybrid};
use crate::integrate::{Fault, Ode, Tolerance};

/// What has to be done before integration goes on.
enum Due {
    Nothing,
    /// Inputs, parameters or states may have jumped.
    Jump,
    Event(Cause),
}

/// Times closer than this are the same.
fn tiny(t: f64) -> f64 {
    4.0 * f64::EPSILON * t.abs()
}

/// Step in s that is too small even at t = 0.
const SHORTEST: f64 = 1e-30;

/// Bounds of the ratio of one step to the one before, safety factor and integral gain of the step control
/// (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4 and IV.2).
const SHRINK: f64 = 0.2;
const GROW: f64 = 10.0;
const SAFETY: f64 = 0.9;
const BETA: f64 = 0.04;

impl Driver {
    /// Simulates up to `t_end`, never beyond.
    ///
    /// * An event iteration runs first (inputs, parameters or states may have been changed by the caller).
    /// * State events are located and handled, time events hit exactly. A time event at `t_end` itself is left
    ///   for the start of the next call, so that it sees the inputs that are valid from then on.
    /// * With `stop_at_event` the call returns at an event, state and time just behind it, before handling it;
    ///   a time event at `t_end` is then reported too.
    /// * `observer` is called after every accepted step and every event handled.
    ///
    /// # Errors
    /// [`DriveError`]; the state then stands at the last time reached.
    pub fn advance_to<M: Hybrid>(
        &mut self,
        model: &M,
        s: &mut State,
        t_end: f64,
        inputs: Inputs,
        observer: &mut dyn FnMut(View) -> Flow,
    ) -> Result<Reached, DriveError> {
        if !(t_end >= *s.t && t_end.is_finite()) {
            return Err(DriveError::Backwards { t: *s.t, t_end });
        }
        self.check(s)?;
        let mut done = Reached::default();
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
        loop {
            if !matches!(due, Due::Nothing) {
                let event = if let Due::Event(cause) = due {
                    self.guard(s, cause)?;
                    if self.options.stop_at_event {
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
                    match tell(observer, s, Moment::Event) {
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
                    done.pending = Some(Cause::Time);
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
                let signal = Signal { inputs, base };
                self.step(model, s, stop, signal, &mut done)?
            };
            self.set_inputs(s, inputs, base);
            if let Some(i) = crossed {
                due = Due::Event(Cause::Indicator(i));
            } else if timed && *s.t == stop {
                due = Due::Event(Cause::Time);
            }
            match tell(observer, s, Moment::Step) {
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

    /// Writes the inputs at `State::t`.
    fn set_inputs(&self, s: &mut State, inputs: Inputs, base: f64) {
        Signal { inputs, base }.at(*s.t, &self.u0, s.u);
    }

    /// The observer has changed the inputs: they go on from here.
    fn rebase(&mut self, s: &mut State, inputs: Inputs) -> f64 {
        self.u0.copy_from_slice(s.u);
        self.set_inputs(s, inputs, *s.t);
        *s.t
    }

    /// Counts events that follow each other within a nanosecond (at times around 1 s).
    fn guard(&self, s: &mut State, cause: Cause) -> Result<(), DriveError> {
        let (t, m) = (*s.t, &mut *s.memory);
        let stands = t - m.event_time <= 1e-9 * t.abs().max(1.0);
        m.chatter = if stands { m.chatter.saturating_add(1) } else { 0 };
        m.event_time = t;
        if m.chatter > self.options.max_chatter {
            return Err(DriveError::Chattering { t, cause });
        }
        Ok(())
    }

    /// Forgets what belongs to the states, modes and inputs before an event.
    fn restart<M: Hybrid>(&mut self, model: &M, s: &State) -> Result<(), DriveError> {
        self.method.restart();
        let z = self.locator.start();
        model.indicators(s.at(), z);
        match z.iter().position(|z| z.is_nan()) {
            Some(i) => Err(DriveError::NotFinite { t: *s.t, what: Quantity::Indicator(i) }),
            None => Ok(()),
        }
    }

    /// One accepted step, not beyond `stop`; ends at the first event in it, whose indicator is returned.
    fn step<M: Hybrid>(
        &mut self,
        model: &M,
        s: &mut State,
        stop: f64,
        signal: Signal,
        done: &mut Reached,
    ) -> Result<Option<usize>, DriveError> {
        let (t, left, floor) = (*s.t, stop - *s.t, tiny(*s.t).max(SHORTEST));
        let Self { options, sizes, nominal, method, locator, work, u0, x1, f0, f1, .. } = self;
        let tol = Tolerance { relative: options.tolerance, nominal };
        let adaptive = method.error_order() > 0;
        let power = 1.0 / f64::from(method.error_order());
        let (p, modes) = (s.p, &*s.modes);
        let mut ode = Frozen { model, p, modes, signal, u0, work };
        if adaptive && s.memory.step <= 0.0 {
            s.memory.step = first_step(&mut ode, t, s.x, tol, power, f0, f1, x1).min(left);
        }
        let mut proposed =
            if adaptive { s.memory.step.max(floor).min(options.max_step) } else { options.max_step };
        let mut fault = None;
        let mut retried = false;
        loop {
            if done.accepted + done.rejected >= options.max_steps {
                return Err(DriveError::MaxSteps { t, steps: options.max_steps });
            }
            // Never a tiny last step: two halves instead.
            let h = if left <= proposed * (1.0 + 1e-9) {
                left
            } else if adaptive && left < 2.0 * proposed {
                0.5 * left
            } else {
                proposed
            };
            let t1 = if h == left { stop } else { t + h };
            let shrink = match method.attempt(&mut ode, t, s.x, h, tol) {
                Err(f) => {
                    fault = Some(match f {
                        Fault::Rate(i) | Fault::Matrix(i) => Quantity::Rate(i),
                        Fault::State(i) => Quantity::State(i),
                    });
                    SHRINK
                }
                Ok(error) if error <= 1.0 => {
                    let mut crossing = None;
                    let mut bad = None;
                    if sizes.indicators > 0 {
                        method.prepare_dense(&mut ode, t, s.x, h);
                        let u = &mut ode.work.u;
                        let mut indicators = |time: f64, z: &mut [f64]| {
                            if time < t1 {
                                method.dense((time - t) / h, x1);
                            } else {
                                x1.copy_from_slice(method.end());
                            }
                            signal.at(time, u0, u);
                            model.indicators(At { t: time, x: x1, u, p, modes }, z);
                        };
                        match locator.find(t, t1, &|i| model.direction(i), &mut indicators) {
                            Ok(found) => crossing = found,
                            Err(i) => bad = Some(Quantity::Indicator(i)),
                        }
                    }
                    if bad.is_none() {
                        done.accepted += 1;
                        if adaptive {
                            let m = &mut *s.memory;
                            let slope = error.powf(power - 0.75 * BETA) / m.error.powf(BETA);
                            let ratio = (SAFETY / slope).clamp(SHRINK, GROW);
                            let new = h * if retried { ratio.min(1.0) } else { ratio };
                            // A step that was cut short says nothing against the size proposed before.
                            m.step = if h < proposed && !retried { new.max(proposed) } else { new };
                            m.error = error.max(1e-4);
                        }
                        match crossing {
                            Some(c) => {
                                if c.t < t1 {
                                    method.dense((c.t - t) / h, s.x);
                                } else {
                                    s.x.copy_from_slice(method.end());
                                }
                                *s.t = c.t;
                            }
                            None => {
                                s.x.copy_from_slice(method.end());
                                *s.t = t1;
                                method.accept();
                                locator.carry();
                            }
                        }
                        return Ok(crossing.map(|c| c.indicator));
                    }
                    fault = bad;
                    SHRINK
                }
                Ok(error) => (SAFETY / error.powf(power)).max(SHRINK),
            };
            done.rejected += 1;
            retried = true;
            proposed = h * shrink;
            if !adaptive || proposed <= floor {
                return Err(match fault {
                    Some(what) => DriveError::NotFinite { t, what },
                    None => DriveError::StepTooSmall { t, h: proposed },
                });
            }
        }
    }
}

/// Events that come ever faster (a ball that comes to rest) must not slip through between the samples of a
/// long step: the step follows their distance, at a length that costs nothing otherwise.
fn after_change(s: &mut State) {
    let since = *s.t - s.memory.change_time;
    if since > 0.0 {
        s.memory.step = s.memory.step.min(1e4 * since);
        s.memory.change_time = *s.t;
    }
}

fn tell(observer: &mut dyn FnMut(View) -> Flow, s: &mut State, moment: Moment) -> Flow {
    observer(View { moment, t: *s.t, x: s.x, u: s.u, modes: s.modes })
}

/// Size of a first step (Hairer, Norsett, Wanner I, II.4).
fn first_step(
    ode: &mut dyn Ode,
    t: f64,
    x: &[f64],
    tol: Tolerance,
    power: f64,
    f0: &mut [f64],
    f1: &mut [f64],
    x1: &mut [f64],
) -> f64 {
    if x.is_empty() {
        return f64::INFINITY;
    }
    ode.rates(t, x, f0);
    let (d0, d1) = (tol.ratio(|i| x[i], x, x), tol.ratio(|i| f0[i], x, x));
    let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 };
    for i in 0..x.len() {
        x1[i] = x[i] + h0 * f0[i];
    }
    ode.rates(t + h0, x1, f1);
    let d2 = tol.ratio(|i| f1[i] - f0[i], x, x) / h0;
    let h1 = if d1.max(d2) <= 1e-15 { (1e-3 * h0).max(1e-6) } else { (0.01 / d1.max(d2)).powf(power) };
    let h = h1.min(100.0 * h0);
    // Not a number: whatever is wrong with the rates is found out by the step itself.
    if h > 0.0 { h } else { 1e-6 }
}
