//! Runs of an arm replayed without effects, window by window.
//!
//! Under gravity a free run of an arm leaves its motion within a second or two, whatever is right or wrong in it. So a
//! run is replayed window by window, each from a state of its own that is refitted with the parameters.

use super::chain::JOINTS;
use super::channels::index_of;
use super::law::HeldLawEffect;
use super::named::HeldValue;
use super::plant::HeldArm;
use super::refit::LinearRefit;
use super::run::{HeldArmRun, at};
use super::scene::{HeldRecord, HeldScene, TRAIN, reading};
use super::values::{HeldArmState, HeldArmValues, RATE};
use crate::tune::{TuningBench, TuningPoint, tune};

/// Steps of replays of a rigid arm and of one with springs, s.
const COARSE: f64 = 5e-3;
const SPRUNG: f64 = 2e-3;
/// Length of a window, s, and how often it is read, Hz.
const WINDOW: f64 = 1.0;
const OFTEN: f64 = 50.0;

/// Where a refit begins.
struct RefitBegin {
    values: Vec<f64>,
    value_steps: Vec<f64>,
    initial: Vec<Vec<f64>>,
    initial_steps: Vec<f64>,
}

/// A stretch of a run.
pub(super) struct HeldWindow {
    run: usize,
    /// Its samples.
    from: usize,
    to: usize,
    start: HeldArmState,
}

pub(super) struct HeldReplays<'a> {
    base: HeldArmValues,
    free: Vec<HeldValue>,
    runs: &'a [HeldRecord],
    windows: Vec<HeldWindow>,
    pub(super) noise: Vec<Vec<[f64; JOINTS]>>,
    channels: &'a [usize],
    scale: Vec<f64>,
    every: usize,
}

impl<'a> HeldReplays<'a> {
    pub(super) fn new(
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
                if taken * all >= passed * scene.windows.min(all) {
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
    pub(super) fn measured(
        &self,
        scene: &HeldScene,
        truth: &HeldArmValues,
        effects: &[HeldLawEffect],
    ) -> Vec<Vec<f64>> {
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
    /// Where a refit begins: values with their steps, first states of the windows with theirs.
    fn begin(&self, truth: &HeldArmValues) -> RefitBegin {
        let values: Vec<f64> = self.free.iter().map(|v| v.get(&self.base)).collect();
        let value_steps = values.iter().map(|v| 1e-3 * v).collect();
        let states = self.free_state();
        // A joint that is assumed rigid begins where its motor is: that is read.
        let from = |i: usize| match i % RATE {
            j if j < JOINTS && !self.base.flexible[j] => i - j + truth.motor(j),
            _ => i,
        };
        let initial =
            self.windows.iter().map(|w| states.iter().map(|i| w.start[from(*i)]).collect()).collect();
        let initial_steps = states.iter().map(|i| if *i < RATE { 1e-5 } else { 2e-4 }).collect();
        RefitBegin { values, value_steps, initial, initial_steps }
    }
    /// What a refit leaves of these readings.
    pub(super) fn left(&self, truth: &HeldArmValues, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let b = self.begin(truth);
        tune(self, measured, &b.values, &b.value_steps, &b.initial, &b.initial_steps).residual
    }
    /// What these readings are off without a refit.
    pub(super) fn off(&self, truth: &HeldArmValues, measured: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let b = self.begin(truth);
        let of = |(w, y): (usize, &Vec<f64>)| {
            let shown = self.response(w, &(b.values.clone(), b.initial[w].clone()));
            y.iter().zip(shown).map(|(y, s)| y - s).collect()
        };
        measured.iter().enumerate().map(of).collect()
    }
    /// The slopes of a refit.
    pub(super) fn slopes(&self, truth: &HeldArmValues) -> LinearRefit {
        let b = self.begin(truth);
        let of = |w: usize| {
            let at = |values: &[f64], initial: &[f64]| self.response(w, &(values.to_vec(), initial.to_vec()));
            let middle = at(&b.values, &b.initial[w]);
            let against =
                |moved: Vec<f64>| -> Vec<f64> { moved.iter().zip(&middle).map(|(a, m)| a - m).collect() };
            let moved = |x: &[f64], steps: &[f64], i: usize| {
                let mut own = x.to_vec();
                own[i] += steps[i];
                own
            };
            let values = (0..b.values.len())
                .map(|i| against(at(&moved(&b.values, &b.value_steps, i), &b.initial[w])))
                .collect();
            let states = (0..b.initial_steps.len())
                .map(|i| against(at(&b.values, &moved(&b.initial[w], &b.initial_steps, i))))
                .collect();
            (values, states)
        };
        LinearRefit::new((0..self.windows.len()).map(of).collect(), &b.values, &b.value_steps)
    }
    pub(super) fn response(&self, window: usize, (values, initial): &TuningPoint) -> Vec<f64> {
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
