//! The runs of a case: the arm, how it moves, when it is read and with what.

use super::chain::JOINTS;
use super::channels::{CHANNELS, index_of};
use super::choice::HeldScales;
use super::drive::{DrawnArm, draw};
use super::law::{HeldLaw, HeldLawEffect};
use super::plant::HeldArm;
use super::reference::ArmCourse;
use super::run::{HeldArmRun, at};
use super::values::{HeldArmState, HeldArmValues, RATE};
use crate::draw::SeededDraw;
use crate::sense::{self, Meter};

/// Step of the truth, s: of a rigid arm, and where springs, bristles or teeth act.
const FINE: f64 = 1e-3;
const FINEST: f64 = 5e-4;
/// Windows of all runs that a refit replays where nothing happens at one time alone.
const WINDOWS: usize = 8;
/// Recordings for fitting.
pub(super) const TRAIN: usize = 2;

/// One recorded run, free of noise.
#[derive(Clone, Debug)]
pub(super) struct HeldRecord {
    pub(super) time: Vec<f64>,
    pub(super) torque: Vec<[f64; JOINTS]>,
    pub(super) track: Vec<(f64, HeldArmState)>,
}

/// What of a scene is not as it is drawn.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeldSceneOrder {
    /// Whether joints have springs.
    pub(super) springs: Option<bool>,
    /// Only this joint moves and is read.
    pub(super) alone: Option<usize>,
}

pub(super) struct HeldScene {
    pub(super) arm: DrawnArm,
    pub(super) courses: Vec<ArmCourse>,
    pub(super) times: Vec<Vec<f64>>,
    pub(super) starts: Vec<[f64; JOINTS]>,
    pub(super) channels: Vec<usize>,
    /// By the kind of a channel: motorAngle, jointAngle, motorVelocity.
    pub(super) meters: [Meter; 3],
    pub(super) rate: f64,
    pub(super) drop: f64,
    pub(super) seeds: u64,
    pub(super) span: f64,
    /// How many windows of its runs a refit replays, at the most.
    pub(super) windows: usize,
}

pub(super) fn reading(
    values: &HeldArmValues,
    effects: &[HeldLawEffect],
    track: &[(f64, HeldArmState)],
    t: f64,
    c: usize,
    span: f64,
) -> f64 {
    let mut late = 0.0;
    for e in effects {
        match &e.law {
            HeldLaw::Late { channel } if *channel == c => late += e.size,
            HeldLaw::Stutter { channel, holds } if *channel == c => {
                late += holds.iter().find(|(a, b)| t > *a && t < *b).map_or(0.0, |(a, _)| t - a);
            }
            _ => {}
        }
    }
    let mut y = at(track, t - late, index_of(values, c));
    for e in effects {
        match e.law {
            HeldLaw::Eccentric { channel, phase } if channel == c => {
                let q = phase - y;
                y += (e.size * q.sin()).atan2(1.0 + e.size * q.cos());
            }
            HeldLaw::Creep { channel, bend } if channel == c => {
                let s = (t / span).clamp(0.0, 1.0);
                y += e.size * if bend > 0.0 { ((s - bend) / (1.0 - bend)).max(0.0) } else { s };
            }
            _ => {}
        }
    }
    y
}

/// Step of the truth with these effects.
pub(super) fn fine(values: &HeldArmValues, effects: &[HeldLawEffect]) -> f64 {
    let short = effects.iter().any(|e| {
        matches!(
            e.law,
            HeldLaw::Presliding { .. }
                | HeldLaw::Ripple { .. }
                | HeldLaw::GearError { .. }
                | HeldLaw::LoadSlip { .. }
        )
    });
    if short || values.flexible.contains(&true) { FINEST } else { FINE }
}

