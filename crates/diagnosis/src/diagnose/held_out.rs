//! Held-out gaps of candidates, and how much of the gap an effect closes alone.

use crate::engine::hypothesis::Hypothesis;
use crate::engine::select::SearchResult;
use crate::outcome::{CandidateCause, Claimed, HeldOutGap, Verdict};

/// Fills in the gap on held-out recordings: of what is claimed that of the claim (`after`), of others that of the best set
/// with them that ran freely (`gaps`: set and gap).
pub(super) fn held_out(
    found: &SearchResult,
    verdict: Verdict,
    after: Option<f64>,
    candidates: &mut [CandidateCause],
    gaps: &[(usize, f64)],
) {
    if verdict == Verdict::NoGap {
        return;
    }
    for c in candidates {
        let same = |h: &Hypothesis| h.is_named(&c.id, &c.component, c.joint);
        let claimed = matches!(verdict, Verdict::Effects | Verdict::Ambiguous);
        let ran = gaps.iter().filter(|(at, _)| found.sets[*at].stated.set.iter().any(same)).map(|g| g.1);
        c.holdout_gap = if claimed && found.best.stated.set.iter().any(same) {
            after
        } else {
            ran.min_by(f64::total_cmp)
        };
    }
}

impl Hypothesis {
    /// Whether this cause is the one that is reported under this id; without a joint, at any place.
    fn is_named(&self, id: &str, component: &str, joint: Option<usize>) -> bool {
        self.id == id && self.component == component && joint.is_none_or(|joint| joint == self.site + 1)
    }
}

/// Reports for each effect how much of the held-out gap it closes alone, where it ran freely alone; elsewhere what its balances
/// gave stays.
pub(super) fn closed_alone(
    found: &SearchResult,
    overall: &HeldOutGap,
    effects: &mut [Claimed],
    gaps: &[(usize, f64)],
) {
    let over = overall.before - overall.floor;
    if over <= 0.0 {
        return;
    }
    for e in effects {
        let alone = |set: &[Hypothesis]| matches!(set, [h] if h.is_named(&e.id, &e.component, e.joint));
        let ran = gaps.iter().filter(|(at, _)| alone(&found.sets[*at].stated.set)).map(|g| g.1);
        // The whole gap is reported for the claim itself.
        let claim = alone(&found.best.stated.set).then_some(overall.after);
        let Some(after) = claim.or_else(|| ran.min_by(f64::total_cmp)) else { continue };
        e.closed_alone = Some(((overall.before - after) / over).clamp(0.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::made::{fitted, found};

    #[test]
    fn what_ran_alone_closes_what_its_free_run_closes() {
        let overall = HeldOutGap {
            before: 11.0,
            tuned: 11.0,
            after: 2.0,
            floor: 1.0,
            closed: Some(0.9),
            ci95: None,
            ..Default::default()
        };
        let claimed = |id: &str| Claimed {
            id: id.into(),
            component: crate::engine::made::cause(id).component,
            joint: Some(1),
            probability: 0.9,
            parameters: Default::default(),
            closed_alone: Some(0.3),
        };
        let shares = |best: usize, gaps: &[(usize, f64)]| {
            let sets = ["backlash", "cable-stiffness", "backlash cable-stiffness"];
            let sets = sets.iter().map(|set| fitted(set, 1.0, 10.0)).collect();
            let mut effects = [claimed("backlash"), claimed("cable-stiffness")];
            closed_alone(&found(sets, Some(best), 10.0), &overall, &mut effects, gaps);
            effects.map(|e| e.closed_alone.unwrap())
        };
        assert_eq!(shares(2, &[(0, 6.0), (2, 2.0)]), [0.5, 0.3], "one ran alone, the other did not");
        assert_eq!(shares(2, &[(0, 12.0), (1, 0.5)]), [0.0, 1.0], "worse than nothing, better than noise");
        assert_eq!(shares(0, &[(0, 6.0)]), [0.9, 0.3], "the claim closes what the gap gives");
    }
}
