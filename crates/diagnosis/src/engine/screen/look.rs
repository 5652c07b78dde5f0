//! Looks at one cause: few simulations, and the improvement that they predict.

use nalgebra::DVector;

use super::looked::LinearisedCause;
use super::projection::Projection;
use crate::engine::hypothesis::{PosedHypothesis, TrialValues};
use crate::engine::problem::BalanceProblem;
use crate::engine::search::{FittedSet, PosedSet};
use trueup_numerics::order::descending;

/// More looks than this are made in one recording first,
const FEW: usize = 3;
/// and so many of them in all.
const LIKELIEST: usize = 2;

/// Share of a typical amplitude at which free runs are looked at.
const CLOSE: f64 = 0.05;

impl PosedHypothesis {
    fn one_sided(&self) -> bool {
        match &self.amplitudes[..] {
            [] => true,
            [(k, neutral)] => self.unknowns[*k].lower >= *neutral,
            _ => false,
        }
    }
}

/// What a look predicts.
pub(super) struct LookPromise {
    /// Where it was looked at.
    pub looked: LinearisedCause,
    /// By how much the sum of squares would fall, half.
    pub gain: f64,
    /// What looks are compared by: of a cause that is there or not, with no factor before it, the gain as it was looked at.
    firm: f64,
    /// Factors of its changes.
    factors: Vec<f64>,
    /// Steps of first states that only the model with the cause has.
    steps: Vec<f64>,
}

/// A cause in addition to those of a base.
pub(super) struct AddedCause<'a> {
    base: &'a FittedSet,
    projection: &'a Projection,
    problem: &'a BalanceProblem<'a>,
    from: &'a [f64],
    /// Its first coordinate.
    begin: usize,
    posed: &'a PosedHypothesis,
    /// Amplitudes to be looked at.
    keeps: Vec<Option<usize>>,
    /// First states that the base does not have.
    fresh: Vec<usize>,
    /// See [`LinearisedCause::fixed_size`].
    fixed_size: bool,
}

impl<'a> AddedCause<'a> {
    /// The last cause of a set, from coordinates `from`, in addition to the others, which the base has.
    pub(super) fn new(
        base: &'a FittedSet,
        projection: &'a Projection,
        problem: &'a BalanceProblem<'a>,
        stated: &'a PosedSet,
        from: &'a [f64],
    ) -> Option<Self> {
        let (begin, posed) = (*stated.begin.last()?, stated.posed.last()?);
        let keeps = match &posed.amplitudes[..] {
            [] => vec![None],
            all => all.iter().map(|a| Some(a.0)).collect(),
        };
        // A compliant joint has a motor of its own, which begins somewhere.
        let fresh = |k: &usize| base.place_of(&stated.unknowns[*k]).is_none();
        let fresh = (0..begin).filter(fresh).collect();
        // Free runs shift what is simulated.
        let fixed_size = base.stated.free.is_none() && stated.set.last()?.shifts_reading();
        Some(Self { base, projection, problem, from, begin, posed, keeps, fresh, fixed_size })
    }

    /// The look that predicts most; of many only the likeliest few are made in full.
    pub(super) fn firmest(&self, looks: Vec<TrialValues>) -> Option<LookPromise> {
        let all = if looks.len() > FEW { self.likeliest(looks) } else { looks };
        let candidates = all.into_iter().filter_map(|values| self.at(values, None));
        candidates.max_by(|a, b| a.firm.total_cmp(&b.firm))
    }

    /// How the residuals change, after removal of what the unknowns of the base would take up.
    pub(super) fn change(&self, values: TrialValues) -> Option<DVector<f64>> {
        self.look(values, None)?.columns.into_iter().next().map(|c| c.1)
    }

    /// Coordinates from where a fit would begin.
    pub(super) fn start(&self, promise: &LookPromise) -> Vec<f64> {
        let LookPromise { looked, factors, steps, .. } = promise;
        let mut start = self.from.to_vec();
        looked.set(&mut start, self.begin, self.posed, factors);
        looked.fresh.iter().zip(steps).for_each(|((k, _), step)| start[*k] += step);
        start
    }

    /// With unknowns around these values, in one recording or all.
    fn at(&self, values: TrialValues, run: Option<usize>) -> Option<LookPromise> {
        let looked = self.look(values, run)?;
        if self.fixed_size {
            return self.standing(looked, run);
        }
        let own = looked.columns.iter().map(|c| &c.1);
        let columns: Vec<&DVector<f64>> = own.chain(looked.fresh.iter().map(|c| &c.1)).collect();
        let (gain, factors) = self.projection.best(&columns);
        let gain = if looked.one_sided && factors[0] <= 0.0 { 0.0 } else { gain };
        if self.fresh.is_empty() {
            return Some(LookPromise { looked, gain, firm: gain, factors, steps: Vec::new() });
        }
        let (firm, steps) = self.projection.firm(&looked)?;
        // What another size of it would explain: biased parameters make every one look bad.
        Some(LookPromise { looked, gain: gain.max(firm), firm, factors: vec![1.0], steps })
    }

