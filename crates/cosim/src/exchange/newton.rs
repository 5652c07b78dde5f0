//! An algebraic loop: inputs u that depend on themselves, u = G(u), where G sets the inputs of all FMUs of the loop, reads
//! their outputs and hands these on.
//!
//! Solved by Newton, r(u) = G(u) - u, (I - G') du = r, damped by halving until the residual shrinks. G' comes from
//! directional derivatives where an FMU provides them, else from differences; it is kept from one time to the next and
//! computed again when it no longer serves. The first try is du = r: a loop that is only apparent (an FMU that does not declare
//! its dependencies) is then done without a derivative.

use trueup_numerics::linear::{lu_factor, lu_solve};

use super::bank::{ElementBank, is_discard};
use crate::error::{ConnectionResidual, CosimError};
use crate::node::{self, InstanceNode};

/// A residual counts as zero below this part of max(|value|, nominal).
pub(super) const TOLERANCE: f64 = 1e-10;
/// It is accepted if it cannot be made smaller (FMUs that iterate inside) and is below this part.
const ACCEPTED: f64 = 1e-6;
const ITERATIONS: u32 = 50;
const HALVINGS: u32 = 12;

/// One element of an input in the loop: slots of its source and its own.
pub(super) struct LoopUnknown {
    pub(super) from: usize,
    pub(super) to: usize,
    pub(super) factor: f64,
    pub(super) offset: f64,
    pub(super) nominal: f64,
}

/// What a loop did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopLog {
    /// Its inputs.
    pub variables: Vec<String>,
    /// How often it was solved.
    pub solved: u64,
    /// How often its inputs were set and outputs read.
    pub evaluations: u64,
    /// Largest residual that was left, as a part of max(|value|, nominal).
    pub residual: f64,
}

/// A loop.
pub(super) struct Loop {
    /// Blocks of reals and of others.
    gets: [Vec<usize>; 2],
    sets: [Vec<usize>; 2],
    unknowns: Vec<LoopUnknown>,
    /// Copies of what is not real, iterated along.
    converted: std::ops::Range<usize>,
    /// Per unknown its number among those of the same node, for differences that do not disturb each other.
    color: Vec<usize>,
    directional: bool,
    /// I - G', factored; empty: not known yet.
    lu: Vec<f64>,
    pivots: Vec<usize>,
    u: Vec<f64>,
    r: Vec<f64>,
    du: Vec<f64>,
    old: Vec<f64>,
    /// Why an FMU refused the values tried last.
    refused: Option<CosimError>,
    pub(super) log: LoopLog,
}

impl Loop {
    pub(super) fn new(
        nodes: &[InstanceNode],
        bank: &ElementBank,
        gets: [Vec<usize>; 2],
        sets: [Vec<usize>; 2],
        unknowns: Vec<LoopUnknown>,
        [_, _, converted]: [(u32, u32); 3],
    ) -> Self {
        let n = unknowns.len();
        let mut count = std::collections::HashMap::new();
        let color = unknowns.iter().map(|u| {
            let next = count.entry(bank.elements[u.to].component).or_insert(0);
            *next += 1;
            *next - 1
        });
        let directional = sets[0].iter().all(|b| {
            let offered = nodes[bank.blocks[*b].node].offered();
            offered.is_some_and(|i| i.provides_directional_derivatives)
        });
        let others = sets[1].iter().flat_map(|b| bank.others[*b].elements.iter().copied());
        let variables = unknowns.iter().map(|u| bank.elements[u.to]).chain(others);
        let variables = variables.map(|e| node::name(nodes, e)).collect();
        Self {
            color: color.collect(),
            directional,
            gets,
            sets,
            unknowns,
            converted: converted.0 as usize..converted.1 as usize,
            lu: Vec::new(),
            pivots: vec![0; n],
            u: vec![0.0; n],
            r: vec![0.0; n],
            du: vec![0.0; n],
            old: vec![0.0; n],
            refused: None,
            log: LoopLog { variables, ..LoopLog::default() },
        }
    }

    /// Blocks of reals and of others that are read.
    pub(super) fn gets(&self) -> &[Vec<usize>; 2] {
        &self.gets
    }

    /// Blocks of reals and of others that are set.
    pub(super) fn sets(&self) -> &[Vec<usize>; 2] {
        &self.sets
    }

    /// Slots of sources and inputs.
    pub(super) fn links(&self) -> impl Iterator<Item = (u32, u32)> {
        self.unknowns.iter().map(|u| (u.from as u32, u.to as u32))
    }

    pub(super) fn hand_slopes(&self, slopes: &mut [f64]) {
        self.unknowns.iter().for_each(|u| slopes[u.to] = u.factor * slopes[u.from]);
    }

    /// Hands to the inputs of one node what was read last.
    pub(super) fn hand(&self, bank: &mut ElementBank, node: usize) {
        for u in self.unknowns.iter().filter(|u| bank.elements[u.to].component == node) {
            bank.reals[u.to] = u.factor * bank.reals[u.from] + u.offset;
        }
    }

