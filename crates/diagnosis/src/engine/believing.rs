//! Priors of the plant's own parameters while much is missed for other reasons.

use nalgebra::{DMatrix, DVector};
use trueup_identification::lsq::{Solution, SolverOptions, solve};
use trueup_identification::predict::PredictError;

use super::problem::{BalanceProblem, BalanceTarget};
use super::search::{CaseSearch, Octave, PosedSet};

/// A fit goes on while it leaves less than this share of what it left before, so often at the most.
const FALLS: f64 = 0.5;
const ROUNDS: usize = 5;

impl PosedSet {
    /// The plant's own parameters among its unknowns.
    fn owned(&self) -> impl Iterator<Item = usize> {
        let own = self.begin.first().copied().unwrap_or(self.unknowns.len());
        (0..own).filter(|k| {
            matches!(self.unknowns[*k].target, BalanceTarget::Parameter(_)) && self.unknowns[*k].run.is_none()
        })
    }
    /// Scales the rows of their prior.
    fn scale_owned(&self, residuals: &mut DVector<f64>, jacobian: &mut DMatrix<f64>, by: f64) {
        let with_prior = (0..self.unknowns.len()).filter(|k| self.unknowns[*k].prior.is_some());
        let first =
            residuals.len() - with_prior.clone().count() - self.belief.as_ref().map_or(0, |b| b.rows.nrows());
        for k in self.owned() {
            if let Some(row) = with_prior.clone().position(|b| b == k) {
                residuals[first + row] *= by;
                jacobian.row_mut(first + row).scale_mut(by);
            }
        }
    }
}

impl CaseSearch<'_> {
    /// Solves with a prior of the plant's own parameters for readings that miss so much for another reason: the
    /// size of a misfit is not known, so that readings count by what is left of it, and what is left falls as the fit goes on.
    /// Where they counted in full a cause that is lacking would drag parameters wherever they take up a little of it.
    pub(super) fn solve_believing(
        &self,
        mut problem: BalanceProblem<'_>,
        stated: &PosedSet,
        start: &[f64],
        options: SolverOptions,
    ) -> Result<Solution, PredictError> {
        let readings = problem.readings();
        // A power of the floor's as one: what is slow has few values, and would not hold what is fast.
        let left = |residuals: &[f64]| {
            let octaves = self.octaves(&residuals[..readings]);
            let [squares, expected] = [|o: &Octave| o.squares, |o: &Octave| o.expected]
                .map(|of| octaves.iter().map(of).sum::<f64>());
            (squares / expected.max(f64::MIN_POSITIVE)).max(1.0)
        };
        let mut power = left(&problem.residuals(start)?);
        let mut start = start.to_vec();
        let mut round = 1;
        loop {
            let tightening = power.sqrt();
            for k in stated.owned() {
                problem.unknowns[k].prior = stated.unknowns[k].prior.map(|p| p.tightening(tightening));
            }
            let mut found = solve(&problem, &start, options)?;
            let now = left(found.residuals.as_slice());
            if now > FALLS * power || round == ROUNDS {
                stated.scale_owned(&mut found.residuals, &mut found.jacobian, 1.0 / tightening);
                return Ok(found);
            }
            (power, start, round) = (now, found.x, round + 1);
        }
    }
}
