//! The exchange of values at one time: outputs are read and inputs set in the order in which they depend on each other,
//! one call per FMU, type and stage; algebraic loops are solved on the way.
//!
//! Built once from numbers ([`Exchange::new`]), then run again and again ([`Exchange::propagate`]) without names, look-ups
//! or allocation. The same code serves initialization (dependencies of `InitialUnknowns`) and stepping (`Outputs`).
//!
//! **Order.** Variables that take part are the nodes of a graph; an edge goes from an output to the inputs that it is
//! connected to, and from an input to the outputs of its FMU that depend on it (undeclared: all of them). Its strongly
//! connected components are loops. The stage of an output is the longest way of connections that leads to it.

mod bank;
mod build;
mod dependencies;
mod newton;

use trueup_fmi_description::description::DescriptionVariability;
use trueup_fmi_import::program::{Instances, Program};

use crate::error::CosimError;
use crate::inputs::InputFileTable;
use crate::node::{InputLine, InstanceNode};
use crate::plan::{DrivenInput, ElementIndex, LinearLink};
use bank::{ElementBank, RealElements, ScaledElement, ValueSlot};
use newton::Loop;
pub use newton::LoopLog;

/// Whose dependencies count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Initialization mode: `InitialUnknowns`.
    Initialization,
    /// Afterwards: `Outputs`.
    Stepping,
}

/// What is connected, of a [`MasterPlan`](crate::plan::MasterPlan).
#[derive(Clone, Copy)]
pub struct Wiring<'a> {
    /// Connections.
    pub links: &'a [LinearLink],
    /// Inputs from a file.
    pub driven: &'a [DrivenInput],
    /// Tables of links.
    pub maps: &'a [Vec<(i64, i64)>],
}

#[derive(Clone, Copy)]
enum Op {
    Get(usize),
    Set(usize),
    GetOther(usize),
    SetOther(usize),
    /// Ranges of the three lists of copies.
    Hand([(u32, u32); 3]),
    Solve(usize),
}

struct DrivenSpot {
    column: usize,
    linear: bool,
    to: ValueSlot,
    node: usize,
}

/// Values, and how they are read, handed on and set.
pub struct Exchange {
    bank: ElementBank,
    ops: Vec<Op>,
    loops: Vec<Loop>,
    driven: Vec<DrivenSpot>,
    /// Continuous inputs: node, value reference, slots.
    inputs: Vec<(usize, u32, std::ops::Range<usize>)>,
    calls: Vec<ExchangeCalls>,
}

impl Exchange {
    /// Values of all `Float64`; the slots of [`InputLine`](crate::node::InputLine) point here.
    pub fn reals(&self) -> &[f64] {
        &self.bank.reals
    }

    pub(crate) fn reals_mut(&mut self) -> &mut [f64] {
        &mut self.bank.reals
    }

    /// Writes the exchange into a program; `false` if it holds more than doubles that are handed on. Inputs that are one
    /// after the other what outputs are one after the other are set from there, without being copied, unless the values of
    /// inputs are required (`copied`).
    pub(crate) fn program(&self, program: &mut Program, owners: &mut impl Instances, copied: bool) -> bool {
        let bank = &self.bank;
        // What each input is made of.
        let mut made: Vec<Option<ScaledElement>> = vec![None; bank.reals.len()];
        let mut call = |program: &mut Program, b: usize, set: bool, values: std::ops::Range<usize>| {
            let RealElements { node, references, .. } = &bank.blocks[b];
            let Some(instance) = owners.instance(*node) else { return false };
            program.call(*node, instance, set, references, values)
        };
        self.ops.iter().all(|op| match *op {
            Op::Get(b) => call(program, b, false, bank.blocks[b].first..bank.blocks[b].end),
            Op::Set(b) => {
                let own = bank.blocks[b].first..bank.blocks[b].end;
                let first = made[own.start].map_or(usize::MAX, |s| s.from as usize);
                let plain = |at: usize| {
                    let source = |s: ScaledElement| (s.from as usize, s.factor, s.offset);
                    made[at].map(source) == Some((first.wrapping_add(at - own.start), 1.0, 0.0))
                };
                if !copied && own.clone().all(plain) {
                    return call(program, b, true, first..first + own.len());
                }
                for s in made[own.clone()].iter().flatten() {
                    program.hand(s.from as usize, s.to as usize, s.factor, s.offset);
                }
                call(program, b, true, own)
            }
            Op::Hand([copies, scaled, converted]) if converted.0 == converted.1 => {
                for c in &bank.copies[copies.0 as usize..copies.1 as usize] {
                    made[c.to as usize] =
                        Some(ScaledElement { from: c.from, to: c.to, factor: 1.0, offset: 0.0 });
                }
                for c in &bank.scaled[scaled.0 as usize..scaled.1 as usize] {
                    made[c.to as usize] = Some(*c);
                }
                true
            }
            _ => false,
        })
    }

