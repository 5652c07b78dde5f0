//! Sets that were fitted, and how.

use trueup_identification::lsq::SolverOptions;

use super::hypothesis::Hypothesis;
use super::search::{self, FittedSet};

/// What the search found.
#[derive(Debug)]
pub struct SearchResult {
    /// Nothing added.
    pub plain: FittedSet,
    /// Every set that was fitted, best first.
    pub sets: Vec<FittedSet>,
    /// The set chosen.
    pub best: FittedSet,
}

/// Share of the floor's power from which an excess is plain.
pub const PLAIN: f64 = 0.25;

/// How a set is fitted.
pub fn fit_options() -> SolverOptions {
    SolverOptions { max_iterations: 10, cost_tolerance: 1e-4, radius: 1.0, ..SolverOptions::default() }
}

impl FittedSet {
    /// Readings that count.
    pub fn count(&self) -> f64 {
        if !self.octaves.is_empty() {
            return self.octaves.iter().map(|o| o.count).sum::<f64>().max(1.0);
        }
        self.readings as f64
    }
    /// Power of the residuals over that of the floor, what the priors object included.
    pub fn excess(&self) -> f64 {
        search::excess(&self.octaves) + self.prior2 / self.count()
    }
    /// Its equation error has nothing that is plain, so that it drags no parameter.
    pub fn misses_little(&self) -> bool {
        self.excess() < PLAIN
    }
}

/// The same causes.
pub fn same(a: &[Hypothesis], b: &[Hypothesis]) -> bool {
    a.len() == b.len() && a.iter().all(|h| b.contains(h))
}
