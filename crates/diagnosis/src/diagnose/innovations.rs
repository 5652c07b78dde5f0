//! A whole diagnosis by the innovations (crate `hypotheses`): its hypotheses become sets, its judgement a decision.
//!
//! The engine decides. What is reported of its winner comes from a last fit that begins at the engine's own values.

use serde::Serialize;
use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect};
use trueup_hypotheses::innovations::law::LawValue;
use trueup_hypotheses::innovations::verdict::{EvidenceJudgement, EvidenceVerdict};
use trueup_models::effect::PlantKind;
use trueup_models::joint;
use trueup_numerics::order::descending;

use crate::engine::decide::{Decision, UNKNOWN_AT_MOST};
use crate::engine::hypothesis::{Hypothesis, Times, joint_of};
use crate::engine::problem::BalanceTarget;
use crate::engine::result::{SearchResult, fit_options, same};
use crate::engine::search::{CaseSearch, FittedSet};
use crate::outcome::{CandidateCause, Verdict};

/// Variable that is a joint's gear ratio.
const GEAR_RATIO: &str = joint::parameter::NAMES[joint::parameter::GEAR_RATIO].0;
/// Odds (natural logarithm) of what the engine distinguishes, at the most.
const DISTINCT: f64 = -10.0;

/// What the verdict was made from.
#[derive(Clone, Debug, Serialize)]
pub struct JudgedCase {
    /// Log evidence of the model alone, its parameters refitted, nats.
    pub alone: f64,
    /// The same of the best effect; `None`: there is none.
    pub leader: Option<f64>,
    /// Nats that the leader gains over the refitted parameters.
    pub gain: f64,
    /// Nats to the next other effect.
    pub margin: f64,
    /// Probability that the leader, or the pair, is right.
    pub probability: f64,
    /// Probability that the best second is right; `None`: there is none.
    pub second: Option<f64>,
    /// Numbers of the leader by name.
    pub numbers: Vec<(String, f64)>,
}

impl From<&CaseFindings> for JudgedCase {
    fn from(found: &CaseFindings) -> Self {
        let EvidenceJudgement { gain, margin, probability, second, .. } = found.judged;
        let numbers = found.judged.numbers.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect();
        let (alone, leader) = (found.alone.evidence, found.effects.first().map(|h| h.evidence));
        Self { alone, leader, gain, margin, probability, second, numbers }
    }
}

/// The engine's hypotheses as sets, and its judgement as a decision.
pub(super) struct EngineDecision {
    pub found: SearchResult,
    pub decision: Decision,
    /// The chosen set with the engine's own values, before the last fit.
    pub own: FittedSet,
    /// What was compared, each with its nats over the refitted parameters.
    pub compared: Vec<CandidateCause>,
}

/// Makes sets of what the engine found.
pub(super) struct DecisionBuilder<'a> {
    search: &'a CaseSearch<'a>,
    findings: &'a CaseFindings,
}

impl<'a> DecisionBuilder<'a> {
    /// For a case.
    pub(super) fn new(search: &'a CaseSearch<'a>, findings: &'a CaseFindings) -> Self {
        Self { search, findings }
    }

    /// Sets and decision.
    ///
    /// # Errors
    /// Which effect cannot be put into the model, or why that cannot be simulated.
    pub(super) fn build(&self) -> Result<EngineDecision, String> {
        let (judged, effects) = (&self.findings.judged, &self.findings.effects);
        let plain = self.set(&self.findings.alone)?;
        let named = |key: &(&str, String)| {
            effects.iter().find(|h| h.key == *key).ok_or_else(|| format!("{} has no fit", key.0))
        };
        let together = judged.verdict == EvidenceVerdict::Effects && judged.set.len() > 1;
        let chosen = match &judged.set[..] {
            [] => &self.findings.alone,
            [..] if together => self.findings.pair.as_ref().ok_or("the pair has no fit")?,
            [first, ..] => named(first)?,
        };
        let own = self.set(chosen)?;
        let best = self.fitted(&own);
        // What is not claimed is kept as the engine has it; what cannot be simulated is none.
        let mut sets: Vec<FittedSet> = Vec::new();
        for h in effects {
            let claimed = judged.set.contains(&h.key);
            let Ok(set) = self.set(h) else { continue };
            let set = if same(&set.stated.set, &best.stated.set) {
                best.clone()
            } else if claimed {
                self.fitted(&set)
            } else {
                set
            };
            if !sets.iter().any(|s| same(&s.stated.set, &set.stated.set)) {
                sets.push(set);
            }
        }
        if best.stated.set.len() > 1 {
            sets.push(best.clone());
        }
        let rivals: Vec<(usize, f64)> = if together {
            Vec::new()
        } else {
            let rival = |(at, s): (usize, &FittedSet)| {
                let other = best.replaced_in(s)?;
                Some((at, if self.is_named(other) { 0.0 } else { DISTINCT }))
            };
            let mut all: Vec<_> = sets.iter().enumerate().filter_map(rival).collect();
            all.sort_by(|a, b| b.1.total_cmp(&a.1));
            all
        };
        let decision = self.decision(best.stated.set.len(), rivals);
        let plain = self.fitted(&plain);
        let best = if best.stated.set.is_empty() { plain.clone() } else { best };
        let found = SearchResult { plain, sets, best };
        Ok(EngineDecision { found, decision, own, compared: self.compared() })
    }

