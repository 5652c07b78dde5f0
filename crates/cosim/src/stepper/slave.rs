//! One FMU in Co-Simulation.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use trueup_fmi_import::program::Following;
use trueup_fmi_import::{CoSimulationStep, StateId, fmi3, interrupt};
use trueup_numerics::ShortNumber;

use super::{Advance, SLOTS, StepLimit, SystemStepper};
use crate::calls::CallCounts;
use crate::error::CosimError;
use crate::grid::ROUNDING;
use crate::node::InstanceNode;
use crate::plan::PlannedComponent;
use crate::step_rule::{InputFollowing, StepRule, is_continuous_input};

/// Halvings of a discarded step before the run is given up.
const HALVINGS: u32 = 20;
/// Steps that end early on the way to one communication point, after which they are assumed to be endless.
const EARLY: u32 = 100_000;
/// Where inputs are held that do not move.
static ANYWHERE: [f64; 1] = [0.5];

/// A line as the callback of the intermediate update reads it, bits of doubles.
#[derive(Default)]
pub(crate) struct SharedInstance {
    from: AtomicU64,
    /// References in the order of the description; value and slope of each element.
    lines: Vec<[AtomicU64; 2]>,
}

/// The settings of Co-Simulation that let an FMU request its inputs, and the answers.
pub(crate) fn intermediate(
    planned: &PlannedComponent,
) -> (fmi3::CoSimulationOptions, Option<Arc<SharedInstance>>) {
    let d = planned.description();
    let inputs = || d.variables.iter().filter(|v| is_continuous_input(v));
    let references: Vec<u32> = inputs().map(|v| v.value_reference).collect();
    let elements: usize = inputs().map(|v| d.elements(v).unwrap_or(1)).sum();
    // NaN: not driven, so not to be set.
    let undriven = || [AtomicU64::new(f64::NAN.to_bits()), AtomicU64::new(0)];
    let shared = Arc::new(SharedInstance {
        from: AtomicU64::new(0),
        lines: std::iter::repeat_with(undriven).take(elements).collect(),
    });
    let theirs = Arc::clone(&shared);
    let spans: Vec<(u32, usize)> =
        inputs().map(|v| (v.value_reference, d.elements(v).unwrap_or(1))).collect();
    let (mut driven, mut values) = (Vec::new(), Vec::new());
    let update = move |now: &mut fmi3::Intermediate| {
        if !now.set_requested {
            return;
        }
        let t = now.time - f64::from_bits(theirs.from.load(Relaxed));
        driven.clear();
        values.clear();
        let mut at = 0;
        for (reference, n) in &spans {
            let lines = &theirs.lines[at..at + n];
            at += n;
            let known = lines.iter().all(|[value, _]| !f64::from_bits(value.load(Relaxed)).is_nan());
            if known {
                driven.push(*reference);
                let on = |[value, slope]: &[AtomicU64; 2]| {
                    f64::from_bits(value.load(Relaxed)) + t * f64::from_bits(slope.load(Relaxed))
                };
                values.extend(lines.iter().map(on));
            }
        }
        let _ = now.set_float64(&driven, &values); // a refusal leaves them as they were set last
    };
    let how = fmi3::CoSimulationOptions {
        intermediate_variables: references,
        intermediate_update: Some(Box::new(update)),
        ..fmi3::CoSimulationOptions::default()
    };
    (how, Some(shared))
}

/// One FMU in Co-Simulation.
pub(crate) struct SlaveStepper {
    node: [usize; 1],
    rule: StepRule,
    /// The regular step in s.
    regular: f64,
    /// The FMU takes steps of other lengths too.
    variable: bool,
    calls: CallCounts,
    /// States may be restored, so the FMU is not promised the contrary.
    rolls_back: bool,
    states: [Option<StateId>; SLOTS],
    shared: Option<Arc<SharedInstance>>,
    /// Per element of the line its place among the shared ones.
    places: Vec<usize>,
    ones: Vec<i32>,
}

