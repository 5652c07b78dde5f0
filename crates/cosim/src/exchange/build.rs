//! From connections and dependencies to the order of calls.

use std::collections::{BTreeMap, HashMap, HashSet};

use trueup_fmi_description::description::VariableType;

use super::bank::{
    ConvertedElement, ElementBank, ElementCopy, OtherElements, RealElements, ScaledElement, ValueSlot,
};
use super::dependencies::dependencies;
use super::{DrivenSpot, Exchange, Op, Phase, Wiring};
use crate::buffer::{ValueBuffer, VariableBlock};
use crate::error::CosimError;
use crate::exchange::newton::{Loop, LoopUnknown};
use crate::graph;
use crate::node::InstanceNode;
use crate::plan::{DrivenInput, ElementIndex, LinearLink, PlannedComponent};
use crate::step_rule::is_continuous_input;
use crate::value;

/// A variable that takes part.
struct ExchangePort {
    node: usize,
    variable: usize,
    output: bool,
    /// `Float64`.
    real: bool,
    elements: usize,
    /// Its strongly connected component.
    component: usize,
    /// When it is read, or its value is there.
    stage: usize,
    /// The first stage at which something depends on it.
    needed: usize,
}

/// First value of an input: as planned, else as described, else zero.
fn start(planned: &PlannedComponent, variable: usize) -> Option<ValueBuffer> {
    let d = planned.description();
    let v = &d.variables[variable];
    let empty = ValueBuffer::new(v.kind, d.version, 0)?;
    let same = |b: &&VariableBlock| {
        b.references.first() == Some(&v.value_reference)
            && std::mem::discriminant(&b.values) == std::mem::discriminant(&empty)
    };
    let planned = planned.start.iter().rev().find(same).map(|b| b.values.clone());
    let described = || value::start(d, v);
    planned.or_else(described).or_else(|| ValueBuffer::new(v.kind, d.version, d.elements(v)?))
}

impl Exchange {
    /// The exchange among the nodes for which `within` holds; connections from others are left out.
    ///
    /// # Errors
    /// Sizes of arrays cannot be had from an FMU.
    pub fn new(
        nodes: &mut [InstanceNode],
        wiring: Wiring<'_>,
        phase: Phase,
        within: impl Fn(usize) -> bool,
    ) -> Result<Self, CosimError> {
        let inner = |l: &&LinearLink| within(l.from.component) && within(l.to.component);
        let links: Vec<LinearLink> = wiring.links.iter().filter(inner).copied().collect();
        let driven: Vec<DrivenInput> =
            wiring.driven.iter().filter(|d| within(d.to.component)).copied().collect();
        let mut ports = Ports::default();
        for link in &links {
            let (from, to) = (ports.add(nodes, link.from, true), ports.add(nodes, link.to, false));
            ports.edge(from, to);
        }
        for d in &driven {
            ports.add(nodes, d.to, false);
        }
        ports.feedthrough(nodes, phase);
        let components = graph::components(&ports.edges);
        ports.stages(&components);
        let acts = ports.acts(&components);
        ExchangeBuilder {
            nodes,
            bank: ElementBank::new(wiring.maps),
            spots: vec![None; ports.list.len()],
            ports,
        }
        .build(&acts, &links, &driven)
    }
}

/// What is done, in its order; numbers are ports.
enum Act {
    Set(Vec<usize>),
    Get(Vec<usize>),
    Solve(Vec<usize>),
    /// Hand on what was read in this stage.
    Hand(usize),
}

#[derive(Default)]
struct Ports {
    list: Vec<ExchangePort>,
    known: HashMap<(usize, usize), usize>,
    edges: Vec<Vec<usize>>,
    /// Of an output the inputs that it depends on.
    inputs_of: Vec<Vec<usize>>,
}

