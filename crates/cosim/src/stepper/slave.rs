//! One FMU in Co-Simulation.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use trueup_fmi_description::Version;
use trueup_fmi_description::description::{Causality, Description, Type, Variability};
use trueup_fmi_import::{StateId, fmi3};

use super::{Advance, SLOTS, Stepper, Within};
use crate::error::Error;
use crate::grid::ROUNDING;
use crate::node::Node;
use crate::plan::Planned;

/// Halvings of a discarded step before the run is given up.
const HALVINGS: u32 = 20;
/// Parts of a step in which inputs are held at the middle of their lines, where the FMU cannot follow lines itself.
const PARTS: u32 = 2;

/// How an FMU follows its inputs on lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// FMI 2.0, `canInterpolateInputs`: `fmi2SetRealInputDerivatives`.
    Derivatives,
    /// FMI 3.0, `providesIntermediateUpdate` of an FMU that takes equal steps only: it asks within its steps.
    Intermediate,
    /// The step in this many parts, inputs held at the middle of each; of one part if the FMU takes equal steps only.
    Parts(u32),
}

impl Way {
    /// The best that an FMU offers.
    pub(crate) fn of(d: &Description) -> Self {
        let Some(offered) = &d.co_simulation else { return Self::Parts(1) };
        let inputs = || d.variables.iter().filter(|v| is_continuous_input(v));
        match d.version {
            Version::V2 if offered.can_interpolate_inputs => Self::Derivatives,
            // Asked for its inputs, an FMU holds them over its next internal step, of unknown length: first order. Held at
            // the middle of a line they are of second order.
            _ if offered.can_handle_variable_communication_step_size => Self::Parts(PARTS),
            Version::V3
                if offered.provides_intermediate_update && inputs().all(|v| v.intermediate_update) =>
            {
                Self::Intermediate
            }
            _ => Self::Parts(1),
        }
    }

    /// The FMU itself knows what to do.
    pub(crate) fn is_native(self) -> bool {
        !matches!(self, Self::Parts(_))
    }
}

pub(crate) fn is_continuous_input(v: &trueup_fmi_description::description::Variable) -> bool {
    v.causality == Causality::Input && v.kind == Type::Float64 && v.variability == Variability::Continuous
}

/// A line as the callback of the intermediate update reads it, bits of doubles.
#[derive(Default)]
pub(crate) struct Shared {
    from: AtomicU64,
    /// References in the order of the description; value and slope of each element.
    lines: Vec<[AtomicU64; 2]>,
}

