//! Steps whose length follows from the error of the whole run (docs/master-adaptive.md).
//!
//! Inputs go on lines whose moments are those of a polynomial through their last values, so that FMUs that take no more
//! than lines are coupled with order four. A second solution with steps twice as long goes along; the
//! difference of both gives the error of the first (Richardson), and steps are chosen so that it stays at the tolerance.

mod control;
mod coupling;

use control::{StepControl, largest, norm};
use coupling::{History, NODES};

use crate::error::CosimError;
use crate::exchange::Exchange;
use crate::inputs::InputFileTable;
use crate::node::InstanceNode;
use crate::stepper::{Advance, StepLimit, SystemStepper};

/// Relative tolerance where none is requested.
pub(crate) const TOLERANCE: f64 = 1e-4;
/// The longest pair of steps, as a part of the run.
const LONGEST: f64 = 0.02;
/// A jump is stepped over once a pair of steps is this part of the run times the tolerance.
const JUMP: f64 = 1e-3;
/// And whatever the errors did before, once it is this part of that.
const FORCED: f64 = 1e-3;
/// A local error below this part of the tolerance is none: behind a jump steps grow by [`control`]'s START, so that a dozen of
/// them come to 1e-4 of the tolerance.
const NOISE: f64 = 1e-5;
/// Jumps in a row after which the run is given up.
const CHATTER: u32 = 1000;
/// Exchanges among events at one time.
const EVENTS: u32 = 25;
/// A pair of steps below this part of the run is none.
const SHORTEST: f64 = 1e-14;

/// What steps, lent by the master.
pub(crate) struct SteppingParts<'a> {
    pub(crate) nodes: &'a mut [InstanceNode],
    pub(crate) steppers: &'a mut [Box<dyn SystemStepper>],
    pub(crate) exchange: &'a mut Exchange,
    pub(crate) inputs: Option<&'a InputFileTable>,
}

/// What the algorithm did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Adapted {
    /// Steps accepted.
    pub accepted: u64,
    /// Pairs of steps rejected and rolled back.
    pub rejected: u64,
    /// Steps that each component took in all: those of predictors, of rejected pairs and of the second solution included.
    pub taken: u64,
    /// Jumps stepped over.
    pub jumps: u64,
    /// The largest error of the run as estimated, over all exchanged values, each relative to its largest magnitude so
    /// far or its nominal value, whichever is larger.
    pub error: f64,
    /// The shortest and the longest step accepted, in s.
    pub steps: (f64, f64),
}

/// The inputs on lines, all nodes' one after the other.
struct Inlets {
    /// Their slots in the exchange.
    slots: Vec<usize>,
    /// Those that the file drives: its column, and whether it goes on lines between its samples.
    columns: Vec<Option<(usize, bool)>>,
    /// The node of each, and by node those that its outputs drive.
    nodes: Vec<usize>,
    driven_by: Vec<Vec<usize>>,
    /// Those that may jump are held.
    held: Vec<bool>,
    /// Largest magnitude so far, at least the nominal value.
    scales: Vec<f64>,
    /// Values at the beginning and slope per step.
    line: [Vec<f64>; 2],
    /// Nodes that requested to end the run in the last step.
    ended: Vec<usize>,
}

/// The algorithm between two calls.
pub(crate) struct Adaptive {
    control: StepControl,
    inlets: Inlets,
    /// Fine and coarse solution: their values so far, and where their states are stored.
    history: [History; 2],
    slots: [usize; 2],
    /// Places for the fine solution half way and for the end of the coarse one.
    spare: [usize; 2],
    stop: f64,
    span: f64,
    /// Values of the inputs at the end of a step: as predicted, as extrapolated, fine, coarse.
    predicted: Vec<f64>,
    extrapolated: Vec<f64>,
    ends: [Vec<f64>; 2],
    /// Ratio of the last rejection, and rejections in a row that did not bring it down.
    stubborn: (f64, u32),
    /// Jumps since polynomials of full order were at work.
    chatter: u32,
    log: Adapted,
}

const FINE: usize = 0;
const COARSE: usize = 1;

