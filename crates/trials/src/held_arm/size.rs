//! What a refit leaves of an effect, and the size at which it leaves so much.
//!
//! Under gravity a free run of an arm leaves its motion within a second or two, whatever is right or wrong in it. So a
//! run is replayed window by window, each from a state of its own that is refitted with the parameters.

use super::chain::JOINTS;
use super::choice::HeldEffectDraw;
use super::law::HeldLawEffect;
use super::nominal::{HeldValue, free_values};
use super::plant::{HeldArm, HeldArmState, HeldArmValues, RATE};
use super::run::{HeldArmRun, at};
use super::scene::{HeldRecord, HeldScene, TRAIN, finite, index_of, reading};
use crate::draw::SeededDraw;
use crate::joint::short;
use crate::tune::{TuningBench, TuningPoint, tune};

/// Steps of replays of a rigid arm and of one with springs, s.
const COARSE: f64 = 5e-3;
const SPRUNG: f64 = 2e-3;
/// Length of a window, s, and how often it is read, Hz.
const WINDOW: f64 = 1.0;
const OFTEN: f64 = 50.0;
/// How many windows are replayed.
const WINDOWS: usize = 8;

/// A stretch of a run.
struct HeldWindow {
    run: usize,
    /// Its samples.
    from: usize,
    to: usize,
    start: HeldArmState,
}

struct HeldReplays<'a> {
    base: HeldArmValues,
    free: Vec<HeldValue>,
    runs: &'a [HeldRecord],
    windows: Vec<HeldWindow>,
    noise: Vec<Vec<[f64; JOINTS]>>,
    channels: &'a [usize],
    scale: Vec<f64>,
    every: usize,
}

impl<'a> HeldReplays<'a> {
    fn new(
        scene: &'a HeldScene,
        base: HeldArmValues,
        runs: &'a [HeldRecord],
        free: &[HeldValue],
        scale: Vec<f64>,
    ) -> Self {
        let length = (WINDOW * scene.rate).round() as usize;
        // Some of all windows, evenly.
        let all = runs.iter().take(TRAIN).map(|r| (r.time.len() - 1) / length).sum::<usize>();
        let (mut passed, mut taken) = (0, 0);
        let mut windows = Vec::new();
        for (run, r) in runs.iter().enumerate().take(TRAIN) {
            for from in (0..r.time.len().saturating_sub(length)).step_by(length) {
                passed += 1;
                if taken * all >= passed * WINDOWS {
                    continue;
                }
                taken += 1;
                let t = r.time[from];
                let start = std::array::from_fn(|i| at(&r.track, t, i));
                windows.push(HeldWindow { run, from, to: from + length, start });
            }
        }
        let every = ((scene.rate / OFTEN).round() as usize).max(1);
        Self {
            base,
            free: free.to_vec(),
            runs,
            windows,
            noise: Vec::new(),
            channels: &scene.channels,
            scale,
            every,
        }
    }
    fn instants(&self, w: &HeldWindow) -> impl Iterator<Item = f64> {
        self.runs[w.run].time[w.from..w.to].iter().step_by(self.every).copied()
    }
    fn measured(&self, scene: &HeldScene, truth: &HeldArmValues, effects: &[HeldLawEffect]) -> Vec<Vec<f64>> {
        let one = |w: &HeldWindow| {
            let track = &self.runs[w.run].track;
            let mut y = Vec::new();
            for (c, s) in self.channels.iter().zip(&self.scale) {
                y.extend(self.instants(w).map(|t| reading(truth, effects, track, t, *c, scene.span) / s));
            }
            y
        };
        self.windows.iter().map(one).collect()
    }
    /// Free coordinates of a start: those of the nominal structure, with their rates.
    fn free_state(&self) -> Vec<usize> {
        let mut list: Vec<usize> = (0..JOINTS).collect();
        list.extend((0..JOINTS).filter(|j| self.base.flexible[*j]).map(|j| JOINTS + j));
        let rates: Vec<usize> = list.iter().map(|i| i + RATE).collect();
        list.extend(rates);
        list
    }
    fn left(&self, truth: &HeldArmValues, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let values: Vec<f64> = self.free.iter().map(|v| v.get(&self.base)).collect();
        let steps: Vec<f64> = values.iter().map(|v| 1e-3 * v).collect();
        let states = self.free_state();
        // A joint that is assumed rigid begins where its motor is: that is read.
        let from = |i: usize| match i % RATE {
            j if j < JOINTS && !self.base.flexible[j] => i - j + truth.motor(j),
            _ => i,
        };
        let initial: Vec<Vec<f64>> =
            self.windows.iter().map(|w| states.iter().map(|i| w.start[from(*i)]).collect()).collect();
        let state_steps: Vec<f64> = states.iter().map(|i| if *i < RATE { 1e-5 } else { 2e-4 }).collect();
        tune(self, measured, &values, &steps, &initial, &state_steps).residual
    }
    fn response(&self, window: usize, (values, initial): &TuningPoint) -> Vec<f64> {
        let mut v = self.base;
        self.free.iter().zip(values).for_each(|(value, x)| value.set(&mut v, *x));
        let mut state = [0.0; 2 * RATE + 4];
        self.free_state().iter().zip(initial).for_each(|(i, x)| state[*i] = *x);
        let w = &self.windows[window];
        let (done, step) = (&self.runs[w.run], if v.flexible.contains(&true) { SPRUNG } else { COARSE });
        let mut r = HeldArmRun::new(HeldArm::new(v, Vec::new(), 1.0), done.time[w.from], state, step);
        for k in w.from..w.to - 1 {
            let mut u = done.torque[k];
            if let Some(noise) = self.noise.get(w.run) {
                (0..JOINTS).for_each(|j| u[j] += noise[k][j]);
            }
            r.hold(done.time[k + 1], u);
        }
        let mut y = Vec::new();
        for (c, s) in self.channels.iter().zip(&self.scale) {
            let index = index_of(&v, *c);
            y.extend(self.instants(w).map(|t| at(&r.track, t, index) / s));
        }
        y
    }
}

