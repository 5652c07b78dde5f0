//! What leads a screen, linearised anew about itself.

use trueup_estimation::fit::{Effort, Fit, fit};

use crate::baseline::Baseline;
use crate::screen::Candidate;

/// Rounds of a refit.
const ROUNDS: usize = 6;

/// A cause at the mode of its posterior.
pub fn refit(baseline: &Baseline, seen: &Candidate) -> Option<Fit> {
    let mut start = baseline.fit.theta.clone();
    start.extend(&seen.at);
    let effort = Effort { rounds: ROUNDS, held: 0, bounds: baseline.bounds };
    fit(&baseline.raw, &seen.parametrized.parametric, &start, seen.latent, &baseline.fit.runs, effort)
}