impl Ports {
    fn add(&mut self, nodes: &[InstanceNode], at: ElementIndex, output: bool) -> usize {
        let (node, variable) = (at.component, at.variable);
        *self.known.entry((node, variable)).or_insert_with(|| {
            let d = nodes[node].description();
            let v = &d.variables[variable];
            let (real, elements) = (v.kind == VariableType::Float64, d.elements(v).unwrap_or(1));
            self.list.push(ExchangePort {
                node,
                variable,
                output,
                real,
                elements,
                component: 0,
                stage: 0,
                needed: 0,
            });
            self.edges.push(Vec::new());
            self.inputs_of.push(Vec::new());
            self.list.len() - 1
        })
    }

    fn of(&self, at: ElementIndex) -> usize {
        self.known[&(at.component, at.variable)]
    }

    fn edge(&mut self, from: usize, to: usize) {
        if !self.edges[from].contains(&to) {
            self.edges[from].push(to);
        }
    }

    /// Edges from inputs to the outputs that depend on them.
    fn feedthrough(&mut self, nodes: &[InstanceNode], phase: Phase) {
        let mut inputs: HashMap<usize, Vec<usize>> = HashMap::new();
        for (i, p) in self.list.iter().enumerate().filter(|(_, p)| !p.output) {
            inputs.entry(p.node).or_default().push(i);
        }
        for o in 0..self.list.len() {
            let ExchangePort { node, variable, output: true, .. } = self.list[o] else { continue };
            let known = dependencies(nodes[node].description(), variable, phase);
            for &i in inputs.get(&node).into_iter().flatten() {
                if known.as_ref().is_none_or(|k| k.contains(&self.list[i].variable)) {
                    self.edges[i].push(o);
                    self.inputs_of[o].push(i);
                }
            }
        }
    }

    /// Stages of all ports: of an output when it is read, of an input when its value is there.
    fn stages(&mut self, components: &[Vec<usize>]) {
        for (c, ports) in components.iter().enumerate() {
            ports.iter().for_each(|p| self.list[*p].component = c);
        }
        let mut stage = vec![0; components.len()];
        let forward = |list: &[ExchangePort], stage: &mut [usize], keep: &dyn Fn(usize) -> bool| {
            for (c, ports) in components.iter().enumerate() {
                for (p, q) in ports.iter().flat_map(|p| self.edges[*p].iter().map(move |q| (*p, *q))) {
                    let d = list[q].component;
                    if d != c && !keep(d) {
                        let one = list[p].output || ports.len() > 1;
                        stage[d] = stage[d].max(stage[c] + usize::from(one));
                    }
                }
            }
        };
        forward(&self.list, &mut stage, &|_| false);
        // An output that nothing waits for is read when its FMU is read anyway.
        let mut read: HashSet<(usize, bool, usize)> = HashSet::new();
        let mut needed = vec![usize::MAX; components.len()];
        for (c, ports) in components.iter().enumerate().rev() {
            let after = |needed: &[usize], p: &usize| {
                let next = self.edges[*p].iter().map(|q| needed[self.list[*q].component]).min();
                next.unwrap_or(usize::MAX)
            };
            let [p] = ports[..] else {
                needed[c] = stage[c];
                continue;
            };
            if !self.list[p].output {
                needed[c] = after(&needed, &p);
                continue;
            }
            let ExchangePort { node, real, .. } = self.list[p];
            let latest = after(&needed, &p).saturating_sub(1);
            let together = (stage[c]..=latest.min(components.len())).rev();
            if let Some(s) = together.into_iter().find(|s| read.contains(&(node, real, *s))) {
                stage[c] = s;
            }
            read.insert((node, real, stage[c]));
            needed[c] = stage[c];
        }
        let fixed = |c: usize| components[c].len() > 1 || self.list[components[c][0]].output;
        for (c, ports) in components.iter().enumerate() {
            if !fixed(c) && !ports.is_empty() {
                stage[c] = 0;
            }
        }
        forward(&self.list, &mut stage, &fixed);
        for p in &mut self.list {
            (p.stage, p.needed) = (stage[p.component], needed[p.component]);
        }
    }

