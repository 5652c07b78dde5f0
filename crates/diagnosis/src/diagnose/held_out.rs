//! Held-out gaps of candidates.

use crate::engine::replay::{Complete, Replayed};
use crate::engine::search::Search;
use crate::engine::select::Found;
use crate::outcome::{Candidate, Verdict};

/// Candidates that were not chosen and are worth a run.
const RUNS: usize = 3;

/// Fills in the gap on held-out recordings: of what is claimed that of the claim (`after`), of the next ones a free run of their
/// own as they were fitted.
pub(super) fn held_out(
    search: &Search<'_>,
    found: &Found,
    verdict: Verdict,
    after: Option<f64>,
    candidates: &mut [Candidate],
    gap_of: impl Fn(&Replayed) -> Option<f64>,
) {
    if verdict == Verdict::NoGap {
        return;
    }
    let runs = if search.case.holdout.is_empty() { &search.case.train } else { &search.case.holdout };
    let mut left = RUNS;
    for c in candidates {
        let same = |h: &crate::engine::hypothesis::Hypothesis| {
            h.id == c.id && h.component == c.component && c.joint == Some(h.site + 1)
        };
        let claimed = matches!(verdict, Verdict::Effects | Verdict::Ambiguous);
        if claimed && found.best.stated.set.iter().any(same) {
            c.holdout_gap = after;
            continue;
        }
        // The best set that has it.
        let Some(f) = found.sets.iter().find(|f| f.stated.set.iter().any(same)).filter(|_| left > 0) else {
            continue;
        };
        left -= 1;
        let complete = Complete { stated: f.stated.clone(), theta: f.theta.clone() };
        c.holdout_gap = search.replay(&complete, runs).ok().and_then(|r| gap_of(&r));
    }
}
