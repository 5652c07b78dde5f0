//! Free runs of one recording from first states of its own, each computed once: a fit of where it begins is followed by another one
//! with other weights from where it ended, and by what is shown there.

use std::cell::RefCell;

use trueup_identification::lsq::{LeastSquares, ResidualEvaluation, SolverOptions, minimise};
use trueup_identification::predict::PredictError;

use crate::engine::problem::{BalanceColumns, BalanceProblem};

/// Free runs that are kept at most: more than a fit tries without a gain.
const MOST: usize = 24;

/// A free run: its coordinates, what it shows beyond what is measured, and the derivatives of that where they were computed.
#[derive(Debug)]
struct KnownRun {
    theta: Vec<f64>,
    errors: Vec<f64>,
    columns: Option<BalanceColumns>,
}

/// Free runs of one recording of a model by their coordinates, whatever their weights.
#[derive(Debug, Default)]
pub(super) struct RememberedRuns(RefCell<Vec<KnownRun>>);

impl RememberedRuns {
    /// What a free run shows beyond what is measured, and its derivatives if requested.
    fn errors(
        &self,
        problem: &BalanceProblem<'_>,
        theta: &[f64],
        jacobian: bool,
    ) -> Result<(Vec<f64>, Option<BalanceColumns>), PredictError> {
        let usable = |k: &&KnownRun| k.theta == theta && (k.columns.is_some() || !jacobian);
        if let Some(known) = self.0.borrow().iter().rev().find(usable) {
            return Ok((known.errors.clone(), known.columns.clone().filter(|_| jacobian)));
        }
        let (errors, columns) = problem.unweighted(theta, jacobian)?;
        let mut all = self.0.borrow_mut();
        if all.len() == MOST {
            all.remove(0);
        }
        all.push(KnownRun { theta: theta.to_vec(), errors: errors.clone(), columns: columns.clone() });
        Ok((errors, columns))
    }

    /// Readings as a free run shows them, channel by channel; `begins`: a fit begins there.
    pub(super) fn shown(
        &self,
        problem: &BalanceProblem<'_>,
        theta: &[f64],
        begins: bool,
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        Ok(problem.with_errors(0, self.errors(problem, theta, begins)?.0))
    }

    /// Where the weighted errors are least, from there on.
    pub(super) fn minimum(
        &self,
        problem: &BalanceProblem<'_>,
        start: &[f64],
        options: SolverOptions,
    ) -> Result<Vec<f64>, PredictError> {
        let weights = problem.weights(0);
        Ok(minimise(&RememberedProblem { problem, runs: self, weights }, start, options)?.0)
    }
}

/// A problem whose free runs are remembered.
struct RememberedProblem<'p, 'a> {
    problem: &'p BalanceProblem<'a>,
    runs: &'p RememberedRuns,
    /// One per reading.
    weights: Vec<f64>,
}

impl LeastSquares for RememberedProblem<'_, '_> {
    type Error = PredictError;

    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        self.problem.bounds()
    }

    fn evaluate(&self, theta: &[f64], jacobian: bool) -> Result<ResidualEvaluation, PredictError> {
        let (mut errors, mut columns) = self.runs.errors(self.problem, theta, jacobian)?;
        let weigh = |own: &mut [f64]| own.iter_mut().zip(&self.weights).for_each(|(v, w)| *v *= w);
        weigh(&mut errors);
        columns.iter_mut().flatten().for_each(|(_, column)| weigh(column));
        Ok(self.problem.with_priors(theta, vec![(errors, columns)], jacobian))
    }
}