    /// Names the first value, in the order in which they are read, that is not finite.
    #[cold]
    pub(crate) fn first_not_finite(&self, nodes: &[InstanceNode], time: f64) -> CosimError {
        let read = self.ops.iter().filter_map(|op| match op {
            Op::Get(b) => Some(self.bank.blocks[*b].first..self.bank.blocks[*b].end),
            _ => None,
        });
        let wrong = |range: &std::ops::Range<usize>| range.clone().any(|at| !self.bank.reals[at].is_finite());
        let range = read.into_iter().find(wrong).unwrap_or(0..self.bank.reals.len());
        *self.bank.not_finite(range, nodes, time)
    }

    /// Gives each node the line of its continuous inputs.
    ///
    /// # Errors
    /// Sizes of arrays cannot be had.
    pub(crate) fn install_lines(&self, nodes: &mut [InstanceNode]) -> Result<(), CosimError> {
        for (i, node) in nodes.iter_mut().enumerate() {
            let own = || self.inputs.iter().filter(|(n, ..)| *n == i);
            let references: Vec<u32> = own().map(|(_, r, _)| *r).collect();
            let slots: Vec<usize> = own().flat_map(|(.., slots)| slots.clone()).collect();
            if !slots.is_empty() {
                node.line = InputLine::new(node.slave.prepare(&references)?, slots);
            }
        }
        Ok(())
    }

    /// Names the value in a slot.
    pub(crate) fn element(&self, slot: usize) -> ElementIndex {
        self.bank.elements[slot]
    }

    /// The slots of outputs that are read from a node.
    pub(crate) fn outputs(&self, node: usize) -> Vec<usize> {
        let blocks = self.calls[node].gets[0].iter().map(|b| &self.bank.blocks[*b]);
        blocks.flat_map(|b| b.first..b.end).collect()
    }

    /// Which slots go continuously: outputs that do, but of FMUs that sample; inputs that are connected to such an output, inputs
    /// from a file on lines.
    pub(crate) fn smooth(&self, nodes: &[InstanceNode]) -> Vec<bool> {
        let continuous = |e: &ElementIndex| {
            let node = &nodes[e.component];
            !node.samples()
                && node.description().variables[e.variable].variability == DescriptionVariability::Continuous
        };
        let mut smooth = vec![false; self.bank.reals.len()];
        for node in 0..self.calls.len() {
            self.outputs(node).into_iter().for_each(|at| smooth[at] = continuous(&self.bank.elements[at]));
        }
        let links = self.bank.copies.iter().map(|c| (c.from, c.to));
        let links = links.chain(self.bank.scaled.iter().map(|c| (c.from, c.to)));
        let links: Vec<_> = links.collect();
        for (from, to) in links.into_iter().chain(self.loops.iter().flat_map(Loop::links)) {
            smooth[to as usize] = smooth[from as usize];
        }
        for d in self.driven.iter().filter(|d| d.linear) {
            if let ValueSlot::Real(at) = d.to {
                smooth[at] = true;
            }
        }
        smooth
    }

