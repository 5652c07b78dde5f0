//! Runs of one case: recorded with effects, replayed without.

use super::abreast::replay_abreast;
use super::choice::JointScales;
use super::drive::{TrialDrive, short};
use super::law::{JointLaw, JointLawEffect};
use super::plant::TrialJoint;
use super::run::{JointRun, Track, replay};
use super::values::{JointState, JointValues};
use crate::draw::SeededDraw;
use crate::motion::{Family, ReferenceMotion};
use crate::sense;
use crate::tune::{TuningBench, TuningPoint, tune};

/// Step of the truth and of replays, s.
const FINE: f64 = 2e-4;
const FINER: f64 = 1e-4;
const COARSE: f64 = 5e-4;
/// A run begins this long before its recording, s.
pub(super) const RUN_IN: f64 = 1.5;
/// Positions of the amplifier's converter, either way: 16 bits.
const CONVERTER: f64 = 32768.0;

/// A current as the amplifier's converter gives it, A, at most `limit` either way.
pub(super) fn converted(current: f64, limit: f64) -> f64 {
    (current / limit * CONVERTER).round() / CONVERTER * limit
}

/// One recorded run, free of noise.
#[derive(Clone, Debug)]
pub(crate) struct JointRecord {
    pub(crate) time: Vec<f64>,
    /// Current held from each instant on.
    pub(crate) current: Vec<f64>,
    pub(crate) track: Track,
    pub(crate) start: JointState,
}

/// Reading of a channel without noise, sensor effects included.
pub(crate) fn reading(effects: &[JointLawEffect], track: &Track, t: f64, channel: usize, span: f64) -> f64 {
    let mut late = 0.0;
    for e in effects {
        match &e.law {
            JointLaw::Late { channel: c } if *c == channel => late += e.size,
            JointLaw::Stutter { channel: c, holds } if *c == channel => {
                if let Some((begin, _)) = holds.iter().find(|(a, b)| t > *a && t < *b) {
                    late = t - begin;
                }
            }
            _ => {}
        }
    }
    let mut y = track.at(t - late, channel);
    for e in effects {
        match e.law {
            JointLaw::Eccentric { channel: c, phase } if c == channel => {
                y += (e.size * (phase - y).sin()).atan2(1.0 + e.size * (phase - y).cos());
            }
            JointLaw::Creep { channel: c, bend } if c == channel => {
                let s = (t / span).clamp(0.0, 1.0);
                y += e.size * if bend > 0.0 { ((s - bend) / (1.0 - bend)).max(0.0) } else { s };
            }
            _ => {}
        }
    }
    y
}

/// Runs `joint` along `motion` under P/PI control at the sampling instants; a command by itself if open loop.
pub(crate) fn record(
    joint: TrialJoint,
    drive: &TrialDrive,
    motion: &ReferenceMotion,
    time: &[f64],
    d: &mut SeededDraw,
) -> JointRecord {
    let v = joint.values;
    let n = v.gear_ratio;
    let span = joint.span;
    let total = v.motor_inertia + v.load_inertia / (n * n);
    let resonance = (v.stiffness * n * n / v.load_inertia).sqrt();
    let bandwidth = (std::f64::consts::TAU * 3.0).min(drive.rate / 12.0).min(0.4 * resonance);
    let fine = joint.effects.iter().any(|e| {
        matches!(
            e.law,
            JointLaw::Presliding { .. }
                | JointLaw::LoadSlip { .. }
                | JointLaw::GearError { .. }
                | JointLaw::Ripple { .. }
        )
    });
    let effects = joint.effects.clone();
    let begin = motion.at(-RUN_IN);
    let mut state = [0.0; 12];
    (state[0], state[2]) = (n * begin, begin);
    let mut run = JointRun::new(joint, -RUN_IN, state, if fine { FINER } else { FINE });
    let period = 1.0 / drive.rate;
    let before = (RUN_IN * drive.rate) as usize;
    let mut instants: Vec<f64> =
        (1..before).map(|i| -RUN_IN + i as f64 * period).filter(|t| *t < 0.0).collect();
    instants.extend(time);
    let (mut last_angle, mut last_time) = (f64::NAN, 0.0);
    let (mut speed, mut integral, mut noise) = (0.0, 0.0, [0.0; 2]);
    let (mut current, mut kept) = (0.0, Vec::with_capacity(time.len()));
    let limit = 6.0 * (total * drive.speed * 6.0 + v.coulomb + v.viscous * drive.speed) / v.torque_constant;
    let mut start = state;
    for t in &instants {
        run.hold(*t, current);
        if *t == time[0] {
            start = run.state;
        }
        let angle = drive.meters[0].read(reading(&effects, &run.track, *t, 0, span), &mut noise[0], d);
        let load = match drive.channels.contains(&1) {
            true => drive.meters[1].read(reading(&effects, &run.track, *t, 1, span), &mut noise[1], d),
            false => angle / n,
        };
        if last_angle.is_finite() {
            speed = 0.5 * speed + 0.5 * (angle - last_angle) / (t - last_time);
        }
        (last_angle, last_time) = (angle, *t);
        let torque = if motion.family == Family::OpenLoop {
            (total * drive.speed * 2.0 + 1.3 * v.coulomb + v.viscous * drive.speed) * motion.shake(*t)
        } else {
            let wanted = n * (0.33 * bandwidth * (motion.at(*t) - load) + motion.rate(*t));
            let error = wanted - speed;
            integral += error * period * bandwidth * bandwidth * 0.2 * total;
            integral = integral.clamp(-limit * v.torque_constant, limit * v.torque_constant);
            total * bandwidth * error + integral
        };
        current = converted((torque / v.torque_constant).clamp(-limit, limit), limit);
        if *t >= time[0] {
            kept.push(current);
        }
    }
    JointRecord { time: time.to_vec(), current: kept, track: run.track, start }
}