    fn acts(&self, components: &[Vec<usize>]) -> Vec<Act> {
        let in_loop = |p: &usize| components[self.list[*p].component].len() > 1;
        let mut order: Vec<usize> = (0..self.list.len()).collect();
        order.sort_by_key(|p| self.list[*p].node); // what belongs together is stored together
        let mut at: BTreeMap<usize, [Vec<usize>; 2]> = BTreeMap::new();
        for p in &order {
            let ExchangePort { output, stage, needed, .. } = self.list[*p];
            match (in_loop(p), output) {
                (false, true) => at.entry(stage).or_default()[0].push(*p),
                (false, false) if needed != usize::MAX => at.entry(needed).or_default()[1].push(*p),
                (false, false) => {}
                (true, _) => drop(at.entry(stage).or_default()),
            }
        }
        let mut by_node: HashMap<usize, Vec<usize>> = HashMap::new();
        for p in order.iter().filter(|p| !self.list[**p].output && !in_loop(p)) {
            by_node.entry(self.list[*p].node).or_default().push(*p);
        }
        let mut loops: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (c, ports) in components.iter().enumerate().filter(|(_, ports)| ports.len() > 1) {
            loops.entry(self.list[ports[0]].stage).or_default().push(c);
        }
        let (mut acts, mut set) = (Vec::new(), vec![false; self.list.len()]);
        for (stage, [outputs, needed]) in at {
            // Who needs one input now gets all that are there, in the same call.
            let mut now = Vec::new();
            for p in needed {
                if set[p] {
                    continue;
                }
                for q in by_node.get(&self.list[p].node).into_iter().flatten() {
                    if !set[*q] && self.list[*q].stage <= stage {
                        set[*q] = true;
                        now.push(*q);
                    }
                }
            }
            acts.extend([Act::Set(now), Act::Get(outputs)]);
            acts.extend(
                loops.remove(&stage).into_iter().flatten().map(|c| Act::Solve(components[c].clone())),
            );
            acts.push(Act::Hand(stage));
        }
        let rest = order.iter().copied().filter(|p| !self.list[*p].output && !in_loop(p) && !set[*p]);
        acts.push(Act::Set(rest.collect()));
        acts
    }
}

impl ElementBank {
    fn new(maps: &[Vec<(i64, i64)>]) -> Self {
        Self {
            reals: Vec::new(),
            elements: Vec::new(),
            blocks: Vec::new(),
            others: Vec::new(),
            copies: Vec::new(),
            scaled: Vec::new(),
            converted: Vec::new(),
            maps: maps.to_vec(),
        }
    }
}

struct ExchangeBuilder<'a> {
    nodes: &'a mut [InstanceNode],
    ports: Ports,
    bank: ElementBank,
    /// Where the first element of a port is stored.
    spots: Vec<Option<ValueSlot>>,
}

/// Blocks of reals and of others.
type BlockPair = [Vec<usize>; 2];

