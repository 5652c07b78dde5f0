//! A case with its result, and which parts of that are right.

use super::said::DiagnosisAnswer;
use crate::case::{Moved, TrialPlant, TrialSplit, TruthKey};

/// A case with its result.
pub(crate) struct Scored {
    pub(crate) key: TruthKey,
    pub(crate) said: DiagnosisAnswer,
}

impl Scored {
    pub(super) fn truth(&self) -> &str {
        self.key.effects.first().map_or("", String::as_str)
    }
    /// Its first claim, where the verdict is one.
    pub(super) fn first(&self) -> Option<&str> {
        let claims = self.said.verdict == "effects";
        self.said.effects.first().filter(|_| claims).map(|e| e.id.as_str())
    }
    pub(super) fn exact(&self) -> bool {
        self.first() == Some(self.truth())
    }
    pub(super) fn by_class(&self) -> bool {
        self.first().is_some_and(|id| self.said.class(id).contains(&self.truth()))
    }
    pub(super) fn ambiguous_with_truth(&self, most: usize) -> bool {
        let set = &self.said.effects;
        self.said.verdict == "ambiguous" && set.len() <= most && set.iter().any(|e| e.id == self.truth())
    }
    pub(super) fn claims(&self, id: &str) -> bool {
        let v = &self.said.verdict;
        (v == "effects" || v == "ambiguous")
            && self.said.effects.iter().any(|e| self.said.class(&e.id).contains(&id))
    }
    pub(super) fn located(&self) -> bool {
        let Some(component) = self.key.components.first() else { return false };
        let first = self.said.effects.first();
        let place = first
            .and_then(|e| e.component.clone())
            .or_else(|| self.said.places.components.first().map(|c| c.id.clone()));
        // Sensors of single elements are under the channel.
        let base = |c: &str| c.split('[').next().unwrap_or(c).to_owned();
        let joint = self.key.joints.first().copied().unwrap_or(0);
        let right = joint == 0
            || self.key.plant == TrialPlant::Joint
            || first.and_then(|e| e.joint).is_none_or(|j| j == joint);
        place.is_some_and(|p| base(&p) == base(component)) && right
    }
    /// Both effects of a pair, and no other.
    pub(super) fn both(&self) -> bool {
        self.key.effects.iter().all(|id| self.claims(id))
    }
    /// The answer is right, as the scorecard counts it.
    pub(crate) fn right(&self) -> bool {
        match self.key.split {
            TrialSplit::Single => self.by_class(),
            TrialSplit::Pairs => self.both() && self.said.effects.len() == 2,
            TrialSplit::Unidentifiable => self.ambiguous_with_truth(usize::MAX),
            TrialSplit::Rig => self.of_a_rig(),
            TrialSplit::None | TrialSplit::Parameters | TrialSplit::Outside => {
                self.said.verdict == self.key.verdict
            }
        }
    }
    /// Of a rig: what is off by its name; an effect first or in a small set.
    pub(super) fn of_a_rig(&self) -> bool {
        if self.key.effects.is_empty() {
            let verdict = self.said.verdict == self.key.verdict;
            return verdict && self.key.moved.iter().all(|(name, m)| self.moves(name, *m));
        }
        self.by_class() || self.ambiguous_with_truth(3)
    }
    /// A value that is off is reported under its name, within its interval or 10 % of it, and nearer to the true value than to the
    /// nominal one.
    pub(super) fn moves(&self, name: &str, m: Moved) -> bool {
        let Some(told) = self.said.parameters.get(name) else { return false };
        let Some(off) = told.value.map(|v| (v - m.to).abs()) else { return false };
        let covers = told
            .ci95
            .is_some_and(|[low, high]| low.is_some_and(|l| l <= m.to) && high.is_some_and(|h| h >= m.to));
        off < 0.5 * (m.to - m.from).abs() && (covers || off <= 0.1 * m.to.abs())
    }
    pub(super) fn gap_seen(&self) -> bool {
        matches!(self.said.verdict.as_str(), "effects" | "ambiguous" | "unknown")
    }
}
