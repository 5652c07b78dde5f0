//! What a look at a cause found.

use nalgebra::DVector;

use crate::engine::hypothesis::PosedHypothesis;

/// A look at a cause: values of its unknowns, and how the residuals change, amplitude by amplitude.
#[derive(Clone, Debug)]
pub(super) struct LinearisedCause {
    pub values: Vec<f64>,
    pub columns: Vec<(Option<usize>, DVector<f64>)>,
    /// The same by first states that only the model with the cause has: coordinates.
    pub fresh: Vec<(usize, DVector<f64>)>,
    /// Only one sign of its change makes sense.
    pub one_sided: bool,
    /// It counts as it was looked at: half the change of a reading that is shifted is the mean of two readings, which has
    /// less noise than either.
    pub fixed_size: bool,
}

impl LinearisedCause {
    /// Sets the unknowns of a cause, the first being coordinate `begin`, such that its changes have these factors.
    pub(super) fn set(&self, theta: &mut [f64], begin: usize, posed: &PosedHypothesis, factors: &[f64]) {
        for (k, u) in posed.unknowns.iter().enumerate() {
            theta[begin + k] = u.scale.coordinate(self.at(posed, k));
        }
        for ((keep, _), s) in self.columns.iter().zip(factors) {
            let Some(k) = keep else { continue };
            let (u, n) = (&posed.unknowns[*k], posed.neutral(*k));
            let value = (n + s * (self.values[*k] - n)).clamp(u.lower, u.upper);
            theta[begin + k] = u.scale.coordinate(value);
        }
        for &k in posed.follow.iter().filter(|_| factors[0] > 0.0) {
            theta[begin + k] = posed.unknowns[k].scale.coordinate(self.values[k] * factors[0]);
        }
    }
    /// Value of an unknown when all amplitudes are neutral.
    pub(super) fn at(&self, posed: &PosedHypothesis, k: usize) -> f64 {
        posed.amplitudes.iter().find(|(a, _)| *a == k).map_or(self.values[k], |(_, neutral)| *neutral)
    }
}

impl PosedHypothesis {
    pub(super) fn neutral(&self, k: usize) -> f64 {
        self.amplitudes.iter().find(|a| a.0 == k).map_or(0.0, |a| a.1)
    }
}
