//! A second effect for what the first leaves, in the first's own frame.

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::fixed_point::FixedPoint;
use trueup_estimation::innovations::frame::InnovationsFrame;

use super::candidate::{ScreenedShape, applied};
use super::hypothesis::{FittedEffect, cost};
use super::joint_along::{UsualSizes, along_joint};
use super::laws::LawRef;
use super::pushes::pursue;
use super::screen::{all_shapes, families, far_out, refine, sift};
use super::shape::LawShape;

/// Nats that a second has to gain in the screen, and in the fit before shapes are refined again.
const GAIN: f64 = 20.0;
/// Seconds elsewhere that are fitted.
const ELSEWHERE: usize = 2;

/// Two effects, fitted together.
#[derive(Clone)]
pub struct FittedPair {
    /// Effect and place of the first.
    pub first: (&'static str, &'static str),
    /// Effect and place of the second.
    pub second: (&'static str, &'static str),
    /// Its shape.
    pub shape: LawShape,
    /// Log evidence with the priors of both shapes, nats.
    pub evidence: f64,
    /// Where the fit ended.
    pub fit: FixedPoint,
    /// Amplitudes of the first, which come before those of the second.
    pub of_first: usize,
}

/// Accepted laws: amplitudes held loosely about what they are.
pub(super) fn held(laws: Vec<AppliedLaw>, amplitudes: &[f64]) -> Vec<AppliedLaw> {
    let mut at = amplitudes.iter();
    let hold = |mut law: AppliedLaw| {
        for (mean, deviation) in law.mean.iter_mut().zip(&mut law.deviation) {
            let a = at.next().copied().unwrap_or(*mean);
            *deviation = (0.3 * a.abs()).max(0.1 * *deviation);
            *mean = a;
        }
        law
    };
    laws.into_iter().map(hold).collect()
}

/// The trajectory of a fitted effect, its laws in force.
fn along_own(z: &mut InnovationsFrame, h: &FittedEffect, sizes: &UsualSizes) {
    z.reset(&h.fit.q);
    for _ in 0..2 {
        let laws = applied(&h.parts, z, sizes);
        z.put_in_force(&laws, &h.fit.amplitudes, &h.fit.zeros, &h.fit.q);
    }
}

/// What a search for second effects found.
#[derive(Default)]
pub struct SecondEffects {
    /// Both together.
    pub pairs: Vec<FittedPair>,
    /// Seconds without the first: where a second gains more than the first did, the first may only have been in its place.
    pub alone: Vec<FittedEffect>,
}

/// Everything else in addition to an effect. The effect itself is fitted once more from where the two came to, as it may have ended early.
/// `null` is the evidence without any effect.
pub fn beside(h: &mut FittedEffect, null: f64, sizes: &UsualSizes) -> SecondEffects {
    let shared = h.frame.clone();
    let z = &mut *shared.borrow_mut();
    let kept = std::mem::replace(&mut z.start, h.fit.theta.clone());
    let out = seconds(z, h, null, sizes);
    z.start = kept;
    out
}

fn seconds(z: &mut InnovationsFrame, h: &mut FittedEffect, null: f64, sizes: &UsualSizes) -> SecondEffects {
    let gained = h.evidence - null;
    along_own(z, h, sizes);
    let standing = held(applied(&h.parts, z, sizes), &h.fit.amplitudes);
    let mut all = all_shapes(z, sizes);
    all.retain(|c| c.law.id() != h.id);
    let alone = sift(z, &mut all, &h.fit.q, &standing);
    let (mut found, _) = families(&all);
    for far in far_out(z, &found, &h.fit.q, &standing) {
        found.iter_mut().filter(|c| c.key() == far.key()).for_each(|c| c.clone_from(&far));
    }
    for place in ["load", "actuator"] {
        if !h.is_impulses() && place != h.place {
            found.extend(pursue(z, sizes, &h.fit.q, place, &standing));
        }
    }
    found.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    // What else is in the same place is mostly the law's form; the verdict requires more of it.
    let (same, elsewhere): (Vec<_>, Vec<_>) = found.into_iter().partition(|c| c.shape.place == h.place);
    let best = elsewhere.first().map_or(f64::NEG_INFINITY, |c| c.evidence);
    let same = same.into_iter().take(1).filter(|c| c.evidence > best);
    let chosen: Vec<ScreenedShape> = elsewhere.into_iter().take(ELSEWHERE).chain(same).collect();
    let mut out = SecondEffects::default();
    for c in chosen {
        if c.evidence < alone + GAIN {
            continue;
        }
        along_own(z, h, sizes);
        let Some(mut second) = c.again(z, sizes) else { continue };
        if !second.law.is_impulses() {
            second = refine(z, second, sizes, &standing, 2);
        }
        let before = h.of_fit;
        let pair = together(z, h, &second, sizes);
        if h.is_plain() && pair.fit.evidence - before > gained.max(GAIN) {
            out.alone.push(without_first(z, h, &pair, second.law, sizes));
        }
        out.pairs.push(pair);
    }
    out
}

