//! A whole diagnosis by the innovations engine (crate `hypotheses`): its hypotheses become sets, its judgement a decision.
//!
//! The engine decides. What is reported of its winner comes from a last fit that begins at the engine's own values.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect};
use trueup_hypotheses::innovations::law::LawValue;
use trueup_hypotheses::innovations::verdict::{EvidenceJudgement, EvidenceVerdict};

use crate::engine::decide::{Decision, Thresholds};
use crate::engine::hypothesis::{Hypothesis, HypothesisClaim, Times};
use crate::engine::problem::BalanceTarget;
use crate::engine::search::{CaseSearch, FittedSet};
use crate::engine::select::{SearchEffort, SearchResult, same};
use crate::json::number;
use crate::outcome::Verdict;

/// Odds (natural logarithm) of what the engine distinguishes, at the most.
const DISTINCT: f64 = -10.0;

/// What the innovations engine decided from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct JudgedCase {
    /// Nats that the leader gains over the refitted parameters.
    #[serde(deserialize_with = "number")]
    pub gain: f64,
    /// Nats to the next other effect.
    #[serde(deserialize_with = "number")]
    pub margin: f64,
    /// Probability that the leader, or the pair, is right.
    #[serde(deserialize_with = "number")]
    pub probability: f64,
    /// Probability that the best second is right; `None`: there is none.
    pub second: Option<f64>,
    /// Numbers of the leader by name.
    pub numbers: Vec<(String, f64)>,
}

impl From<&EvidenceJudgement> for JudgedCase {
    fn from(j: &EvidenceJudgement) -> Self {
        let EvidenceJudgement { gain, margin, probability, second, .. } = *j;
        let numbers = j.numbers.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect();
        Self { gain, margin, probability, second, numbers }
    }
}

/// The engine's hypotheses as sets, and its judgement as a decision.
pub(super) struct EngineDecision {
    pub found: SearchResult,
    pub decision: Decision,
    /// The chosen set with the engine's own values, before the last fit.
    pub own: FittedSet,
    /// Nats over the refitted parameters, by effect and place.
    pub evidence: BTreeMap<(String, String), f64>,
}

/// Makes sets of what the engine found.
pub(super) struct DecisionBuilder<'a> {
    search: &'a CaseSearch<'a>,
    findings: &'a CaseFindings,
    effort: SearchEffort,
}

impl<'a> DecisionBuilder<'a> {
    /// For a case.
    pub(super) fn new(search: &'a CaseSearch<'a>, findings: &'a CaseFindings, effort: SearchEffort) -> Self {
        Self { search, findings, effort }
    }

    /// Sets and decision.
    ///
    /// # Errors
    /// Which effect cannot be put into the model, or why that cannot be simulated.
    pub(super) fn build(&self, limits: &Thresholds) -> Result<EngineDecision, String> {
        let (judged, effects) = (&self.findings.judged, &self.findings.effects);
        let plain = self.set(&self.findings.alone)?;
        let named = |key: &(&str, String)| {
            effects.iter().find(|h| h.key == *key).ok_or_else(|| format!("{} has no fit", key.0))
        };
        let together = judged.verdict == EvidenceVerdict::Effects && judged.set.len() > 1;
        let own = match &judged.set[..] {
            [] => plain.clone(),
            [..] if together => self.set(self.findings.pair.as_ref().ok_or("the pair has no fit")?)?,
            [first, ..] => self.set(named(first)?)?,
        };
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
                sets.push(set.lean());
            }
        }
        if best.stated.set.len() > 1 {
            sets.push(best.clone().lean());
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
        let decision = self.decision(best.stated.set.len(), rivals, limits);
        let plain = self.fitted(&plain);
        let best = if best.stated.set.is_empty() { plain.clone() } else { best };
        let evidence = |h: &FoundEffect| {
            let gain = h.evidence - self.findings.alone.evidence;
            h.causes.iter().map(move |c| ((c.id.to_owned(), c.place.clone()), gain)).collect::<Vec<_>>()
        };
        // The best first, which keeps its own.
        let evidence = effects.iter().rev().flat_map(evidence).collect();
        Ok(EngineDecision { found: SearchResult { plain, sets, best }, decision, own, evidence })
    }

    fn decision(&self, causes: usize, rivals: Vec<(usize, f64)>, limits: &Thresholds) -> Decision {
        let judged = &self.findings.judged;
        let verdict = match judged.verdict {
            EvidenceVerdict::NoGap => Verdict::NoGap,
            EvidenceVerdict::Parameters => Verdict::Parameters,
            EvidenceVerdict::Effects => Verdict::Effects,
            EvidenceVerdict::Ambiguous => Verdict::Ambiguous,
            EvidenceVerdict::Unknown => Verdict::Unknown,
        };
        let power = |h: &FoundEffect| h.power.max(f64::MIN_POSITIVE);
        let left = self.findings.effects.first().map_or(1.0, |h| power(h) / power(&self.findings.alone));
        let taken = (1.0 - left).clamp(0.0, 1.0);
        let unknown = 1.0 - judged.probability;
        Decision {
            verdict,
            probability: vec![judged.probability; causes],
            rivals: vec![rivals; causes],
            explained: taken,
            closed: taken,
            unknown: match verdict {
                Verdict::NoGap | Verdict::Parameters => unknown.min(limits.gap.unknown_at_most),
                Verdict::Unknown => unknown.max(0.5),
                Verdict::Effects | Verdict::Ambiguous => unknown,
            },
            odds: limits.odds.apart,
            ..Decision::nothing()
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
        let stated = search.state(&causes?)?;
        let start = |name: &str| stated.unknowns.iter().find(|u| u.name == name).map(|u| u.start);
        // Those of the plant first: an effect's word on the plant comes last.
        let own = self.findings.names.iter().zip(&found.theta);
        let mut values: Vec<(Option<usize>, String, f64)> =
            own.map(|(name, value)| (None, name.clone(), *value)).collect();
        for (cause, h) in found.causes.iter().zip(&stated.set) {
            let HypothesisClaim::Effect(choice) = h.claim else { continue };
            let names = |name: &str| [h.here(&choice.variable(name)), h.here(name), name.to_owned()];
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
        let fit = self.search.fit(own.stated.clone(), &own.theta, self.effort.options());
        fit.ok().filter(|f| f.evidence(1.0) >= own.evidence(1.0)).unwrap_or_else(|| own.clone())
    }

    fn cause(&self, of: &FoundCause) -> Result<Hypothesis, String> {
        let times = match of.impulses {
            _ if of.is_of_single_recordings() => Times::EachRun,
            0 | 1 => Times::Once,
            _ => Times::Several,
        };
        let named = |h: &&Hypothesis| {
            let there = !h.per_joint || of.place.starts_with("sensor:") || h.site == of.joint;
            h.id == of.id && h.component == of.place && there && (!h.is_push() || h.times == times)
        };
        let found = self.search.causes.iter().filter(|h| h.is_effect()).find(named);
        found.cloned().ok_or_else(|| format!("these recordings have no {} at {}", of.id, of.place))
    }
}
