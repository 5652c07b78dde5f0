//! The coupled system from one communication point to the next.

mod anderson;
mod repeat;
mod shared_events;

use crate::adaptive::SteppingParts;
use crate::calls::FmuCalls;
use crate::error::CosimError;
use crate::exchange::{Exchange, Phase, Wiring};
use crate::inputs::InputFileTable;
use crate::node::InstanceNode;
use crate::stepper::{Advance, EventSettled, StepLimit, SystemStepper};
use anderson::Anderson;
use repeat::Saved;
pub use repeat::{Attempt, Followed};
use shared_events::{EventTreatment, SharedEvents};

/// Repetitions of a step before it is given up as not settling.
const ITERATIONS: u32 = 25;

/// A step below this part of the longest one, up to an event or on from it, defines no slopes: the previous ones are kept.
const SHORT: f64 = 1e-6;

/// When a stepper steps.
pub(crate) struct StepperTurn {
    /// Steps of the grid that it takes at once.
    every: u64,
    /// Its time, in s.
    pub(crate) time: f64,
    /// Length of its last step in s; 0: none yet.
    pub(crate) last: f64,
    /// It is to step, or has just stepped.
    due: bool,
    /// One of its FMUs requests to end the run.
    pub(crate) terminated: bool,
}

/// All components, their connections, and their time. Initialized; between two communication points.
///
/// A step that may be repeated or rejected:
///
/// ```text
/// coupling.save(t)?;                             // everything: FMUs, values, slopes
/// loop {
///     let attempt = coupling.iterate(t, t + h, tolerance)?;
///     if attempt.settled && good_enough(&coupling) {
///         break;                                 // is at t + h, exchanged; accept by going on
///     }
///     coupling.restore(t)?;                      // is at t again
///     h *= 0.5;
/// }
/// ```
///
/// [`iterate`](Coupling::iterate) calls `restore` itself between its repetitions. [`lines`](Coupling::lines) then returns,
/// for error estimates, what inputs were assumed to be at the end of the step and what the outputs made of them.
pub struct Coupling {
    pub(crate) nodes: Vec<InstanceNode>,
    pub(crate) steppers: Vec<Box<dyn SystemStepper>>,
    /// When each of them steps.
    pub(crate) turns: Vec<StepperTurn>,
    /// Steppers in the order in which they hand on values.
    order: Vec<usize>,
    pub(crate) exchange: Exchange,
    inputs: Option<InputFileTable>,
    /// Unit of each node.
    unit: Vec<usize>,
    uniform: bool,
    /// Some stepper has events to settle.
    has_events: bool,
    /// Per slot: slope in 1/s, value at the point before, 1 if it may be extrapolated (else 0).
    pub(crate) slopes: Vec<f64>,
    pub(crate) previous: Vec<f64>,
    pub(crate) smooth: Vec<f64>,
    /// Per slot of an input: its source steps before, in the order of the units.
    known: Vec<bool>,
    /// Per slot of an input: its source steps at least as often as its own FMU, so its own samples give the slope.
    sampled: Vec<bool>,
    /// Outputs of each unit.
    outputs: Vec<Vec<usize>>,
    saved: Saved,
    anderson: Anderson,
    shared: Option<SharedEvents>,
    /// The longest step so far in s.
    longest: f64,
}

