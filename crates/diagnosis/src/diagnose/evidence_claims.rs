//! What is reported of what the innovations found where no last fit follows: verdict, effects, parameters, under the names of the plant.

use std::collections::BTreeMap;

use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect};
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_models::effect::EffectChoice;
use trueup_signals::Case;

use super::innovations::{JudgedCase, with_compared};
use super::record::{DecisionRecord, RecordedCause, RecordedEstimate, RecordedSet, SCHEMA as RECORD};
use crate::engine::free::FreeRun;
use crate::outcome::*;

/// Why a value has no interval.
const NO_INTERVAL: &str = "by the innovations, without an interval";

/// A parameter of the plant as it was found.
pub(super) struct ComparedParameter {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// Its nominal value, where it is one of the plant.
    pub nominal: Option<f64>,
    /// Prior standard deviation of that, in its unit.
    pub deviation: Option<f64>,
    /// The relative one that the comparison took.
    pub share: f64,
}

/// Names of the engine as those of the plant that is reported on.
pub(super) trait EvidenceNames {
    /// A place, readings by the plant's names.
    fn place(&self, place: &str) -> String;
    /// The joint of a cause, from 1; `None`: it acts at none.
    fn joint(&self, cause: &FoundCause) -> Option<usize>;
    /// The effect at a place of the engine.
    fn choice(&self, id: &str, place: &str) -> Option<EffectChoice>;
    /// Name of a parameter of a cause, without the index of its joint.
    fn parameter_of(&self, _cause: &FoundCause, value: &str) -> String {
        value.to_owned()
    }
    /// Whether a value of a cause belongs to a parameter of the plant.
    fn is_of_plant(&self, cause: &FoundCause, value: &str) -> bool;
    /// Parameters of the plant with an effect, and what was estimated of its sensors.
    fn parameters(&self, found: &CaseFindings, effect: &FoundEffect) -> Vec<ComparedParameter>;
}

/// What is reported of a verdict.
pub(super) struct EvidenceClaims {
    pub verdict: Verdict,
    pub unknown: f64,
    pub effects: Vec<Claimed>,
    pub candidates: Vec<CandidateCause>,
    pub parameters: BTreeMap<String, ClaimedAmount>,
    pub components: Vec<ComponentShare>,
    pub indistinguishable: Vec<Vec<String>>,
    pub not_compared: Option<String>,
}

impl Default for EvidenceClaims {
    fn default() -> Self {
        Self {
            verdict: Verdict::Unknown,
            unknown: 1.0,
            effects: Vec::new(),
            candidates: Vec::new(),
            parameters: Default::default(),
            components: Vec::new(),
            indistinguishable: Vec::new(),
            not_compared: None,
        }
    }
}

impl EvidenceClaims {
    /// The same where nothing is claimed after all.
    pub(super) fn refused(self) -> Self {
        let candidates = self.candidates.into_iter();
        Self {
            verdict: Verdict::Unknown,
            unknown: self.unknown.max(0.5),
            candidates: candidates.map(|c| CandidateCause { probability: 0.0, ..c }).collect(),
            parameters: self.parameters,
            ..Self::default()
        }
    }
}

/// What the verdict names, as it was fitted.
pub(super) fn chosen(found: &CaseFindings) -> Option<&FoundEffect> {
    let judged = &found.judged;
    let together = judged.verdict == EvidenceVerdict::Effects && judged.set.len() > 1;
    if together {
        return found.pair.as_ref();
    }
    let first = judged.set.first()?;
    found.effects.iter().find(|h| h.key == *first)
}

/// What is reported of the findings.
pub(super) fn reported(names: &dyn EvidenceNames, found: &CaseFindings) -> EvidenceClaims {
    let judged = &found.judged;
    let verdict = Verdict::from(judged.verdict);
    let named = chosen(found);
    let ambiguous = verdict == Verdict::Ambiguous;
    let share = if ambiguous { 1.0 / judged.set.len().max(1) as f64 } else { 1.0 };
    let claimed = |c: &FoundCause| Claimed {
        id: c.id.to_owned(),
        component: names.place(&c.place),
        joint: names.joint(c),
        probability: share * judged.probability,
        parameters: {
            let own = c.values.iter().filter(|v| !names.is_of_plant(c, v.name));
            own.map(|v| amount(names, c, v.name, v.value)).collect()
        },
        closed_alone: None,
    };
    let claims: Vec<&FoundEffect> = if ambiguous {
        judged.set.iter().filter_map(|key| found.effects.iter().find(|h| h.key == *key)).collect()
    } else {
        named.into_iter().collect()
    };
    let effects: Vec<Claimed> = claims.iter().flat_map(|h| h.causes.iter().map(claimed)).collect();
    let candidate = |h: &FoundEffect, c: &FoundCause, probability: f64| CandidateCause {
        id: c.id.to_owned(),
        component: names.place(&c.place),
        joint: names.joint(c),
        probability,
        evidence: h.evidence - found.alone.evidence,
        holdout_gap: None,
    };
    let of = |probability: f64| move |h| (h, probability);
    let own = claims.iter().copied().map(of(share * judged.probability));
    let own = own.flat_map(|(h, p)| h.causes.iter().map(move |c| candidate(h, c, p))).collect();
    let compared = found
        .effects
        .iter()
        .chain(&found.pair)
        .flat_map(|h| h.causes.iter().map(move |c| candidate(h, c, 0.0)));
    let left = found.effects.first().map_or(1.0, |h| h.power / found.alone.power.max(f64::MIN_POSITIVE));
    let components = effects.iter().map(|e| ComponentShare {
        id: e.component.clone(),
        share: (1.0 - left).clamp(0.0, 1.0) / effects.len().max(1) as f64,
        joint: e.joint.filter(|_| !e.component.starts_with("sensor")),
    });
    let set: Vec<String> = effects.iter().map(|e| e.id.clone()).collect();
    let unknown = 1.0 - judged.probability;
    EvidenceClaims {
        verdict,
        unknown: if verdict == Verdict::Unknown { unknown.max(0.5) } else { unknown },
        components: components.collect(),
        candidates: with_compared(own, compared.collect()),
        parameters: match verdict {
            Verdict::NoGap => Default::default(),
            _ => parameters(names, found, named.unwrap_or(&found.alone)),
        },
        indistinguishable: if ambiguous && set.len() > 1 { vec![set] } else { Vec::new() },
        effects,
        not_compared: None,
    }
}

