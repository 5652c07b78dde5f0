//! What a Jacobian says about the unknowns: rank, covariance, correlation.

use nalgebra::{DMatrix, DVector};

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
    /// How much of each unknown lies in undetermined directions, 0 to 1.
    pub undetermined: Vec<f64>,
    /// The undetermined directions, scaled unknowns, one per column.
    pub null: DMatrix<f64>,
}

impl Information {
    /// By singular values of the R factor of J with its columns scaled to length 1.
    pub fn new(jacobian: &DMatrix<f64>) -> Self {
        let n = jacobian.ncols();
        let scale: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
        let unit = |s: f64| if s > 0.0 { s } else { 1.0 };
        let mut scaled = jacobian.clone();
        scaled.column_iter_mut().zip(&scale).for_each(|(mut c, s)| c /= unit(*s));
        let r = if scaled.nrows() > n { scaled.qr().r() } else { scaled };
        let svd = r.svd(false, true);
        let values = &svd.singular_values;
        let v_t = svd.v_t.unwrap_or_else(|| DMatrix::identity(n, n));
        let largest = values.iter().copied().fold(0.0, f64::max);
        let kept = |i: usize| values[i] > RANK_TOLERANCE * largest;
        let rank = (0..values.len()).filter(|&i| kept(i)).count();
        let mut covariance = DMatrix::zeros(n, n);
        let mut determined = DMatrix::<f64>::zeros(n, n);
        for i in (0..values.len()).filter(|&i| kept(i)) {
            let v: DVector<f64> = v_t.row(i).transpose();
            let w = DVector::from_fn(n, |k, _| v[k] / (values[i] * unit(scale[k])));
            covariance += &w * w.transpose();
            determined += &v * v.transpose();
        }
        let undetermined = (0..n).map(|k| (1.0 - determined[(k, k)]).clamp(0.0, 1.0)).collect();
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let lost: Vec<DVector<f64>> =
            (0..values.len()).filter(|&i| !kept(i)).map(|i| v_t.row(i).transpose()).collect();
        let null = if lost.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&lost) };
        Self {
            rank,
            condition: if smallest > 0.0 { largest / smallest } else { f64::INFINITY },
            covariance,
            undetermined,
            null,
        }
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
