//! Leave-one-out over the recordings for fitting: a search that has not seen one of them.

use super::kept::SearchMemory;
use super::recordings::PreparedCase;
use super::replay::FreeRunFit;
use super::search::{CaseSearch, FittedSet};
use trueup_identification::lsq::SolverOptions;

impl PreparedCase {
    /// The same case with one recording for fitting held out, and nothing else.
    fn leaving_out(&self, run: usize) -> Self {
        let mut own = self.clone();
        own.holdout = vec![own.train.remove(run)];
        own
    }
}

/// Iterations from the estimate from all recordings for a set that ran freely already.
const AGAIN: usize = 6;

/// One recording for fitting held out.
#[derive(Debug)]
pub struct Fold {
    case: PreparedCase,
    run: usize,
}

impl Fold {
    /// Of a search; `run`: which is held out.
    pub fn new(search: &CaseSearch<'_>, run: usize) -> Self {
        Self { case: search.case.leaving_out(run), run }
    }

    /// The search over the others: typical sizes, causes and floors are those of all.
    pub fn search<'a>(&'a self, all: &CaseSearch<'_>) -> CaseSearch<'a> {
        let mut prescribed = all.prescribed[..all.case.train.len()].to_vec();
        let mut expected = all.expected[..prescribed.len()].to_vec();
        let (last, left) = (prescribed.remove(self.run), expected.remove(self.run));
        prescribed.push(last);
        expected.push(left);
        let (sizes, causes, drifting_starts) =
            (all.sizes.clone(), all.causes.clone(), all.drifting_starts.clone());
        let memory = SearchMemory::default();
        CaseSearch { case: &self.case, sizes, causes, prescribed, expected, drifting_starts, memory }
    }

    /// Fits a set to the others, free-running, from the estimate from all recordings: as it ran freely, or else as the balances have
    /// it.
    pub fn fit(
        &self,
        search: &CaseSearch<'_>,
        from: &FittedSet,
        options: SolverOptions,
        polish: usize,
    ) -> Option<FreeRunFit> {
        let known = self.known(from);
        let set = &from.stated.set;
        let stated = search.state(set).ok()?;
        let start = stated.begin_with(&[&known]);
        let prescribed = search.fit(stated, &start, options).ok()?;
        let Some(free) = &from.stated.free else { return Some(search.polish(&prescribed, polish)) };
        let mut allowed = free.clone();
        allowed.remove(self.run);
        let mut stated = search.state_like(set, Some(allowed)).ok()?;
        let start = stated.begin_with(&[&known]);
        if prescribed.is_unbiased() {
            prescribed.believe(&mut stated, 1.0);
        }
        search.polished(stated, &start, AGAIN)
    }

    /// A fit to all, recordings counted as they are without the one that is held out, of which nothing is known.
    fn known(&self, from: &FittedSet) -> FittedSet {
        let mut known = from.clone();
        for unknown in &mut known.stated.unknowns {
            unknown.run = match unknown.run {
                Some(run) if run == self.run => Some(usize::MAX),
                Some(run) if run > self.run => Some(run - 1),
                run => run,
            };
        }
        known
    }
}