fn amount(names: &dyn EvidenceNames, c: &FoundCause, name: &str, value: f64) -> (String, ClaimedAmount) {
    let choice = names.choice(c.id, &c.place);
    let unit = choice.and_then(|choice| {
        let own = choice.parameters().iter().find(|p| p.name == name)?;
        Some(choice.unit(own.unit))
    });
    (names.parameter_of(c, name), without_interval(value, unit.unwrap_or("")))
}

fn without_interval(value: f64, unit: &str) -> ClaimedAmount {
    ClaimedAmount { value, unit: unit.to_owned(), reason: Some(NO_INTERVAL.to_owned()), ..Default::default() }
}

fn parameters(
    names: &dyn EvidenceNames,
    found: &CaseFindings,
    effect: &FoundEffect,
) -> BTreeMap<String, ClaimedAmount> {
    let one = |p: ComparedParameter| {
        let amount = without_interval(p.value, &p.unit);
        (p.name, ClaimedAmount { nominal: p.nominal, nominal_deviation: p.deviation, ..amount })
    };
    names.parameters(found, effect).into_iter().map(one).collect()
}

/// What the verdict was decided from.
pub(super) fn record(names: &dyn EvidenceNames, found: &CaseFindings, gap: &GapReport) -> DecisionRecord {
    let set = |h: &FoundEffect| {
        let cause = |c: &FoundCause| RecordedCause {
            id: c.id.into(),
            component: names.place(&c.place),
            joint: names.joint(c),
        };
        let estimate = |p: ComparedParameter| RecordedEstimate {
            name: p.name,
            value: p.value,
            unit: p.unit,
            deviation: p.share,
        };
        RecordedSet {
            causes: h.causes.iter().map(cause).collect(),
            posterior: names.parameters(found, h).into_iter().map(estimate).collect(),
            excess: None,
        }
    };
    let free = gap.overall.as_ref().map_or_else(FreeRun::default, |g| FreeRun {
        before: g.before,
        tuned: g.tuned,
        after: g.after,
        floor: g.floor,
        chance: g.floor,
    });
    let plain = set(&found.alone);
    DecisionRecord {
        schema: RECORD.into(),
        innovations: Some(JudgedCase::from(found)),
        raw_excess: None,
        free,
        best: chosen(found).map_or_else(|| set(&found.alone), &set),
        plain,
        sets: found.effects.iter().map(set).collect(),
    }
}

/// A diagnosis of what is claimed and of the gap.
pub(super) fn diagnosis(
    case: &Case,
    claimed: EvidenceClaims,
    gap: GapReport,
    capped: bool,
    notes: Vec<String>,
) -> Diagnosis {
    let location =
        GapLocation { channels: shares(&gap), components: claimed.components, ..Default::default() };
    let present = claimed.verdict == Verdict::Unknown;
    Diagnosis {
        schema: SCHEMA.into(),
        model: case.model.clone(),
        verdict: claimed.verdict,
        gap,
        sensors: SensorFindings::default(),
        location,
        effects: claimed.effects,
        candidates: claimed.candidates,
        parameters: claimed.parameters,
        correlation: None,
        budget: Vec::new(),
        pack: None,
        indistinguishable: claimed.indistinguishable,
        unknown: UnknownShare { present, probability: claimed.unknown, place: None },
        next_experiment: None,
        watch: None,
        augmented: None,
        capped,
        not_compared: claimed.not_compared,
        findings: Vec::new(),
        inputs: None,
        notes,
    }
}

/// Share of each channel in the excess over the floor.
fn shares(gap: &GapReport) -> Vec<ChannelShare> {
    let excess = |g: &HeldOutGap| (g.before.powi(2) - g.floor.powi(2)).max(0.0);
    let total: f64 = gap.channels.values().map(excess).sum();
    let share =
        |(name, g): (&String, &HeldOutGap)| ChannelShare { name: name.clone(), share: excess(g) / total };
    let mut all: Vec<ChannelShare> =
        if total > 0.0 { gap.channels.iter().map(share).collect() } else { Vec::new() };
    trueup_numerics::order::descending(&mut all, |c| c.share);
    all
}
