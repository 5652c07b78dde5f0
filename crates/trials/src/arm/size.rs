//! What a refit leaves of an effect, and the size at which it leaves so much.

use super::choice::ArmEffectDraw;
use super::law::ArmLawEffect;
use super::plant::{ArmValues, COORDINATES, LINKS, TrialArm};
use super::run::{ArmRun, at};
use super::scene::{ArmRecord, ArmScene, finite, index_of, reading};
use crate::draw::SeededDraw;
use crate::joint::short;
use crate::tune::{TuningBench, TuningPoint, tune};

/// Step of replays, s.
const COARSE: f64 = 5e-3;

/// Which of [`FREE`] a refit moves: all, those that do not belong to the last link, none.
pub(super) const ALL: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7];
pub(super) const OTHERS: &[usize] = &[0, 1, 5, 6, 7];
pub(super) const NONE: &[usize] = &[];

/// Parameters that a refit may move.
pub(super) const FREE: [&str; 8] = [
    "baseMass",
    "baseInertia",
    "linkMass[3]",
    "linkInertia[3]",
    "linkCenterOfMass[3,1]",
    "motorInertia[1]",
    "jointStiffness[1]",
    "jointDamping[1]",
];

pub(super) fn get(v: &ArmValues, i: usize) -> f64 {
    match i {
        0 => v.base_mass,
        1 => v.base_inertia,
        2 => v.mass[2],
        3 => v.inertia[2],
        4 => v.center[2][0],
        5 => v.motor_inertia[0],
        6 => v.stiffness[0],
        _ => v.damping[0],
    }
}
pub(super) fn set(v: &mut ArmValues, i: usize, x: f64) {
    match i {
        0 => v.base_mass = x,
        1 => v.base_inertia = x,
        2 => v.mass[2] = x,
        3 => v.inertia[2] = x,
        4 => v.center[2][0] = x,
        5 => v.motor_inertia[0] = x,
        6 => v.stiffness[0] = x,
        _ => v.damping[0] = x,
    }
}

pub(super) struct ArmReplays<'a> {
    base: ArmValues,
    free: Vec<usize>,
    runs: &'a [ArmRecord],
    noise: Vec<Vec<[f64; LINKS]>>,
    channels: &'a [usize],
    scale: Vec<f64>,
    every: usize,
}

impl<'a> ArmReplays<'a> {
    fn new(
        scene: &'a ArmScene,
        base: ArmValues,
        runs: &'a [ArmRecord],
        refit: &[usize],
        scale: Vec<f64>,
    ) -> Self {
        let there = |i: &usize| get(&base, *i) != 0.0 && (base.flexible[0] || *i < 6);
        let free = refit.iter().copied().filter(there).collect();
        let every = (runs[0].time.len() / 250).max(1);
        Self { base, free, runs, noise: Vec::new(), channels: &scene.channels, scale, every }
    }
    fn measured(&self, scene: &ArmScene, truth: &ArmValues, effects: &[ArmLawEffect]) -> Vec<Vec<f64>> {
        let one = |r: &ArmRecord| {
            let mut y = Vec::new();
            for (c, s) in self.channels.iter().zip(&self.scale) {
                let times = r.time.iter().step_by(self.every);
                y.extend(times.map(|t| reading(truth, effects, &r.track, *t, *c, scene.span) / s));
            }
            y
        };
        self.runs.iter().map(one).collect()
    }
    /// Free coordinates of the start: those of the nominal structure, with their rates.
    fn free_state(&self) -> Vec<usize> {
        let mut list: Vec<usize> = (0..3 + LINKS).collect();
        list.extend((0..LINKS).filter(|j| self.base.flexible[*j]).map(|j| 3 + LINKS + j));
        let rates: Vec<usize> = list.iter().map(|i| i + COORDINATES).collect();
        list.extend(rates);
        list
    }
    fn left(&self, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let values: Vec<f64> = self.free.iter().map(|i| get(&self.base, *i)).collect();
        let steps: Vec<f64> = values.iter().map(|v| 1e-3 * v).collect();
        let states = self.free_state();
        let initial: Vec<Vec<f64>> =
            self.runs.iter().map(|r| states.iter().map(|i| r.start[*i]).collect()).collect();
        tune(self, measured, &values, &steps, &initial, &vec![1e-4; states.len()]).residual
    }
}

impl TuningBench for ArmReplays<'_> {
    fn responses(&self, run: usize, points: &[TuningPoint]) -> Vec<Vec<f64>> {
        points.iter().map(|p| self.response(run, p)).collect()
    }
}