impl Adaptive {
    /// Begins at `start` (s), where all values have been exchanged. `step`: the first one in s.
    ///
    /// # Errors
    /// [`CosimError::Setting`] if an FMU cannot go back or takes equal steps only; whatever an FMU returns.
    pub(crate) fn new(
        parts: &mut SteppingParts,
        tolerance: f64,
        [start, stop]: [f64; 2],
        step: f64,
    ) -> Result<Self, CosimError> {
        refuse(parts)?;
        let inlets = Inlets::new(parts);
        let n = inlets.slots.len();
        let mut this = Self {
            control: StepControl::new(tolerance, stop - start, step),
            inlets,
            history: Default::default(),
            slots: [0, 1],
            spare: [2, 3],
            stop,
            span: stop - start,
            predicted: vec![0.0; n],
            extrapolated: vec![0.0; n],
            ends: [vec![0.0; n], vec![0.0; n]],
            stubborn: (f64::INFINITY, 0),
            chatter: 0,
            log: Adapted { steps: (f64::INFINITY, 0.0), ..Adapted::default() },
        };
        for track in [FINE, COARSE] {
            this.inlets.take(parts, &mut this.ends[track]);
            this.history[track].push(start, &this.ends[track]);
            each(parts, |stepper, nodes| stepper.save_in(this.slots[track], nodes, start))?;
        }
        this.inlets.rescale(&this.ends[FINE]);
        Ok(this)
    }

    /// What was done so far.
    pub(crate) fn log(&self) -> Adapted {
        self.log
    }

    /// The instances that want to end the run.
    pub(crate) fn ended(&self, nodes: &[InstanceNode]) -> String {
        self.inlets.ended.iter().map(|n| nodes[*n].slave.name()).collect::<Vec<_>>().join(", ")
    }

    /// A pair of accepted steps from `time` (s). Before and after all values have been exchanged.
    ///
    /// # Errors
    /// [`CosimError::Stuck`] if no step is short enough; whatever an FMU returns.
    pub(crate) fn advance(&mut self, parts: &mut SteppingParts, time: f64) -> Result<Advance, CosimError> {
        let limit = self.inlets.limit(parts, time).min(self.stop);
        let mut total = Advance::default();
        loop {
            let times = self.points(time, limit);
            let reason = if times[2] - time < SHORTEST * self.span || times[1] <= time {
                "no step is short enough for the tolerance; relax it"
            } else if self.chatter > CHATTER {
                "values jump at every step, however short; choose an algorithm with fixed steps"
            } else {
                ""
            };
            if !reason.is_empty() {
                return Err(CosimError::Stuck { time, reason: reason.into(), log: Vec::new() });
            }
            let pair = (times[2] - time) / (JUMP * self.control.tolerance * self.span);
            let jump = pair <= 1.0 && self.stubborn.1 >= 2 || pair <= FORCED;
            let points = self.history[FINE].len();
            let (ratio, done) = self.attempt(parts, times, jump, &mut total)?;
            if let Some(done) = done {
                self.accept(times, (ratio, points), jump, done.terminate);
                return Ok(Advance { time: done.time, terminate: done.terminate, ..total });
            }
            self.log.rejected += 1;
            let falls = ratio < 0.5 * self.stubborn.0;
            self.stubborn = (ratio, if falls { 0 } else { self.stubborn.1 + 1 });
            self.control.step = 0.5 * (times[2] - time);
            // What does not come down with the step is a jump: straight to it.
            self.control.reject(if falls { ratio } else { f64::INFINITY }, points);
        }
    }

    /// Beginning, middle and end of a pair of steps. What little would be left before the limit is taken along.
    fn points(&self, time: f64, limit: f64) -> [f64; 3] {
        let (pair, left) = ((2.0 * self.control.step).min(LONGEST * self.span), limit - time);
        let end = match left / pair {
            n if n <= 1.1 => limit,
            n if n < 2.0 => time + 0.5 * left,
            _ => time + pair,
        };
        [time, 0.5 * (time + end), end]
    }