pub(crate) fn scales(done: &JointRecord, v: &JointValues) -> JointScales {
    let during = || done.track.time.iter().zip(&done.track.state).filter(|(t, _)| **t >= 0.0).map(|(_, x)| x);
    let largest = |f: &dyn Fn(&JointState) -> f64| during().map(|x| f(x).abs()).fold(1e-12, f64::max);
    let n = v.gear_ratio;
    let (low, high) =
        during().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x[2]), b.max(x[2])));
    JointScales {
        torque: done.current.iter().fold(1e-12, |m: f64, u| m.max(u.abs())) * v.torque_constant,
        speed: largest(&|x| x[1]),
        deflection: largest(&|x| x[0] - n * x[2]),
        rate: largest(&|x| x[1] - n * x[3]),
        center: 0.5 * (low + high),
        reach: (0.5 * (high - low)).max(1e-9),
        span: done.time[done.time.len() - 1],
    }
}

/// A replay of recorded commands by a joint without effects, for [`tune`].
pub(crate) struct JointReplays<'a> {
    pub(crate) base: JointValues,
    pub(crate) rigid: bool,
    /// Which of the values are refitted (numbers in [`JointValues::list`]).
    pub(crate) free: Vec<usize>,
    pub(crate) runs: Vec<(&'a [f64], Vec<f64>)>,
    pub(crate) channels: Vec<usize>,
    /// Standard deviation of what is read, per run and channel.
    pub(crate) scale: Vec<f64>,
    pub(crate) every: usize,
    /// Effects that are declared known.
    pub(crate) known: Vec<JointLawEffect>,
}

impl<'a> JointReplays<'a> {
    pub(crate) fn new(
        drive: &TrialDrive,
        base: JointValues,
        rigid: bool,
        runs: &'a [JointRecord],
        refit: bool,
    ) -> Self {
        let free = if !refit {
            Vec::new()
        } else if rigid {
            vec![0, 3, 6, 7]
        } else {
            vec![0, 1, 3, 4, 5, 6, 7]
        };
        let free = free.into_iter().filter(|i| base.list()[*i] != 0.0).collect();
        let every = (runs[0].time.len() / 800).max(1);
        let scale = drive.channels.iter().map(|_| 1.0).collect();
        Self {
            base,
            rigid,
            free,
            runs: runs.iter().map(|r| (&r.time[..], r.current.clone())).collect(),
            channels: drive.channels.clone(),
            scale,
            every,
            known: Vec::new(),
        }
    }
    /// What was read, without noise, divided by the scales.
    pub(crate) fn measured(
        &self,
        runs: &[JointRecord],
        effects: &[JointLawEffect],
        span: f64,
    ) -> Vec<Vec<f64>> {
        let read = |r: &JointRecord, t: f64, c: usize| {
            reading(effects, &r.track, t, self.channels[c], span) / self.scale[c]
        };
        let one = |r: &JointRecord| {
            let mut y = Vec::new();
            for c in 0..self.channels.len() {
                y.extend(r.time.iter().step_by(self.every).map(|t| read(r, *t, c)));
            }
            y
        };
        runs.iter().map(one).collect()
    }
    pub(crate) fn initial(&self, runs: &[JointRecord]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let k = if self.rigid { 2 } else { 4 };
        let n = self.base.gear_ratio;
        let steps = [1e-3, 1e-2, 1e-3 / n, 1e-2 / n];
        (runs.iter().map(|r| r.start[..k].to_vec()).collect(), steps[..k].to_vec())
    }
    pub(crate) fn start(&self) -> (Vec<f64>, Vec<f64>) {
        let all = self.base.list();
        let v: Vec<f64> = self.free.iter().map(|i| all[*i]).collect();
        let steps = v.iter().map(|x| 1e-3 * x).collect();
        (v, steps)
    }
    /// Residual of each run after a refit.
    pub(crate) fn left(&self, measured: &[Vec<f64>], runs: &[JointRecord]) -> Vec<Vec<f64>> {
        let ((values, steps), (initial, initial_steps)) = (self.start(), self.initial(runs));
        tune(self, measured, &values, &steps, &initial, &initial_steps).residual
    }
}

