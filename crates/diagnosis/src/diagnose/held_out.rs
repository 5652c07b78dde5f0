//! Held-out gaps of candidates.

use crate::engine::hypothesis::Hypothesis;
use crate::engine::select::Found;
use crate::outcome::{Candidate, Verdict};

/// Fills in the gap on held-out recordings: of what is claimed that of the claim (`after`), of others that of the best set
/// with them that ran freely (`gaps`: set and gap).
pub(super) fn held_out(
    found: &Found,
    verdict: Verdict,
    after: Option<f64>,
    candidates: &mut [Candidate],
    gaps: &[(usize, f64)],
) {
    if verdict == Verdict::NoGap {
        return;
    }
    for c in candidates {
        let same = |h: &Hypothesis| h.id == c.id && h.component == c.component && c.joint == Some(h.site + 1);
        let claimed = matches!(verdict, Verdict::Effects | Verdict::Ambiguous);
        let ran = gaps.iter().filter(|(at, _)| found.sets[*at].stated.set.iter().any(same)).map(|g| g.1);
        c.holdout_gap = if claimed && found.best.stated.set.iter().any(same) {
            after
        } else {
            ran.min_by(f64::total_cmp)
        };
    }
}