impl HeldScene {
    /// Run `i` under PD control of every motor with the weight that its values give.
    pub(super) fn run(&self, values: HeldArmValues, effects: &[HeldLawEffect], i: usize) -> HeldRecord {
        let mut d = SeededDraw::new("encoders", self.seeds, i, 0);
        let (time, course) = (&self.times[i], &self.courses[i]);
        let arm = HeldArm::new(values, effects.to_vec(), self.span);
        let start = values.at_rest(&self.starts[i]);
        let m = values.chain.mass_matrix(&values.chain.motion(&self.arm.posture, &[0.0; JOINTS]));
        let inertia: [f64; JOINTS] = std::array::from_fn(|j| m[j][j] + values.chain.rotor[j]);
        let bandwidth = (self.rate / 10.0).min(if values.flexible.contains(&true) { 8.0 } else { 12.0 });
        let mut run = HeldArmRun::new(arm, time[0], start, fine(&values, effects));
        let mut torques = Vec::with_capacity(time.len());
        for (k, t) in time.iter().enumerate() {
            let read = |d: &mut SeededDraw, x: f64, noise: f64| x + noise * d.normal();
            let (mut q, mut v) = ([0.0; JOINTS], [0.0; JOINTS]);
            for j in 0..JOINTS {
                q[j] = read(&mut d, run.state[values.motor(j)], 1e-5);
                v[j] = read(&mut d, run.state[RATE + values.motor(j)], 5e-4);
            }
            let weight = values.chain.weight(&q);
            let u = std::array::from_fn(|j| {
                let (wanted, rate) = course.at(j, *t);
                let sag = if values.flexible[j] { weight[j] / values.stiffness[j] } else { 0.0 };
                let (error, slow) = (wanted + sag - q[j], rate - v[j]);
                let torque = inertia[j] * bandwidth * (bandwidth * error + 1.8 * slow) + weight[j];
                (torque.clamp(-400.0, 400.0) * 1e5).round() / 1e5
            });
            torques.push(u);
            if let Some(next) = time.get(k + 1) {
                run.hold(*next, u);
            }
        }
        HeldRecord { time: time.clone(), torque: torques, track: run.track }
    }
    pub(super) fn runs(
        &self,
        values: HeldArmValues,
        effects: &[HeldLawEffect],
        which: &[usize],
    ) -> Vec<HeldRecord> {
        which.iter().map(|i| self.run(values, effects, *i)).collect()
    }
    pub(super) fn meter(&self, c: usize) -> Meter {
        self.meters[c / JOINTS]
    }
}

pub(super) fn scene(d: &mut SeededDraw, seed: u64, index: usize, order: HeldSceneOrder) -> HeldScene {
    let arm = draw(d, order.springs);
    let rate = d.pick(&[100.0, 125.0, 200.0, 200.0, 250.0]);
    let count = (d.uniform(6.0, 10.0) * rate) as usize + 1;
    let jitter = if d.chance(0.2) { 0.03 } else { 0.0 };
    let holdouts = if d.chance(0.3) { 2 } else { 1 };
    let (mut courses, mut times, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..TRAIN + holdouts {
        let t = sense::instants(rate, count, jitter, d);
        let center = std::array::from_fn(|j| arm.posture[j] + d.uniform(-0.25, 0.25));
        let speed = std::array::from_fn(|_| d.uniform(0.5, 1.6));
        let course = ArmCourse::draw(d, center, &speed, t[t.len() - 1], order.alone);
        starts.push(std::array::from_fn(|j| course.at(j, t[0]).0 + 0.01 * d.uniform(-1.0, 1.0)));
        courses.push(course);
        times.push(t);
    }
    let step = std::f64::consts::TAU / f64::from(1u32 << (15 + d.below(4)));
    let angle = Meter { noise: step * d.uniform(0.3, 0.9), step, color: 0.0 };
    let step = std::f64::consts::TAU / f64::from(1u32 << (16 + d.below(3)));
    let link = Meter { noise: step * d.uniform(0.3, 0.9), step, color: 0.0 };
    let speed = Meter { noise: d.log(5e-4, 4e-3), step: 0.0, color: 0.0 };
    let mut channels: Vec<usize> = match order.alone {
        Some(j) => vec![j],
        None => (0..JOINTS).collect(),
    };
    if order.alone.is_none() {
        channels.extend((0..JOINTS).filter(|j| arm.values.flexible[*j]).map(|j| JOINTS + j));
        if d.chance(0.2) {
            channels.extend(2 * JOINTS..CHANNELS);
        }
    }
    let span = times.iter().map(|t: &Vec<f64>| t[t.len() - 1]).fold(0.0, f64::max);
    HeldScene {
        arm,
        courses,
        times,
        starts,
        channels,
        meters: [angle, link, speed],
        rate,
        drop: if d.chance(0.2) { d.uniform(0.002, 0.01) } else { 0.0 },
        seeds: seed ^ ((index as u64) << 20),
        span,
        windows: WINDOWS,
    }
}

pub(super) fn scales(runs: &[HeldRecord], scene: &HeldScene) -> HeldScales {
    let v = &scene.arm.values;
    let largest = |f: &dyn Fn(&HeldArmState) -> f64| {
        runs.iter().flat_map(|r| &r.track).map(|(_, x)| f(x).abs()).fold(1e-9, f64::max)
    };
    let torque = |j: usize| runs.iter().flat_map(|r| &r.torque).map(|u| u[j].abs()).fold(1e-9, f64::max);
    HeldScales {
        torque: std::array::from_fn(torque),
        speed: std::array::from_fn(|j| largest(&|x| x[RATE + v.motor(j)])),
        deflection: std::array::from_fn(|j| largest(&|x| x[v.motor(j)] - x[j])),
        rate: std::array::from_fn(|j| largest(&|x| x[RATE + v.motor(j)] - x[RATE + j])),
        posture: scene.arm.posture,
        span: scene.span,
    }
}

pub(super) fn finite(runs: &[HeldRecord]) -> bool {
    let calm = |x: &HeldArmState| x[..RATE + RATE].iter().all(|v| v.is_finite() && v.abs() < 12.0);
    runs.iter().all(|r| r.track.iter().all(|(_, x)| calm(x)))
}