impl ExchangeBuilder<'_> {
    fn build(
        mut self,
        acts: &[Act],
        links: &[LinearLink],
        driven: &[DrivenInput],
    ) -> Result<Exchange, CosimError> {
        // All places first, then what is handed between them.
        let mut blocks: Vec<[BlockPair; 2]> = Vec::new();
        for act in acts {
            blocks.push(match act {
                Act::Set(ports) | Act::Get(ports) => [self.blocks(ports)?, BlockPair::default()],
                Act::Solve(ports) => {
                    let (outputs, inputs): (Vec<_>, Vec<_>) =
                        ports.iter().partition(|p| self.ports.list[**p].output);
                    [self.blocks(&outputs)?, self.blocks(&inputs)?]
                }
                Act::Hand(_) => Default::default(),
            });
        }
        let (mut ops, mut loops) = (Vec::new(), Vec::new());
        let component = |ports: &Ports, at| ports.list[ports.of(at)].component;
        let mut by_stage: HashMap<usize, Vec<LinearLink>> = HashMap::new();
        let mut inside: HashMap<usize, Vec<LinearLink>> = HashMap::new();
        for link in links {
            let c = component(&self.ports, link.from);
            if c == component(&self.ports, link.to) {
                inside.entry(c).or_default().push(*link);
            } else {
                by_stage.entry(self.ports.list[self.ports.of(link.from)].stage).or_default().push(*link);
            }
        }
        for (act, [first, second]) in acts.iter().zip(blocks) {
            let [reals, others] = first;
            match act {
                Act::Set(_) => {
                    ops.extend(reals.into_iter().map(Op::Set));
                    ops.extend(others.into_iter().map(Op::SetOther));
                }
                Act::Get(_) => {
                    ops.extend(reals.into_iter().map(Op::Get));
                    ops.extend(others.into_iter().map(Op::GetOther));
                }
                Act::Solve(ports) => {
                    let c = self.ports.list[ports[0]].component;
                    let links = inside.remove(&c).unwrap_or_default();
                    let (unknowns, converted) = self.unknowns(&links);
                    loops.push(Loop::new(
                        self.nodes,
                        &self.bank,
                        [reals, others],
                        second,
                        unknowns,
                        converted,
                    ));
                    ops.push(Op::Solve(loops.len() - 1));
                }
                Act::Hand(stage) => {
                    let mut links = by_stage.remove(stage).unwrap_or_default();
                    links.sort_by_key(|l| (self.real(l.from), self.real(l.to)));
                    let ranges = self.hand(&links);
                    if ranges.iter().any(|(a, b)| a != b) {
                        ops.push(Op::Hand(ranges));
                    }
                }
            }
        }
        let driven = driven.iter().filter_map(|d| {
            let to = self.spot(d.to)?;
            Some(DrivenSpot { column: d.column, linear: d.linear, to, node: d.to.component })
        });
        let driven = driven.collect();
        let mut inputs = Vec::new();
        for (p, spot) in self.ports.list.iter().zip(&self.spots) {
            let v = &self.nodes[p.node].description().variables[p.variable];
            if let (false, Some(ValueSlot::Real(first))) = (p.output, spot)
                && is_continuous_input(v)
            {
                inputs.push((p.node, v.value_reference, *first..*first + p.elements));
            }
        }
        let mut exchange = Exchange { bank: self.bank, ops, loops, driven, inputs, calls: Vec::new() };
        exchange.index(self.nodes.len());
        Ok(exchange)
    }

    fn spot(&self, at: ElementIndex) -> Option<ValueSlot> {
        Some(match self.spots[self.ports.of(at)]? {
            ValueSlot::Real(first) => ValueSlot::Real(first + at.element),
            ValueSlot::Other(block, first) => ValueSlot::Other(block, first + at.element),
        })
    }

    fn real(&self, at: ElementIndex) -> Option<usize> {
        match self.spot(at) {
            Some(ValueSlot::Real(at)) => Some(at),
            _ => None,
        }
    }

    /// One block per node and type.
    fn blocks(&mut self, ports: &[usize]) -> Result<BlockPair, CosimError> {
        let mut reals: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut others = Vec::new();
        for p in ports {
            let ExchangePort { node, variable, output, real, elements, .. } = self.ports.list[*p];
            if real {
                reals.entry(node).or_default().push(*p);
                continue;
            }
            let planned = &self.nodes[node].planned;
            let d = planned.description();
            let v = &d.variables[variable];
            let values =
                if output { ValueBuffer::new(v.kind, d.version, elements) } else { start(planned, variable) };
            let Some(values) = values else { continue }; // binaries and clocks were refused
            let named = (0..elements).map(|element| ElementIndex { component: node, variable, element });
            let same = |b: &&usize| {
                let b: &OtherElements = &self.bank.others[**b];
                b.node == node && std::mem::discriminant(&b.block.values) == std::mem::discriminant(&values)
            };
            match others.iter().find(same).copied() {
                Some(b) => {
                    let block = &mut self.bank.others[b];
                    block.block.references.push(v.value_reference);
                    block.elements.extend(named);
                    self.spots[*p] = Some(ValueSlot::Other(b, block.block.values.append(values)));
                }
                None => {
                    let block = VariableBlock { references: vec![v.value_reference], values };
                    self.bank.others.push(OtherElements { node, block, elements: named.collect() });
                    others.push(self.bank.others.len() - 1);
                    self.spots[*p] = Some(ValueSlot::Other(self.bank.others.len() - 1, 0));
                }
            }
        }
        let mut list = Vec::new();
        for (node, ports) in reals {
            let first = self.bank.reals.len();
            let mut references = Vec::new();
            for p in ports {
                let ExchangePort { variable, output, elements, .. } = self.ports.list[p];
                let planned = &self.nodes[node].planned;
                references.push(planned.description().variables[variable].value_reference);
                let at = self.bank.reals.len();
                self.spots[p] = Some(ValueSlot::Real(at));
                self.bank.reals.resize(at + elements, 0.0);
                if let (false, Some(ValueBuffer::Float64(v))) = (output, start(planned, variable))
                    && v.len() == elements
                {
                    self.bank.reals[at..].copy_from_slice(&v);
                }
                let named = (0..elements).map(|element| ElementIndex { component: node, variable, element });
                self.bank.elements.extend(named);
            }
            let references = self.nodes[node].slave.prepare(&references)?;
            self.bank.blocks.push(RealElements { node, references, first, end: self.bank.reals.len() });
            list.push(self.bank.blocks.len() - 1);
        }
        Ok([list, others])
    }

    /// Appends copies.
    fn hand(&mut self, links: &[LinearLink]) -> [(u32, u32); 3] {
        let lengths =
            |b: &ElementBank| [b.copies.len() as u32, b.scaled.len() as u32, b.converted.len() as u32];
        let before = lengths(&self.bank);
        for l in links {
            let (Some(from), Some(to)) = (self.spot(l.from), self.spot(l.to)) else { continue };
            let LinearLink { factor, offset, map, .. } = *l;
            match (from, to) {
                (ValueSlot::Real(a), ValueSlot::Real(b)) if (factor, offset) == (1.0, 0.0) => {
                    self.bank.copies.push(ElementCopy { from: a as u32, to: b as u32 });
                }
                (ValueSlot::Real(a), ValueSlot::Real(b)) => {
                    self.bank.scaled.push(ScaledElement { from: a as u32, to: b as u32, factor, offset });
                }
                _ => self.bank.converted.push(ConvertedElement { from, to, factor, offset, map }),
            }
        }
        let after = lengths(&self.bank);
        [0, 1, 2].map(|i| (before[i], after[i]))
    }

    /// Of the connections inside a loop those between reals, and copies of all others.
    fn unknowns(&mut self, links: &[LinearLink]) -> (Vec<LoopUnknown>, [(u32, u32); 3]) {
        let (mut unknowns, mut rest) = (Vec::new(), Vec::new());
        for l in links {
            let (Some(from), Some(to)) = (self.real(l.from), self.real(l.to)) else {
                rest.push(*l);
                continue;
            };
            let d = self.nodes[l.to.component].description();
            let nominal = d.attributes(&d.variables[l.to.variable]).nominal;
            let nominal = nominal.map(f64::abs).filter(|x| *x > 0.0 && x.is_finite()).unwrap_or(1.0);
            let (factor, offset) = (l.factor, l.offset);
            unknowns.push(LoopUnknown { from, to, factor, offset, nominal });
        }
        let rest = self.hand(&rest);
        (unknowns, rest)
    }
}
