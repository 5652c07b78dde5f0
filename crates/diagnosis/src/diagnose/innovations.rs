//! A whole diagnosis of a joint by the innovations engine (crate `hypotheses`): its hypotheses become sets, its judgement a decision.
//!
//! The engine decides. What is reported of its winner comes from a last fit that begins at the engine's own values.

mod values;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use trueup_estimation::innovations::intensity::power;
use trueup_hypotheses::innovations::hypothesis::{FittedEffect, SharedFrame};
use trueup_hypotheses::innovations::pairs::FittedPair;
use trueup_hypotheses::innovations::search::JointFindings;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_hypotheses::innovations::verdict::{JointJudgement, JointVerdict};
use trueup_models::effect::PUSHES;

use crate::engine::decide::{Decision, Thresholds};
use crate::engine::hypothesis::{Hypothesis, HypothesisClaim, Times};
use crate::engine::problem::BalanceTarget;
use crate::engine::search::{CaseSearch, FittedSet};
use crate::engine::select::{SearchEffort, SearchResult, same};
use crate::json::number;
use crate::outcome::Verdict;
use values::{ColumnFit, ColumnUnits};

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

impl From<&JointJudgement> for JudgedCase {
    fn from(j: &JointJudgement) -> Self {
        let JointJudgement { gain, margin, probability, second, .. } = *j;
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

/// An effect of the engine's with the numbers that it takes in a set.
struct EffectPart<'a> {
    /// Effect and place.
    key: (&'static str, &'static str),
    /// In which it was fitted.
    frame: &'a SharedFrame,
    shape: &'a LawShape,
    amplitudes: &'a [f64],
}

impl<'a> EffectPart<'a> {
    fn alone(effect: &'a FittedEffect) -> Self {
        let FittedEffect { shape, fit, frame, .. } = effect;
        Self { key: effect.key(), frame, shape, amplitudes: &fit.amplitudes }
    }
}

/// Makes sets of what the engine found.
pub(super) struct DecisionBuilder<'a> {
    search: &'a CaseSearch<'a>,
    findings: &'a JointFindings,
    effort: SearchEffort,
}

impl<'a> DecisionBuilder<'a> {
    /// For a case.
    pub(super) fn new(search: &'a CaseSearch<'a>, findings: &'a JointFindings, effort: SearchEffort) -> Self {
        Self { search, findings, effort }
    }