    /// One step of the coarse solution and two of the fine one: the largest error per s as a part of what is allowed, and
    /// what the fine solution did, unless the pair is rejected.
    fn attempt(
        &mut self,
        parts: &mut SteppingParts,
        [time, middle, end]: [f64; 3],
        jump: bool,
        total: &mut Advance,
    ) -> Result<(f64, Option<Advance>), CosimError> {
        let points = self.history[FINE].len();
        let allowed = self.control.rate(points);
        let good = |ratio: f64| ratio <= 1.0 || jump;
        // In steps twice as long the error per s is 2^order times as large, if they are stable; and as much again.
        let (error, _) = self.step(parts, COARSE, self.slots[COARSE], [time, end], total)?;
        let mut ratio = error / (allowed * 2.0_f64.powi(points as i32 + 1));
        if !good(ratio) {
            return Ok((ratio, None));
        }
        let [half_way, coarse_end] = self.spare;
        each(parts, |stepper, nodes| stepper.save_in(coarse_end, nodes, end))?;
        let before = self.history[FINE].clone();
        let mut done = Advance::default();
        for (slot, from, to) in [(self.slots[FINE], time, middle), (half_way, middle, end)] {
            let error;
            (error, done) = self.step(parts, FINE, slot, [from, to], total)?;
            ratio = ratio.max(error / allowed);
            if !good(ratio) {
                self.history[FINE] = before;
                return Ok((ratio, None));
            }
            if done.terminate {
                break;
            }
            self.history[FINE].push(to, &self.ends[FINE]);
            let slot = if to == middle { half_way } else { self.slots[FINE] };
            each(parts, |stepper, nodes| stepper.save_in(slot, nodes, to))?;
        }
        Ok((ratio, Some(done)))
    }

    /// A step predicted, gone back, and corrected; its error per s as estimated.
    ///
    /// The outputs show the local error of what they depend on. Behind a limit they show nothing; what bounds the error of
    /// the states there is by how much the inputs were missed.
    fn step(
        &mut self,
        parts: &mut SteppingParts,
        track: usize,
        slot: usize,
        [from, to]: [f64; 2],
        total: &mut Advance,
    ) -> Result<(f64, Advance), CosimError> {
        let h = to - from;
        let predictor = self.history[track].predictor(h);
        each(parts, |stepper, nodes| stepper.restore_from(slot, nodes, from))?;
        let [value, slope] = &mut self.inlets.line;
        self.history[track].line(&predictor, None, value, slope);
        self.inlets.go(parts, &self.history[track], [from, to], total)?;
        self.inlets.take(parts, &mut self.predicted);
        each(parts, |stepper, nodes| stepper.restore_from(slot, nodes, from))?;
        let [value, slope] = &mut self.inlets.line;
        self.history[track].line(&predictor.corrector(), Some(&self.predicted), value, slope);
        let done = self.inlets.go(parts, &self.history[track], [from, to], total)?;
        self.inlets.take(parts, &mut self.ends[track]);
        self.log.taken += 2;
        let apart = |from: &[f64]| {
            let moved = self.ends[track].iter().zip(from).map(|(end, from)| end - from);
            norm(moved, &self.inlets.scales)
        };
        let local = predictor.milne() * apart(&self.predicted);
        // Of steps as short as those at a jump, values differ by rounding, which no shorter step corrects.
        let local = if local > NOISE * self.control.tolerance { local / h } else { 0.0 };
        self.history[track].extrapolate(&predictor, &mut self.extrapolated);
        for i in 0..self.extrapolated.len() {
            if !self.inlets.is_judged(i, &self.predicted, &self.ends[track]) {
                self.extrapolated[i] = self.ends[track][i];
            }
        }
        let missed = self.control.pace(predictor.missed() * apart(&self.extrapolated));
        Ok((local.max(missed), done))
    }

