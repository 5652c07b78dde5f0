//! A case of an arm from its numbers.

use std::collections::BTreeMap;

use super::choice::{CHANNELS, Choice, IDS, OUTSIDE, Scales, choose};
use super::law::{Effect, Law};
use super::plant::{Arm, COORDINATES, LINKS, State, TEST_BED, Values};
use super::run::{Run, at};
use crate::case::{Case, Column, Key, Plant, Recording, Sensor, Split};
use crate::draw::Draw;
use crate::error::Error;
use crate::joint::short;
use crate::motion::{FAMILIES, Family, Motion};
use crate::sense::{self, Meter};
use crate::tune::{Bench, tune};

const ATTEMPTS: usize = 40;
/// Steps of the truth and of replays, s.
const FINE: f64 = 2e-3;
const COARSE: f64 = 5e-3;

/// Effects that these data cannot separate, and the channels that there are then.
const MIMICS: [(&[&str], &[usize]); 2] =
    [(&["actuator-lag", "sensor-delay"], &[6]), (&["table-tilt", "base-thrust"], &[0, 1])];

/// Draws until the effect shows.
pub(crate) fn generate(split: Split, seed: u64, index: usize) -> Result<Case, Error> {
    for attempt in 0..ATTEMPTS {
        let mut d = Draw::new(&format!("manipulator/{}", split.name()), seed, index, attempt);
        if let Some(case) = one(split, seed, index, index + attempt / 8, &mut d) {
            return Ok(case);
        }
    }
    Err(Error::Useless { split: split.name(), seed, index })
}

/// One recorded run, free of noise.
#[derive(Clone, Debug)]
struct Done {
    time: Vec<f64>,
    torque: Vec<[f64; LINKS]>,
    track: Vec<(f64, State)>,
    start: State,
}

struct Scene {
    values: Values,
    motions: Vec<[Motion; LINKS]>,
    times: Vec<Vec<f64>>,
    starts: Vec<State>,
    channels: Vec<usize>,
    meters: [Meter; 7],
    rate: f64,
    drop: f64,
    seeds: u64,
    span: f64,
}

fn index_of(values: &Values, channel: usize) -> usize {
    if channel == 6 && !values.flexible[0] { 3 } else { channel }
}

fn reading(values: &Values, effects: &[Effect], track: &[(f64, State)], t: f64, c: usize, span: f64) -> f64 {
    let mut late = 0.0;
    for e in effects {
        match &e.law {
            Law::Late { channel } if *channel == c => late += e.size,
            Law::Stutter { channel, holds } if *channel == c => {
                late += holds.iter().find(|(a, b)| t > *a && t < *b).map_or(0.0, |(a, _)| t - a);
            }
            _ => {}
        }
    }
    let mut y = at(track, t - late, index_of(values, c));
    for e in effects {
        match e.law {
            Law::Eccentric { channel, phase, order } if channel == c => {
                let q = phase - order * y;
                y += (e.size * q.sin()).atan2(1.0 + e.size * q.cos());
            }
            Law::Creep { channel, bend } if channel == c => {
                let s = (t / span).clamp(0.0, 1.0);
                y += e.size * if bend > 0.0 { ((s - bend) / (1.0 - bend)).max(0.0) } else { s };
            }
            _ => {}
        }
    }
    y
}

impl Scene {
    /// Run `i` under P/PI control of every motor; what is not driven drifts.
    fn run(&self, values: Values, effects: &[Effect], i: usize) -> Done {
        let mut d = Draw::new("encoders", self.seeds, i, 0);
        let (time, motions) = (&self.times[i], &self.motions[i]);
        let arm = Arm::new(values, effects.to_vec(), self.span);
        let start = self.starts[i];
        let inertia: [f64; LINKS] = std::array::from_fn(|j| arm.felt(&start, j));
        let motor: [usize; LINKS] = std::array::from_fn(|j| arm.motor(j));
        let short_bristles = effects.iter().any(|e| {
            matches!(
                e.law,
                Law::MotorSlip { .. } | Law::LoadSlip { .. } | Law::Ripple { .. } | Law::GearError { .. }
            )
        });
        let mut run = Run::new(arm, time[0], start, if short_bristles { 1e-3 } else { FINE });
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
        Done { time: time.clone(), torque: torques, track: run.track, start }
    }
    fn runs(&self, values: Values, effects: &[Effect], which: &[usize]) -> Vec<Done> {
        which.iter().map(|i| self.run(values, effects, *i)).collect()
    }
}

