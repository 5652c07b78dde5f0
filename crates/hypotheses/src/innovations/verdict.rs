//! From evidences to a verdict: a few numbers and two logistic models of them ([`levels`]).

use trueup_estimation::innovations::intensity::power;

use super::hypothesis::FittedEffect;
use super::levels::{
    ALIKE, ALIKE_FIT, ALIKE_MOST, AUDIBLE, EQUAL_SLOPES, FALL, FLOOR, LOST, LogisticWeights, ODD, ONE_SHIFT,
    PARAMETERS, QUIET, RIGHT, SECOND, SMALL, WORTH,
};
use super::pairs::FittedPair;
use super::search::JointFindings;

/// The result for a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EvidenceVerdict {
    /// Nothing is missing.
    NoGap,
    /// Other parameters are enough.
    Parameters,
    /// These effects are missing.
    Effects,
    /// One of these effects is missing.
    Ambiguous,
    /// Something is missing that no effect explains.
    Unknown,
}

impl EvidenceVerdict {
    /// As reports have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoGap => "no-gap",
            Self::Parameters => "parameters",
            Self::Effects => "effects",
            Self::Ambiguous => "ambiguous",
            Self::Unknown => "unknown",
        }
    }
}

/// An effect with its place as it is reported.
pub type ReportedEffect = (&'static str, String);

/// A verdict with the numbers that it is made from.
#[derive(Clone, Debug)]
pub struct EvidenceJudgement {
    /// The verdict.
    pub verdict: EvidenceVerdict,
    /// Effects with their places: what is missing, or what it may be.
    pub set: Vec<ReportedEffect>,
    /// Probability that the leader, or the pair, is right.
    pub probability: f64,
    /// Probability that the best second is right; `None`: there is none.
    pub second: Option<f64>,
    /// Nats that the leader gains over the refitted parameters.
    pub gain: f64,
    /// Nats to the next other effect.
    pub margin: f64,
    /// Numbers of the leader, of an arm of the second too, by name.
    pub numbers: Vec<(&'static str, f64)>,
}

fn decades(x: f64) -> f64 {
    x.clamp(1.0, 1e5).log10()
}

fn largest(q: &[f64]) -> f64 {
    q.iter().copied().fold(0.0, f64::max)
}

pub(super) fn logistic(weights: LogisticWeights, numbers: &[(&'static str, f64)]) -> f64 {
    let value = |name: &str| {
        if name == "bias" { 1.0 } else { numbers.iter().find(|n| n.0 == name).map_or(0.0, |n| n.1) }
    };
    let sum: f64 = weights.iter().map(|(name, w)| w * value(name)).sum();
    1.0 / (1.0 + (-sum.clamp(-30.0, 30.0)).exp())
}

/// A nonlinear spring whose terms beyond its line are nothing next to it (of two slopes: that are equal) is another stiffness, no
/// effect. Returns by which factor it is another.
pub(super) fn other_stiffness(id: &str, form: &str, amplitudes: &[f64]) -> Option<f64> {
    let (line, bends) = amplitudes.split_last()?;
    let terms = match form {
        "slopes" => 1,
        "knees" => 2,
        "power" => 3,
        _ => return None,
    };
    let slope = 1.0 + line;
    let void = bends.iter().all(|a| a.abs() < EQUAL_SLOPES * slope.abs());
    (id == "nonlinear-stiffness" && bends.len() == terms && void).then_some(slope)
}

fn is_void(h: &FittedEffect) -> bool {
    other_stiffness(h.id, h.shape.form, &h.fit.amplitudes).is_some()
}

/// Whether two effects are friction of motor and load that are one body.
fn is_one_body(a: &FittedEffect, b: &FittedEffect) -> bool {
    let friction = |h: &FittedEffect| matches!(h.id, "motor-friction" | "load-friction");
    friction(a) && friction(b) && a.frame.borrow().plant.elements().is_empty()
}

/// Whether two effects are a late drive and a late reading of the only angle: one shift of time between command and reading.
fn is_one_shift(a: &FittedEffect, b: &FittedEffect, [gain, other]: [f64; 2]) -> bool {
    let late = |h: &FittedEffect| matches!(h.id, "actuator-lag" | "sensor-delay");
    late(a) && late(b) && other > ONE_SHIFT * gain && !a.frame.borrow().two_angles()
}

/// Effects that the recordings do not distinguish from a leader: the evidence is nearly the same, or the fit is whatever the width of the
/// priors, or both are one body or one shift of time.
fn rivals<'a>(leader: &FittedEffect, effects: &[&'a FittedEffect], gain: f64) -> Vec<&'a FittedEffect> {
    let share = if largest(&leader.fit.q) > AUDIBLE { ALIKE[1] * gain } else { 0.0 };
    let alike = |h: &&FittedEffect| {
        leader.evidence - h.evidence < ALIKE[0].max(share)
            || leader.penalised() - h.penalised() < ALIKE_FIT
            || is_one_body(leader, h)
            || is_one_shift(leader, h, [gain, gain - (leader.evidence - h.evidence)])
    };
    effects.iter().copied().filter(|h| h.id != leader.id).filter(alike).take(ALIKE_MOST - 1).collect()
}

/// Judges a search; `None` where it has no effect at all.
pub fn judge(findings: &JointFindings) -> Option<EvidenceJudgement> {
    judge_by(findings, RIGHT, SECOND)
}

/// [`judge`] with other weights: of a leader, and of a second next to it.
pub fn judge_by(
    findings: &JointFindings,
    right: LogisticWeights,
    of_second: LogisticWeights,
) -> Option<EvidenceJudgement> {
    let null = &findings.null;
    let mut effects: Vec<&FittedEffect> = findings.effects.iter().filter(|h| !is_void(h)).collect();
    if effects.is_empty() {
        effects.extend(findings.effects.last());
    }
    let leader = *effects.first()?;
    let start = power(&null.q);
    let gain = leader.evidence - null.evidence;
    let next = effects.iter().find(|h| h.id != leader.id);
    let next = next.map_or(null.evidence - 10.0, |h| h.evidence);
    let margin = leader.evidence - next.max(null.evidence);
    let fallen = if start > FLOOR { (start / leader.power()).log10() } else { 0.5 };
    let count = null.count.max(1) as f64;
    let numbers = vec![
        ("gain", decades(gain)),
        ("power", fallen.clamp(-1.0, 4.0)),
        ("margin", margin / gain.max(1.0)),
        ("left", largest(&leader.fit.q).log10()),
        ("rate", (gain.max(1.0) / count).log10()),
        ("had", largest(&null.q).log10()),
    ];
    let fall = |q: &[f64]| (start / power(q)).log10();
    let mut probability = logistic(right, &numbers);
    let small = if start > FLOOR { SMALL[0] } else { SMALL[1] };
    let rivals = rivals(leader, &effects, gain);
    // What an approximation leaves where nothing else is left has the form of one law; a slow force has that of several.
    let several = start <= FLOOR && !rivals.is_empty();
    if gain < small && fall(&leader.fit.q) < FALL[0] && !several {
        // Little is gained, and what is left stays as it was.
        probability = probability.min(0.3);
    }
    if largest(&leader.fit.q) > LOST {
        probability = 0.0;
    }
    let reported = |(id, place): (&'static str, &'static str)| (id, place.to_owned());
    let mut set = vec![reported(leader.key())];
    let chance = |p: &FittedPair| {
        let numbers = second_numbers(findings, leader, p, &effects)?;
        Some(logistic(of_second, &numbers))
    };
    let best = findings.pairs.iter().filter_map(|p| Some((chance(p)?, p)));
    let best = best.reduce(|a, b| if b.0 > a.0 { b } else { a });
    let mut second = None;
    if let Some((chance, pair)) = best {
        second = Some(chance);
        let takes_away = fall(&pair.fit.q) > FALL[1] && largest(&pair.fit.q) < LOST;
        if chance > 0.5 && (probability > 0.5 || takes_away) {
            set = [pair.first, pair.second].map(reported).to_vec();
            probability = probability.max(chance);
        }
    }
    let mut verdict = if probability > 0.5 && gain > QUIET {
        EvidenceVerdict::Effects
    } else if null.latents > WORTH || null.farthest > ODD {
        EvidenceVerdict::Unknown
    } else if null.evidence + null.unread.gain - null.nominal.0 < PARAMETERS {
        EvidenceVerdict::NoGap
    } else {
        EvidenceVerdict::Parameters
    };
    if verdict == EvidenceVerdict::Effects && set.len() == 1 && !rivals.is_empty() {
        verdict = EvidenceVerdict::Ambiguous;
        set.extend(rivals.iter().map(|h| reported(h.key())));
    }
    if !matches!(verdict, EvidenceVerdict::Effects | EvidenceVerdict::Ambiguous) {
        set.clear();
    }
    Some(EvidenceJudgement { verdict, set, probability, second, gain, margin, numbers })
}

/// Numbers of the second of a pair by name; `None` where its first is no effect.
fn second_numbers(
    findings: &JointFindings,
    leader: &FittedEffect,
    pair: &FittedPair,
    effects: &[&FittedEffect],
) -> Option<[(&'static str, f64); 5]> {
    let first = effects.iter().find(|h| h.key() == pair.first)?;
    let gain = pair.evidence - leader.evidence;
    Some([
        ("gain", decades(gain)),
        ("same", f64::from(u8::from(pair.first.1 == pair.second.1))),
        ("share", gain / (pair.evidence - findings.null.evidence).max(1.0)),
        ("power", (first.power() / power(&pair.fit.q)).log10().clamp(-1.0, 4.0)),
        ("left", largest(&pair.fit.q).log10()),
    ])
}