    /// Sets all inputs to u, reads all outputs; `r` = G(u) - u. Its size, as a part of max(|u|, nominal); infinite if an
    /// FMU refuses these values.
    fn evaluate(
        &mut self,
        bank: &mut ElementBank,
        nodes: &mut [InstanceNode],
        time: f64,
        due: &impl Fn(usize) -> bool,
    ) -> Result<f64, CosimError> {
        self.log.evaluations += 1;
        for (unknown, u) in self.unknowns.iter().zip(&self.u) {
            bank.reals[unknown.to] = *u;
        }
        match self.call(bank, nodes, time, due) {
            Err(e) if is_discard(&e) => {
                self.refused = Some(e);
                return Ok(f64::INFINITY);
            }
            done => done?,
        }
        let mut size = 0.0_f64;
        for (i, x) in self.unknowns.iter().enumerate() {
            let held = !due(bank.elements[x.to].component);
            self.r[i] = if held { 0.0 } else { x.factor * bank.reals[x.from] + x.offset - self.u[i] };
            let part = self.r[i].abs() / self.u[i].abs().max(x.nominal);
            size = if part.is_nan() { f64::INFINITY } else { size.max(part) };
        }
        for at in self.converted.clone() {
            if bank.convert(at) {
                size = size.max(1.0); // another round
            }
        }
        Ok(size)
    }

    fn call(
        &self,
        bank: &mut ElementBank,
        nodes: &mut [InstanceNode],
        time: f64,
        due: &impl Fn(usize) -> bool,
    ) -> Result<(), CosimError> {
        for &b in self.sets[0].iter().filter(|b| due(bank.blocks[**b].node)) {
            bank.set(b, nodes, time)?;
        }
        for &b in self.sets[1].iter().filter(|b| due(bank.others[**b].node)) {
            bank.set_other(b, nodes, time)?;
        }
        for b in 0..self.gets[0].len() {
            let b = self.gets[0][b];
            if due(bank.blocks[b].node) {
                bank.get(b, nodes, time)?;
            }
        }
        for b in 0..self.gets[1].len() {
            let b = self.gets[1][b];
            if due(bank.others[b].node) {
                bank.get_other(b, nodes, time)?;
            }
        }
        Ok(())
    }

    /// Solves the loop, from what its inputs are.
    ///
    /// # Errors
    /// [`CosimError::Loop`]; whatever an FMU returns.
    pub(super) fn solve(
        &mut self,
        bank: &mut ElementBank,
        nodes: &mut [InstanceNode],
        time: f64,
        due: &impl Fn(usize) -> bool,
    ) -> Result<(), CosimError> {
        if !self.sets.iter().zip([0, 1]).any(|(blocks, kind)| {
            blocks.iter().any(|b| due(if kind == 0 { bank.blocks[*b].node } else { bank.others[*b].node }))
        }) {
            return Ok(());
        }
        self.log.solved += 1;
        for (unknown, u) in self.unknowns.iter().zip(&mut self.u) {
            *u = bank.reals[unknown.to];
        }
        let mut size = self.evaluate(bank, nodes, time, due)?;
        if !size.is_finite() {
            // Not the loop's fault: its values are those that were exchanged last.
            let refused = self.refused.take();
            return Err(refused.unwrap_or_else(|| self.unsolved(bank, nodes, time, "its values overflow")));
        }
        let mut fresh = false;
        for iteration in 0..ITERATIONS {
            if size <= TOLERANCE {
                break;
            }
            // The derivative is made where there is none that serves; the first try does without.
            let plain = self.lu.is_empty() && iteration == 0;
            if !plain && self.lu.is_empty() {
                if !self.derive(bank, nodes, time, due)? {
                    return Err(self.unsolved(bank, nodes, time, "its derivative is singular"));
                }
                fresh = true;
            }
            self.du.copy_from_slice(&self.r);
            if !plain {
                lu_solve(&self.lu, self.u.len(), &self.pivots, &mut self.du);
            }
            self.old.copy_from_slice(&self.u);
            let (before, mut part, mut tries) = (size, 1.0, 0);
            loop {
                for ((u, old), du) in self.u.iter_mut().zip(&self.old).zip(&self.du) {
                    *u = old + part * du;
                }
                size = self.evaluate(bank, nodes, time, due)?;
                let stale = !plain && !fresh;
                if size <= TOLERANCE || size < (1.0 - 1e-4 * part) * before && !(stale && size > 0.1 * before)
                {
                    break;
                }
                tries += 1;
                if plain || stale || tries > HALVINGS {
                    self.u.copy_from_slice(&self.old);
                    size = self.evaluate(bank, nodes, time, due)?;
                    break;
                }
                part *= 0.5;
            }
            if tries > HALVINGS {
                if size <= ACCEPTED {
                    break;
                }
                return Err(self.unsolved(bank, nodes, time, "no step makes it smaller"));
            }
            // Newton proper: a new derivative at the new point, unless this one does well.
            if !plain && (tries > 0 || size > 0.1 * before) && size > TOLERANCE {
                self.lu.clear();
            }
            fresh = false;
        }
        self.log.residual = self.log.residual.max(size);
        if size <= ACCEPTED {
            return Ok(());
        }
        Err(self.unsolved(bank, nodes, time, &format!("it does not settle in {ITERATIONS} iterations")))
    }