/// Parameters that a refit may move.
const FREE: [&str; 8] = [
    "baseMass",
    "baseInertia",
    "linkMass[3]",
    "linkInertia[3]",
    "linkCenterOfMass[3,1]",
    "motorInertia[1]",
    "jointStiffness[1]",
    "jointDamping[1]",
];

fn get(v: &Values, i: usize) -> f64 {
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
fn set(v: &mut Values, i: usize, x: f64) {
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

struct Replays<'a> {
    base: Values,
    free: Vec<usize>,
    runs: &'a [Done],
    noise: Vec<Vec<[f64; LINKS]>>,
    channels: &'a [usize],
    scale: Vec<f64>,
    every: usize,
}

impl<'a> Replays<'a> {
    fn new(scene: &'a Scene, base: Values, runs: &'a [Done], refit: bool, scale: Vec<f64>) -> Self {
        let free = if refit { (0..8).filter(|i| get(&base, *i) != 0.0).collect() } else { Vec::new() };
        let free =
            if base.flexible[0] { free } else { free.into_iter().filter(|i: &usize| *i < 6).collect() };
        let every = (runs[0].time.len() / 250).max(1);
        Self { base, free, runs, noise: Vec::new(), channels: &scene.channels, scale, every }
    }
    fn measured(&self, scene: &Scene, truth: &Values, effects: &[Effect]) -> Vec<Vec<f64>> {
        let one = |r: &Done| {
            let mut y = Vec::new();
            for (c, s) in self.channels.iter().zip(&self.scale) {
                let times = r.time.iter().step_by(self.every);
                y.extend(times.map(|t| reading(truth, effects, &r.track, *t, *c, scene.span) / s));
            }
            y
        };
        self.runs.iter().map(one).collect()
    }
    /// Free coordinates of the start: those of the believed structure, with their rates.
    fn free_state(&self) -> Vec<usize> {
        let mut list: Vec<usize> = (0..3 + LINKS).collect();
        list.extend((0..LINKS).filter(|j| self.base.flexible[*j]).map(|j| 3 + LINKS + j));
        let rates: Vec<usize> = list.iter().map(|i| i + COORDINATES).collect();
        list.extend(rates);
        list
    }
    fn left(&self, measured: &[Vec<f64>], rounds: usize) -> Vec<Vec<f64>> {
        let values: Vec<f64> = self.free.iter().map(|i| get(&self.base, *i)).collect();
        let steps: Vec<f64> = values.iter().map(|v| 1e-3 * v).collect();
        let states = self.free_state();
        let initial: Vec<Vec<f64>> =
            self.runs.iter().map(|r| states.iter().map(|i| r.start[*i]).collect()).collect();
        tune(self, measured, &values, &steps, &initial, &vec![1e-4; states.len()], rounds).residual
    }
}

impl Bench for Replays<'_> {
    fn response(&self, run: usize, values: &[f64], initial: &[f64]) -> Vec<f64> {
        let mut v = self.base;
        self.free.iter().zip(values).for_each(|(i, x)| set(&mut v, *i, *x));
        let mut state = [0.0; 2 * COORDINATES + 2];
        self.free_state().iter().zip(initial).for_each(|(i, x)| state[*i] = *x);
        let done = &self.runs[run];
        let mut r = Run::new(Arm::new(v, Vec::new(), 1.0), done.time[0], state, COARSE);
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

fn spread(scene: &Scene, values: &Values, runs: &[Done]) -> Vec<f64> {
    let of = |c: &usize| {
        let i = index_of(values, *c);
        let y: Vec<f64> = runs.iter().flat_map(|r| r.track.iter().step_by(9).map(move |s| s.1[i])).collect();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / y.len() as f64).sqrt().max(1e-9)
    };
    scene.channels.iter().map(of).collect()
}

fn overall(left: &[f64], floor: &[f64], spread: &[f64]) -> f64 {
    let sum =
        |x: &dyn Fn(usize) -> f64| (0..spread.len()).map(|c| (x(c) / spread[c]).powi(2)).sum::<f64>().sqrt();
    sum(&|c| left[c].hypot(floor[c])) / sum(&|c| floor[c])
}

/// Gap over floor after `rounds` of refitting `base`.
fn ratio(
    scene: &Scene,
    truth: &Values,
    base: Values,
    effects: &[Effect],
    runs: &[Done],
    floor: &[f64],
    rounds: usize,
    refit: bool,
) -> f64 {
    let bench = Replays::new(scene, base, runs, refit, floor.to_vec());
    let measured = bench.measured(scene, truth, effects);
    let rms: Vec<f64> = by_channel(&bench.left(&measured, rounds), floor.len())
        .iter()
        .zip(floor)
        .map(|(r, s)| r * s)
        .collect();
    overall(&rms, floor, &spread(scene, truth, runs))
}

fn floors(scene: &Scene, plain: &[Done], noise: [f64; LINKS]) -> Vec<f64> {
    let mut d = Draw::new("carried", scene.seeds, 0, 0);
    let own: Vec<f64> = scene.channels.iter().map(|c| scene.meters[*c].deviation()).collect();
    let mut bench = Replays::new(scene, scene.values, plain, true, own.clone());
    let measured = bench.measured(scene, &scene.values, &[]);
    let draw = |r: &Done, d: &mut Draw| -> Vec<[f64; LINKS]> {
        r.time.iter().map(|_| std::array::from_fn(|j| noise[j] * d.normal())).collect()
    };
    bench.noise = plain.iter().map(|r| draw(r, &mut d)).collect();
    let carried = by_channel(&bench.left(&measured, 1), own.len());
    own.iter().zip(carried).map(|(s, c)| s * c.hypot(1.0)).collect()
}

fn scene(d: &mut Draw, seed: u64, index: usize, mimic: Option<&[usize]>, moving: bool) -> Scene {
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
        let motion = |d: &mut Draw| {
            let family = d.pick(&FAMILIES);
            let speed = if still { 1e-3 } else { d.uniform(0.04, 0.14) };
            Motion::draw(d, family, speed, 0.8, span)
        };
        motions.push([motion(d), motion(d), motion(d)]);
        times.push(t);
        let mut x: State = [0.0; 2 * COORDINATES + 2];
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
                *other = Motion::draw(d, Family::Multisine, 1e-12, 0.5, 10.0);
            }
        }
    }
    let bits = |d: &mut Draw, from: usize, to: usize| {
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
    Scene {
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

fn scales(runs: &[Done], scene: &Scene) -> Scales {
    let largest = |f: &dyn Fn(&State) -> f64| {
        runs.iter().flat_map(|r| &r.track).map(|(_, x)| f(x).abs()).fold(1e-9, f64::max)
    };
    let torque = |j: usize| runs.iter().flat_map(|r| &r.torque).map(|u| u[j].abs()).fold(1e-9, f64::max);
    let arm = Arm::new(scene.values, Vec::new(), 1.0);
    let motor: [usize; LINKS] = std::array::from_fn(|j| arm.motor(j));
    let middle = |i: usize| {
        let all = || runs[0].track.iter().map(|s| s.1[i]);
        0.5 * (all().fold(f64::INFINITY, f64::min) + all().fold(f64::NEG_INFINITY, f64::max))
    };
    Scales {
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

fn finite(runs: &[Done]) -> bool {
    let calm = |x: &State| x.iter().all(|v| v.is_finite() && v.abs() < 50.0);
    runs.iter().all(|r| r.track.iter().all(|(_, x)| calm(x)))
}

/// The size at which a refit leaves `target` floors, as near as it gets.
fn size(s: &Scene, base: Values, c: &Choice, floor: &[f64], target: f64) -> Option<(Effect, f64)> {
    let wanted = (target * target - 1.0).sqrt();
    let mut size = (c.least * c.most).sqrt();
    let mut best: Option<(f64, Effect, f64)> = None;
    for _ in 0..7 {
        let effect = Effect { law: c.law.clone(), size: short(size), joint: c.joint };
        let one = std::slice::from_ref(&effect);
        let runs = s.runs(s.values, one, &[0, 1]);
        if !finite(&runs) {
            size = (0.3 * size).max(c.least);
            continue;
        }
        let reached = ratio(s, &s.values, base, one, &runs, floor, 1, true);
        if !reached.is_finite() {
            return None;
        }
        let miss = (reached / target).ln().abs();
        if best.as_ref().is_none_or(|b| miss < b.0) {
            best = Some((miss, effect, reached));
        }
        let excess = (reached * reached - 1.0).max(1e-4).sqrt();
        let next = (size * (wanted / excess).clamp(0.05, 15.0).powf(0.9)).clamp(c.least, c.most);
        if miss < 0.3 || (next / size).ln().abs() < 1e-3 {
            break;
        }
        size = next;
    }
    best.map(|(_, effect, reached)| (effect, reached))
}

fn one(split: Split, seed: u64, index: usize, turn: usize, d: &mut Draw) -> Option<Case> {
    let mimic = (split == Split::Unidentifiable).then(|| MIMICS[turn % MIMICS.len()]);
    let s = scene(d, seed, index, mimic.map(|m| m.1), true);
    let values = s.values;
    let plain = s.runs(values, &[], &[0, 1]);
    if !finite(&plain) {
        return None;
    }
    let sizes = scales(&plain, &s);
    let noise: [f64; LINKS] = std::array::from_fn(|j| short(sizes.torque[j] * d.log(3e-4, 3e-3)));
    let floor = floors(&s, &plain, noise);
    let ids: Vec<&'static str> = match split {
        Split::None | Split::Parameters => Vec::new(),
        Split::Single => vec![IDS[turn % IDS.len()]],
        Split::Pairs => {
            let few = &IDS[..IDS.len() - 1];
            let a = turn % few.len();
            vec![few[a], few[(a + 1 + d.below(few.len() - 1)) % few.len()]]
        }
        Split::Outside => vec![OUTSIDE[turn % OUTSIDE.len()]],
        Split::Unidentifiable => {
            let class = mimic?.0;
            vec![class[(turn / MIMICS.len()) % class.len()]]
        }
    };
    let mut choices = Vec::new();
    for id in &ids {
        choices.push(choose(id, turn / IDS.len() + d.below(3), d, &values, &sizes, &s.channels)?);
    }
    if let [a, b] = &choices[..]
        && (a.component == b.component || a.id == b.id)
    {
        return None;
    }
    if let (Some(_), [c]) = (mimic, &mut choices[..]) {
        c.joint = 0;
    }
    let (weakest, strongest) = if split == Split::Single { (1.5, 30.0) } else { (4.0, 15.0) };
    let mut base = values;
    if choices.iter().any(|c| c.id == "joint-flexibility") {
        base.flexible[0] = false;
    }
    let (mut effects, mut left) = (Vec::new(), 1.0);
    for c in &choices {
        let target = d.log(weakest, strongest);
        let (effect, reached) = size(&s, base, c, &floor, target)?;
        if reached < 0.85 * weakest || reached > 1.6 * strongest {
            return None;
        }
        left = reached;
        effects.push(effect);
    }
    let all: Vec<usize> = (0..s.motions.len()).collect();
    let runs = s.runs(values, &effects, &all);
    if !finite(&runs) {
        return None;
    }
    if !effects.is_empty() {
        left = ratio(&s, &values, base, &effects, &runs[..2], &floor, 3, true);
        if left.is_nan() || left < 0.8 * weakest {
            return None;
        }
    }
    let (nominal, doubts) = believe(split, &s, &base, &runs, &floor, d)?;
    Some(write(
        split,
        seed,
        index,
        &s,
        &choices,
        &effects,
        &runs,
        &nominal,
        &doubts,
        noise,
        left,
        mimic.map(|m| m.0),
        d,
    ))
}

fn believe(
    split: Split,
    s: &Scene,
    base: &Values,
    runs: &[Done],
    floor: &[f64],
    d: &mut Draw,
) -> Option<(Values, Vec<(usize, f64)>)> {
    let mut nominal = *base;
    let mut doubts = Vec::new();
    let here: Vec<usize> = (0..8).filter(|i| get(base, *i) != 0.0 && (*i < 6 || base.flexible[0])).collect();
    match split {
        Split::Parameters => {
            let mut moved: Vec<(usize, f64)> = Vec::new();
            for _ in 0..1 + d.below(3) {
                let i = d.pick(&here);
                if moved.iter().all(|(k, _)| *k != i) {
                    moved.push((i, d.sign() * d.uniform(0.5, 1.0)));
                }
            }
            let target = d.log(2.0, 30.0);
            let (mut size, mut reached) = (0.05, 0.0);
            for _ in 0..6 {
                nominal = *base;
                moved
                    .iter()
                    .for_each(|(i, m)| set(&mut nominal, *i, short(get(base, *i) * (1.0 + size * m))));
                reached = ratio(s, base, nominal, &[], &runs[..2], floor, 1, false);
                if (reached / target).ln().abs() < 0.3 {
                    break;
                }
                let factor = ((target * target - 1.0) / (reached * reached - 1.0).max(1e-4)).sqrt();
                size = (size * factor.clamp(0.1, 8.0)).clamp(2e-4, 0.4);
            }
            if reached < 1.5 {
                return None;
            }
            for (i, m) in moved {
                if d.chance(0.85) {
                    doubts.push((i, short((size * m.abs() / d.uniform(0.5, 2.0)).max(0.005))));
                }
            }
        }
        _ => {
            let off = split != Split::None && d.chance(0.6);
            if off || d.chance(0.7) {
                for i in here {
                    if off {
                        set(&mut nominal, i, short(get(base, i) * (1.0 + d.sign() * d.uniform(0.01, 0.05))));
                    }
                    doubts.push((i, d.pick(&[0.03, 0.05, 0.1])));
                }
            }
        }
    }
    Some((nominal, doubts))
}

fn write(
    split: Split,
    seed: u64,
    index: usize,
    s: &Scene,
    choices: &[Choice],
    effects: &[Effect],
    runs: &[Done],
    nominal: &Values,
    doubts: &[(usize, f64)],
    noise: [f64; LINKS],
    left: f64,
    class: Option<&[&str]>,
    d: &mut Draw,
) -> Case {
    let mut reads = |name: String, run: &Done| {
        let mut columns: Vec<Column> = (0..LINKS)
            .map(|j| Column {
                name: format!("jointTorque[{}]", j + 1),
                values: run.torque.iter().map(|u| u[j] + noise[j] * d.normal()).collect(),
                unit_step: noise[j],
            })
            .collect();
        for c in &s.channels {
            let (meter, mut last) = (s.meters[*c], d.normal());
            let mut values: Vec<f64> = Vec::with_capacity(run.time.len());
            for t in &run.time {
                let y = reading(&s.values, effects, &run.track, *t, *c, s.span);
                values.push(meter.read(y, &mut last, d));
            }
            sense::drop_out(&mut values, s.drop, d);
            columns.push(Column { name: CHANNELS[*c].into(), values, unit_step: meter.deviation() });
        }
        Recording { name, time: run.time.clone(), columns }
    };
    let train = (0..3).map(|i| reads(format!("train-{}.csv", i + 1), &runs[i])).collect();
    let holdout = (3..runs.len()).map(|i| reads(format!("holdout-{}.csv", i - 2), &runs[i])).collect();
    let mut sensors: Vec<Sensor> = (0..LINKS)
        .map(|j| Sensor {
            name: format!("jointTorque[{}]", j + 1),
            noise: Some(noise[j]),
            hold: true,
            ..Sensor::default()
        })
        .collect();
    for c in &s.channels {
        let m = s.meters[*c];
        sensors.push(Sensor {
            name: CHANNELS[*c].into(),
            resolution: Some(short(m.step)),
            noise: Some(short(m.noise)),
            ..Sensor::default()
        });
    }
    let mut amplitudes: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
    for (c, e) in choices.iter().zip(effects) {
        let base = |c: usize| CHANNELS[c].split('[').next().unwrap_or_default();
        let same: Vec<(String, f64)> = match &e.law {
            Law::Play { .. } => vec![("backlashGap".into(), e.size)],
            Law::DeadTime => vec![("actuatorDelay".into(), e.size)],
            Law::Late { channel } => vec![(format!("{}Delay", base(*channel)), e.size)],
            Law::Tilt { way } => vec![
                ("tiltAccelerationX".into(), e.size * way.cos()),
                ("tiltAccelerationY".into(), e.size * way.sin()),
            ],
            Law::Leak { way, lever } => vec![
                ("thrustForceX".into(), e.size * way.cos()),
                ("thrustForceY".into(), e.size * way.sin()),
                ("thrustTorque".into(), e.size * lever),
            ],
            Law::Panel { inertia, frequency, .. } => {
                vec![("appendageInertia".into(), e.size * inertia), ("appendageFrequency".into(), *frequency)]
            }
            _ => Vec::new(),
        };
        if !same.is_empty() {
            amplitudes.insert(c.id.to_owned(), same.into_iter().collect());
        }
    }
    let verdict = match split {
        Split::None => "no-gap",
        Split::Parameters => "parameters",
        Split::Single | Split::Pairs => "effects",
        Split::Outside => "unknown",
        Split::Unidentifiable => "ambiguous",
    };
    Case {
        model: "PlanarManipulator",
        train,
        holdout,
        rest: Vec::new(),
        repeats: Vec::new(),
        parameters: parameters(nominal),
        uncertain: doubts.iter().map(|(i, x)| (FREE[*i].to_owned(), (*x).into())).collect(),
        sensors,
        key: Key {
            case: String::new(),
            plant: Plant::Manipulator,
            split,
            verdict: verdict.into(),
            effects: choices.iter().map(|c| c.id.to_owned()).collect(),
            components: choices.iter().map(|c| c.component.clone()).collect(),
            joints: choices.iter().map(|c| if c.of_joint { c.joint + 1 } else { 0 }).collect(),
            class: class.unwrap_or_default().iter().map(|c| (*c).to_owned()).collect(),
            ratio: left,
            seed,
            index,
            law: choices
                .iter()
                .zip(effects)
                .map(|(c, e)| format!("{}, size {:.4e}", c.name, e.size))
                .collect(),
            amplitudes,
            parameters: (0..8).map(|i| (FREE[i].to_owned(), get(&s.values, i))).collect(),
        },
    }
}

fn parameters(v: &Values) -> toml::Table {
    let list = |x: &[f64]| toml::Value::Array(x.iter().map(|v| (*v).into()).collect());
    let mut t = toml::Table::new();
    let mut put = |name: &str, value: toml::Value| {
        t.insert(name.to_owned(), value);
    };
    put("baseMass", v.base_mass.into());
    put("baseInertia", v.base_inertia.into());
    put("mountPosition", list(&v.mount));
    put("linkMass", list(&v.mass));
    put("linkInertia", list(&v.inertia));
    put("linkLength", list(&v.length));
    put("linkCenterOfMass", toml::Value::Array(v.center.iter().map(|c| list(c)).collect()));
    put("motorInertia", list(&v.motor_inertia));
    put("gearRatio", list(&[v.gear_ratio; LINKS]));
    if v.flexible[0] {
        // Rigid joints have none; their values are not used.
        put("jointStiffness[1]", v.stiffness[0].into());
        put("jointDamping[1]", v.damping[0].into());
    }
    put("motorCoupling", if v.paper { "paper" } else { "geared" }.into());
    put("jointFlexible", toml::Value::Array(v.flexible.iter().map(|f| (*f).into()).collect()));
    t
}
