//! What a refit leaves of an effect, and the size at which it leaves so much.

use super::chain::JOINTS;
use super::channels::index_of;
use super::choice::HeldEffectDraw;
use super::law::HeldLawEffect;
use super::named::{HeldValue, free_values};
use super::refit::LinearRefit;
use super::replay::HeldReplays;
use super::scene::{HeldRecord, HeldScene, TRAIN, finite};
use super::values::HeldArmValues;
use crate::draw::SeededDraw;
use crate::joint::short;

fn by_channel(left: &[Vec<f64>], channels: usize) -> Vec<f64> {
    (0..channels)
        .map(|c| {
            let part = left.iter().flat_map(|r| {
                let n = r.len() / channels;
                r[c * n..(c + 1) * n].iter()
            });
            let (sum, count) = part.fold((0.0, 0usize), |(s, n), e| (s + e * e, n + 1));
            (sum / count.max(1) as f64).sqrt()
        })
        .collect()
}

fn spread(scene: &HeldScene, values: &HeldArmValues, runs: &[HeldRecord]) -> Vec<f64> {
    let of = |c: &usize| {
        let i = index_of(values, *c);
        let y: Vec<f64> = runs.iter().flat_map(|r| r.track.iter().step_by(9).map(move |s| s.1[i])).collect();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / y.len() as f64).sqrt().max(1e-3)
    };
    scene.channels.iter().map(of).collect()
}

fn overall(left: &[f64], floor: &[f64], spread: &[f64]) -> f64 {
    let sum =
        |x: &dyn Fn(usize) -> f64| (0..spread.len()).map(|c| (x(c) / spread[c]).powi(2)).sum::<f64>().sqrt();
    sum(&|c| left[c].hypot(floor[c])) / sum(&|c| floor[c])
}

/// Gap over floor after `base` was refitted: the first states of its windows and these parameters.
pub(super) fn ratio(
    scene: &HeldScene,
    truth: &HeldArmValues,
    base: HeldArmValues,
    effects: &[HeldLawEffect],
    runs: &[HeldRecord],
    floor: &[f64],
    refit: &[HeldValue],
) -> f64 {
    let bench = HeldReplays::new(scene, base, runs, refit, floor.to_vec());
    let measured = bench.measured(scene, truth, effects);
    let left = bench.left(truth, &measured);
    let rms: Vec<f64> = by_channel(&left, floor.len()).iter().zip(floor).map(|(r, s)| r * s).collect();
    overall(&rms, floor, &spread(scene, truth, runs))
}

/// What sizes of effects are measured by: what noise alone leaves per channel, and the slopes of a refit along the runs
/// without effects, which are near those of a run with an effect.
pub(super) struct SizeGauge {
    pub(super) floor: Vec<f64>,
    slopes: LinearRefit,
    own: Vec<f64>,
}

/// Noise: the sensor's own, and that of the torques carried through the windows. `base`: the nominal structure.
pub(super) fn gauge(
    scene: &HeldScene,
    base: &HeldArmValues,
    plain: &[HeldRecord],
    noise: [f64; JOINTS],
) -> SizeGauge {
    let mut d = SeededDraw::new("carried", scene.seeds, 0, 0);
    let values = &scene.arm.values;
    let own: Vec<f64> = scene.channels.iter().map(|c| scene.meter(*c).deviation()).collect();
    let mut bench = HeldReplays::new(scene, *values, plain, &free_values(values), own.clone());
    let measured = bench.measured(scene, values, &[]);
    let slopes = bench.slopes(values);
    let draw = |r: &HeldRecord, d: &mut SeededDraw| -> Vec<[f64; JOINTS]> {
        r.time.iter().map(|_| std::array::from_fn(|j| noise[j] * d.normal())).collect()
    };
    bench.noise = plain.iter().map(|r| draw(r, &mut d)).collect();
    let carried = by_channel(&slopes.left(&bench.off(values, &measured)), own.len());
    let floor = own.iter().zip(carried).map(|(s, c)| s * c.hypot(1.0)).collect();
    let slopes = if base == values {
        slopes
    } else {
        HeldReplays::new(scene, *base, plain, &free_values(base), own.clone()).slopes(values)
    };
    SizeGauge { floor, slopes, own }
}

impl SizeGauge {
    /// Gap over floor after `base` was refitted, by the slopes.
    fn ratio(
        &self,
        scene: &HeldScene,
        base: HeldArmValues,
        effects: &[HeldLawEffect],
        runs: &[HeldRecord],
    ) -> f64 {
        let values = &scene.arm.values;
        let bench = HeldReplays::new(scene, base, runs, &free_values(&base), self.own.clone());
        let measured = bench.measured(scene, values, effects);
        let left = by_channel(&self.slopes.left(&bench.off(values, &measured)), self.own.len());
        let rms: Vec<f64> = left.iter().zip(&self.own).map(|(r, s)| r * s).collect();
        overall(&rms, &self.floor, &spread(scene, values, runs))
    }
}

/// An effect of a chosen size, what a refit leaves of it by the slopes, and the first runs with it alone.
pub(super) struct SizedHeldEffect {
    pub(super) effect: HeldLawEffect,
    pub(super) ratio: f64,
    pub(super) runs: Vec<HeldRecord>,
}

/// The size at which a refit leaves `target` floors, as near as it gets.
pub(super) fn size(
    s: &HeldScene,
    base: HeldArmValues,
    c: &HeldEffectDraw,
    gauge: &SizeGauge,
    target: f64,
) -> Option<SizedHeldEffect> {
    let wanted = (target * target - 1.0).sqrt();
    let which: Vec<usize> = (0..TRAIN).collect();
    let mut size = (c.least * c.most).sqrt();
    let mut best: Option<(f64, SizedHeldEffect)> = None;
    for _ in 0..7 {
        let effect = HeldLawEffect::new(c.law.clone(), short(size), c.joint);
        let one = std::slice::from_ref(&effect);
        let runs = s.runs(s.arm.values, one, &which);
        if !finite(&runs) {
            size = (0.3 * size).max(c.least);
            continue;
        }
        let reached = gauge.ratio(s, base, one, &runs);
        if !reached.is_finite() {
            return None;
        }
        let miss = (reached / target).ln().abs();
        if best.as_ref().is_none_or(|b| miss < b.0) {
            best = Some((miss, SizedHeldEffect { effect, ratio: reached, runs }));
        }
        let excess = (reached * reached - 1.0).max(1e-4).sqrt();
        let next = (size * (wanted / excess).clamp(0.05, 15.0).powf(0.9)).clamp(c.least, c.most);
        if miss < 0.25 || (next / size).ln().abs() < 1e-3 {
            break;
        }
        size = next;
    }
    best.map(|(_, sized)| sized)
}