    /// Sources of the reals: pairs of slots.
    pub(crate) fn sources(&self) -> Vec<(u32, u32)> {
        let copies = self.bank.copies.iter().map(|c| (c.from, c.to));
        let scaled = self.bank.scaled.iter().map(|c| (c.from, c.to));
        copies.chain(scaled).chain(self.loops.iter().flat_map(Loop::links)).collect()
    }

    /// Overwrites a real, as for a source whose value is not of now.
    pub(crate) fn set_real(&mut self, slot: usize, value: f64) {
        self.bank.reals[slot] = value;
    }

    /// What the loops did so far.
    pub fn loops(&self) -> impl Iterator<Item = &LoopLog> {
        self.loops.iter().map(|l| &l.log)
    }

    /// Slopes of inputs from those of the outputs, both by slot.
    pub(crate) fn hand_slopes(&self, slopes: &mut [f64]) {
        for c in &self.bank.copies {
            slopes[c.to as usize] = slopes[c.from as usize];
        }
        for c in &self.bank.scaled {
            slopes[c.to as usize] = c.factor * slopes[c.from as usize];
        }
        self.loops.iter().for_each(|l| l.hand_slopes(slopes));
    }

    /// Values of inputs that a file drives, as of `time`, of the nodes that are due.
    pub fn drive(&mut self, inputs: Option<&InputFileTable>, time: f64, due: impl Fn(usize) -> bool) {
        let Some(inputs) = inputs else { return };
        for d in &self.driven {
            if !due(d.node) {
                continue;
            }
            match d.to {
                ValueSlot::Real(at) => self.bank.reals[at] = inputs.at(d.column, time, d.linear),
                ValueSlot::Other(block, at) => {
                    inputs.put(d.column, time, d.linear, &mut self.bank.others[block].block.values, at);
                }
            }
        }
    }

    /// Values of inputs on lines just before `time`, of the nodes that are due: what their lines over a step lead to, where they jump then.
    pub(crate) fn drive_before(
        &mut self,
        inputs: Option<&InputFileTable>,
        time: f64,
        due: impl Fn(usize) -> bool,
    ) {
        let Some(inputs) = inputs else { return };
        for d in self.driven.iter().filter(|d| d.linear && due(d.node)) {
            if let ValueSlot::Real(at) = d.to {
                self.bank.reals[at] = inputs.before(d.column, time, true);
            }
        }
    }

    /// Columns that drive inputs: which, and whether on lines between samples.
    pub(crate) fn driven(&self) -> impl Iterator<Item = (usize, bool)> {
        self.driven.iter().map(|d| (d.column, d.linear))
    }

    /// Those that drive reals: slot, column, whether on lines.
    pub(crate) fn driven_reals(&self) -> impl Iterator<Item = (usize, usize, bool)> {
        self.driven.iter().filter_map(|d| match d.to {
            ValueSlot::Real(slot) => Some((slot, d.column, d.linear)),
            ValueSlot::Other(..) => None,
        })
    }

    /// Slopes of driven inputs over `from..to`, by slot.
    pub(crate) fn drive_slopes(
        &self,
        inputs: Option<&InputFileTable>,
        from: f64,
        to: f64,
        slopes: &mut [f64],
    ) {
        let Some(inputs) = inputs else { return };
        for d in self.driven.iter().filter(|d| d.linear) {
            if let ValueSlot::Real(at) = d.to {
                let (a, b) = (inputs.at(d.column, from, true), inputs.before(d.column, to, true));
                slopes[at] = (b - a) / (to - from);
            }
        }
    }

    /// Reads all outputs and sets all inputs as of `time`, in order of dependency, and solves the loops.
    ///
    /// # Errors
    /// Whatever an FMU returns; [`CosimError::NotFinite`]; [`CosimError::Loop`].
    #[inline]
    pub fn propagate(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        self.propagate_due(nodes, time, |_| true)
    }