impl SlaveStepper {
    /// `step`: the regular one in s.
    pub(crate) fn new(
        nodes: &[InstanceNode],
        node: usize,
        rule: StepRule,
        step: f64,
        rolls_back: bool,
        shared: Option<Arc<SharedInstance>>,
    ) -> Self {
        let d = nodes[node].description();
        let variable =
            d.co_simulation.as_ref().is_some_and(|i| i.can_handle_variable_communication_step_size);
        let line = &nodes[node].line;
        let references = line.references.as_ref().map_or(&[][..], |p| p.references());
        let inputs: Vec<_> = d.variables.iter().filter(|v| is_continuous_input(v)).collect();
        let mut places = Vec::new();
        for reference in references {
            let mut at = 0;
            for v in &inputs {
                let n = d.elements(v).unwrap_or(1);
                if v.value_reference == *reference {
                    places.extend(at..at + n);
                }
                at += n;
            }
        }
        Self {
            node: [node],
            rule,
            regular: step,
            variable,
            calls: CallCounts::default(),
            rolls_back,
            states: Default::default(),
            shared,
            places,
            ones: vec![1; references.len()],
        }
    }

    /// A regular step is of the same length to the last bit: FMUs keep what they have computed for it.
    #[inline]
    fn is_regular(&self, from: f64, to: f64) -> bool {
        !self.variable || ((to - from) - self.regular).abs() <= ROUNDING * self.regular
    }

    #[inline]
    fn length(&self, from: f64, to: f64) -> f64 {
        if self.is_regular(from, to) { self.regular } else { to - from }
    }

    /// Steps up to `to`, at first one of this length (`to - from` but for rounding); a discarded one goes on from where the FMU came, or is halved. With `lines` the
    /// FMU receives before each the derivatives of its inputs. `first`: what the first step has come to, if it was made already.
    fn advance(
        &mut self,
        node: &mut InstanceNode,
        [from, to]: [f64; 2],
        length: f64,
        lines: bool,
        mut first: Option<CoSimulationStep>,
        done: &mut Advance,
    ) -> Result<(), CosimError> {
        let (mut time, mut step, mut halvings, mut early) = (from, length, 0, 0);
        loop {
            if lines {
                self.tell(node, time)?;
            }
            let result = match first.take() {
                Some(result) => result,
                None => match node.slave.step(time, step, !self.rolls_back) {
                    Ok(None) => CoSimulationStep::whole(time, step),
                    Ok(Some(other)) => *other,
                    Err(source) => return Err(CosimError::Call { time, source: *source }),
                },
            };
            self.calls.add(step, 1);
            if result.event && !result.terminate && !result.discarded {
                (done.time, done.event) = (if result.early { result.time } else { time + step }, true);
                if !result.early && step >= (to - time) * (1.0 - ROUNDING) {
                    done.time = to;
                }
                return Ok(());
            }
            if !result.early {
                // What rounding leaves is no step of its own.
                let whole = (time == from && step == length) || step >= (to - time) * (1.0 - ROUNDING);
                (done.time, done.terminate) = (if whole { to } else { time + step }, result.terminate);
                if whole || result.terminate {
                    return Ok(());
                }
                time += step;
            } else {
                done.discarded += u64::from(result.discarded);
                // Its clock and ours differ by rounding.
                let rounding = ROUNDING * step.abs();
                let progress = result.time > time + rounding && result.time <= to + rounding;
                let astray = !progress && (result.time.is_nan() || (result.time - time).abs() > rounding);
                if result.terminate && astray {
                    let reason = "ends the run there and does not report its time";
                    return Err(stuck(node, time, step, result.time, reason));
                }
                if result.terminate {
                    (done.time, done.terminate) = (if progress { result.time } else { time }, true);
                    return Ok(());
                }
                if interrupt::requested() {
                    return Err(CosimError::Interrupted { time });
                }
                (halvings, early) = (halvings + u32::from(!progress), early + 1);
                let reason = if !self.variable {
                    "and takes no other step"
                } else if halvings > HALVINGS {
                    "however short the step"
                } else if early > EARLY {
                    "and has done so 100000 times within one communication step: it hardly advances"
                } else if astray {
                    "and does not report its time"
                } else {
                    ""
                };
                if !reason.is_empty() {
                    return Err(stuck(node, time, step, result.time, reason));
                }
                (time, step) = if progress { (result.time.min(to), step) } else { (time, step / 2.0) };
                node.line.dirty = true;
                if time >= to - rounding {
                    done.time = to;
                    return Ok(());
                }
            }
            step = step.min(to - time);
        }
    }