    /// The master goes on from the fine solution, which is what the FMUs and the exchange hold now.
    fn accept(
        &mut self,
        [time, middle, end]: [f64; 3],
        (ratio, points): (f64, usize),
        jump: bool,
        terminated: bool,
    ) {
        let (shortest, longest) = self.log.steps;
        self.log.steps = (shortest.min(middle - time), longest.max(end - middle));
        self.log.accepted += 2;
        if terminated {
            return;
        }
        std::mem::swap(&mut self.slots[COARSE], &mut self.spare[1]);
        self.history[COARSE].push(end, &self.ends[COARSE]);
        self.inlets.rescale(&self.ends[FINE]);
        let apart = self.ends[FINE].iter().zip(&self.ends[COARSE]).map(|(fine, coarse)| fine - coarse);
        let error = largest(apart, &self.inlets.scales) / (2.0_f64.powi(NODES as i32) - 1.0);
        self.control.step = 0.5 * (end - time);
        match jump && ratio > 1.0 {
            true => self.control.jumped(error),
            false => self.control.accept(ratio, points, error),
        }
        self.log.error = self.control.largest;
        self.stubborn = (f64::INFINITY, 0);
        if points == NODES {
            self.chatter = 0;
        }
        if jump && ratio > 1.0 {
            self.log.jumps += 1;
            self.chatter += 1;
            self.history.iter_mut().for_each(History::restart);
        }
    }
}

impl Inlets {
    fn new(parts: &SteppingParts) -> Self {
        let slots: Vec<usize> = parts.nodes.iter().flat_map(|n| n.line.slots.iter().copied()).collect();
        let smooth = parts.exchange.smooth(parts.nodes);
        let mut columns = vec![None; slots.len()];
        for (slot, column, linear) in parts.exchange.driven_reals() {
            slots
                .iter()
                .zip(&mut columns)
                .filter(|(s, _)| **s == slot)
                .for_each(|(_, c)| *c = Some((column, linear)));
        }
        let of = |slot: usize| parts.exchange.element(slot).component;
        let mut driven_by = vec![Vec::new(); parts.nodes.len()];
        for (from, to) in parts.exchange.sources() {
            let driven = (0..slots.len()).filter(|i| slots[*i] == to as usize);
            driven_by[of(from as usize)].extend(driven);
        }
        let nominal = |slot: &usize| {
            let of = parts.exchange.element(*slot);
            let d = parts.nodes[of.component].description();
            d.attributes(&d.variables[of.variable]).nominal.map_or(1.0, f64::abs)
        };
        Self {
            nodes: slots.iter().map(|slot| of(*slot)).collect(),
            driven_by,
            held: slots.iter().map(|slot| !smooth[*slot]).collect(),
            scales: slots.iter().map(nominal).map(|n| if n > 0.0 { n } else { 1.0 }).collect(),
            line: [vec![0.0; slots.len()], vec![0.0; slots.len()]],
            ended: Vec::new(),
            columns,
            slots,
        }
    }

    /// Values of the inputs as they were exchanged last.
    fn take(&self, parts: &SteppingParts, values: &mut [f64]) {
        let reals = parts.exchange.reals();
        values.iter_mut().zip(&self.slots).for_each(|(u, slot)| *u = reals[*slot]);
    }

    /// Whether nothing else shows the effect of missing input `i`: its course is not known, and its FMU has an output that
    /// the correction left where it was predicted, or none that goes anywhere.
    fn is_judged(&self, i: usize, predicted: &[f64], ends: &[f64]) -> bool {
        let mut out = self.driven_by[self.nodes[i]].iter().peekable();
        let silent = out.peek().is_none() || out.any(|j| ends[*j] == predicted[*j]);
        silent && !self.held[i] && self.columns[i].is_none()
    }

    fn rescale(&mut self, values: &[f64]) {
        self.scales.iter_mut().zip(values).for_each(|(scale, u)| *scale = scale.max(u.abs()));
    }

    /// The next time at which an input from the file bends or jumps.
    fn limit(&self, parts: &SteppingParts, time: f64) -> f64 {
        let Some(inputs) = parts.inputs else { return f64::INFINITY };
        parts
            .exchange
            .driven()
            .map(|(column, linear)| inputs.next_bend(column, time, linear))
            .fold(f64::INFINITY, f64::min)
    }

