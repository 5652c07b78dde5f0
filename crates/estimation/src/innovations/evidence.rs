//! Log evidence of a set of columns with normal priors.
//!
//! ```text
//! A = G_11 + diag(1 / sd^2),  b = G_10 + mu / sd^2,  a = A^-1 b
//! L = -1/2 (G_00 + mu^2 / sd^2 - b a + sum log S) - 1/2 log|A| - sum log sd
//! ```

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::column::{AppliedLaw, FilterColumn};
use super::gram::BaseGram;
use super::numeric::median;

/// Relative step of a parameter up to which its column is used.
pub const TRUST: f64 = 0.3;
/// How fast evidence falls beyond: one of these is half a nat.
const BEYOND: f64 = 0.02;

/// Normal priors of amplitudes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AmplitudePriors {
    /// Means.
    pub mean: Vec<f64>,
    /// Standard deviations.
    pub deviation: Vec<f64>,
    /// How many of the first are relative changes of parameters.
    pub parameters: usize,
}

impl AmplitudePriors {
    /// With more amplitudes behind.
    pub fn with(&self, mean: &[f64], deviation: &[f64]) -> Self {
        let mean = [&self.mean[..], mean].concat();
        Self { mean, deviation: [&self.deviation[..], deviation].concat(), parameters: self.parameters }
    }
    /// With those of laws, whose columns go behind the others.
    pub fn with_laws(self, laws: &[AppliedLaw], columns: &mut Vec<FilterColumn>) -> Self {
        laws.iter().fold(self, |priors, law| {
            columns.extend(law.columns.iter().cloned());
            priors.with(&law.mean, &law.deviation)
        })
    }
}

/// What the recordings say of a set of columns.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SetEvidence {
    /// Log evidence, nats.
    pub log: f64,
    /// Log likelihood with the squares of the priors at the posterior mode, nats: the evidence without the volumes.
    pub penalised: f64,
    /// Amplitudes at the posterior mode.
    pub amplitudes: Vec<f64>,
    /// What is left of the data with the priors, as a sum of squares.
    pub squares: f64,
    /// Readings that count.
    pub count: usize,
}

/// Columns of a Gram matrix with their priors, as one linear problem: A = L L' in units of `scale`.
struct Normals {
    right: Vec<f64>,
    scale: Vec<f64>,
    factor: Option<Cholesky<f64, Dyn>>,
}

impl Normals {
    fn new(g: &BaseGram, priors: &AmplitudePriors) -> Self {
        let n = priors.mean.len();
        let weight: Vec<f64> = priors.deviation.iter().map(|d| 1.0 / (d * d)).collect();
        let mut a = DMatrix::from_fn(n, n, |i, j| g.product(i + 1, j + 1));
        (0..n).for_each(|i| a[(i, i)] += weight[i]);
        let right = (0..n).map(|i| g.product(i + 1, 0) + weight[i] * priors.mean[i]).collect();
        let scale: Vec<f64> = (0..n).map(|i| a[(i, i)].sqrt()).collect();
        let scaled = DMatrix::from_fn(n, n, |i, j| a[(i, j)] / (scale[i] * scale[j]));
        let ridges = [0.0, 1e-6, 1e-4, 1e-2, 1.0];
        let factor = ridges.iter().find_map(|e| Cholesky::new(&scaled + DMatrix::identity(n, n) * *e));
        Self { right, scale, factor }
    }
}

/// Covariance of the amplitudes: A^-1 (EST-5); `None`: it has none.
pub fn posterior_covariance(g: &BaseGram, priors: &AmplitudePriors) -> Option<DMatrix<f64>> {
    let normals = Normals::new(g, priors);
    let scale = &normals.scale;
    let inverse = normals.factor?.inverse();
    Some(DMatrix::from_fn(scale.len(), scale.len(), |i, j| inverse[(i, j)] / (scale[i] * scale[j])))
}

/// Evidence of all columns of a Gram matrix; not finite sums have an evidence of minus infinity.
pub fn log_evidence(g: &BaseGram, priors: &AmplitudePriors) -> SetEvidence {
    let n = priors.mean.len();
    let weight: Vec<f64> = priors.deviation.iter().map(|d| 1.0 / (d * d)).collect();
    let Normals { right: b, scale, factor } = Normals::new(g, priors);
    let Some(factor) = factor else {
        let (log, squares) = (f64::NEG_INFINITY, f64::INFINITY);
        return SetEvidence { log, penalised: log, amplitudes: vec![0.0; n], squares, count: g.count };
    };
    let right = DVector::from_fn(n, |i, _| b[i] / scale[i]);
    let solved = factor.solve(&right);
    let amplitudes: Vec<f64> = (0..n).map(|i| solved[i] / scale[i]).collect();
    let prior: f64 = (0..n).map(|i| weight[i] * priors.mean[i].powi(2)).sum();
    let explained: f64 = b.iter().zip(&amplitudes).map(|(b, a)| b * a).sum();
    let squares = g.product(0, 0) + prior - explained;
    let volume: f64 = (0..n).map(|i| factor.l_dirty()[(i, i)].ln() + scale[i].ln()).sum();
    let width: f64 = weight.iter().map(|w| w.ln()).sum();
    let penalised = -0.5 * (squares + g.log_variance);
    let mut log = penalised - volume + 0.5 * width; // (EST-5)
    // A longer step of a parameter was linearised elsewhere; all together change nothing, hence the median.
    let steps = &amplitudes[..priors.parameters];
    let middle = if steps.len() > 2 { median(steps.to_vec()) } else { 0.0 };
    let far = steps.iter().map(|x| (((x - middle).abs() - TRUST).max(0.0) / BEYOND).powi(2));
    log -= 0.5 * far.sum::<f64>();
    if !log.is_finite() {
        log = f64::NEG_INFINITY;
    }
    SetEvidence { log, penalised, amplitudes, squares, count: g.count }
}