    /// A step in parts from part `begin` on, inputs held in each; `first`: what that part came to, if it was made already.
    fn parts(
        &mut self,
        node: &mut InstanceNode,
        [from, to]: [f64; 2],
        begin: usize,
        mut first: Option<CoSimulationStep>,
        done: &mut Advance,
    ) -> Result<(), CosimError> {
        let places = self.places(node, self.length(from, to));
        let n = places.len();
        let at = |k: usize| if k == n { to } else { from + (to - from) * k as f64 / n as f64 };
        let part = self.length(from, to) / n as f64;
        for (k, held) in places.iter().enumerate().skip(begin) {
            if first.is_none() {
                node.set_on_line(from + held * (to - from))?;
            }
            self.advance(node, [at(k), at(k + 1)], part, false, first.take(), done)?;
            if done.terminate || done.event {
                break;
            }
        }
        Ok(())
    }

    /// Over a step in which continuous inputs go on lines they are held in parts, and these lines are no constants.
    pub(crate) fn holds(&self, node: &InstanceNode, within: StepLimit) -> bool {
        within == StepLimit::Line
            && matches!(self.rule.way, InputFollowing::Held(_))
            && node.line.slope.iter().any(|slope| *slope != 0.0)
    }

    /// Whether the inputs on their lines at `time` are an event at once, of an FMU that is there; it tries a step of `h` s.
    pub(crate) fn is_event(
        &mut self,
        node: &mut InstanceNode,
        time: f64,
        h: f64,
    ) -> Result<bool, CosimError> {
        node.set_on_line(time)?;
        self.calls.add(h, 1);
        match node.slave.step(time, h, !self.rolls_back) {
            Ok(None) => Ok(false),
            Ok(Some(step)) => Ok(step.event && step.early && step.time <= time),
            Err(source) => Err(CosimError::Call { time, source: *source }),
        }
    }