    /// All steppers go with the inputs on the lines; then all values are exchanged.
    fn go(
        &mut self,
        parts: &mut SteppingParts,
        history: &History,
        [from, to]: [f64; 2],
        total: &mut Advance,
    ) -> Result<Advance, CosimError> {
        let mut i = 0;
        for node in parts.nodes.iter_mut() {
            node.line.from = from;
            node.line.dirty = true;
            for at in 0..node.line.slots.len() {
                let (mut value, mut slope) = (self.line[0][i], self.line[1][i]);
                if let (Some((column, linear)), Some(inputs)) = (self.columns[i], parts.inputs) {
                    value = inputs.at(column, from, linear);
                    slope = if linear { inputs.before(column, to, linear) - value } else { 0.0 };
                } else if self.held[i] {
                    (value, slope) = (history.newest(i), 0.0);
                }
                node.line.value[at] = value;
                node.line.slope[at] = slope / (to - from);
                i += 1;
            }
        }
        let mut done = Advance { time: to, ..Advance::default() };
        self.ended.clear();
        for stepper in parts.steppers.iter_mut() {
            let one = stepper.step(parts.nodes, from, to, StepLimit::Line)?;
            total.discarded += one.discarded;
            total.events += one.events;
            if one.terminate {
                self.ended.extend_from_slice(stepper.nodes());
            }
            (done.time, done.terminate) = (done.time.min(one.time), done.terminate | one.terminate);
            stepper.stay(parts.nodes, one.time)?;
        }
        parts.exchange.drive(parts.inputs, done.time, |_| true);
        parts.exchange.propagate(parts.nodes, done.time)?;
        self.settle(parts, &mut done)?;
        Ok(done)
    }

    /// Events at the end of a step, until nothing changes any more.
    fn settle(&mut self, parts: &mut SteppingParts, done: &mut Advance) -> Result<(), CosimError> {
        for _ in 0..EVENTS {
            let mut changed = false;
            for stepper in parts.steppers.iter_mut() {
                let settled = stepper.settle(parts.nodes, done.time)?;
                changed |= settled.changed;
                if settled.terminated {
                    self.ended.extend_from_slice(stepper.nodes());
                    done.terminate = true;
                }
            }
            if !changed || done.terminate {
                return Ok(());
            }
            parts.exchange.propagate(parts.nodes, done.time)?;
        }
        let reason = format!("events at one time do not end: inputs still changed after {EVENTS} exchanges");
        Err(CosimError::Stuck { time: done.time, reason, log: Vec::new() })
    }
}

fn each(
    parts: &mut SteppingParts,
    mut f: impl FnMut(&mut dyn SystemStepper, &mut [InstanceNode]) -> Result<(), CosimError>,
) -> Result<(), CosimError> {
    parts.steppers.iter_mut().try_for_each(|stepper| f(stepper.as_mut(), parts.nodes))
}

/// Names the components the algorithm cannot run.
fn refuse(parts: &SteppingParts) -> Result<(), CosimError> {
    let mut wrong = Vec::new();
    for stepper in parts.steppers.iter() {
        let name = |n: &usize| parts.nodes[*n].planned.name.clone();
        if !stepper.can_restore(parts.nodes) {
            let names: Vec<_> = stepper.nodes().iter().map(name).collect();
            wrong.push(format!("{}: the adaptive algorithm goes back, which this FMU cannot (canGetAndSetFMUstate is not true); choose another algorithm, such as \"extrapolate\"", names.join(", ")));
        }
    }
    for node in parts.nodes.iter().filter(|n| !n.allows_any_step()) {
        let equal = !node.offered().is_some_and(|i| i.can_handle_variable_communication_step_size);
        let why = if equal {
            "takes equal steps only (canHandleVariableCommunicationStepSize is not true)"
        } else {
            "takes whole multiples of its internal step only (fixedInternalStepSize)"
        };
        wrong.push(format!(
            "{}: the adaptive algorithm chooses its steps, but this FMU {why}; choose another algorithm",
            node.planned.name
        ));
    }
    if wrong.is_empty() { Ok(()) } else { Err(CosimError::Setting(wrong)) }
}
