//! What the recordings cannot determine keeps the value that the case has.
//!
//! A fit moves an unknown that nothing determines to wherever chance takes it. Where the case's values fit as well, by the
//! likelihood ratio (Wilks 1938), the estimate stays with them.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::estimate::{EstimateSettings, ParameterEstimate, ProfileProblem, assess};
use crate::fit::{OutputErrorFit, misfit, of_solution};
use crate::lsq::{LeastSquares, Loss, Solution, SolverOptions, solve};
use crate::output_error::OutputError;
use crate::predict::PredictError;
use crate::unknown::{FitTarget, FitUnknown};

/// Probability with which chance alone lifts the cost by less than what still counts as chance.
const LEVEL: f64 = 0.95;

/// An unknown that keeps its value.
pub(super) struct KeptUnknown {
    /// Its index.
    pub(super) unknown: usize,
    /// Why the recordings do not give it.
    reason: String,
}

impl KeptUnknown {
    /// Puts it into an estimate, whatever the derivatives at that value say.
    pub(super) fn said(&self, e: &mut ParameterEstimate) {
        (e.standard_error, e.cramer_rao) = (None, None);
        e.reason = Some(format!("{}; the case's value is kept", self.reason));
    }
}

/// The fit with the case's values for those of the first unknowns that it does not determine, and which these are.
///
/// # Errors
/// See [`PredictError`].
pub(super) fn of(
    problem: &OutputError,
    fit: OutputErrorFit,
    nominal: &[f64],
    shared: &[FitUnknown],
    loss: Loss,
) -> Result<(OutputErrorFit, Vec<KeptUnknown>), PredictError> {
    let how = EstimateSettings { starts: Vec::new(), loss, profile: Vec::new(), first_iterations: 0 };
    let first = assess(problem, &fit.solution, &how);
    let (lower, upper) = problem.bounds();
    let candidates: Vec<(usize, f64)> = (shared.iter().enumerate())
        .filter(|(k, _)| first.unknowns[*k].standard_error.is_none())
        .filter_map(|(k, u)| match u.target {
            FitTarget::Parameter(i) => Some((k, u.scale.coordinate(nominal[i]))),
            _ => None,
        })
        .filter(|(k, at)| at.is_finite() && (lower[*k]..=upper[*k]).contains(at))
        .collect();
    // Together, as most of them are; else as many as go, one after the other.
    let mut held: Vec<(usize, f64)> = Vec::new();
    let mut best: Option<Solution> = None;
    if let Some(solution) = as_good(problem, &fit.solution, &candidates, loss) {
        (held, best) = (candidates, Some(solution));
    } else {
        for one in candidates {
            held.push(one);
            match as_good(problem, &fit.solution, &held, loss) {
                Some(solution) => best = Some(solution),
                None => _ = held.pop(),
            }
        }
    }
    let Some(solution) = best else { return Ok((fit, Vec::new())) };
    let kept = held.iter().map(|(k, _)| {
        let reason = match fit.solution.at_bound[*k] {
            0 => first.unknowns[*k].reason.clone().unwrap_or_default(),
            _ => "no other value of it fits better beyond chance".to_owned(),
        };
        KeptUnknown { unknown: *k, reason }
    });
    let kept = kept.collect();
    Ok((of_solution(problem, solution, loss, fit.origins)?, kept))
}

/// The best fit with some unknowns held, if it is as good as the free one but for chance.
fn as_good(problem: &OutputError, free: &Solution, at: &[(usize, f64)], loss: Loss) -> Option<Solution> {
    if at.is_empty() {
        return None;
    }
    let mut start = free.x.clone();
    at.iter().for_each(|(k, at)| start[*k] = *at);
    let options = SolverOptions { loss, ..SolverOptions::default() };
    let found = solve(&ProfileProblem { problem, at }, &start, options).ok()?;
    // Residuals above the noise make chance larger.
    let level = ChiSquared::new(at.len() as f64).ok()?.inverse_cdf(LEVEL);
    let chance = 0.5 * level * misfit(problem, free).powi(2);
    if found.cost - free.cost > chance {
        return None;
    }
    let here = problem.evaluate(&found.x, true).ok()?;
    Some(Solution {
        jacobian: here.jacobian?,
        residuals: here.residuals,
        at_bound: held_free(&found, at),
        ..found
    })
}

/// What is held is at no bound.
fn held_free(found: &Solution, at: &[(usize, f64)]) -> Vec<i8> {
    let mut bounds = found.at_bound.clone();
    at.iter().for_each(|(k, _)| bounds[*k] = 0);
    bounds
}