    /// Where inputs are held in a step of this length.
    fn places(&self, node: &InstanceNode, step: f64) -> &'static [f64] {
        if node.line.slope.iter().any(|s| *s != 0.0) { self.rule.places(step) } else { &ANYWHERE }
    }

    /// It may be given a step of `length` s.
    pub(crate) fn allows(&self, length: f64) -> bool {
        self.rule.allows(length)
    }

    /// Passes the derivatives of its inputs to the FMU from `time`.
    fn tell(&mut self, node: &mut InstanceNode, time: f64) -> Result<(), CosimError> {
        if node.line.dirty || time != node.line.from {
            node.set_on_line(time)?;
            node.line.dirty = false;
        }
        match (self.rule.way, &self.shared) {
            (InputFollowing::Derivatives, _) => {
                let Some(references) = &node.line.references else { return Ok(()) };
                node.slave
                    .set_input_derivatives(references.references(), &self.ones, &node.line.slope)
                    .map_err(|source| CosimError::Call { time, source })
            }
            (InputFollowing::Intermediate, Some(shared)) => {
                shared.from.store(node.line.from.to_bits(), Relaxed);
                for ((place, value), slope) in self.places.iter().zip(&node.line.value).zip(&node.line.slope)
                {
                    shared.lines[*place][0].store(value.to_bits(), Relaxed);
                    shared.lines[*place][1].store(slope.to_bits(), Relaxed);
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

#[cold]
fn stuck(node: &InstanceNode, time: f64, step: f64, came: f64, reason: &str) -> CosimError {
    let name = node.slave.name();
    let (step, came) = (ShortNumber(step), ShortNumber(came));
    let reason =
        format!("doStep of instance \"{name}\" over {step} s ended early at {came} s (Discard) {reason}");
    CosimError::Stuck { time, reason, log: node.slave.log() }
}

impl SystemStepper for SlaveStepper {
    fn nodes(&self) -> &[usize] {
        &self.node
    }

    #[inline]
    fn step(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Advance, CosimError> {
        let node = &mut nodes[self.node[0]];
        let mut done = Advance { time: to, ..Advance::default() };
        let lines = within == StepLimit::Line && !node.line.slots.is_empty();
        match self.rule.way {
            InputFollowing::Held(_) if lines => self.parts(node, [from, to], 0, None, &mut done)?,
            _ => self.advance(node, [from, to], self.length(from, to), lines, None, &mut done)?,
        }
        Ok(done)
    }

    #[inline]
    fn pace(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Option<Box<Advance>>, Box<CosimError>> {
        let node = &mut nodes[self.node[0]];
        let held = within == StepLimit::Held || node.line.slots.is_empty();
        if held && self.is_regular(from, to) {
            return match node.slave.step(from, self.regular, !self.rolls_back) {
                Ok(None) => {
                    self.calls.add(self.regular, 1);
                    Ok(None)
                }
                Ok(Some(first)) => {
                    Ok(Some(Box::new(self.resume(nodes, [from, to], StepLimit::Held, 0, Some(*first))?)))
                }
                Err(source) => Err(Box::new(CosimError::Call { time: from, source: *source })),
            };
        }
        let whole = Advance { time: to, ..Advance::default() };
        match self.step(nodes, from, to, within) {
            Ok(done) => Ok((done != whole).then(|| Box::new(done))),
            Err(error) => Err(Box::new(error)),
        }
    }

    fn is_plain(&self) -> bool {
        !self.rolls_back
    }

    fn made(&mut self, steps: u64, in_parts: u64) {
        let parts = self.rule.places(self.regular).len() as u64;
        self.calls.add(self.regular, steps - in_parts);
        self.calls.add(self.regular / parts as f64, in_parts * parts);
    }

    fn calls(&self) -> Option<(&CallCounts, &'static str)> {
        Some((&self.calls, self.rule.words()))
    }

    fn following(&self) -> Option<Following> {
        match self.rule.way {
            InputFollowing::Held(places) => Some(Following::Parts(places)),
            InputFollowing::Derivatives => Some(Following::Derivatives),
            InputFollowing::Intermediate => None,
        }
    }

    #[cold]
    fn resume(
        &mut self,
        nodes: &mut [InstanceNode],
        [from, to]: [f64; 2],
        within: StepLimit,
        part: usize,
        first: Option<CoSimulationStep>,
    ) -> Result<Advance, CosimError> {
        let mut done = Advance { time: to, ..Advance::default() };
        let node = &mut nodes[self.node[0]];
        let lines = within == StepLimit::Line && !node.line.slots.is_empty();
        match self.rule.way {
            InputFollowing::Held(_) if lines => {
                // Those before were made by the program.
                let begin = if first.is_some() { part } else { part + 1 };
                self.calls.add(self.regular / self.places(node, self.regular).len() as f64, begin as u64);
                self.parts(node, [from, to], begin, first, &mut done)?;
            }
            _ if first.is_some() => {
                self.advance(node, [from, to], self.regular, lines, first, &mut done)?;
            }
            _ => self.calls.add(self.regular, 1),
        }
        Ok(done)
    }

    fn can_restore(&self, nodes: &[InstanceNode]) -> bool {
        nodes[self.node[0]].can_restore()
    }

    fn save_in(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        nodes[self.node[0]]
            .slave
            .save(&mut self.states[slot])
            .map_err(|source| CosimError::Call { time, source })
    }

    fn restore_from(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        nodes[self.node[0]].line.dirty = true;
        match &self.states[slot] {
            Some(state) => {
                nodes[self.node[0]].slave.restore(state).map_err(|source| CosimError::Call { time, source })
            }
            None => Ok(()), // nothing has been stored, so nothing was stepped
        }
    }
}
