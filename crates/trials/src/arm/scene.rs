//! The runs of a case: the arm, how it moves, when it is read and with what.

use super::choice::ArmScales;
use super::law::{ArmLaw, ArmLawEffect};
use super::plant::{ArmState, ArmValues, COORDINATES, LINKS, TEST_BED, TrialArm};
use super::run::{ArmRun, at};
use crate::draw::SeededDraw;
use crate::joint::short;
use crate::motion::{FAMILIES, Family, ReferenceMotion};
use crate::sense::{self, Meter};

/// Step of the truth, s.
const FINE: f64 = 2e-3;

/// One recorded run, free of noise.
#[derive(Clone, Debug)]
pub(super) struct ArmRecord {
    pub(super) time: Vec<f64>,
    pub(super) torque: Vec<[f64; LINKS]>,
    pub(super) track: Vec<(f64, ArmState)>,
    pub(super) start: ArmState,
}

pub(super) struct ArmScene {
    pub(super) values: ArmValues,
    pub(super) motions: Vec<[ReferenceMotion; LINKS]>,
    pub(super) times: Vec<Vec<f64>>,
    pub(super) starts: Vec<ArmState>,
    pub(super) channels: Vec<usize>,
    pub(super) meters: [Meter; 7],
    pub(super) rate: f64,
    pub(super) drop: f64,
    pub(super) seeds: u64,
    pub(super) span: f64,
}

pub(super) fn index_of(values: &ArmValues, channel: usize) -> usize {
    if channel == 6 && !values.flexible[0] { 3 } else { channel }
}

pub(super) fn reading(
    values: &ArmValues,
    effects: &[ArmLawEffect],
    track: &[(f64, ArmState)],
    t: f64,
    c: usize,
    span: f64,
) -> f64 {
    let mut late = 0.0;
    for e in effects {
        match &e.law {
            ArmLaw::Late { channel } if *channel == c => late += e.size,
            ArmLaw::Stutter { channel, holds } if *channel == c => {
                late += holds.iter().find(|(a, b)| t > *a && t < *b).map_or(0.0, |(a, _)| t - a);
            }
            _ => {}
        }
    }
    let mut y = at(track, t - late, index_of(values, c));
    for e in effects {
        match e.law {
            ArmLaw::Eccentric { channel, phase, order } if channel == c => {
                let q = phase - order * y;
                y += (e.size * q.sin()).atan2(1.0 + e.size * q.cos());
            }
            ArmLaw::Creep { channel, bend } if channel == c => {
                let s = (t / span).clamp(0.0, 1.0);
                y += e.size * if bend > 0.0 { ((s - bend) / (1.0 - bend)).max(0.0) } else { s };
            }
            _ => {}
        }
    }
    y
}

impl ArmScene {
    /// Run `i` under P/PI control of every motor; what is not driven drifts.
    pub(super) fn run(&self, values: ArmValues, effects: &[ArmLawEffect], i: usize) -> ArmRecord {
        let mut d = SeededDraw::new("encoders", self.seeds, i, 0);
        let (time, motions) = (&self.times[i], &self.motions[i]);
        let arm = TrialArm::new(values, effects.to_vec(), self.span);
        let start = self.starts[i];
        let inertia: [f64; LINKS] = std::array::from_fn(|j| arm.felt(&start, j));
        let motor: [usize; LINKS] = std::array::from_fn(|j| arm.motor(j));
        let short_bristles = effects.iter().any(|e| {
            matches!(
                e.law,
                ArmLaw::MotorSlip { .. }
                    | ArmLaw::LoadSlip { .. }
                    | ArmLaw::Ripple { .. }
                    | ArmLaw::GearError { .. }
            )
        });
        let mut run = ArmRun::new(arm, time[0], start, if short_bristles { 1e-3 } else { FINE });
        let bandwidth = 2.5f64.min(self.rate / 8.0);
        let mut integral = [0.0; LINKS];
        let mut torques = Vec::with_capacity(time.len());
        for (k, t) in time.iter().enumerate() {
            let mut u = [0.0; LINKS];
            for j in 0..LINKS {
                let m = &motions[j];
                let (q, v) = (run.state[motor[j]], run.state[COORDINATES + motor[j]]);
                let (q, v) = (q + 1e-4 * d.normal(), v + 1e-3 * d.normal());
                let from = start[motor[j]] - m.at(time[0]);
                let wanted = 0.4 * bandwidth * (m.at(*t) + from - q) + m.rate(*t);
                let error = wanted - v;
                integral[j] += 0.2 * bandwidth * bandwidth * inertia[j] * error / self.rate;
                let torque = match m.family {
                    Family::OpenLoop => 0.5 * inertia[j] * bandwidth * 0.1 * m.shake(*t),
                    _ => inertia[j] * bandwidth * error + integral[j],
                };
                u[j] = (torque.clamp(-40.0, 40.0) * 1e5).round() / 1e5;
            }
            torques.push(u);
            if let Some(next) = time.get(k + 1) {
                run.hold(*next, u);
            }
        }
        ArmRecord { time: time.clone(), torque: torques, track: run.track, start }
    }
    pub(super) fn runs(
        &self,
        values: ArmValues,
        effects: &[ArmLawEffect],
        which: &[usize],
    ) -> Vec<ArmRecord> {
        which.iter().map(|i| self.run(values, effects, *i)).collect()
    }
}