    /// As [`Exchange::propagate`], for the nodes that are due alone: of the others the values read last count, and
    /// nothing is set.
    ///
    /// # Errors
    /// As [`Exchange::propagate`].
    #[inline]
    pub fn propagate_due(
        &mut self,
        nodes: &mut [InstanceNode],
        time: f64,
        due: impl Fn(usize) -> bool,
    ) -> Result<(), CosimError> {
        let Self { bank, ops, loops, .. } = self;
        for op in &*ops {
            match *op {
                Op::Get(b) if due(bank.blocks[b].node) => bank.get(b, nodes, time)?,
                Op::Set(b) if due(bank.blocks[b].node) => bank.set(b, nodes, time)?,
                Op::GetOther(b) if due(bank.others[b].node) => bank.get_other(b, nodes, time)?,
                Op::SetOther(b) if due(bank.others[b].node) => bank.set_other(b, nodes, time)?,
                Op::Hand(ranges) => bank.hand(ranges),
                Op::Solve(l) => loops[l].solve(bank, nodes, time, &due)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// Reads what one node gives now, without setting anything.
    ///
    /// # Errors
    /// Whatever the FMU returns; [`CosimError::NotFinite`].
    pub(crate) fn read(
        &mut self,
        node: usize,
        nodes: &mut [InstanceNode],
        time: f64,
    ) -> Result<(), CosimError> {
        let ExchangeCalls { gets: [reals, others], .. } = &self.calls[node];
        reals.iter().try_for_each(|b| self.bank.get(*b, nodes, time))?;
        others.iter().try_for_each(|b| self.bank.get_other(*b, nodes, time))
    }

    /// Hands to one node what was read last, and sets it.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub(crate) fn write(
        &mut self,
        node: usize,
        nodes: &mut [InstanceNode],
        time: f64,
    ) -> Result<(), CosimError> {
        let ExchangeCalls { sets: [reals, others], inward, .. } = &self.calls[node];
        for ranges in inward {
            self.bank.hand(*ranges);
        }
        for l in &self.loops {
            l.hand(&mut self.bank, node);
        }
        reals.iter().try_for_each(|b| self.bank.set(*b, nodes, time))?;
        others.iter().try_for_each(|b| self.bank.set_other(*b, nodes, time))
    }

    /// Lists the calls and copies of each node.
    fn index(&mut self, nodes: usize) {
        let Self { bank, ops, loops, calls, .. } = self;
        calls.resize_with(nodes, ExchangeCalls::default);
        let mut add = |b: usize, kind: usize, set: bool| {
            let node = if kind == 0 { bank.blocks[b].node } else { bank.others[b].node };
            let calls = &mut calls[node];
            (if set { &mut calls.sets } else { &mut calls.gets })[kind].push(b);
        };
        for op in &*ops {
            match *op {
                Op::Get(b) => add(b, 0, false),
                Op::Set(b) => add(b, 0, true),
                Op::GetOther(b) => add(b, 1, false),
                Op::SetOther(b) => add(b, 1, true),
                Op::Hand(_) => {}
                Op::Solve(l) => {
                    for kind in [0, 1] {
                        loops[l].gets()[kind].iter().for_each(|b| add(*b, kind, false));
                        loops[l].sets()[kind].iter().for_each(|b| add(*b, kind, true));
                    }
                }
            }
        }
        let of = |spot: &ValueSlot| match *spot {
            ValueSlot::Real(at) => bank.elements[at].component,
            ValueSlot::Other(block, _) => bank.others[block].node,
        };
        let one = |i: usize| (i as u32, i as u32 + 1);
        for (i, c) in bank.copies.iter().enumerate() {
            calls[of(&ValueSlot::Real(c.to as usize))].inward.push([one(i), (0, 0), (0, 0)]);
        }
        for (i, c) in bank.scaled.iter().enumerate() {
            calls[of(&ValueSlot::Real(c.to as usize))].inward.push([(0, 0), one(i), (0, 0)]);
        }
        for (i, c) in bank.converted.iter().enumerate() {
            calls[of(&c.to)].inward.push([(0, 0), (0, 0), one(i)]);
        }
    }
}

/// The blocks of one node (of reals, of others), and the copies that lead to it.
#[derive(Default)]
struct ExchangeCalls {
    gets: [Vec<usize>; 2],
    sets: [Vec<usize>; 2],
    inward: Vec<[(u32, u32); 3]>,
}
