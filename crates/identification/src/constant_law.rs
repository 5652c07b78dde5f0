//! The step of an affine law whose matrices have no derivatives: those of a run that begins elsewhere, with all else known.
//!
//! The same products and sums in the same order as in [`crate::law`], without those that are 0. Matrices are computed once for all runs of
//! a model with these values ([`KeptLaws`]).

use std::sync::{Mutex, PoisonError};

use trueup_numerics::Scalar;
use trueup_plant::{Plant, PlantScalar};

use crate::law::{AFFINE_STEP, KEPT, LinearStepLaw, Sparse, terms};
use crate::sensors::InputMap;

/// Models of which laws are kept.
const MODELS: usize = 4;

/// A linear map, row by row: the entries that belong to states, then those of what has no derivatives.
#[derive(Clone, Debug, Default)]
struct SplitRows {
    /// Of each row: where its entries begin, where those of what has no derivatives do, and where they end.
    bounds: Vec<[usize; 3]>,
    entries: Vec<(usize, f64)>,
}

impl SplitRows {
    /// Of `rows` rows over `states` states and what follows them.
    fn new(sparse: &Sparse<f64>, rows: usize, states: usize) -> Self {
        let mut own = Self::default();
        for row in 0..rows {
            let begin = own.entries.len();
            let of_row = || sparse.0.iter().filter(|e| e.0 == row);
            own.entries.extend(of_row().filter(|e| e.1 < states).map(|e| (e.1, e.2)));
            let middle = own.entries.len();
            own.entries.extend(of_row().filter(|e| e.1 >= states).map(|e| (e.1 - states, e.2)));
            own.bounds.push([begin, middle, own.entries.len()]);
        }
        own
    }

    fn apply<T: Scalar>(&self, x: &[T], rest: &[f64], out: &mut [T]) {
        for ([begin, middle, end], out) in self.bounds.iter().zip(out) {
            let mut sum = T::zero();
            self.entries[*begin..*middle].iter().for_each(|(k, v)| sum += x[*k] * *v);
            self.entries[*middle..*end].iter().for_each(|(k, v)| sum = sum + rest[*k] * *v);
            *out = sum;
        }
    }
}

/// What holds in one set of modes.
#[derive(Debug)]
pub(crate) struct ConstantLaw {
    law: LinearStepLaw<f64>,
    rates: SplitRows,
    readout: SplitRows,
    /// By the bits of the step size.
    maps: Vec<(u64, SplitRows)>,
    /// The last that was used in this run.
    recent: usize,
    /// Step sizes of this run that have maps.
    seen: Vec<u64>,
    /// Longest step, s.
    pub(crate) longest: f64,
    states: usize,
    inputs: usize,
    /// Inputs, 1, slopes of the inputs.
    rest: Vec<f64>,
}

/// States of a step, kept from one step to the next.
#[derive(Debug, Default)]
pub(crate) struct StepStates<T>([Vec<T>; 2]);

impl ConstantLaw {
    pub(crate) fn new(law: LinearStepLaw<f64>, wanted: usize) -> Self {
        let (states, inputs) = (law.states, law.inputs);
        let rates = SplitRows::new(&law.rates, states, states);
        let readout = SplitRows::new(&law.readout, wanted, states);
        let (longest, rest) = (law.longest, vec![1.0; 2 * inputs + 1]);
        Self {
            law,
            rates,
            readout,
            maps: Vec::new(),
            recent: usize::MAX,
            seen: Vec::new(),
            longest,
            states,
            inputs,
            rest,
        }
    }

    /// A run begins.
    fn begin(&mut self) {
        (self.recent, self.seen) = (usize::MAX, Vec::new());
        if self.maps.len() > 4 * KEPT {
            self.maps.clear();
        }
    }

    /// The requested outputs.
    pub(crate) fn read<T: Scalar>(&mut self, x: &[T], u: impl Iterator<Item = f64>, y: &mut [T]) {
        self.rest.iter_mut().zip(u).for_each(|(own, u)| *own = u);
        self.readout.apply(x, &self.rest, y);
    }

