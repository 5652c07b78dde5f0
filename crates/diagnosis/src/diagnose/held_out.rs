//! Held-out gaps of candidates, and how much of the gap an effect closes alone.

use crate::engine::hypothesis::Hypothesis;
use crate::engine::result::SearchResult;
use crate::outcome::{CandidateCause, Claimed, HeldOutGap, Verdict};

/// Fills in the gap on held-out recordings of what is claimed (`after`).
pub(super) fn held_out(
    found: &SearchResult,
    verdict: Verdict,
    after: Option<f64>,
    candidates: &mut [CandidateCause],
) {
    if !matches!(verdict, Verdict::Effects | Verdict::Ambiguous) {
        return;
    }
    for c in candidates {
        let same = |h: &Hypothesis| h.is_named(&c.id, &c.component, c.joint);
        c.holdout_gap = after.filter(|_| found.best.stated.set.iter().any(same));
    }
}

impl Hypothesis {
    /// Whether this cause is the one that is reported under this id; without a joint, at any place.
    fn is_named(&self, id: &str, component: &str, joint: Option<usize>) -> bool {
        self.id == id && self.component == component && joint.is_none_or(|joint| joint == self.site + 1)
    }
}

/// Reports for an effect that is claimed alone that it closes what the claim closes; of several what their equation errors gave stays.
pub(super) fn closed_alone(found: &SearchResult, overall: &HeldOutGap, effects: &mut [Claimed]) {
    let over = overall.before - overall.floor;
    let [only] = &found.best.stated.set[..] else { return };
    for e in effects.iter_mut().filter(|e| over > 0.0 && only.is_named(&e.id, &e.component, e.joint)) {
        e.closed_alone = Some(((overall.before - overall.after) / over).clamp(0.0, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::made::{fitted, found};

    #[test]
    fn what_is_claimed_alone_closes_what_the_claim_closes() {
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
        let shares = |best: usize| {
            let sets = ["backlash", "cable-stiffness", "backlash cable-stiffness"];
            let sets = sets.iter().map(|set| fitted(set, 1.0, 10.0)).collect();
            let mut effects = [claimed("backlash"), claimed("cable-stiffness")];
            closed_alone(&found(sets, Some(best), 10.0), &overall, &mut effects);
            effects.map(|e| e.closed_alone.unwrap())
        };
        assert_eq!(shares(2), [0.3, 0.3], "two are claimed");
        assert_eq!(shares(0), [0.9, 0.3], "the claim closes what the gap gives");
    }
}
