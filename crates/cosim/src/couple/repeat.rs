//! A step that is repeated until its inputs settle, or taken back.

use super::{Coupling, ITERATIONS};
use crate::error::{ConnectionResidual, CosimError};
use crate::node;
use crate::stepper::{Advance, StepLimit};

/// Values at the start of a step that may be repeated.
#[derive(Default)]
pub(super) struct Saved {
    slopes: Vec<f64>,
    previous: Vec<f64>,
    reals: Vec<f64>,
    /// Time and last step of each unit.
    turns: Vec<(f64, f64)>,
}

/// Result of a step that was repeated until its inputs converged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attempt {
    /// What the steppers did, in the last repetition.
    pub advance: Advance,
    /// How often the step was made.
    pub iterations: u32,
    /// The inputs agree with the outputs that they come from.
    pub settled: bool,
}

/// An input that is followed on a line, after a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Followed {
    /// Node.
    pub node: usize,
    /// Slot among [`Exchange::reals`](crate::exchange::Exchange::reals).
    pub slot: usize,
    /// Value that was assumed for the end of the step.
    pub assumed: f64,
    /// Value that the outputs at the end of the step make of it.
    pub found: f64,
}

impl Coupling {
    /// Every unit that is due can save and restore.
    pub fn can_restore(&self) -> bool {
        self.steppers.iter().all(|s| s.can_restore(&self.nodes))
    }

    /// Stores everything at `time`.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    pub fn save(&mut self, time: f64) -> Result<(), CosimError> {
        for (stepper, _) in self.steppers.iter_mut().zip(&self.turns).filter(|(_, t)| t.due) {
            stepper.save(&mut self.nodes, time)?;
        }
        let saved = &mut self.saved;
        saved.slopes.clone_from(&self.slopes);
        saved.previous.clone_from(&self.previous);
        saved.reals.clear();
        saved.reals.extend_from_slice(self.exchange.reals());
        saved.turns.clear();
        saved.turns.extend(self.turns.iter().map(|u| (u.time, u.last)));
        Ok(())
    }

    /// Goes back to what was stored. Lines stay as they are.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    pub fn restore(&mut self, time: f64) -> Result<(), CosimError> {
        for (stepper, _) in self.steppers.iter_mut().zip(&self.turns).filter(|(_, t)| t.due) {
            stepper.restore(&mut self.nodes, time)?;
        }
        self.slopes.clone_from(&self.saved.slopes);
        self.previous.clone_from(&self.saved.previous);
        for (slot, x) in self.saved.reals.iter().enumerate() {
            self.exchange.set_real(slot, *x);
        }
        for (unit, (time, last)) in self.turns.iter_mut().zip(&self.saved.turns) {
            (unit.time, unit.last) = (*time, *last);
        }
        Ok(())
    }

    /// What was assumed of inputs on lines at `to`, and what was found there.
    pub fn lines(&self, to: f64) -> impl Iterator<Item = Followed> {
        let due = self.nodes.iter().enumerate().filter(|(n, _)| self.turns[self.unit[*n]].due);
        due.flat_map(move |(node, it)| {
            let line = &it.line;
            line.slots.iter().enumerate().map(move |(i, slot)| Followed {
                node,
                slot: *slot,
                assumed: line.value[i] + line.slope[i] * (to - line.from),
                found: self.exchange.reals()[*slot],
            })
        })
    }

    /// The nominal value of a slot's value.
    pub fn nominal(&self, slot: usize) -> f64 {
        let e = self.exchange.element(slot);
        let d = self.nodes[e.component].description();
        let nominal = d.attributes(&d.variables[e.variable]).nominal.map(f64::abs);
        nominal.filter(|x| *x > 0.0 && x.is_finite()).unwrap_or(1.0)
    }

    /// Steps to `to` again and again, inputs on the line from their values at the start to the newest ones at the end,
    /// until these change by less than `tolerance` times max(|value|, nominal). [`save`](Coupling::save) comes before.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    pub fn iterate(&mut self, from: f64, to: f64, tolerance: f64) -> Result<Attempt, CosimError> {
        let followed: Vec<(usize, f64)> = self.lines(to).map(|f| (f.slot, self.nominal(f.slot))).collect();
        self.anderson.begin(followed.len());
        let mut iterations = 0;
        loop {
            iterations += 1;
            let advance = self.step(to, StepLimit::Line)?;
            self.extrapolate_held(to);
            self.exchange(to)?;
            let Self { turns, unit, exchange, inputs, .. } = self;
            exchange.drive_before(inputs.as_ref(), to, |n| turns[unit[n]].due);
            let mut anderson = std::mem::take(&mut self.anderson);
            let mut settled = true;
            for (f, (_, nominal)) in self.lines(to).zip(&followed) {
                let free = self.smooth[f.slot] != 0.0;
                let r = if free { f.found - f.assumed } else { 0.0 };
                settled &= r.abs() <= tolerance * f.found.abs().max(*nominal);
                anderson.put(f.assumed / nominal, r / nominal);
            }
            self.anderson = anderson;
            if settled || advance.terminate || iterations == ITERATIONS {
                let Self { turns, unit, exchange, inputs, .. } = self;
                exchange.drive(inputs.as_ref(), to, |n| turns[unit[n]].due);
                return Ok(Attempt { advance, iterations, settled: settled || advance.terminate });
            }
            let next = self.anderson.next();
            self.restore(from)?;
            let mut at = 0;
            for (n, node) in self.nodes.iter_mut().enumerate() {
                if !self.turns[self.unit[n]].due {
                    continue;
                }
                let line = &mut node.line;
                for i in 0..line.slots.len() {
                    if self.smooth[line.slots[i]] != 0.0 {
                        line.slope[i] = (next[at] * followed[at].1 - line.value[i]) / (to - line.from);
                    }
                    at += 1;
                }
            }
        }
    }

    /// The inputs that still change after a step, for an error.
    pub(crate) fn unsettled(&self, time: f64, to: f64, tolerance: f64, reason: String) -> CosimError {
        let sources: std::collections::HashMap<u32, u32> =
            self.exchange.sources().into_iter().map(|(from, to)| (to, from)).collect();
        let name = |slot: usize| node::name(&self.nodes, self.exchange.element(slot));
        let one = |f: Followed| ConnectionResidual {
            variable: name(f.slot),
            source: sources.get(&(f.slot as u32)).map_or_else(String::new, |s| name(*s as usize)),
            value: f.assumed,
            residual: f.found - f.assumed,
        };
        let changes =
            |f: &Followed| (f.found - f.assumed).abs() > tolerance * f.found.abs().max(self.nominal(f.slot));
        CosimError::Unsettled { time, reason, variables: self.lines(to).filter(changes).map(one).collect() }
    }
}