pub(super) fn scene(
    d: &mut SeededDraw,
    seed: u64,
    index: usize,
    mimic: Option<&[usize]>,
    moving: bool,
) -> ArmScene {
    let mut values = TEST_BED;
    let mut about = |x: f64, by: f64| short(x * (1.0 + d.uniform(-by, by)));
    values.base_mass = about(values.base_mass, 0.1);
    values.base_inertia = about(values.base_inertia, 0.1);
    for j in 0..LINKS {
        values.mass[j] = about(values.mass[j], 0.1);
        values.inertia[j] = about(values.inertia[j], 0.1);
    }
    values.center[2][0] = about(values.center[2][0], 0.1);
    values.motor_inertia[0] = about(5.6, 0.15);
    values.stiffness[0] = about(5.47, 0.3);
    values.damping[0] = about(0.5, 0.4);
    if d.chance(0.3) {
        values.paper = false;
        values.motor_inertia[0] = short(d.uniform(0.3, 1.5));
    }
    if mimic.is_none() && d.chance(0.15) {
        values.flexible[0] = false;
        values.motor_inertia = [short(d.uniform(0.2, 0.6)), 0.2, 0.1];
    }
    let rate = d.pick(&[20.0, 50.0, 50.0, 100.0]);
    let jitter = if d.chance(0.3) { 0.03 } else { 0.0 };
    let count = (d.uniform(9.0, 14.0) * rate) as usize + 1;
    let holdouts = 1 + d.below(2);
    let (mut motions, mut times, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..3 + holdouts {
        let t = sense::instants(rate, count, jitter, d);
        let span = t[t.len() - 1];
        let still = moving && i > 0 && d.chance(0.15);
        let motion = |d: &mut SeededDraw| {
            let family = d.pick(&FAMILIES);
            let speed = if still { 1e-3 } else { d.uniform(0.04, 0.14) };
            ReferenceMotion::draw(d, family, speed, 0.8, span)
        };
        motions.push([motion(d), motion(d), motion(d)]);
        times.push(t);
        let mut x: ArmState = [0.0; 2 * COORDINATES + 2];
        for (k, q) in [0.0, 0.0, 0.2, 0.8, 0.8, 0.8].into_iter().enumerate() {
            x[k] = q * d.uniform(-1.0, 1.0);
        }
        for (k, v) in [0.01, 0.01, 0.02].into_iter().enumerate() {
            x[COORDINATES + k] = v * d.uniform(-1.0, 1.0);
        }
        x[3 + LINKS] = x[3] + 0.03 * d.uniform(-1.0, 1.0);
        starts.push(x);
    }
    if let Some(&[6]) = mimic {
        // Only joint 1 is driven: one channel behind one input.
        for m in &mut motions {
            for other in &mut m[1..] {
                *other = ReferenceMotion::draw(d, Family::Multisine, 1e-12, 0.5, 10.0);
            }
        }
    }
    let bits = |d: &mut SeededDraw, from: usize, to: usize| {
        std::f64::consts::TAU / f64::from(1u32 << (from + d.below(to - from + 1)))
    };
    let encoder = {
        let step = bits(d, 13, 17);
        Meter { noise: step * d.uniform(0.3, 0.9), step, color: 0.0 }
    };
    let camera = Meter { noise: d.uniform(2e-4, 1e-3), step: 1e-4, color: 0.0 };
    let attitude = Meter { noise: d.uniform(5e-4, 3e-3), step: 1e-4, color: 0.0 };
    let channels = match mimic {
        Some(list) => list.to_vec(),
        None => match d.below(6) {
            0 => vec![3, 4, 5, 6],
            1 => vec![0, 1, 2, 3, 4, 5],
            _ => vec![0, 1, 2, 3, 4, 5, 6],
        },
    };
    let channels = channels.into_iter().filter(|c| *c != 6 || values.flexible[0]).collect();
    let span = times.iter().map(|t| t[t.len() - 1]).fold(0.0, f64::max);
    ArmScene {
        values,
        motions,
        times,
        starts,
        channels,
        meters: [camera, camera, attitude, encoder, encoder, encoder, encoder],
        rate,
        drop: if d.chance(0.3) { d.uniform(0.002, 0.015) } else { 0.0 },
        seeds: seed ^ ((index as u64) << 20),
        span,
    }
}

pub(super) fn scales(runs: &[ArmRecord], scene: &ArmScene) -> ArmScales {
    let largest = |f: &dyn Fn(&ArmState) -> f64| {
        runs.iter().flat_map(|r| &r.track).map(|(_, x)| f(x).abs()).fold(1e-9, f64::max)
    };
    let torque = |j: usize| runs.iter().flat_map(|r| &r.torque).map(|u| u[j].abs()).fold(1e-9, f64::max);
    let arm = TrialArm::new(scene.values, Vec::new(), 1.0);
    let motor: [usize; LINKS] = std::array::from_fn(|j| arm.motor(j));
    let middle = |i: usize| {
        let all = || runs[0].track.iter().map(|s| s.1[i]);
        0.5 * (all().fold(f64::INFINITY, f64::min) + all().fold(f64::NEG_INFINITY, f64::max))
    };
    ArmScales {
        torque: std::array::from_fn(torque),
        speed: std::array::from_fn(|j| largest(&|x| x[COORDINATES + motor[j]])),
        deflection: largest(&|x| x[motor[0]] - x[3]),
        rate: largest(&|x| x[COORDINATES + motor[0]] - x[COORDINATES + 3]),
        velocity: largest(&|x| x[COORDINATES].hypot(x[COORDINATES + 1])),
        base_rate: largest(&|x| x[COORDINATES + 2]),
        middle: std::array::from_fn(middle),
        span: scene.span,
    }
}

pub(super) fn finite(runs: &[ArmRecord]) -> bool {
    let calm = |x: &ArmState| x.iter().all(|v| v.is_finite() && v.abs() < 50.0);
    runs.iter().all(|r| r.track.iter().all(|(_, x)| calm(x)))
}