    /// Each cause once, with the best evidence that it has: fitted ones first, then those of the screen, then pairs.
    fn compared(&self) -> Vec<CandidateCause> {
        let findings = self.findings;
        let plant = self.search.case.subject.plant;
        let mut all: Vec<CandidateCause> = Vec::new();
        for h in findings.effects.iter().chain(&findings.screened).chain(&findings.pair) {
            for cause in &h.causes {
                // What these recordings cannot have in the model has its place by itself.
                let joint = match self.hypotheses(cause).next() {
                    Some(h) => joint_of(h, plant),
                    None => Some(cause.joint + 1).filter(|_| !matches!(&*cause.place, "base" | "tip")),
                };
                let c = CandidateCause {
                    id: cause.id.to_owned(),
                    component: cause.place.clone(),
                    joint,
                    probability: 0.0,
                    evidence: h.evidence - findings.alone.evidence,
                    holdout_gap: None,
                };
                if !all.iter().any(|o| o.is_same(&c)) {
                    all.push(c);
                }
            }
        }
        all
    }

    fn decision(&self, causes: usize, rivals: Vec<(usize, f64)>) -> Decision {
        let judged = &self.findings.judged;
        let verdict = Verdict::from(judged.verdict);
        let power = |h: &FoundEffect| h.power.max(f64::MIN_POSITIVE);
        let left = self.findings.effects.first().map_or(1.0, |h| power(h) / power(&self.findings.alone));
        let taken = (1.0 - left).clamp(0.0, 1.0);
        let unknown = 1.0 - judged.probability;
        Decision {
            verdict,
            probability: vec![judged.probability; causes],
            rivals: vec![rivals; causes],
            explained: taken,
            unknown: match verdict {
                Verdict::NoGap | Verdict::Parameters => unknown.min(UNKNOWN_AT_MOST),
                Verdict::Unknown => unknown.max(0.5),
                Verdict::Effects | Verdict::Ambiguous => unknown,
            },
        }
    }

    /// Whether the verdict names an effect of which this is a cause.
    fn is_named(&self, cause: &Hypothesis) -> bool {
        let same = |c: &FoundCause| c.id == cause.id && c.place == cause.component;
        let named = |h: &&FoundEffect| self.findings.judged.set.contains(&h.key);
        self.findings.effects.iter().filter(named).any(|h| h.causes.iter().any(same))
    }

    /// A set with the engine's values.
    fn set(&self, found: &FoundEffect) -> Result<FittedSet, String> {
        let search = self.search;
        let causes: Result<Vec<Hypothesis>, String> = found.causes.iter().map(|c| self.cause(c)).collect();
        let mut stated = search.state(&causes?)?;
        // Which states the readings behind a gear are along the recordings: by the ratio that was found.
        let ratio = self.findings.names.iter().zip(&found.theta).find(|(name, _)| *name == GEAR_RATIO);
        if let (Some((_, ratio)), PlantKind::Joint) = (ratio, search.case.subject.plant) {
            stated.nominal[joint::parameter::GEAR_RATIO] = *ratio;
        }
        let start = |name: &str| stated.unknowns.iter().find(|u| u.name == name).map(|u| u.start);
        // Those of the plant first: an effect's word on the plant comes last.
        let own = self.findings.names.iter().zip(&found.theta);
        let mut values: Vec<(Option<usize>, String, f64)> =
            own.map(|(name, value)| (None, name.clone(), *value)).collect();
        values.extend(found.offsets.iter().map(|(name, run, value)| (Some(*run), name.clone(), *value)));
        for (cause, h) in found.causes.iter().zip(&stated.set) {
            let names = |name: &str| [h.here(&h.choice.variable(name)), h.here(name), name.to_owned()];
            let known = |name: &str| names(name).into_iter().find(|n| start(n).is_some());
            let value = |v: &LawValue| v.with_unit(|unit| known(unit).and_then(|n| start(&n)));
            let named = |v: &LawValue| known(v.name).map(|name| (v.recording, name, value(v)));
            values.extend(cause.values.iter().filter_map(named));
        }
        let mut start = search.compare(&stated).start();
        for (x, u) in start.iter_mut().zip(&stated.unknowns) {
            let mut all = values.iter().rev();
            let Some((.., value)) = all.find(|(run, name, _)| *run == u.run && *name == u.name) else {
                continue;
            };
            // What exceeds another is distinguished from it by the engine, too.
            let own = matches!(u.target, BalanceTarget::Parameter(_)) || u.target.is_of_sensor();
            let set = own || u.target.shifts();
            if set || matches!(u.target, BalanceTarget::Above { .. }) {
                *x = u.scale.coordinate(value.clamp(u.lower, u.upper));
            }
        }
        search
            .standing(stated, start)
            .ok_or_else(|| "the model with what was found cannot be simulated".into())
    }

