//! Which output is the velocity of which input, by reciprocity.
//!
//! An effort u (torque, force, current) and a velocity y are conjugate where u y is the power that enters. For conjugate pairs the
//! matrix d(dy/dt)/du = J M^-1 J' is symmetric with a positive diagonal. Of all assignments of outputs to inputs for which that
//! holds, the one with most inputs is taken, among those the one that names suggest.

use crate::experiment::Experiment;
use crate::kind::PortKind;
use crate::quantity::FmuQuantities;
use crate::words::affinity;

/// The velocity of an input.
#[derive(Clone, Debug, PartialEq)]
pub struct ConjugatePair {
    /// Input.
    pub input: usize,
    /// Output.
    pub output: usize,
    /// Other outputs that would do as well; outputs that are equal at all times do not count.
    pub others: Vec<usize>,
}

/// Steps of the search: beyond them the best assignment so far is taken.
const STEPS: usize = 50_000;
/// An element of the matrix counts from this share of the largest one in its column on.
const SHARE: f64 = 1e-8;

/// Velocity outputs that may be conjugate to an input of this kind.
fn fits(effort: PortKind, velocity: PortKind) -> bool {
    match effort {
        PortKind::Torque | PortKind::Current => velocity == PortKind::AngularVelocity,
        PortKind::Force => velocity == PortKind::Velocity,
        _ => false,
    }
}

/// Of two elements that mirror each other, one that is as large as that has no counterpart of 0: diagonals would have to differ by 1e6.
const CLEAR: f64 = 1e-2;

struct ConjugateSearch<'a> {
    e: &'a Experiment,
    inputs: Vec<usize>,
    /// Factor of the input's column is known: a torque or a force.
    scaled: Vec<bool>,
    /// Outputs for each input, with how names suggest them.
    candidates: Vec<Vec<(usize, f64)>>,
    chosen: Vec<Option<usize>>,
    steps: usize,
    best: (usize, f64),
    found: Vec<Vec<Option<usize>>>,
}

/// An input at its place in the search.
struct OrderedInput {
    /// How names suggest its best output.
    name: f64,
    /// Other inputs that agree with that output.
    most: usize,
    at: usize,
    candidates: Vec<(usize, f64)>,
}

/// Assigns outputs to inputs; `false`: not all assignments were tried.
pub fn conjugates(e: &Experiment, all: &FmuQuantities) -> (Vec<ConjugatePair>, bool) {
    let inputs: Vec<usize> = (0..all.inputs.len()).filter(|j| e.amplitudes[*j].is_some()).collect();
    let column = |j: usize| {
        let one =
            |k: usize| (fits(all.inputs[j].kind, all.outputs[k].kind)).then(|| e.mobilities[0][k][j].abs());
        (0..all.outputs.len()).filter_map(one).fold(0.0, f64::max)
    };
    let candidates = |j: usize| {
        let largest = column(j);
        let mut list: Vec<(usize, f64)> = (0..all.outputs.len())
            .filter(|k| fits(all.inputs[j].kind, all.outputs[*k].kind))
            .filter(|k| e.mobilities.iter().all(|m| m[*k][j] > SHARE * largest))
            .map(|k| (k, affinity(&all.inputs[j].name, &all.outputs[k].name)))
            .collect();
        // Of outputs that are equal at all times one is enough.
        list.sort_by(|a, b| {
            b.1.total_cmp(&a.1).then(e.mobilities[0][b.0][j].total_cmp(&e.mobilities[0][a.0][j]))
        });
        let mut kept: Vec<(usize, f64)> = Vec::new();
        for c in list {
            if !kept.iter().any(|k| e.same(k.0, c.0)) {
                kept.push(c);
            }
        }
        kept
    };
    let candidates: Vec<_> = inputs.iter().map(|j| candidates(*j)).collect();
    let scaled = inputs.iter().map(|j| all.inputs[*j].kind != PortKind::Current).collect();
    let chosen = vec![None; inputs.len()];
    let mut search = ConjugateSearch {
        e,
        inputs,
        scaled,
        candidates,
        chosen,
        steps: 0,
        best: (0, f64::NEG_INFINITY),
        found: Vec::new(),
    };
    search.order();
    let open = search.candidates.clone();
    search.from(0, &open, 0, 0.0);
    let whole = search.steps <= STEPS;
    (search.pairs(), whole)
}

