//! What follows from a Jacobian for the unknowns: rank, covariance, correlation.

use nalgebra::{DMatrix, DVector};

use crate::lsq::Loss;

/// Singular values below this share of the largest one (columns scaled to length 1) count as 0: the data say nothing
/// along that direction.
pub const RANK_TOLERANCE: f64 = 1e-7;

/// The information in J = dr/dx, residuals of unit variance.
#[derive(Clone, Debug)]
pub struct Information {
    /// How many directions the data determine.
    pub rank: usize,
    /// Largest over smallest singular value of the scaled Jacobian.
    pub condition: f64,
    /// (J^T J)^+, over the determined directions.
    pub covariance: DMatrix<f64>,
    /// W with W W^T = (J^T J)^+, one column per determined direction: J W has orthonormal columns.
    pub root: DMatrix<f64>,
    /// How much of each unknown is in undetermined directions, 0 to 1.
    pub undetermined: Vec<f64>,
    /// The undetermined directions, scaled unknowns, one per column.
    pub null: DMatrix<f64>,
}

impl Information {
    /// By singular values of the R factor of J with its columns scaled to length 1.
    pub fn new(jacobian: &DMatrix<f64>) -> Self {
        let n = jacobian.ncols();
        let mut scaled = jacobian.clone();
        // Nothing is known along a column whose length is no number, and the factors of one would have no end.
        for mut column in scaled.column_iter_mut().filter(|c| !c.norm_squared().is_finite()) {
            column.fill(0.0);
        }
        let scale: Vec<f64> = scaled.column_iter().map(|c| c.norm()).collect();
        let unit = |s: f64| if s > 0.0 { s } else { 1.0 };
        scaled.column_iter_mut().zip(&scale).for_each(|(mut c, s)| c /= unit(*s));
        let r = if scaled.nrows() > n { scaled.qr().r() } else { scaled };
        let svd = r.svd(false, true);
        let values = &svd.singular_values;
        let v_t = svd.v_t.unwrap_or_else(|| DMatrix::identity(n, n));
        let largest = values.iter().copied().fold(0.0, f64::max);
        let (given, lost): (Vec<usize>, Vec<usize>) =
            (0..values.len()).partition(|&i| values[i] > RANK_TOLERANCE * largest);
        let rank = given.len();
        let directions = DMatrix::from_fn(n, rank, |k, i| v_t[(given[i], k)]);
        let root = DMatrix::from_fn(n, rank, |k, i| directions[(k, i)] / (values[given[i]] * unit(scale[k])));
        let determined = &directions * directions.transpose();
        let undetermined = (0..n).map(|k| (1.0 - determined[(k, k)]).clamp(0.0, 1.0)).collect();
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        Self {
            rank,
            condition: if smallest > 0.0 { largest / smallest } else { f64::INFINITY },
            covariance: &root * root.transpose(),
            root,
            undetermined,
            null: DMatrix::from_fn(n, lost.len(), |k, i| v_t[(lost[i], k)]),
        }
    }

    /// Of a fit whose readings a robust loss weighs.
    pub fn weighed(residuals: &DVector<f64>, jacobian: &DMatrix<f64>, loss: Loss) -> Self {
        let mut weighted = jacobian.clone();
        for mut column in weighted.column_iter_mut() {
            column.iter_mut().zip(residuals.iter()).for_each(|(j, r)| *j *= loss.weight(*r).sqrt());
        }
        Self::new(&weighted)
    }

    /// Whether the data determine unknown `i`.
    pub fn determines(&self, i: usize) -> bool {
        self.undetermined[i] < 1e-3 && self.covariance[(i, i)] > 0.0
    }
}

/// Correlation matrix of a covariance; 0 where a variance is 0.
pub fn correlation(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let sd: Vec<f64> = (0..covariance.nrows()).map(|i| covariance[(i, i)].max(0.0).sqrt()).collect();
    DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| {
        if sd[i] > 0.0 && sd[j] > 0.0 { covariance[(i, j)] / (sd[i] * sd[j]) } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_known_along_a_column_that_is_no_number() {
        for wild in [f64::NAN, f64::INFINITY, 1e200] {
            let i = Information::new(&DMatrix::from_row_slice(3, 2, &[1.0, wild, 2.0, 0.0, 2.0, 1.0]));
            assert_eq!((i.rank, i.determines(0), i.determines(1)), (1, true, false), "{wild}");
            assert!((i.covariance[(0, 0)] - 1.0 / 9.0).abs() < 1e-15);
        }
    }
}