    /// Fitted from there, where that gives more information.
    fn fitted(&self, own: &FittedSet) -> FittedSet {
        let fit = self.search.fit(own.stated.clone(), &own.theta, fit_options());
        fit.ok().filter(|f| f.evidence(1.0) >= own.evidence(1.0)).unwrap_or_else(|| own.clone())
    }

    fn cause(&self, of: &FoundCause) -> Result<Hypothesis, String> {
        let times = match of.impulses {
            _ if of.is_of_single_recordings() => Times::EachRun,
            0 | 1 => Times::Once,
            _ => Times::Several,
        };
        let found = self.hypotheses(of).find(|h| !(h.is_push() || h.begins()) || h.times == times);
        found.cloned().ok_or_else(|| format!("these recordings have no {} at {}", of.id, of.place))
    }

    /// The same cause among those of the case, however often it occurs.
    fn hypotheses(&self, of: &FoundCause) -> impl Iterator<Item = &Hypothesis> {
        let named = |h: &&Hypothesis| {
            let there = !h.per_joint || of.place.starts_with("sensor:") || h.site == of.joint;
            h.id == of.id && h.component == of.place && there
        };
        self.search.causes.iter().filter(named)
    }
}

/// Candidates of a diagnosis with their evidences, and what else was compared: likeliest first, those without a probability by
/// their evidence.
pub(super) fn with_compared(own: Vec<CandidateCause>, compared: Vec<CandidateCause>) -> Vec<CandidateCause> {
    let mut all = own;
    for c in &mut all {
        c.evidence = compared.iter().find(|o| o.is_same(c)).map_or(c.evidence, |o| o.evidence);
    }
    let known = all.len();
    for c in compared {
        if !all[..known].iter().any(|o| o.is_same(&c)) {
            all.push(c);
        }
    }
    descending(&mut all, |c| c.evidence);
    descending(&mut all, |c| c.probability);
    all
}

#[cfg(test)]
mod tests {
    use super::with_compared;
    use crate::outcome::CandidateCause;

    #[test]
    fn what_was_compared_is_listed_with_its_evidence_behind_what_is_claimed() {
        let candidate = |id: &str, joint, probability, evidence| CandidateCause {
            id: id.into(),
            component: "load".into(),
            joint: Some(joint),
            probability,
            evidence,
            holdout_gap: None,
        };
        // Of balances, which have another measure.
        let own =
            vec![candidate("a", 1, 0.9, -7e3), candidate("b", 1, 0.0, -8e3), candidate("c", 1, 0.0, -6e3)];
        let compared = vec![
            candidate("a", 1, 0.0, 500.0),
            candidate("b", 1, 0.0, 20.0),
            candidate("a", 2, 0.0, 90.0),
            candidate("d", 3, 0.0, 3.0),
        ];
        let all = with_compared(own, compared);
        let listed: Vec<_> = all.iter().map(|c| (&*c.id, c.joint, c.probability, c.evidence)).collect();
        assert_eq!(
            listed,
            [
                ("a", Some(1), 0.9, 500.0),
                ("a", Some(2), 0.0, 90.0),
                ("b", Some(1), 0.0, 20.0),
                ("d", Some(3), 0.0, 3.0),
                ("c", Some(1), 0.0, -6e3),
            ]
        );
    }
}