    /// As it was looked at, or as far off as its change would have it: whichever explains more.
    fn standing(&self, looked: LinearisedCause, run: Option<usize>) -> Option<LookPromise> {
        let (_, factors) = self.projection.best(&[&looked.columns.first()?.1]);
        let mut values = looked.values.clone();
        self.posed.amplitudes.iter().for_each(|(k, n)| values[*k] = n + factors[0] * (values[*k] - n));
        let moved = if factors[0] > 0.0 { self.look(values, run) } else { None };
        let candidates = [Some(looked), moved].into_iter().flatten().filter_map(|looked| {
            let firm = self.projection.standing(&looked.columns.first()?.1);
            let (factors, steps) = (vec![1.0], Vec::new());
            // Too far off to be compared it predicts no improvement.
            firm.is_finite().then(|| LookPromise { looked, gain: firm.max(0.0), firm, factors, steps })
        });
        candidates.max_by(|a, b| a.firm.total_cmp(&b.firm))
    }

    /// How the residuals change with unknowns around these values.
    fn look(&self, values: TrialValues, run: Option<usize>) -> Option<LinearisedCause> {
        let (one_sided, fixed_size) = (self.posed.one_sided(), self.fixed_size);
        let mut looked =
            LinearisedCause { values, columns: Vec::new(), fresh: Vec::new(), one_sided, fixed_size };
        let begins = self.problem.begins();
        let rows = run.map_or(0..begins[begins.len() - 1], |r| begins[r]..begins[r + 1]);
        for keep in &self.keeps {
            let mut theta = self.from.to_vec();
            for (k, u) in self.posed.unknowns.iter().enumerate() {
                theta[self.begin + k] = u.scale.coordinate(looked.at(self.posed, k));
            }
            // What a free run adds up is in proportion only while it is small.
            let close = if self.base.stated.free.is_some() && keep.is_some() { CLOSE } else { 1.0 };
            if let Some(k) = keep {
                let (u, n) = (&self.posed.unknowns[*k], self.posed.neutral(*k));
                let value = (n + close * (looked.values[*k] - n)).clamp(u.lower, u.upper);
                theta[self.begin + k] = u.scale.coordinate(value);
            }
            let residuals = |theta: &[f64]| {
                run.map_or_else(|| self.problem.residuals(theta), |r| self.problem.residual(r, theta))
            };
            let Ok(mut there) = residuals(&theta) else { continue };
            for (k, of) in self.fresh.iter().filter_map(|k| Some((*k, self.problem.unknowns[*k].run?))) {
                if run.is_some_and(|r| r != of) {
                    continue;
                }
                theta[k] += 1.0;
                let moved = self.problem.residual(of, &theta);
                theta[k] -= 1.0;
                let Ok(mut moved) = moved else { continue };
                let own = begins[of] - rows.start..begins[of + 1] - rows.start;
                moved.iter_mut().zip(&there[own]).for_each(|(a, b)| *a -= b);
                looked.fresh.push((k, self.projection.out(begins[of], &moved)));
            }
            let base = &self.base.residuals.as_slice()[rows.clone()];
            there.iter_mut().zip(base).for_each(|(a, b)| *a = (*a - b) / close);
            looked.columns.push((*keep, self.projection.out(rows.start, &there)));
        }
        (!looked.columns.is_empty()).then_some(looked)
    }

    /// Of many the few that explain most where most is missing.
    fn likeliest(&self, looks: Vec<TrialValues>) -> Vec<TrialValues> {
        let begins = self.problem.begins();
        let power = |r: usize| {
            let rows = &self.base.residuals.as_slice()[begins[r]..begins[r + 1]];
            rows.iter().map(|r| r * r).sum::<f64>() / rows.len().max(1) as f64
        };
        let Some(run) = (0..begins.len() - 1).max_by(|a, b| power(*a).total_cmp(&power(*b))) else {
            return looks;
        };
        let mut all: Vec<LookPromise> =
            looks.into_iter().filter_map(|values| self.at(values, Some(run))).collect();
        descending(&mut all, |item| item.firm);
        all.truncate(LIKELIEST);
        all.into_iter().map(|p| p.looked.values).collect()
    }
}
