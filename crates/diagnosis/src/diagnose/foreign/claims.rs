//! What is reported of a joint of others: verdict, effects, parameters, under the names of its FMU.

use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect};
use trueup_hypotheses::innovations::foreign::{BREAKAWAY, ForcedPlant, ForeignJoint, JointFigures};
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_identification::fmu::FmuSubject;
use trueup_identification::model::NamedVariables;
use trueup_identification::run::IdentificationRun;
use trueup_models::effect::{EffectChoice, PlantKind};
use trueup_signals::Case;

use super::{ChannelVariable, ForeignClaims};
use crate::diagnose::innovations::{JudgedCase, with_compared};
use crate::diagnose::record::{DecisionRecord, RecordedCause, RecordedEstimate, RecordedSet, SCHEMA};
use crate::engine::free::FreeRun;
use crate::outcome::*;

/// Why a value has no interval.
const NO_INTERVAL: &str = "by the innovations, without an interval";

/// Names of the engine and those of the FMU.
#[derive(Debug)]
pub(super) struct ForeignNames<'a> {
    pub channels: &'a [ChannelVariable],
    pub joint: &'a ForeignJoint,
}

impl ForeignNames<'_> {
    /// The FMU's variable that is a channel of the engine.
    pub(super) fn variable(&self, channel: &str) -> Option<&str> {
        self.channels.iter().find(|c| c.0 == channel).map(|c| c.1.as_str())
    }
    /// A place, readings by the FMU's names.
    pub(super) fn place(&self, place: &str) -> String {
        let named = |channel: &str| self.variable(channel).unwrap_or(channel).to_owned();
        place.strip_prefix("sensor:").map_or_else(|| place.to_owned(), |c| format!("sensor:{}", named(c)))
    }
    /// A parameter, or what is estimated of a channel: `motorCurrent.gain`.
    fn parameter(&self, name: &str) -> String {
        let of_channel = name.rsplit_once('.').and_then(|(c, what)| Some((self.variable(c)?, what)));
        of_channel.map_or_else(|| name.to_owned(), |(c, what)| format!("{c}.{what}"))
    }
    /// The effect of this project at a place of the engine.
    pub(super) fn choice(&self, id: &str, place: &str) -> Option<EffectChoice> {
        let place = if place.starts_with("sensor:") { None } else { Some(place) };
        let is = |c: &EffectChoice| c.spec().id == id && place.is_none_or(|p| c.component() == p);
        EffectChoice::all(PlantKind::Joint).find(is)
    }
    /// Figures of the joint, and the level of its dry friction (N.m), with what was found.
    pub(super) fn figures(&self, effect: &FoundEffect) -> (JointFigures, f64) {
        let own = self.joint.parameters().len().min(effect.theta.len());
        let dry = self.joint.coordinates().first().and_then(|c| c.dry);
        let mut figures = self.joint.figures(&effect.theta[..own]);
        let mut level = dry.map_or(0.0, |k| effect.theta[k]);
        for v in effect.causes.iter().flat_map(|c| &c.values) {
            let at = match v.name {
                "stiffness" => &mut figures.stiffness,
                "damping" => &mut figures.damping,
                "coulombFriction" => &mut level,
                "viscousFriction" => &mut figures.viscous,
                _ => continue,
            };
            *at = v.value;
        }
        (figures, level)
    }
    /// Usual speed of its motor, rad/s.
    pub(super) fn usual_speed(&self, runs: &[IdentificationRun], n: f64) -> f64 {
        let angle = self.variable("motorAngle");
        let load = self.variable("loadAngle");
        let mut speeds = Vec::new();
        for c in runs.iter().flat_map(|r| &r.channels) {
            let turns = if Some(c.name.as_str()) == angle {
                1.0
            } else if Some(c.name.as_str()) == load {
                n
            } else {
                continue;
            };
            let ends = c.t.iter().zip(&c.y).step_by((c.t.len() / 200).max(1));
            let ends: Vec<_> = ends.collect();
            speeds.extend(ends.windows(2).map(|w| (turns * (w[1].1 - w[0].1) / (w[1].0 - w[0].0)).abs()));
        }
        speeds.retain(|v| v.is_finite());
        speeds.into_iter().fold(0.0, f64::max).max(f64::MIN_POSITIVE)
    }
    /// Values of the FMU's parameters that were found. Those that come with an effect take precedence.
    fn found(&self, found: &CaseFindings, effect: &FoundEffect) -> Vec<(String, f64)> {
        let mut all: Vec<(String, f64)> =
            found.names.iter().map(|n| self.parameter(n)).zip(effect.theta.iter().copied()).collect();
        // Where it breaks away follows what it slides with, as the engine has it.
        let motor = self.joint.coordinates().first();
        let level = motor.and_then(|c| Some(effect.theta.get(c.dry?)? * c.breakaway));
        if let (Some(level), Some((index, per_unit))) = (level, self.joint.counterpart(BREAKAWAY)) {
            all.push((self.joint.name_of(index).to_owned(), level / per_unit));
        }
        for (cause, v) in effect.causes.iter().flat_map(|c| c.values.iter().map(move |v| (c, v))) {
            let Some((name, per_unit)) = self.of_plant(cause, v.name) else { continue };
            all.iter_mut().filter(|a| a.0 == name).for_each(|a| a.1 = v.value / per_unit);
        }
        all
    }
    /// The FMU's parameter that a value of an effect belongs to, where it is one of the plant, with its factor.
    fn of_plant(&self, cause: &FoundCause, value: &str) -> Option<(&str, f64)> {
        let own = |c: &EffectChoice| c.parameters().iter().any(|p| p.name == value);
        let (index, per_unit) = self.joint.counterpart(value)?;
        let of_effect = self.choice(cause.id, &cause.place).is_some_and(|c| own(&c));
        (!of_effect).then(|| (self.joint.name_of(index), per_unit))
    }
    /// All parameters of the FMU with those that were found, as far as it accepts them.
    pub(super) fn values(
        &self,
        subject: &FmuSubject,
        nominal: &[f64],
        found: &CaseFindings,
        effect: &FoundEffect,
    ) -> Vec<f64> {
        let mut values = nominal.to_vec();
        for (name, value) in self.found(found, effect) {
            if let Some(k) = subject.parameter(&name) {
                let q = &subject.parameters()[k];
                values[k] = value.clamp(q.min, q.max);
            }
        }
        values
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
    let verdict = match judged.verdict {
        EvidenceVerdict::NoGap => Verdict::NoGap,
        EvidenceVerdict::Parameters => Verdict::Parameters,
        EvidenceVerdict::Effects => Verdict::Effects,
        EvidenceVerdict::Ambiguous => Verdict::Ambiguous,
        EvidenceVerdict::Unknown => Verdict::Unknown,
    };
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
) -> std::collections::BTreeMap<String, ClaimedAmount> {
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
pub(super) fn record(joint: &ForeignJoint, found: &CaseFindings, gap: &GapReport) -> DecisionRecord {
    let set = |h: &FoundEffect| {
        let cause =
            |c: &FoundCause| RecordedCause { id: c.id.into(), component: c.place.clone(), joint: None };
        let own = joint.parameters().iter().zip(&h.theta);
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
