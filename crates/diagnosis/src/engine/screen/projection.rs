//! How far changes of the residuals explain what a fit leaves, in addition to what its unknowns explain.

use nalgebra::{DMatrix, DVector};

use super::looked::LinearisedCause;
use crate::engine::search::FittedSet;

/// What the unknowns of a fit cannot take up.
pub(super) struct Projection {
    /// Orthonormal columns that span the Jacobian (with the rows of the priors).
    q: DMatrix<f64>,
    /// What they leave.
    pub residuals: DVector<f64>,
    /// Products of the columns of the Jacobian among themselves,
    information: DMatrix<f64>,
    /// and with the residuals of the fit,
    gradient: DVector<f64>,
    /// whose sum of squares this is.
    squares: f64,
}

impl Projection {
    pub(super) fn new(base: &FittedSet) -> Self {
        let (residuals, j) = base.as_fitted();
        Self::of(residuals, j)
    }
    /// Of a fit that lacks its last cause, in proportion: as if all that it does were to be explained again (EST-10).
    pub(super) fn without_last(fitted: &FittedSet) -> Self {
        let (mut residuals, j) = fitted.as_fitted();
        let s = &fitted.stated;
        let begin = s.begin.last().copied().unwrap_or(s.unknowns.len());
        for (k, neutral) in s.posed.last().iter().flat_map(|p| &p.amplitudes) {
            let at = begin + k;
            let by = s.unknowns[at].scale.coordinate(*neutral) - fitted.theta[at];
            residuals.axpy(by, &j.column(at), 1.0);
        }
        Self::of(residuals, j.columns(0, begin).into_owned())
    }
    fn of(residuals: DVector<f64>, mut j: DMatrix<f64>) -> Self {
        let (information, gradient) = (j.tr_mul(&j), j.tr_mul(&residuals));
        let squares = residuals.norm_squared();
        for mut column in j.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        let q = j.qr().q();
        let residuals = &residuals - &q * q.tr_mul(&residuals);
        Self { q, residuals, information, gradient, squares }
    }
    /// A change of the readings from `first` on, less what the unknowns would do against it.
    pub(super) fn out(&self, first: usize, readings: &[f64]) -> DVector<f64> {
        let mut v = DVector::zeros(self.residuals.len());
        v.as_mut_slice()[first..first + readings.len()].copy_from_slice(readings);
        let along = self.q.tr_mul(&v);
        v - &self.q * along
    }
    /// Half the fall of the sum of squares with the best factors of these changes, and the factors; a factor of 1 has
    /// the prior's standard deviation.
    pub(super) fn best(&self, columns: &[&DVector<f64>]) -> (f64, Vec<f64>) {
        best_of(columns, &self.residuals)
    }
    /// Half the fall of the sum of squares with a cause as it was looked at and the best first states, and their steps.
    pub(super) fn firm(&self, looked: &LinearisedCause) -> Option<(f64, Vec<f64>)> {
        let fresh: Vec<&DVector<f64>> = looked.fresh.iter().map(|c| &c.1).collect();
        let with = &self.residuals + &looked.columns.first()?.1;
        let (gain, steps) = best_of(&fresh, &with);
        Some((gain + 0.5 * (self.residuals.norm_squared() - with.norm_squared()), steps))
    }
    /// Half the fall of the sum of squares with a change as it is.
    pub(super) fn standing(&self, change: &DVector<f64>) -> f64 {
        -(change.dot(&self.residuals) + 0.5 * change.norm_squared())
    }
    /// Half the fall of the sum of squares when unknown `k` is doubted by `sd` instead of by its prior, and its step.
    pub(super) fn relaxed(&self, base: &FittedSet, k: usize, sd: f64) -> Option<(f64, f64)> {
        let old = base.stated.unknowns[k].prior?;
        let (mut a, mut b) = (self.information.clone(), self.gradient.clone());
        let r = base.theta[k] - old.mean;
        let change = base.tightening.powi(2) * (1.0 / (sd * sd) - 1.0 / (old.deviation * old.deviation));
        a[(k, k)] += change;
        b[k] += change * r;
        let step = -a.cholesky()?.solve(&b);
        let before = 0.5 * (self.squares + change * r * r);
        let gain = -0.5 * step.dot(&b) + 0.5 * self.squares - before;
        Some((gain.max(0.0), step[k]))
    }
}