/// The settings of Co-Simulation that let an FMU ask for its inputs, and what it is told then.
pub(crate) fn intermediate(planned: &Planned) -> (fmi3::CoSimulation, Option<Arc<Shared>>) {
    let d = planned.description();
    if Way::of(d) != Way::Intermediate {
        return (fmi3::CoSimulation::default(), None);
    }
    let inputs = || d.variables.iter().filter(|v| is_continuous_input(v));
    let references: Vec<u32> = inputs().map(|v| v.value_reference).collect();
    let elements: usize = inputs().map(|v| d.elements(v).unwrap_or(1)).sum();
    // NaN: not driven, so not to be set.
    let undriven = || [AtomicU64::new(f64::NAN.to_bits()), AtomicU64::new(0)];
    let shared = Arc::new(Shared {
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
    let how = fmi3::CoSimulation {
        intermediate_variables: references,
        intermediate_update: Some(Box::new(update)),
        ..fmi3::CoSimulation::default()
    };
    (how, Some(shared))
}

/// One FMU in Co-Simulation.
pub(crate) struct SlaveStepper {
    node: [usize; 1],
    way: Way,
    /// The regular step in s.
    regular: f64,
    /// The FMU takes steps of other lengths too.
    variable: bool,
    /// States may be restored, so the FMU is not promised the contrary.
    rolls_back: bool,
    states: [Option<StateId>; SLOTS],
    shared: Option<Arc<Shared>>,
    /// Per element of the line its place among the shared ones.
    places: Vec<usize>,
    ones: Vec<i32>,
}

impl SlaveStepper {
    /// `step`: the regular one in s.
    pub(crate) fn new(
        nodes: &[Node],
        node: usize,
        step: f64,
        rolls_back: bool,
        shared: Option<Arc<Shared>>,
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
            way: Way::of(d),
            regular: step,
            variable,
            rolls_back,
            states: Default::default(),
            shared,
            places,
            ones: vec![1; references.len()],
        }
    }

    /// Steps of any length up to `to`; a discarded one goes on from where the FMU came, or is halved. With `lines` the
    /// FMU is told before each how its inputs go on.
    fn advance(
        &mut self,
        node: &mut Node,
        from: f64,
        to: f64,
        lines: bool,
        done: &mut Advance,
    ) -> Result<(), Error> {
        // A regular step is of the same length to the last bit: FMUs keep what they have computed for it.
        let regular = !self.variable || ((to - from) - self.regular).abs() <= ROUNDING * self.regular;
        let (mut time, mut step, mut halvings) = (from, if regular { self.regular } else { to - from }, 0);
        loop {
            if lines {
                self.tell(node, time)?;
            }
            let result = node
                .slave
                .do_step(time, step, !self.rolls_back)
                .map_err(|source| Error::Call { time, source })?;
            if result.event && !result.terminate && !result.discarded {
                (done.time, done.event) = (if result.early { result.time } else { time + step }, true);
                if !result.early && step >= to - time {
                    done.time = to;
                }
                return Ok(());
            }
            if !result.early {
                let whole = (regular && time == from && step == self.regular) || step >= to - time;
                (done.time, done.terminate) = (if whole { to } else { time + step }, result.terminate);
                if whole || result.terminate {
                    return Ok(());
                }
                time += step;
            } else {
                done.discarded += u64::from(result.discarded);
                let progress = result.time > time && result.time <= to;
                if result.terminate {
                    (done.time, done.terminate) = (if progress { result.time } else { time }, true);
                    return Ok(());
                }
                halvings += u32::from(!progress);
                let reason = if !self.variable {
                    "and takes no other step"
                } else if halvings > HALVINGS {
                    "however short the step"
                } else if !progress && result.time != time {
                    "and does not say where it stands"
                } else {
                    ""
                };
                if !reason.is_empty() {
                    return Err(stuck(node, time, step, result.time, reason));
                }
                (time, step) = if progress { (result.time, step) } else { (time, step / 2.0) };
                node.line.dirty = true;
                if time >= to {
                    done.time = to;
                    return Ok(());
                }
            }
            step = step.min(to - time);
        }
    }

    /// Tells the FMU how its inputs go on from `time`.
    fn tell(&mut self, node: &mut Node, time: f64) -> Result<(), Error> {
        if node.line.dirty || time != node.line.from {
            node.set_on_line(time)?;
            node.line.dirty = false;
        }
        match (self.way, &self.shared) {
            (Way::Derivatives, _) => {
                let Some(references) = &node.line.references else { return Ok(()) };
                node.slave
                    .set_input_derivatives(references.references(), &self.ones, &node.line.slope)
                    .map_err(|source| Error::Call { time, source })
            }
            (Way::Intermediate, Some(shared)) => {
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
fn stuck(node: &Node, time: f64, step: f64, came: f64, reason: &str) -> Error {
    let name = node.slave.name();
    let reason =
        format!("doStep of instance \"{name}\" over {step:?} s ended early at {came:?} s (Discard) {reason}");
    Error::Stuck { time, reason, log: node.slave.log() }
}

impl Stepper for SlaveStepper {
    fn nodes(&self) -> &[usize] {
        &self.node
    }

    #[inline]
    fn step(&mut self, nodes: &mut [Node], from: f64, to: f64, within: Within) -> Result<Advance, Error> {
        let node = &mut nodes[self.node[0]];
        let mut done = Advance { time: to, ..Advance::default() };
        let lines = within == Within::Line && !node.line.slots.is_empty();
        match self.way {
            Way::Parts(n) if lines => {
                let n = if node.line.slope.iter().all(|s| *s == 0.0) { 1 } else { n };
                let at = |k: u32| if k == n { to } else { from + (to - from) * f64::from(k) / f64::from(n) };
                for k in 0..n {
                    node.set_on_line(0.5 * (at(k) + at(k + 1)))?;
                    self.advance(node, at(k), at(k + 1), false, &mut done)?;
                    if done.terminate || done.event {
                        break;
                    }
                }
            }
            _ => self.advance(node, from, to, lines, &mut done)?,
        }
        Ok(done)
    }

    fn can_restore(&self, nodes: &[Node]) -> bool {
        nodes[self.node[0]].can_restore()
    }

    fn save_in(&mut self, slot: usize, nodes: &mut [Node], time: f64) -> Result<(), Error> {
        nodes[self.node[0]].slave.save(&mut self.states[slot]).map_err(|source| Error::Call { time, source })
    }

    fn restore_from(&mut self, slot: usize, nodes: &mut [Node], time: f64) -> Result<(), Error> {
        nodes[self.node[0]].line.dirty = true;
        match &self.states[slot] {
            Some(state) => {
                nodes[self.node[0]].slave.restore(state).map_err(|source| Error::Call { time, source })
            }
            None => Ok(()), // nothing has been stored, so nothing was stepped
        }
    }
}