impl JointReplays<'_> {
    /// The joint of a point, and where it begins.
    fn begins(&self, (values, initial): &TuningPoint) -> (JointValues, JointState) {
        let mut all = self.base.list();
        for (i, v) in self.free.iter().zip(values) {
            all[*i] = *v;
        }
        let values = JointValues::of(all);
        let n = values.gear_ratio;
        let mut state = [0.0; 12];
        state[..initial.len()].copy_from_slice(initial);
        if self.rigid {
            (state[2], state[3]) = (state[0] / n, state[1] / n);
        }
        (values, state)
    }

    /// Responses at `points`, as many at a time.
    fn abreast<const L: usize>(&self, run: usize, instants: &[f64], points: &[TuningPoint]) -> Vec<Vec<f64>> {
        let begins: [_; L] = std::array::from_fn(|l| self.begins(&points[l.min(points.len() - 1)]));
        let (time, current) = &self.runs[run];
        let states = begins.map(|b| b.1);
        let read =
            replay_abreast(begins.map(|b| b.0), self.rigid, &states, (time, current), COARSE, instants);
        read.iter().take(points.len()).map(|r| self.by_channel(r.len(), |c, i| r[i][c])).collect()
    }

    /// One response after the other, with the effects that are known.
    fn alone(&self, run: usize, instants: &[f64], point: &TuningPoint) -> Vec<f64> {
        let (values, state) = self.begins(point);
        let (time, current) = &self.runs[run];
        let joint = TrialJoint::new(values, self.rigid, self.known.clone(), time[time.len() - 1]);
        let track = replay(joint, state, time, current, COARSE);
        self.by_channel(instants.len(), |c, i| track.at(instants[i], c))
    }

    /// `count` readings `of(channel, number)` of every channel, divided by its scale.
    fn by_channel(&self, count: usize, of: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let channels = self.channels.iter().zip(&self.scale);
        channels.flat_map(|(c, scale)| (0..count).map(|i| of(*c, i) / scale).collect::<Vec<_>>()).collect()
    }
}

impl TuningBench for JointReplays<'_> {
    fn responses(&self, run: usize, points: &[TuningPoint]) -> Vec<Vec<f64>> {
        let instants: Vec<f64> = self.runs[run].0.iter().step_by(self.every).copied().collect();
        if !self.known.is_empty() {
            return points.iter().map(|p| self.alone(run, &instants, p)).collect();
        }
        let some = |points: &[TuningPoint]| match points.len() {
            1 => self.abreast::<1>(run, &instants, points),
            _ => self.abreast::<4>(run, &instants, points),
        };
        points.chunks(4).flat_map(some).collect()
    }
}

/// Standard deviations of the channels over all runs, without noise.
pub(crate) fn spread(drive: &TrialDrive, runs: &[JointRecord]) -> Vec<f64> {
    let of = |channel: usize| {
        let y: Vec<f64> =
            runs.iter().flat_map(|r| r.time.iter().step_by(7).map(|t| r.track.at(*t, channel))).collect();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / y.len() as f64).sqrt().max(1e-12)
    };
    drive.channels.iter().map(|c| of(*c)).collect()
}

/// Instants of a run.
pub(crate) fn times(drive: &TrialDrive, d: &mut SeededDraw) -> Vec<f64> {
    sense::instants(drive.rate, drive.samples, drive.jitter, d)
}

/// Noise of the logged current: 0.05 to 0.5 % of what flows.
pub(super) fn current_noise(plain: &[JointRecord], d: &mut SeededDraw) -> f64 {
    let rms = (plain[0].current.iter().map(|u| u * u).sum::<f64>() / plain[0].current.len() as f64).sqrt();
    short(rms * d.log(5e-4, 5e-3))
}
