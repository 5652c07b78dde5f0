//! From evidences of a chain to a verdict, by the few numbers of [`levels`](super::levels).

use super::chain_effect::{ChainEffect, LatentLevels};
use super::chain_search::ChainFindings;
use super::law::DryFriction;
use super::levels::{CHAIN, CHAIN_RIGHT};
use super::verdict::{EvidenceJudgement, EvidenceVerdict, ReportedEffect, logistic};

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

/// Judges what a search found.
pub fn judge_chain(found: &ChainFindings) -> EvidenceJudgement {
    let null = &found.null;
    let (nominal, parameters) = (null.nominal, null.fit.evidence);
    let nothing =
        |total: f64| if total < CHAIN.quiet { EvidenceVerdict::NoGap } else { EvidenceVerdict::Parameters };
    let Some(h) = found.effects.first() else {
        let verdict = nothing(parameters - nominal);
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
    let rival = found.effects.iter().skip(1).find(|o| o.id != h.id).map_or(parameters - 10.0, |o| o.evidence);
    let margin = h.evidence - rival.max(parameters);
    let had = null.left.power();
    let share = if had > 2.0 { 1.0 - (h.left.power() - 1.0) / (had - 1.0) } else { 1.0 };
    let mut set = vec![reported(h)];
    let mut gain_of_second = 0.0;
    let mut left = h.left.power();
    let mut two = false;
    if let Some(p) = found.pairs.first() {
        gain_of_second = p.evidence - h.evidence;
        let falls = fall(&h.left, &p.left).min(fall(&p.first.left, &p.left));
        let counts = falls > CHAIN.fall_of_second || p.left.largest() < CHAIN.matters;
        if gain_of_second > CHAIN.second.max(CHAIN.second_share * gain) && counts {
            set = p.named().to_vec();
            (two, left) = (true, p.left.power());
        }
    }
    let mut verdict = if gain < CHAIN.quiet {
        let largest = null.left.largest();
        let calm = largest < CHAIN.matters || gain < CHAIN.nothing && largest < CHAIN.loud;
        if calm { nothing(parameters.max(h.evidence) - nominal) } else { EvidenceVerdict::Unknown }
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
        let alike = |o: &&ChainEffect| h.evidence - o.evidence < near && o.id != h.id;
        let rivals: Vec<ReportedEffect> =
            found.effects.iter().skip(1).filter(alike).take(2).map(reported).collect();
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