impl ConjugateSearch<'_> {
    /// Chooses for input `at` and those after it; `open`: what is left of their candidates.
    fn from(&mut self, at: usize, open: &[Vec<(usize, f64)>], count: usize, names: f64) {
        self.steps += 1;
        // Each output serves one input.
        let mut outputs: Vec<usize> = open.iter().flatten().map(|c| c.0).collect();
        outputs.sort_unstable();
        outputs.dedup();
        let left = open.iter().filter(|c| !c.is_empty()).count().min(outputs.len());
        if self.steps > STEPS || count + left < self.best.0 {
            return;
        }
        let Some((mine, others)) = open.split_first() else {
            if (count, names) > self.best {
                self.best = (count, names);
                self.found.clear();
            }
            if (count, names) == self.best && self.found.len() < 64 {
                self.found.push(self.chosen.clone());
            }
            return;
        };
        let hope: f64 = open.iter().map(|c| c.first().map_or(0.0, |c| c.1.max(0.0))).sum();
        if count + left == self.best.0 && names + hope < self.best.1 {
            return;
        }
        for (k, name) in mine {
            let fitting = |(next, list): (usize, &Vec<(usize, f64)>)| -> Vec<(usize, f64)> {
                let fits = |c: &&(usize, f64)| self.consistent((at, *k), (at + 1 + next, c.0));
                list.iter().filter(fits).copied().collect()
            };
            let rest: Vec<Vec<(usize, f64)>> = others.iter().enumerate().map(fitting).collect();
            self.chosen[at] = Some(*k);
            self.from(at + 1, &rest, count + 1, names + name);
        }
        self.chosen[at] = None;
        self.from(at + 1, others, count, names);
    }

    /// Inputs that names decide come first, then those whose outputs agree with outputs of most other inputs: wrong ones agree
    /// with few.
    fn order(&mut self) {
        let n = self.inputs.len();
        let agreeing = |at: usize, k: usize| {
            let with = |other: usize| {
                self.candidates[other].iter().any(|(l, _)| self.consistent((other, *l), (at, k)))
            };
            (0..n).filter(|other| *other != at && with(*other)).count()
        };
        let mut ordered: Vec<OrderedInput> = (0..n)
            .map(|at| {
                let mut list: Vec<(usize, usize, f64)> =
                    self.candidates[at].iter().map(|(k, name)| (agreeing(at, *k), *k, *name)).collect();
                list.sort_by(|a, b| b.2.total_cmp(&a.2).then(b.0.cmp(&a.0)));
                let (name, most) = list.first().map_or((f64::NEG_INFINITY, 0), |c| (c.2, c.0));
                OrderedInput {
                    name,
                    most,
                    at,
                    candidates: list.into_iter().map(|(_, k, name)| (k, name)).collect(),
                }
            })
            .collect();
        ordered.sort_by(|a, b| b.name.total_cmp(&a.name).then(b.most.cmp(&a.most)));
        let (inputs, scaled) = (self.inputs.clone(), self.scaled.clone());
        self.inputs = ordered.iter().map(|o| inputs[o.at]).collect();
        self.scaled = ordered.iter().map(|o| scaled[o.at]).collect();
        self.candidates = ordered.into_iter().map(|o| o.candidates).collect();
    }

    /// Two pairs of an input and an output can both be conjugate.
    fn consistent(&self, (other, l): (usize, usize), (at, k): (usize, usize)) -> bool {
        if k == l {
            return false;
        }
        let (i, j) = (self.inputs[other], self.inputs[at]);
        let tolerance = self.e.tolerance();
        self.e.mobilities.iter().all(|m| {
            let (own, others) = (m[k][j], m[l][i]);
            let (a, b) = (m[l][j], m[k][i]);
            // Cauchy and Schwarz: of a positive matrix. The factors of the inputs cancel.
            if a * b > (1.0 + tolerance) * own * others || a * b < -tolerance * own * others {
                return false;
            }
            if self.scaled[other] && self.scaled[at] {
                return (a - b).abs() <= tolerance * (own * others).sqrt();
            }
            // A factor is unknown: both are 0, or none.
            let none = |v: f64, of: f64| v.abs() <= SHARE * of;
            let some = |v: f64, of: f64| v.abs() > CLEAR * of;
            !(none(a, own) && some(b, others) || some(a, own) && none(b, others))
        })
    }

    fn pairs(self) -> Vec<ConjugatePair> {
        let Some(first) = self.found.first() else { return Vec::new() };
        let mut pairs = Vec::new();
        for (at, output) in first.iter().enumerate() {
            let Some(output) = *output else { continue };
            let mut others: Vec<usize> =
                self.found.iter().filter_map(|f| f[at]).filter(|k| *k != output).collect();
            others.sort_unstable();
            others.dedup();
            pairs.push(ConjugatePair { input: self.inputs[at], output, others });
        }
        pairs
    }
}

/// Largest asymmetry of the matrix over these pairs, relative to its diagonal; only inputs of known scale are compared.
pub fn asymmetry(e: &Experiment, pairs: &[(usize, usize)]) -> Option<f64> {
    let mut worst: Option<f64> = None;
    for (at, (i, l)) in pairs.iter().enumerate() {
        for (j, k) in &pairs[..at] {
            for m in &e.mobilities {
                let size = (m[*k][*j] * m[*l][*i]).abs().sqrt();
                if size > 0.0 {
                    let error = (m[*l][*j] - m[*k][*i]).abs() / size;
                    worst = Some(worst.map_or(error, |w| w.max(error)));
                }
            }
        }
    }
    worst
}