    /// A step of a size that will come again.
    pub(crate) fn step<T: Scalar>(
        &mut self,
        x: &mut [T],
        [u, du]: [&[f64]; 2],
        h: f64,
        kept: &mut StepStates<T>,
    ) {
        let bits = h.to_bits();
        if self.maps.get(self.recent).is_none_or(|m| m.0 != bits) {
            // Which steps are by maps depends on the run alone, so that its bits do not depend on what others left.
            if !self.seen.contains(&bits) {
                if self.seen.len() >= KEPT {
                    return self.step_once(x, [u, du], h, kept);
                }
                self.seen.push(bits);
            }
            self.recent = self.maps.iter().position(|m| m.0 == bits).unwrap_or(self.maps.len());
            if self.recent == self.maps.len() {
                let columns = self.states + 2 * self.inputs + 1;
                self.maps.push((bits, SplitRows::new(&self.law.map(columns, h), self.states, self.states)));
            }
        }
        self.take(u);
        self.rest[self.inputs + 1..].copy_from_slice(du);
        let before = &mut kept.0[0];
        before.clear();
        before.extend_from_slice(x);
        self.maps[self.recent].1.apply(before, &self.rest, x);
    }

    fn take(&mut self, u: &[f64]) {
        self.rest[..self.inputs].copy_from_slice(u);
        self.rest[self.inputs] = 1.0;
    }

    /// A step of any size up to [`Self::longest`].
    pub(crate) fn step_once<T: Scalar>(
        &mut self,
        x: &mut [T],
        [u, du]: [&[f64]; 2],
        h: f64,
        kept: &mut StepStates<T>,
    ) {
        self.take(u);
        let [z, d] = &mut kept.0;
        z.clear();
        z.extend_from_slice(x);
        d.resize(x.len(), T::zero());
        let mut factor = 1.0;
        for k in 1..=terms(AFFINE_STEP * h / self.longest) {
            self.rates.apply(z, &self.rest, d);
            factor *= h / k as f64;
            x.iter_mut().zip(d.iter()).for_each(|(x, d)| *x += *d * factor);
            z.copy_from_slice(d);
            if k == 1 {
                self.rest[..self.inputs].copy_from_slice(du);
            } else {
                self.rest[..self.inputs].fill(0.0);
            }
            self.rest[self.inputs] = 0.0;
        }
        self.rest[self.inputs] = 1.0;
    }
}

/// Laws of a model with these values, by modes.
#[derive(Debug, Default)]
pub(crate) struct ModelLaws {
    values: Vec<f64>,
    wanted: Vec<usize>,
    pub(crate) known: Vec<(Vec<i32>, ConstantLaw)>,
}

/// Laws of one model with one set of values or a few, for all of its runs; another model needs another one.
#[derive(Debug, Default)]
pub struct KeptLaws(Mutex<Vec<ModelLaws>>);

impl KeptLaws {
    /// Takes those of a model with these values, or none yet.
    fn take(&self, values: Vec<f64>, wanted: &[usize]) -> ModelLaws {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let same = |m: &ModelLaws| m.values == values && m.wanted == wanted;
        match all.iter().position(same) {
            Some(at) => {
                let mut laws = all.swap_remove(at);
                laws.known.iter_mut().for_each(|(_, law)| law.begin());
                laws
            }
            None => ModelLaws { values, wanted: wanted.to_vec(), known: Vec::new() },
        }
    }

    pub(crate) fn give_back(&self, laws: ModelLaws) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if all.len() >= MODELS {
            all.remove(0);
        }
        all.push(laws);
    }
}

/// Laws of a run with constant matrices: of an affine plant of which nothing has derivatives but where it begins. `None`: it is
/// another one.
pub(crate) fn constant_laws<T: PlantScalar>(
    model: &dyn Plant,
    p: &[T],
    map: &InputMap<T>,
    wanted: &[usize],
    kept: &KeptLaws,
) -> Option<ModelLaws> {
    if !model.affine() {
        return None;
    }
    let constant = |v: &T| (*v - T::constant(v.value())).vanishes();
    let mut values: Vec<f64> = p.iter().map(|v| v.value()).collect();
    let mut begins = vec![false; p.len()];
    for at in model.coordinates().iter().flat_map(|c| [c.initial_position, c.initial_rate]) {
        (values[at], begins[at]) = (0.0, true);
    }
    let all = p.iter().zip(&begins).all(|(v, begins)| *begins || constant(v));
    (all && map.gain.iter().chain(&map.bias).all(constant)).then(|| kept.take(values, wanted))
}