impl Coupling {
    /// Of nodes that have left initialization mode. `order`: units as they hand on values.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    pub(crate) fn new(
        mut nodes: Vec<InstanceNode>,
        wiring: Wiring<'_>,
        inputs: Option<InputFileTable>,
        steppers: impl FnOnce(&mut [InstanceNode]) -> Result<Vec<(Box<dyn SystemStepper>, u64)>, CosimError>,
        order: Vec<usize>,
        time: f64,
    ) -> Result<Self, CosimError> {
        let exchange = Exchange::new(&mut nodes, wiring, Phase::Stepping, |_| true)?;
        exchange.install_lines(&mut nodes)?;
        let (steppers, every): (Vec<_>, Vec<u64>) = steppers(&mut nodes)?.into_iter().unzip();
        let turn =
            |every: u64| StepperTurn { every: every.max(1), time, last: 0.0, due: true, terminated: false };
        let turns: Vec<StepperTurn> = every.into_iter().map(turn).collect();
        let mut unit = vec![0; nodes.len()];
        for (u, stepper) in steppers.iter().enumerate() {
            stepper.nodes().iter().for_each(|n| unit[*n] = u);
        }
        let n = exchange.reals().len();
        let mut rank = vec![0; steppers.len()];
        order.iter().enumerate().for_each(|(at, u)| rank[*u] = at);
        let (mut known, mut sampled) = (vec![false; n], vec![false; n]);
        let every = |slot: u32| turns[unit[exchange.element(slot as usize).component]].every;
        let owner = |slot: u32| rank[unit[exchange.element(slot as usize).component]];
        for (from, to) in exchange.sources() {
            known[to as usize] = owner(from) < owner(to);
            sampled[to as usize] = every(from) <= every(to);
        }
        let outputs = steppers.iter().map(|s| s.nodes().iter().flat_map(|n| exchange.outputs(*n)).collect());
        let outputs = outputs.collect();
        let smooth = exchange.smooth(&nodes).into_iter().map(|s| f64::from(u8::from(s))).collect();
        let mut this = Self {
            uniform: turns.iter().all(|u| u.every == 1),
            has_events: steppers.iter().any(|s| s.has_events()),
            nodes,
            steppers,
            turns,
            order,
            inputs,
            unit,
            slopes: vec![0.0; n],
            previous: vec![0.0; n],
            smooth,
            known,
            sampled,
            outputs,
            saved: Saved::default(),
            anderson: Anderson::default(),
            shared: None,
            longest: 0.0,
            exchange,
        };
        for stepper in &mut this.steppers {
            stepper.begin(&mut this.nodes, time)?;
        }
        this.exchange(time)?;
        this.settle(time)?;
        this.previous.copy_from_slice(this.exchange.reals());
        Ok(this)
    }

    /// The FMUs.
    pub fn nodes(&mut self) -> &mut [InstanceNode] {
        &mut self.nodes
    }

    /// Lends everything to the adaptive algorithm.
    pub(crate) fn parts(&mut self) -> SteppingParts<'_> {
        let Self { nodes, steppers, exchange, inputs, .. } = self;
        SteppingParts { nodes, steppers, exchange, inputs: inputs.as_ref() }
    }

    /// Values that are exchanged.
    pub fn values(&self) -> &Exchange {
        &self.exchange
    }

    /// Which units step to the communication point `point`; the last one is everybody's.
    pub(crate) fn turn(&mut self, point: u64, last: bool) {
        if !self.uniform {
            self.turns.iter_mut().for_each(|u| u.due = last || point.is_multiple_of(u.every));
        }
    }

    /// Reads all outputs and sets all inputs as of `time` of those that are there, solves the loops.
    ///
    /// # Errors
    /// Whatever an FMU returns; a loop without solution; a value that is not finite.
    #[inline]
    pub fn exchange(&mut self, time: f64) -> Result<(), CosimError> {
        if self.uniform {
            self.exchange.drive(self.inputs.as_ref(), time, |_| true);
            return self.exchange.propagate(&mut self.nodes, time);
        }
        let Self { turns, unit, exchange, nodes, inputs, .. } = self;
        let due = |n: usize| turns[unit[n]].due;
        exchange.drive(inputs.as_ref(), time, due);
        exchange.propagate_due(nodes, time, due)
    }

    /// After an exchange: events that wait at `time`, and what they make of others, until nothing changes any more. What
    /// jumps there does not count as a slope.
    ///
    /// # Errors
    /// Whatever an FMU returns; events without end.
    pub(crate) fn settle(&mut self, time: f64) -> Result<EventSettled, CosimError> {
        let mut all = EventSettled::default();
        if !self.has_events {
            return Ok(all);
        }
        for _ in 0..ITERATIONS {
            let mut changed = false;
            for (stepper, turn) in self.steppers.iter_mut().zip(&mut self.turns).filter(|(_, t)| t.due) {
                let settled = stepper.settle(&mut self.nodes, time)?;
                all.events += settled.events;
                changed |= settled.changed;
                turn.terminated |= settled.terminated;
                all.terminated |= settled.terminated;
            }
            all.changed |= changed;
            if !changed || all.terminated {
                return Ok(all);
            }
            let before = self.exchange.reals().to_vec();
            self.exchange(time)?;
            for ((previous, new), old) in self.previous.iter_mut().zip(self.exchange.reals()).zip(&before) {
                // In this order: what was held and has jumped has a slope of 0, with no rounding.
                *previous = new - (old - *previous);
            }
        }
        let reason =
            format!("events at one time do not end: inputs still changed after {ITERATIONS} exchanges");
        Err(CosimError::Stuck { time, reason, log: Vec::new() })
    }

    /// All units step at all points, there are no events and no inputs from a file.
    pub(crate) fn is_plain(&self) -> bool {
        self.uniform && !self.has_events && self.inputs.is_none()
    }

    /// All units have come to `time` by steps of this length.
    pub(crate) fn stand_at(&mut self, time: f64, step: f64) {
        self.turns.iter_mut().for_each(|turn| (turn.last, turn.time) = (step, time));
    }

    /// What the steppers chose on the way.
    pub(crate) fn notes(&self) -> impl Iterator<Item = String> {
        self.steppers.iter().flat_map(|s| s.notes()).chain(self.unshared())
    }

    /// Every unit that is due steps to `to`, one after the other, with the inputs that it has or on their lines. Nothing
    /// is exchanged.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    #[inline]
    pub fn step(&mut self, to: f64, within: StepLimit) -> Result<Advance, CosimError> {
        if let Some(done) = self.step_to_event(to, EventTreatment::Together(within))? {
            return Ok(done);
        }
        let mut all = Advance { time: to, ..Advance::default() };
        for (stepper, turn) in self.steppers.iter_mut().zip(&mut self.turns).filter(|(_, t)| t.due) {
            let end = match stepper.pace(&mut self.nodes, turn.time, to, within) {
                Ok(None) => to,
                Ok(Some(done)) => {
                    turn.terminated |= done.terminate;
                    join(&mut all, *done);
                    done.time
                }
                Err(error) => return Err(*error),
            };
            (turn.last, turn.time) = (end - turn.time, end);
            if self.has_events {
                stepper.stay(&mut self.nodes, end)?;
            }
        }
        Ok(all)
    }

    /// Each unit in the order in which values are handed on, with the newest ones: on the line to what those before
    /// it have reached, extrapolated where the source steps later.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    pub(crate) fn step_in_order(&mut self, to: f64) -> Result<Advance, CosimError> {
        if let Some(done) = self.step_to_event(to, EventTreatment::InOrder)? {
            return Ok(done);
        }
        let mut all = Advance { time: to, ..Advance::default() };
        for at in 0..self.order.len() {
            let u = self.order[at];
            if !self.turns[u].due {
                continue;
            }
            let from = self.turns[u].time;
            self.take_inputs(u)?;
            self.aim_lines(u, from, to);
            let done = self.steppers[u].step(&mut self.nodes, from, to, StepLimit::Line)?;
            self.turns[u].terminated |= done.terminate;
            (self.turns[u].last, self.turns[u].time) = (to - from, to);
            self.steppers[u].stay(&mut self.nodes, to)?;
            self.hand_outputs(u, to)?;
            join(&mut all, done);
        }
        Ok(all)
    }

    /// Sets the inputs of a unit as they were exchanged last.
    fn take_inputs(&mut self, u: usize) -> Result<(), CosimError> {
        let nodes = self.steppers[u].nodes();
        nodes.iter().try_for_each(|n| self.exchange.write(*n, &mut self.nodes, self.turns[u].time))
    }

    /// Lines of the inputs of a unit to what those before it have reached at `to`.
    fn aim_lines(&mut self, u: usize, from: f64, to: f64) {
        for &n in self.steppers[u].nodes() {
            let line = &mut self.nodes[n].line;
            for ((slot, value), slope) in line.slots.iter().zip(&line.value).zip(&mut line.slope) {
                if self.known[*slot] && self.smooth[*slot] != 0.0 {
                    *slope = (self.exchange.reals()[*slot] - value) / (to - from);
                }
            }
            line.dirty = true;
        }
    }

    /// Reads the outputs of a unit at `time`, for those behind it.
    fn hand_outputs(&mut self, u: usize, time: f64) -> Result<(), CosimError> {
        let nodes = self.steppers[u].nodes();
        nodes.iter().try_for_each(|n| self.exchange.read(*n, &mut self.nodes, time))
    }

    /// Sources that have not stepped to `time` go on on their lines, as far as others see them.
    pub(crate) fn extrapolate_held(&mut self, time: f64) {
        if self.uniform {
            return;
        }
        for (unit, outputs) in self.turns.iter().zip(&self.outputs).filter(|(u, _)| !u.due) {
            for &slot in outputs {
                let value = self.previous[slot] + self.slopes[slot] * (time - unit.time);
                self.exchange.set_real(slot, value);
            }
        }
    }

    /// After an exchange: slopes over the last step, and the lines of the next one, up to `next(every)`.
    pub(crate) fn draw_lines(&mut self, next: impl Fn(u64) -> f64) {
        let reals = self.exchange.reals();
        let last = self.turns.first().map_or(0.0, |u| u.last);
        self.longest = self.longest.max(last);
        let uniform = self.uniform
            && (self.shared.is_none() || self.turns.iter().all(|u| u.last == last))
            && !self.steppers.iter().any(|s| s.jumps());
        if uniform && last < SHORT * self.longest {
            self.previous.copy_from_slice(reals);
        } else if uniform {
            let rate = if last > 0.0 { 1.0 / last } else { 0.0 };
            for (((slope, previous), x), smooth) in
                self.slopes.iter_mut().zip(&mut self.previous).zip(reals).zip(&self.smooth)
            {
                *slope = (x - *previous) * rate * smooth;
                *previous = *x;
            }
        } else {
            let units = self.turns.iter().zip(&self.outputs).zip(&self.steppers);
            for ((unit, outputs), stepper) in units.filter(|((turn, _), _)| turn.due) {
                let rate = if unit.last > 0.0 { 1.0 / unit.last } else { 0.0 };
                let tells = unit.last >= SHORT * self.longest && !stepper.jumps();
                for &slot in outputs {
                    if tells {
                        self.slopes[slot] = (reals[slot] - self.previous[slot]) * rate * self.smooth[slot];
                    }
                    self.previous[slot] = reals[slot];
                }
            }
            self.exchange.hand_slopes(&mut self.slopes);
            self.slopes.iter_mut().zip(&self.smooth).for_each(|(slope, smooth)| *slope *= smooth);
            if self.uniform {
                self.previous.copy_from_slice(reals);
            }
        }
        for (stepper, unit) in self.steppers.iter().zip(&self.turns).filter(|(_, t)| t.due) {
            let to = next(unit.every);
            if self.inputs.is_some() && to > unit.time {
                let inputs = self.inputs.as_ref();
                self.exchange.drive_slopes(inputs, unit.time, to, &mut self.slopes);
            }
            for &n in stepper.nodes() {
                let line = &mut self.nodes[n].line;
                let rate = if unit.last > 0.0 { 1.0 / unit.last } else { 0.0 };
                for ((slot, value), slope) in line.slots.iter().zip(&mut line.value).zip(&mut line.slope) {
                    let own = !self.uniform && self.sampled[*slot];
                    let sampled = (reals[*slot] - *value) * rate * self.smooth[*slot];
                    *slope = if own { sampled } else { self.slopes[*slot] };
                    *value = reals[*slot];
                }
                (line.from, line.dirty) = (unit.time, false);
            }
        }
    }

    /// The FMUs that want to end the run.
    pub(crate) fn terminated_by(&self) -> String {
        let ended = self.steppers.iter().zip(&self.turns).filter(|(_, t)| t.terminated);
        let names = ended.flat_map(|(s, _)| s.nodes()).map(|n| self.nodes[*n].slave.name().to_owned());
        names.collect::<Vec<_>>().join(", ")
    }

    /// Some FMU takes no shorter step than was requested.
    pub(crate) fn takes_whole_steps(&self) -> bool {
        !self.nodes.iter().all(InstanceNode::allows_any_step)
    }

    /// Calls of doStep of each FMU that makes some.
    pub(crate) fn calls(&self) -> Vec<FmuCalls> {
        let of = |stepper: &dyn SystemStepper| {
            let (calls, inputs) = stepper.calls()?;
            let node = &self.nodes[*stepper.nodes().first()?];
            let inputs = if node.line.slots.is_empty() { "" } else { inputs };
            Some(FmuCalls { component: node.planned.name.clone(), calls: calls.clone(), inputs })
        };
        self.steppers.iter().filter_map(|stepper| of(stepper.as_ref())).collect()
    }
}

pub(crate) fn join(all: &mut Advance, one: Advance) {
    all.discarded += one.discarded;
    all.events += one.events;
    if one.terminate {
        (all.terminate, all.time) = (true, all.time.min(one.time));
    }
    if one.event {
        (all.event, all.time) = (true, all.time.min(one.time));
    }
}