    /// Sets and decision.
    ///
    /// # Errors
    /// Which effect cannot be put into the model, or why that cannot be simulated.
    pub(super) fn build(
        &self,
        judged: &JointJudgement,
        limits: &Thresholds,
    ) -> Result<EngineDecision, String> {
        let plain = self.set(&[], &self.findings.null.theta)?;
        let effects = &self.findings.effects;
        let of = |key: &(&str, &str)| {
            effects.iter().find(|h| h.key() == *key).ok_or_else(|| format!("{} has no fit", key.0))
        };
        let pair = judged.verdict == JointVerdict::Effects && judged.set.len() > 1;
        let own = match &judged.set[..] {
            [] => plain.clone(),
            [first, second] if pair => {
                let both = |p: &&FittedPair| [p.first, p.second] == [*first, *second];
                let p = self.findings.pairs.iter().find(both).ok_or("the pair has no fit")?;
                let (a, b) = p.fit.amplitudes.split_at(p.of_first.min(p.fit.amplitudes.len()));
                let first = EffectPart { amplitudes: a, ..EffectPart::alone(of(first)?) };
                let second = EffectPart { key: *second, shape: &p.shape, amplitudes: b, ..first };
                let parts = [first, second];
                self.set(&parts, &p.fit.theta)?
            }
            [first, ..] => self.single(of(first)?)?,
        };
        let best = self.fitted(&own);
        // What is not claimed is kept as the engine has it; what cannot be simulated is none.
        let mut sets: Vec<FittedSet> = Vec::new();
        for h in effects {
            let claimed = judged.set.contains(&h.key());
            let Ok(set) = self.single(h) else { continue };
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
        let rivals: Vec<(usize, f64)> = if best.stated.set.len() == 1 {
            let rival = |(at, s): (usize, &FittedSet)| {
                let h = &s.stated.set[0];
                let other = s.stated.set.len() == 1 && *h != best.stated.set[0];
                let alike = judged.set.iter().any(|key| *key == (&*h.id, &*h.component));
                other.then_some((at, if alike { 0.0 } else { DISTINCT }))
            };
            let mut all: Vec<_> = sets.iter().enumerate().filter_map(rival).collect();
            all.sort_by(|a, b| b.1.total_cmp(&a.1));
            all
        } else {
            Vec::new()
        };
        let decision = self.decision(judged, best.stated.set.len(), rivals, limits);
        let plain = self.fitted(&plain);
        let best = if best.stated.set.is_empty() { plain.clone() } else { best };
        let evidence = |h: &FittedEffect| {
            ((h.id.to_owned(), h.place.to_owned()), h.evidence - self.findings.null.evidence)
        };
        let evidence = effects.iter().map(evidence).collect();
        Ok(EngineDecision { found: SearchResult { plain, sets, best }, decision, own, evidence })
    }

    fn decision(
        &self,
        judged: &JointJudgement,
        causes: usize,
        rivals: Vec<(usize, f64)>,
        limits: &Thresholds,
    ) -> Decision {
        let verdict = match judged.verdict {
            JointVerdict::NoGap => Verdict::NoGap,
            JointVerdict::Parameters => Verdict::Parameters,
            JointVerdict::Effects => Verdict::Effects,
            JointVerdict::Ambiguous => Verdict::Ambiguous,
            JointVerdict::Unknown => Verdict::Unknown,
        };
        let power = |q: &[f64]| power(q).max(f64::MIN_POSITIVE);
        let left =
            self.findings.effects.first().map_or(1.0, |h| power(&h.fit.q) / power(&self.findings.null.q));
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

    fn single(&self, effect: &FittedEffect) -> Result<FittedSet, String> {
        self.set(&[EffectPart::alone(effect)], &effect.fit.theta)
    }

    /// A set with the engine's values.
    fn set(&self, parts: &[EffectPart<'_>], theta: &[f64]) -> Result<FittedSet, String> {
        let search = self.search;
        let causes: Result<Vec<Hypothesis>, String> = parts.iter().map(|p| self.cause(p)).collect();
        let stated = search.state(&causes?)?;
        let mut values: Vec<(String, f64)> = Vec::new();
        for (name, value) in self.findings.null.names.iter().zip(theta) {
            values.push(((*name).to_owned(), *value));
        }
        for (part, h) in parts.iter().zip(&stated.set) {
            let HypothesisClaim::Effect(choice) = h.claim else { continue };
            let frame = part.frame.borrow();
            let units = ColumnUnits::of(&frame, &self.findings.null.sizes);
            let fit = ColumnFit { id: part.key.0, shape: part.shape, amplitudes: part.amplitudes, theta };
            let start = |name: &str| {
                let name = choice.variable(name);
                stated.unknowns.iter().find(|u| u.stem() == name).map(|u| u.start)
            };
            let own = choice.parameters();
            values.extend(fit.values(&units, start).into_iter().map(|(name, value)| {
                let is_own = own.iter().any(|s| s.name == name);
                (if is_own { choice.variable(name) } else { name.to_owned() }, value)
            }));
        }
        let mut start = search.compare(&stated).start();
        for (x, u) in start.iter_mut().zip(&stated.unknowns).filter(|(_, u)| u.run.is_none()) {
            // An effect's word on the plant comes last.
            let Some((_, value)) = values.iter().rev().find(|(name, _)| name == u.stem()) else { continue };
            // What exceeds another is distinguished from it by the engine, too.
            let set = matches!(u.target, BalanceTarget::Parameter(_)) || u.target.shifts();
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

    fn cause(&self, part: &EffectPart<'_>) -> Result<Hypothesis, String> {
        let (id, place) = part.key;
        let several = part.shape.pulses.len().min(PUSHES) > 1;
        let times = if several { Times::Several } else { Times::Once };
        let named = |h: &&Hypothesis| {
            h.id == id && h.component == place && (!h.is_push() || h.times == times) && h.is_effect()
        };
        let found = self.search.causes.iter().find(named);
        found.cloned().ok_or_else(|| format!("these recordings have no {id} at {place}"))
    }
}
