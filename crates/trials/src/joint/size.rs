//! What a refit leaves of an effect, and the size at which it leaves so much.

use super::bench::{JointRecord, JointReplays, spread};
use super::choice::JointEffectDraw;
use super::drive::short;
use super::law::JointLawEffect;
use super::scene::{BelievedJoint, JointScene};
use super::values::JointValues;
use crate::draw::SeededDraw;

/// What noise of the current leaves in each channel after a refit.
pub(super) fn carried(
    scene: &JointScene,
    values: JointValues,
    plain: &[JointRecord],
    noise: f64,
) -> Vec<f64> {
    let mut d = SeededDraw::new("carried", scene.seeds, 0, 0);
    let mut bench = JointReplays::new(&scene.drive, values, scene.rigid, plain, true);
    bench.known.clone_from(&scene.known);
    bench.scale = scene.drive.channels.iter().map(|c| scene.drive.meters[*c].deviation()).collect();
    let measured = bench.measured(plain, &[], scene.span);
    for (_, current) in &mut bench.runs {
        current.iter_mut().for_each(|u| *u += noise * d.normal());
    }
    let left = bench.left(&measured, plain);
    by_channel(&left, scene.drive.channels.len()).iter().zip(&bench.scale).map(|(r, s)| r * s).collect()
}

/// Root mean square per channel over all runs.
pub(super) fn by_channel(left: &[Vec<f64>], channels: usize) -> Vec<f64> {
    (0..channels)
        .map(|c| {
            let (mut sum, mut count) = (0.0, 0);
            for r in left {
                let n = r.len() / channels;
                sum += r[c * n..(c + 1) * n].iter().map(|e| e * e).sum::<f64>();
                count += n;
            }
            (sum / count as f64).sqrt()
        })
        .collect()
}

/// Floor of each channel: its sensor and the current's noise carried.
pub(super) fn floors(scene: &JointScene, values: JointValues, plain: &[JointRecord], noise: f64) -> Vec<f64> {
    let carried = carried(scene, values, plain, noise);
    let own = scene.drive.channels.iter().map(|c| scene.drive.meters[*c].deviation());
    own.zip(&carried).map(|(a, b)| a.hypot(*b)).collect()
}

/// Gap over floor, both overall as a diagnosis gives them: root mean square over channels of their NRMSE.
pub(super) fn overall(left: &[f64], floor: &[f64], spread: &[f64]) -> f64 {
    let sum =
        |x: &dyn Fn(usize) -> f64| (0..spread.len()).map(|c| (x(c) / spread[c]).powi(2)).sum::<f64>().sqrt();
    sum(&|c| left[c].hypot(floor[c])) / sum(&|c| floor[c])
}

pub(super) fn left(
    scene: &JointScene,
    truth: JointValues,
    believed: &BelievedJoint,
    effects: &[JointLawEffect],
    runs: &[JointRecord],
    floor: &[f64],
) -> f64 {
    let base = if believed.frictionless { truth } else { believed.values };
    let mut bench = JointReplays::new(&scene.drive, base, believed.rigid, runs, true);
    bench.known.clone_from(&scene.known);
    bench.scale = floor.to_vec();
    let measured = bench.measured(runs, effects, scene.span);
    let residual = bench.left(&measured, runs);
    let rms: Vec<f64> =
        by_channel(&residual, floor.len()).iter().zip(&bench.scale).map(|(r, s)| r * s).collect();
    overall(&rms, floor, &spread(&scene.drive, runs))
}

/// An effect of a chosen size, what a refit leaves of it, and the first two runs with it alone.
pub(super) struct SizedJointEffect {
    pub(super) effect: JointLawEffect,
    pub(super) ratio: f64,
    pub(super) runs: Vec<JointRecord>,
}

/// The size at which a refit leaves `target` floors, as near as it gets.
pub(super) fn size(
    scene: &JointScene,
    truth: JointValues,
    believed: &BelievedJoint,
    c: &JointEffectDraw,
    floor: &[f64],
    target: f64,
) -> Option<SizedJointEffect> {
    let wanted = (target * target - 1.0).sqrt();
    let mut size = (c.least * c.most).sqrt().max(c.least);
    let mut best: Option<(f64, SizedJointEffect)> = None;
    for _ in 0..7 {
        let effect = JointLawEffect::new(c.law.clone(), short(size));
        let runs = scene.run(truth, std::slice::from_ref(&effect), &[0, 1]);
        if runs.iter().any(|r| r.track.state.iter().any(|x| !x[0].is_finite() || !x[2].is_finite())) {
            size = (size * 0.3).max(c.least);
            continue;
        }
        let ratio = left(scene, truth, believed, std::slice::from_ref(&effect), &runs, floor);
        if !ratio.is_finite() {
            return None;
        }
        let miss = (ratio / target).ln().abs();
        if best.as_ref().is_none_or(|b| miss < b.0) {
            best = Some((miss, SizedJointEffect { effect, ratio, runs }));
        }
        if miss < 0.25 || c.least == c.most {
            break;
        }
        let excess = (ratio * ratio - 1.0).max(1e-4).sqrt();
        let next = (size * (wanted / excess).clamp(0.06, 12.0).powf(0.85)).clamp(c.least, c.most);
        if (next / size).ln().abs() < 1e-3 {
            break;
        }
        size = next;
    }
    best.map(|(_, sized)| sized)
}