    #[cold]
    fn unsolved(
        &mut self,
        bank: &ElementBank,
        nodes: &[InstanceNode],
        time: f64,
        reason: &str,
    ) -> CosimError {
        self.lu.clear();
        let one = |(i, x): (usize, &LoopUnknown)| ConnectionResidual {
            variable: node::name(nodes, bank.elements[x.to]),
            source: node::name(nodes, bank.elements[x.from]),
            value: self.u[i],
            residual: self.r[i],
        };
        let variables = self.unknowns.iter().enumerate().map(one).collect();
        CosimError::Loop { time, reason: reason.into(), variables }
    }

    /// I - G' at u, factored; `false` if it is singular. `r` and the FMUs are at u before and after.
    fn derive(
        &mut self,
        bank: &mut ElementBank,
        nodes: &mut [InstanceNode],
        time: f64,
        due: &impl Fn(usize) -> bool,
    ) -> Result<bool, CosimError> {
        let n = self.unknowns.len();
        let mut g = vec![0.0; n * n];
        if self.directional && self.directional(bank, nodes, due, &mut g).is_err() {
            self.directional = false; // declared, but not there
            g.fill(0.0);
        }
        if !self.directional {
            self.differences(bank, nodes, time, due, &mut g)?;
        }
        for (i, x) in g.iter_mut().enumerate() {
            *x = f64::from(u8::from(i % (n + 1) == 0)) - *x;
        }
        let regular =
            lu_factor(&mut g, n, &mut self.pivots).is_ok() && (0..n).all(|i| g[i * n + i].abs() > 1e-14);
        self.lu = if regular { g } else { Vec::new() };
        Ok(regular)
    }

    fn directional(
        &self,
        bank: &ElementBank,
        nodes: &mut [InstanceNode],
        due: &impl Fn(usize) -> bool,
        g: &mut [f64],
    ) -> Result<(), trueup_fmi_import::ImportError> {
        let n = self.unknowns.len();
        for (j, input) in self.unknowns.iter().enumerate() {
            let of = bank.elements[input.to];
            if !due(of.component) {
                continue;
            }
            let v = &nodes[of.component].description().variables[of.variable];
            let knowns = [v.value_reference];
            let mut seed = vec![0.0; nodes[of.component].description().elements(v).unwrap_or(1)];
            seed[of.element] = 1.0;
            for b in self.gets[0].iter().map(|b| &bank.blocks[*b]).filter(|b| b.node == of.component) {
                let mut result = vec![0.0; b.end - b.first];
                let slave = &mut nodes[b.node].slave;
                slave.directional(b.references.references(), &knowns, &seed, &mut result)?;
                for (i, x) in self.unknowns.iter().enumerate() {
                    if (b.first..b.end).contains(&x.from) && due(bank.elements[x.to].component) {
                        g[i * n + j] = x.factor * result[x.from - b.first];
                    }
                }
            }
        }
        Ok(())
    }

    /// One input of each FMU at a time: those of different FMUs act on different outputs.
    fn differences(
        &mut self,
        bank: &mut ElementBank,
        nodes: &mut [InstanceNode],
        time: f64,
        due: &impl Fn(usize) -> bool,
        g: &mut [f64],
    ) -> Result<(), CosimError> {
        let n = self.unknowns.len();
        let (u, r) = (self.u.clone(), self.r.clone());
        for color in 0..=self.color.iter().copied().max().unwrap_or(0) {
            let mut delta: Vec<f64> = Vec::new();
            for (i, x) in self.unknowns.iter().enumerate() {
                let d = f64::EPSILON.sqrt() * u[i].abs().max(x.nominal);
                let moved = self.color[i] == color && due(bank.elements[x.to].component);
                self.u[i] = if moved { u[i] + d } else { u[i] };
                delta.push(self.u[i] - u[i]);
            }
            if !self.evaluate(bank, nodes, time, due)?.is_finite() {
                // The other side, where that one is refused.
                for i in 0..n {
                    self.u[i] = u[i] - delta[i];
                    delta[i] = -delta[i];
                }
                self.evaluate(bank, nodes, time, due)?;
            }
            for j in (0..n).filter(|j| delta[*j] != 0.0) {
                let node = bank.elements[self.unknowns[j].to].component;
                for (i, x) in self.unknowns.iter().enumerate() {
                    if bank.elements[x.from].component == node {
                        // r = G - u: what u itself adds is taken out.
                        let moved = self.r[i] + self.u[i] - r[i] - u[i];
                        g[i * n + j] = moved / delta[j];
                    }
                }
            }
        }
        self.u.copy_from_slice(&u);
        self.evaluate(bank, nodes, time, due)?;
        Ok(())
    }
}