/// Of these changes of residuals.
fn best_of(columns: &[&DVector<f64>], residuals: &DVector<f64>) -> (f64, Vec<f64>) {
    let n = columns.len();
    let a = DMatrix::from_fn(n, n, |i, j| columns[i].dot(columns[j]));
    best(a, DVector::from_fn(n, |i, _| columns[i].dot(residuals)))
}

/// Of changes with products `a` among themselves and `b` with the residuals.
pub(super) fn best(mut a: DMatrix<f64>, b: DVector<f64>) -> (f64, Vec<f64>) {
    let (n, bare) = (b.len(), a.clone());
    (0..n).for_each(|i| a[(i, i)] += 1.0);
    let Some(c) = a.cholesky() else { return (0.0, vec![0.0; n]) };
    let mut s = -c.solve(&b);
    // A simulation at one size gives little information on one that is many times as large.
    let most = s.amax();
    if most > 4.0 {
        s *= 4.0 / most;
    }
    let gain = -(b.dot(&s) + 0.5 * s.dot(&(&bare * &s)) + 0.5 * s.norm_squared());
    (gain.max(0.0), s.iter().copied().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::hypothesis::PosedHypothesis;
    use crate::engine::made::fitted;
    use crate::engine::unknown::{BalanceTarget, BalanceUnknown};
    use trueup_identification::unknown::Scale;

    /// EST-10: what does nine tenths of what a cause of size 3 does explains nine tenths of it, whatever the parameters would take up of
    /// either; what does the opposite, or what parameters take up, explains nothing.
    #[test]
    fn what_does_the_same_explains_what_a_cause_does() {
        let unknown = |name: &str| BalanceUnknown {
            name: name.into(),
            unit: String::new(),
            target: BalanceTarget::Parameter(0),
            run: None,
            start: 0.0,
            scale: Scale::Linear(1.0),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            prior: None,
        };
        let mut best = fitted("backlash", 1.0, 10.0);
        best.stated.unknowns = vec![unknown("a"), unknown("b"), unknown("size")];
        best.stated.begin = vec![2];
        best.stated.posed =
            vec![PosedHypothesis { amplitudes: vec![(0, 0.0)], ..PosedHypothesis::default() }];
        best.theta = vec![0.3, -0.2, 3.0];
        // Two parameters, then the cause: along e3, and something that the first parameter takes up.
        let mut j = DMatrix::zeros(6, 3);
        (j[(0, 0)], j[(1, 1)], j[(2, 2)], j[(0, 2)]) = (1.0, 1.0, 100.0, 70.0);
        (best.residuals, best.jacobian) = (DVector::zeros(6), j);
        let projection = Projection::without_last(&best);
        let whole = 0.5 * projection.residuals.norm_squared();
        assert!((whole / (0.5 * 300.0f64.powi(2)) - 1.0).abs() < 1e-12, "{whole}");
        let share = |change: [f64; 6]| projection.best(&[&projection.out(0, &change)]).0 / whole;
        let alike = share([5.0, -7.0, 90f64.sqrt() * 10.0, 10f64.sqrt() * 10.0, 0.0, 0.0]);
        assert!((alike - 0.9).abs() < 1e-3, "{alike}");
        assert_eq!(share([9.0, 4.0, 0.0, 0.0, 0.0, 0.0]), 0.0);
        let (_, factors) = projection.best(&[&projection.out(0, &[0.0, 0.0, -100.0, 0.0, 0.0, 0.0])]);
        assert!(factors[0] < 0.0, "what has one sign is tested by its factor");
    }
}