impl ArmReplays<'_> {
    fn response(&self, run: usize, (values, initial): &TuningPoint) -> Vec<f64> {
        let mut v = self.base;
        self.free.iter().zip(values).for_each(|(i, x)| set(&mut v, *i, *x));
        let mut state = [0.0; 2 * COORDINATES + 2];
        self.free_state().iter().zip(initial).for_each(|(i, x)| state[*i] = *x);
        let done = &self.runs[run];
        let mut r = ArmRun::new(TrialArm::new(v, Vec::new(), 1.0), done.time[0], state, COARSE);
        for (k, pair) in done.time.windows(2).enumerate() {
            let mut u = done.torque[k];
            if let Some(noise) = self.noise.get(run) {
                (0..LINKS).for_each(|j| u[j] += noise[k][j]);
            }
            r.hold(pair[1], u);
        }
        let mut y = Vec::new();
        for (c, s) in self.channels.iter().zip(&self.scale) {
            let index = index_of(&v, *c);
            y.extend(done.time.iter().step_by(self.every).map(|t| at(&r.track, *t, index) / s));
        }
        y
    }
}

pub(super) fn by_channel(left: &[Vec<f64>], channels: usize) -> Vec<f64> {
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

pub(super) fn spread(scene: &ArmScene, values: &ArmValues, runs: &[ArmRecord]) -> Vec<f64> {
    let of = |c: &usize| {
        let i = index_of(values, *c);
        let y: Vec<f64> = runs.iter().flat_map(|r| r.track.iter().step_by(9).map(move |s| s.1[i])).collect();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / y.len() as f64).sqrt().max(1e-9)
    };
    scene.channels.iter().map(of).collect()
}

pub(super) fn overall(left: &[f64], floor: &[f64], spread: &[f64]) -> f64 {
    let sum =
        |x: &dyn Fn(usize) -> f64| (0..spread.len()).map(|c| (x(c) / spread[c]).powi(2)).sum::<f64>().sqrt();
    sum(&|c| left[c].hypot(floor[c])) / sum(&|c| floor[c])
}

/// Gap over floor after `base` was refitted: its first states and these parameters.
pub(super) fn ratio(
    scene: &ArmScene,
    truth: &ArmValues,
    base: ArmValues,
    effects: &[ArmLawEffect],
    runs: &[ArmRecord],
    floor: &[f64],
    refit: &[usize],
) -> f64 {
    let bench = ArmReplays::new(scene, base, runs, refit, floor.to_vec());
    let measured = bench.measured(scene, truth, effects);
    let rms: Vec<f64> =
        by_channel(&bench.left(&measured), floor.len()).iter().zip(floor).map(|(r, s)| r * s).collect();
    overall(&rms, floor, &spread(scene, truth, runs))
}

pub(super) fn floors(scene: &ArmScene, plain: &[ArmRecord], noise: [f64; LINKS]) -> Vec<f64> {
    let mut d = SeededDraw::new("carried", scene.seeds, 0, 0);
    let own: Vec<f64> = scene.channels.iter().map(|c| scene.meters[*c].deviation()).collect();
    let mut bench = ArmReplays::new(scene, scene.values, plain, ALL, own.clone());
    let measured = bench.measured(scene, &scene.values, &[]);
    let draw = |r: &ArmRecord, d: &mut SeededDraw| -> Vec<[f64; LINKS]> {
        r.time.iter().map(|_| std::array::from_fn(|j| noise[j] * d.normal())).collect()
    };
    bench.noise = plain.iter().map(|r| draw(r, &mut d)).collect();
    let carried = by_channel(&bench.left(&measured), own.len());
    own.iter().zip(carried).map(|(s, c)| s * c.hypot(1.0)).collect()
}

/// An effect of a chosen size, what a refit leaves of it, and the first two runs with it alone.
pub(super) struct SizedArmEffect {
    pub(super) effect: ArmLawEffect,
    pub(super) ratio: f64,
    pub(super) runs: Vec<ArmRecord>,
}

/// The size at which a refit leaves `target` floors, as near as it gets.
pub(super) fn size(
    s: &ArmScene,
    base: ArmValues,
    c: &ArmEffectDraw,
    floor: &[f64],
    target: f64,
) -> Option<SizedArmEffect> {
    let wanted = (target * target - 1.0).sqrt();
    let mut size = (c.least * c.most).sqrt();
    let mut best: Option<(f64, SizedArmEffect)> = None;
    for _ in 0..7 {
        let effect = ArmLawEffect { law: c.law.clone(), size: short(size), joint: c.joint };
        let one = std::slice::from_ref(&effect);
        let runs = s.runs(s.values, one, &[0, 1]);
        if !finite(&runs) {
            size = (0.3 * size).max(c.least);
            continue;
        }
        let reached = ratio(s, &s.values, base, one, &runs, floor, ALL);
        if !reached.is_finite() {
            return None;
        }
        let miss = (reached / target).ln().abs();
        if best.as_ref().is_none_or(|b| miss < b.0) {
            best = Some((miss, SizedArmEffect { effect, ratio: reached, runs }));
        }
        let excess = (reached * reached - 1.0).max(1e-4).sqrt();
        let next = (size * (wanted / excess).clamp(0.05, 15.0).powf(0.9)).clamp(c.least, c.most);
        if miss < 0.3 || (next / size).ln().abs() < 1e-3 {
            break;
        }
        size = next;
    }
    best.map(|(_, sized)| sized)
}
