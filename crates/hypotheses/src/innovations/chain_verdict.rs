//! From evidences of a chain to a verdict, by the few numbers of [`levels`](super::levels).

use super::chain_effect::{ChainEffect, LatentLevels};
use super::chain_search::ChainFindings;
use super::law::DryFriction;
use super::levels::{CHAIN, CHAIN_RIGHT};
use super::shape::LawShape;
use super::verdict::{EvidenceJudgement, EvidenceVerdict, ReportedEffect, logistic, other_stiffness};

/// Decades that the fall of the latents' power counts within.
const FALLEN: [f64; 2] = [-1.0, 4.0];

fn reported(h: &ChainEffect) -> ReportedEffect {
    (h.id, h.place())
}

/// The largest fall of power from `a` to `b` among the latents that matter in `a`.
fn fall(a: &LatentLevels, b: &LatentLevels) -> f64 {
    let floored = |l: &LatentLevels| l.weighted().into_iter().map(|w| w.max(1.0)).collect::<Vec<_>>();
    let (x, y) = (floored(a), floored(b));
    if x.len() != y.len() {
        return 1.0 - b.power() / a.power();
    }
    let least = CHAIN.matters.max(CHAIN.matters_share * x.iter().copied().fold(0.0, f64::max));
    let big = x.iter().zip(&y).filter(|(x, _)| **x > least);
    big.map(|(x, y)| 1.0 - (y / x).powi(2)).reduce(f64::max).unwrap_or(0.0)
}

/// Joints with the factors by which their springs are stiffer, of a hypothesis that is other stiffnesses alone, no effect; a structure of
/// its own, which has no amplitudes, is none.
pub(super) fn other_stiffnesses(h: &ChainEffect) -> Option<Vec<(usize, f64)>> {
    if h.fit.amplitudes.is_empty() {
        return None;
    }
    let shapes: Vec<_> =
        h.form.as_ref().map_or_else(|| vec![&h.shape], |f| f.parts.iter().map(|p| &p.shape).collect());
    let each = h.fit.amplitudes.chunks((h.fit.amplitudes.len() / shapes.len().max(1)).max(1));
    let of = |(shape, a): (&&LawShape, &[f64])| Some((shape.joint(), other_stiffness(h.id, shape.form, a)?));
    shapes.iter().zip(each).map(of).collect()
}

/// The refit of the parameters: where other stiffnesses alone gain more they are it.
pub(super) fn refit(found: &ChainFindings) -> Option<&ChainEffect> {
    let stiffer = |h: &&ChainEffect| h.evidence > found.null.fit.evidence && other_stiffnesses(h).is_some();
    found.effects.iter().find(stiffer)
}

/// Judges what a search found.
pub fn judge_chain(found: &ChainFindings) -> EvidenceJudgement {
    let null = &found.null;
    let refit = refit(found);
    let parameters = refit.map_or(null.fit.evidence, |h| h.evidence);
    let (nominal, had) = (null.nominal, refit.map_or(&null.left, |h| &h.left));
    let effects: Vec<&ChainEffect> =
        found.effects.iter().filter(|h| other_stiffnesses(h).is_none()).collect();
    let quiet =
        |gain: f64| had.largest() < CHAIN.matters || gain < CHAIN.nothing && had.largest() < CHAIN.loud;
    let nothing =
        |total: f64| if total < CHAIN.quiet { EvidenceVerdict::NoGap } else { EvidenceVerdict::Parameters };
    let Some(h) = effects.first().copied() else {
        let calm = refit.is_none() || quiet(0.0);
        let verdict = if calm { nothing(parameters - nominal) } else { EvidenceVerdict::Unknown };
        return EvidenceJudgement {
            verdict,
            set: Vec::new(),
            probability: CHAIN.unnamed,
            second: None,
            gain: 0.0,
            margin: 0.0,
            numbers: Vec::new(),
        };
    };
    let gain = h.evidence - parameters;
    let rival = effects.iter().skip(1).find(|o| o.id != h.id).map_or(parameters - 10.0, |o| o.evidence);
    let margin = h.evidence - rival.max(parameters);
    let had = had.power();
    let share = if had > 2.0 { 1.0 - (h.left.power() - 1.0) / (had - 1.0) } else { 1.0 };
    let mut set = vec![reported(h)];
    let mut gain_of_second = 0.0;
    let mut left = h.left.power();
    let mut two = false;
    if let Some(p) = found.pairs.iter().find(|p| other_stiffnesses(&p.first).is_none()) {
        gain_of_second = p.evidence - h.evidence;
        let falls = fall(&h.left, &p.left).min(fall(&p.first.left, &p.left));
        let counts = falls > CHAIN.fall_of_second || p.left.largest() < CHAIN.matters;
        if gain_of_second > CHAIN.second.max(CHAIN.second_share * gain) && counts {
            set = p.named().to_vec();
            (two, left) = (true, p.left.power());
        }
    }
    let mut verdict = if gain < CHAIN.quiet {
        if quiet(gain) { nothing(parameters.max(h.evidence) - nominal) } else { EvidenceVerdict::Unknown }
    } else if share > CHAIN.share || two || h.left.largest() < CHAIN.explained {
        EvidenceVerdict::Effects
    } else {
        EvidenceVerdict::Unknown
    };
    if verdict == EvidenceVerdict::Effects && !two {
        let near = CHAIN.alike.max((CHAIN.alike_share * gain).min(CHAIN.alike_most));
        let rigid = |j: &usize| h.frame.plant.drives.len() > *j && !h.frame.plant.flexible(*j);
        if h.dry_friction() == Some(DryFriction::Plain) && h.joints().iter().all(rigid) {
            // One body where there is no spring.
            verdict = EvidenceVerdict::Ambiguous;
            set.push(("load-friction", "load".to_owned()));
        }
        let alike = |o: &&&ChainEffect| h.evidence - o.evidence < near && o.id != h.id;
        let rivals: Vec<ReportedEffect> =
            effects.iter().skip(1).filter(alike).take(2).map(|o| reported(o)).collect();
        if !rivals.is_empty() {
            verdict = EvidenceVerdict::Ambiguous;
            set.extend(rivals);
        }
    }
    if !matches!(verdict, EvidenceVerdict::Effects | EvidenceVerdict::Ambiguous) {
        set.clear();
    }
    let fallen = (had / left).log10().clamp(FALLEN[0], FALLEN[1]);
    let numbers = vec![("fall", fallen), ("share", share), ("gain of the second", gain_of_second)];
    let probability = if set.is_empty() { CHAIN.unnamed } else { logistic(CHAIN_RIGHT, &numbers) };
    let second = (!found.pairs.is_empty()).then_some(if two { probability } else { CHAIN.unnamed });
    EvidenceJudgement { verdict, set, probability, second, gain, margin, numbers }
}