fn together(
    z: &mut InnovationsFrame,
    h: &mut FittedEffect,
    second: &ScreenedShape,
    sizes: &UsualSizes,
) -> FittedPair {
    let of_first = h.fit.amplitudes.len();
    let mut parts = h.parts.clone();
    parts.push((second.law, second.shape.clone()));
    let mut fit = z.fit(&|f| applied(&parts, f, sizes), &second.intensities, 8, false);
    if fit.evidence - h.of_fit > GAIN && h.is_plain() {
        let refined = both_again(z, &parts, &fit, sizes);
        let more = z.fit(&|f| applied(&refined, f, sizes), &fit.q, 3, false);
        if more.evidence > fit.evidence {
            (fit, parts) = (more, refined);
        }
    }
    if fit.evidence - h.of_fit > GAIN {
        let alone = from_both(z, &h.parts, &fit, &fit.amplitudes[..of_first], sizes);
        if alone.evidence > h.of_fit + 1.0 {
            h.evidence += alone.evidence - h.of_fit;
            h.of_fit = alone.evidence;
            h.fit = alone;
        }
    }
    let shape = parts.pop().map_or_else(|| second.shape.clone(), |part| part.1);
    let evidence = fit.evidence - (h.of_fit - h.evidence) - cost(&shape);
    FittedPair { first: h.key(), second: second.key(), shape, evidence, fit, of_first }
}

/// One of two effects alone, fitted from where both came to.
fn from_both(
    z: &mut InnovationsFrame,
    parts: &[(LawRef, LawShape)],
    both: &FixedPoint,
    amplitudes: &[f64],
    sizes: &UsualSizes,
) -> FixedPoint {
    z.take_unknowns(&both.theta);
    let laws = applied(parts, z, sizes);
    z.put_in_force(&laws, amplitudes, &both.zeros, &both.q);
    z.fit(&|f| applied(parts, f, sizes), &both.q, 5, false)
}

/// The second of a pair, of this law and with its shape there, as an effect of its own.
fn without_first(
    z: &mut InnovationsFrame,
    h: &FittedEffect,
    pair: &FittedPair,
    law: LawRef,
    sizes: &UsualSizes,
) -> FittedEffect {
    let parts = [(law, pair.shape.clone())];
    let fit = from_both(z, &parts, &pair.fit, &pair.fit.amplitudes[pair.of_first..], sizes);
    let [(law, shape)] = parts;
    FittedEffect::of_law(&h.frame, law, shape, fit)
}

/// Both shapes once more, each next to the other.
fn both_again(
    z: &mut InnovationsFrame,
    parts: &[(LawRef, LawShape)],
    fit: &FixedPoint,
    sizes: &UsualSizes,
) -> Vec<(LawRef, LawShape)> {
    let mut parts = parts.to_vec();
    let first = fit.laws.first().map_or(0, |l| l.columns.len());
    let (a, b) = fit.amplitudes.split_at(first);
    for (own, other, amplitudes) in [(0, 1, b), (1, 0, a)] {
        let (law, shape) = parts[own].clone();
        if law.is_impulses() {
            continue;
        }
        let standing = held(applied(&parts[other..=other], z, sizes), amplitudes);
        let made = ScreenedShape::new(law, &along_joint(z, sizes), shape);
        if let Some(mut c) = made {
            c.intensities.clone_from(&fit.q);
            parts[own].1 = refine(z, c, sizes, &standing, 2).shape;
        }
    }
    parts
}
