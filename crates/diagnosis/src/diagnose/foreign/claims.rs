//! What is reported of a joint of others: verdict, effects, parameters, under the names of its FMU.

use std::collections::BTreeMap;

use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect};
use trueup_hypotheses::innovations::foreign::ForcedPlant;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_signals::Case;

use super::names::ForeignNames;
use crate::diagnose::innovations::{JudgedCase, with_compared};
use crate::diagnose::record::{DecisionRecord, RecordedCause, RecordedEstimate, RecordedSet, SCHEMA};
use crate::engine::free::FreeRun;
use crate::outcome::*;

/// Why a value has no interval.
const NO_INTERVAL: &str = "by the innovations, without an interval";

/// What is reported of a verdict.
pub(super) struct ForeignClaims {
    pub verdict: Verdict,
    pub unknown: f64,
    pub effects: Vec<Claimed>,
    pub candidates: Vec<CandidateCause>,
    pub parameters: BTreeMap<String, ClaimedAmount>,
    pub components: Vec<ComponentShare>,
    pub indistinguishable: Vec<Vec<String>>,
    pub not_compared: Option<String>,
}

impl Default for ForeignClaims {
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
pub(super) fn reported(names: &ForeignNames<'_>, case: &Case, found: &CaseFindings) -> ForeignClaims {
    let judged = &found.judged;
    let verdict = Verdict::from(judged.verdict);
    let named = chosen(found);
    let ambiguous = verdict == Verdict::Ambiguous;
    let share = if ambiguous { 1.0 / judged.set.len().max(1) as f64 } else { 1.0 };
    let claimed = |c: &FoundCause| Claimed {
        id: c.id.to_owned(),
        component: names.place(&c.place),
        joint: Some(1),
        probability: share * judged.probability,
        parameters: {
            let own = c.values.iter().filter(|v| names.of_plant(c, v.name).is_none());
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
        joint: Some(1),
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
        joint: None,
    });
    let set: Vec<String> = effects.iter().map(|e| e.id.clone()).collect();
    let unknown = 1.0 - judged.probability;
    ForeignClaims {
        verdict,
        unknown: if verdict == Verdict::Unknown { unknown.max(0.5) } else { unknown },
        components: components.collect(),
        candidates: with_compared(own, compared.collect()),
        parameters: match verdict {
            Verdict::NoGap => Default::default(),
            _ => parameters(names, case, found, named.unwrap_or(&found.alone)),
        },
        indistinguishable: if ambiguous && set.len() > 1 { vec![set] } else { Vec::new() },
        effects,
        not_compared: None,
    }
}

fn amount(names: &ForeignNames<'_>, c: &FoundCause, name: &str, value: f64) -> (String, ClaimedAmount) {
    let choice = names.choice(c.id, &c.place);
    let unit = choice.and_then(|choice| {
        let own = choice.parameters().iter().find(|p| p.name == name)?;
        Some(choice.unit(own.unit))
    });
    (name.to_owned(), without_interval(value, unit.unwrap_or("")))
}

fn without_interval(value: f64, unit: &str) -> ClaimedAmount {
    ClaimedAmount { value, unit: unit.to_owned(), reason: Some(NO_INTERVAL.to_owned()), ..Default::default() }
}

fn parameters(
    names: &ForeignNames<'_>,
    case: &Case,
    found: &CaseFindings,
    effect: &FoundEffect,
) -> BTreeMap<String, ClaimedAmount> {
    let own = names.joint.parameters();
    let one = |(name, value): (String, f64)| {
        let known = own.iter().find(|p| p.name == name);
        let amount = without_interval(value, known.map_or("", |p| p.unit));
        let amount = ClaimedAmount {
            nominal: known.map(|p| p.value),
            nominal_deviation: known.and_then(|p| Some(case.doubt(p.name)? * p.value.abs())),
            ..amount
        };
        (name, amount)
    };
    names.found(found, effect).into_iter().map(one).collect()
}

/// What the verdict was decided from.
pub(super) fn record(names: &ForeignNames<'_>, found: &CaseFindings, gap: &GapReport) -> DecisionRecord {
    let set = |h: &FoundEffect| {
        let cause =
            |c: &FoundCause| RecordedCause { id: c.id.into(), component: names.place(&c.place), joint: None };
        let own = names.joint.parameters().iter().zip(&h.theta);
        let estimate = |(p, value): (&trueup_hypotheses::innovations::foreign::BelievedParameter, &f64)| {
            RecordedEstimate {
                name: p.name.into(),
                value: *value,
                unit: p.unit.into(),
                deviation: p.deviation,
            }
        };
        RecordedSet {
            causes: h.causes.iter().map(cause).collect(),
            posterior: own.map(estimate).collect(),
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
        schema: SCHEMA.into(),
        innovations: Some(JudgedCase::from(found)),
        raw_excess: None,
        free,
        best: chosen(found).map_or_else(|| set(&found.alone), &set),
        plain,
        sets: found.effects.iter().map(set).collect(),
    }
}
