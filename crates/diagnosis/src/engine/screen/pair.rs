//! Causes in pairs: looked at apart, fitted together.

use nalgebra::{DMatrix, DVector};
use trueup_identification::lsq::SolverOptions;

use super::ScreenedCause;
use super::looked::LinearisedCause;
use super::projection::{Projection, best};
use crate::engine::hypothesis::Times;
use crate::engine::search::{CaseSearch, FittedSet};
use trueup_numerics::order::descending;

/// Two causes together.
#[derive(Clone, Debug)]
pub struct CausePair {
    /// Which of the causes.
    pub indices: [usize; 2],
    /// By how much the sum of squares would fall, half.
    pub gain: f64,
    /// Factors of the changes of either.
    factors: [Vec<f64>; 2],
}

impl CaseSearch<'_> {
    /// Pairs of effects out of a screen in addition to `base`, best first: looked at apart, fitted together.
    pub fn pairs(&self, base: &FittedSet, screened: &[ScreenedCause]) -> Vec<CausePair> {
        let looks: Vec<(&ScreenedCause, &LinearisedCause)> = (screened.iter())
            .filter(|s| self.causes[s.index].is_effect() && self.causes[s.index].times != Times::Several)
            .filter_map(|s| Some((s, s.looked.as_ref()?)))
            .collect();
        let mut begin = vec![0];
        looks.iter().for_each(|(_, l)| begin.push(begin[begin.len() - 1] + l.columns.len()));
        let all: Vec<DVector<f64>> =
            looks.iter().flat_map(|(_, l)| l.columns.iter().map(|c| c.1.clone())).collect();
        if all.is_empty() {
            return Vec::new();
        }
        let fixed_size: Vec<bool> =
            looks.iter().flat_map(|(_, l)| l.columns.iter().map(|_| l.fixed_size)).collect();
        let all = DMatrix::from_columns(&all);
        let (among, with) = (all.tr_mul(&all), all.tr_mul(&Projection::new(base).residuals));
        let of = |a: usize, b: usize| -> Option<CausePair> {
            let indices = [looks[a].0.index, looks[b].0.index];
            let [one, other] = indices.map(|i| &self.causes[i]);
            if one.same_place(other) || one.is_push() && other.is_push() {
                return None;
            }
            let own = |i: usize| begin[i]..begin[i + 1];
            // What is kept as it was looked at changes what the other has to explain.
            let (fixed, at): (Vec<usize>, Vec<usize>) = own(a).chain(own(b)).partition(|i| fixed_size[*i]);
            let left = |i: usize| with[i] + fixed.iter().map(|f| among[(i, *f)]).sum::<f64>();
            let products = DMatrix::from_fn(at.len(), at.len(), |i, j| among[(at[i], at[j])]);
            let (gain, factors) = best(products, DVector::from_fn(at.len(), |i, _| left(at[i])));
            let taken: f64 = fixed.iter().map(|f| -0.5 * (with[*f] + left(*f))).sum();
            let factor = |i: usize| at.iter().position(|k| *k == i).map_or(1.0, |k| factors[k]);
            let factors = [a, b].map(|i| own(i).map(factor).collect::<Vec<f64>>());
            let against = |i: usize, factors: &[f64]| looks[i].1.one_sided && factors[0] <= 0.0;
            let sensible = !against(a, &factors[0]) && !against(b, &factors[1]);
            sensible.then_some(CausePair { indices, gain: gain + taken, factors })
        };
        let mut pairs: Vec<CausePair> = (0..looks.len())
            .flat_map(|a| (a + 1..looks.len()).map(move |b| (a, b)))
            .filter_map(|(a, b)| of(a, b))
            .filter(|p| screened.first().is_some_and(|best| p.gain > best.gain))
            .collect();
        descending(&mut pairs, |item| item.gain);
        pairs
    }

    /// A pair fitted in addition to `base`.
    pub fn fit_pair(
        &self,
        base: &FittedSet,
        screened: &[ScreenedCause],
        pair: &CausePair,
        options: SolverOptions,
    ) -> Option<FittedSet> {
        let mut set = base.stated.set.clone();
        set.extend(pair.indices.map(|i| self.causes[i].clone()));
        let stated = self.state(&set).ok()?;
        let mut start = self.begin_with(&stated, base);
        let first = stated.begin.len() - 2;
        for (k, index) in pair.indices.into_iter().enumerate() {
            let looked = screened.iter().find(|s| s.index == index)?.looked.as_ref()?;
            let posed = &stated.posed[first + k];
            let factors = &pair.factors[k];
            looked.set(&mut start, stated.begin[first + k], posed, factors);
        }
        self.fit_in_addition(stated, &start, options, base).ok()
    }
}
