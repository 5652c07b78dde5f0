//! Other minima of the cost: one that is lower than where the search ended, and those that chance alone may have made
//! higher.
//!
//! The first stage of a search compares starts by a loss that forgives, before they have converged; a minimum that it
//! passes over may be the better one, or as good.

use crate::fit::{Origins, OutputErrorFit, misfit, of_solution};
use crate::lsq::{Loss, Solution, SolverOptions, solve};
use crate::output_error::OutputError;
use crate::predict::PredictError;
use trueup_numerics::order::ascending;

/// Logarithm of the odds, 20 to 1, beyond which the recordings distinguish one set of values from another.
const ODDS: f64 = 3.0;
/// Standard errors by which an unknown of another minimum is off.
const APART: f64 = 5.0;
/// Starts that are followed to their minimum, those of the lowest cost.
const FOLLOWED: usize = 4;

/// The lowest of the minima that the starts lead to. Others within chance of it are reported in `notes`, by those of the
/// first `shared` unknowns that differ.
///
/// # Errors
/// See [`PredictError`].
pub(super) fn lowest(
    problem: &OutputError,
    fit: OutputErrorFit,
    shared: usize,
    loss: Loss,
    notes: &mut Vec<String>,
) -> Result<OutputErrorFit, PredictError> {
    let errors: Vec<f64> = (0..shared).map(|k| fit.information.covariance[(k, k)].max(0.0).sqrt()).collect();
    let determined: Vec<usize> = (0..shared).filter(|k| fit.information.determines(*k)).collect();
    // Residuals above the noise make errors and chance larger.
    let size = misfit(problem, &fit.solution);
    let differ = |a: &[f64], b: &[f64]| -> Vec<usize> {
        let apart = |k: &usize| (a[*k] - b[*k]).abs() > APART * size * errors[*k];
        determined.iter().copied().filter(apart).collect()
    };
    let of = |start: &usize| fit.origins.costs[*start];
    let mut starts: Vec<usize> = (0..fit.origins.ends.len())
        .filter(|start| of(start).is_finite() && !differ(&fit.origins.ends[*start], &fit.theta).is_empty())
        .collect();
    ascending(&mut starts, |item| of(item));
    let options = SolverOptions { loss, ..SolverOptions::default() };
    let mut found: Vec<(usize, Solution)> = Vec::new();
    for start in starts.into_iter().take(FOLLOWED) {
        let Ok(solution) = solve(problem, &fit.origins.ends[start], options) else { continue };
        let others = found.iter().map(|f| &f.1);
        let known =
            std::iter::once(&fit.solution).chain(others).any(|s| differ(&solution.x, &s.x).is_empty());
        if solution.stop.converged() && !known {
            found.push((start, solution));
        }
    }
    ascending(&mut found, |item| item.1.cost);
    let mut fit = fit;
    if found.first().is_some_and(|(_, lowest)| lowest.cost < fit.cost) {
        let (start, solution) = found.remove(0);
        let origins = Origins { start, ..fit.origins.clone() };
        let better = of_solution(problem, solution, loss, origins)?;
        let before = std::mem::replace(&mut fit, better);
        found.insert(0, (before.origins.start, before.solution));
    }
    for (_, other) in found.iter().filter(|(_, s)| s.cost - fit.cost < ODDS * size * size) {
        let values: Vec<String> = differ(&other.x, &fit.theta)
            .iter()
            .map(|k| {
                let u = &problem.unknowns()[*k];
                let [there, here] = [&other.x, &fit.theta].map(|x| u.scale.value(x[*k]).0);
                format!("{} = {there:.4e} instead of {here:.4e}", u.name)
            })
            .collect();
        notes.push(format!(
            "other values fit as well but for chance ({:.1} to 1 against them): {}. The intervals do not hold them; a recording that excites it otherwise, or an entry under [uncertain], decides",
            ((other.cost - fit.cost) / (size * size)).exp(),
            values.join(", ")
        ));
    }
    Ok(fit)
}