impl TuningBench for HeldReplays<'_> {
    fn responses(&self, run: usize, points: &[TuningPoint]) -> Vec<Vec<f64>> {
        points.iter().map(|p| self.response(run, p)).collect()
    }
}

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

/// What noise alone leaves per channel: the sensor's own, and that of the torques carried through the windows.
pub(super) fn floors(scene: &HeldScene, plain: &[HeldRecord], noise: [f64; JOINTS]) -> Vec<f64> {
    let mut d = SeededDraw::new("carried", scene.seeds, 0, 0);
    let values = &scene.arm.values;
    let own: Vec<f64> = scene.channels.iter().map(|c| scene.meter(*c).deviation()).collect();
    let mut bench = HeldReplays::new(scene, *values, plain, &free_values(values), own.clone());
    let measured = bench.measured(scene, values, &[]);
    let draw = |r: &HeldRecord, d: &mut SeededDraw| -> Vec<[f64; JOINTS]> {
        r.time.iter().map(|_| std::array::from_fn(|j| noise[j] * d.normal())).collect()
    };
    bench.noise = plain.iter().map(|r| draw(r, &mut d)).collect();
    let carried = by_channel(&bench.left(values, &measured), own.len());
    own.iter().zip(carried).map(|(s, c)| s * c.hypot(1.0)).collect()
}

/// An effect of a chosen size, what a refit leaves of it, and the first runs with it alone.
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
    floor: &[f64],
    target: f64,
) -> Option<SizedHeldEffect> {
    let wanted = (target * target - 1.0).sqrt();
    let which: Vec<usize> = (0..TRAIN).collect();
    let free = free_values(&base);
    let mut size = (c.least * c.most).sqrt();
    let mut best: Option<(f64, SizedHeldEffect)> = None;
    for _ in 0..6 {
        let effect = HeldLawEffect::new(c.law.clone(), short(size), c.joint);
        let one = std::slice::from_ref(&effect);
        let runs = s.runs(s.arm.values, one, &which);
        if !finite(&runs) {
            size = (0.3 * size).max(c.least);
            continue;
        }
        let reached = ratio(s, &s.arm.values, base, one, &runs, floor, &free);
        if !reached.is_finite() {
            return None;
        }
        let miss = (reached / target).ln().abs();
        if best.as_ref().is_none_or(|b| miss < b.0) {
            best = Some((miss, SizedHeldEffect { effect, ratio: reached, runs }));
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
