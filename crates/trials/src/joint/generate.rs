//! A case of a joint from its numbers.

use std::collections::BTreeMap;

use super::bench::{Done, Replays, record, scales, spread, times};
use super::choice::{CHANNELS, Choice, IDS, OUTSIDE, choose};
use super::drive::{self, Drive, short};
use super::law::{Effect, Law};
use super::plant::{Joint, NAMES, Values};
use super::run::replay;
use crate::case::{Case, Column, Key, Plant, Recording, Sensor, Split};
use crate::draw::Draw;
use crate::error::Error;
use crate::motion::{FAMILIES, Family, Motion};
use crate::sense;

/// Attempts until a case is given up.
const ATTEMPTS: usize = 40;

/// Pairs of effects that data of this kind cannot separate, with the way they are made to look alike.
const MIMICS: [(&[&str], Mimic); 4] = [
    (&["actuator-lag", "sensor-delay"], Mimic::OneChannel),
    (&["gravity-torque", "cable-stiffness"], Mimic::SmallMotion),
    (&["asymmetric-friction", "gravity-torque"], Mimic::ConstantPull),
    (&["torque-ripple", "kinematic-error"], Mimic::FastRipple),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Mimic {
    OneChannel,
    SmallMotion,
    ConstantPull,
    FastRipple,
}

/// Draws until the effect shows.
pub(crate) fn generate(split: Split, seed: u64, index: usize) -> Result<Case, Error> {
    for attempt in 0..ATTEMPTS {
        let mut d = Draw::new(&format!("joint/{}", split.name()), seed, index, attempt);
        // An effect that does not show on this drive gets a few drives, then the next one has its turn.
        if let Some(case) = attempt_one(split, seed, index, index + attempt / 8, &mut d) {
            return Ok(case);
        }
    }
    Err(Error::Useless { split: split.name(), seed, index })
}

/// The runs of a case and what they are measured with.
struct Scene {
    drive: Drive,
    motions: Vec<Motion>,
    times: Vec<Vec<f64>>,
    /// For the controller's encoder noise.
    seeds: u64,
    span: f64,
}

impl Scene {
    fn run(&self, values: Values, rigid: bool, effects: &[Effect], which: &[usize]) -> Vec<Done> {
        let one = |i: &usize| {
            let mut d = Draw::new("encoders", self.seeds, *i, 0);
            let joint = Joint::new(values, rigid, effects.to_vec(), self.span);
            record(joint, &self.drive, &self.motions[*i], &self.times[*i], &mut d)
        };
        which.iter().map(one).collect()
    }
}

fn attempt_one(split: Split, seed: u64, index: usize, turn: usize, d: &mut Draw) -> Option<Case> {
    let rests = d.chance(0.25);
    let color = if rests && d.chance(0.6) { d.uniform(0.3, 0.8) } else { 0.0 };
    let mut drive = drive::draw(d, color);
    let mimic = (split == Split::Unidentifiable).then(|| MIMICS[turn % MIMICS.len()]);
    if let Some((_, mimic)) = mimic {
        drive.channels = vec![0];
        if mimic == Mimic::FastRipple && !drive.small {
            return None;
        }
        if mimic == Mimic::FastRipple {
            // Far above the load's resonance nothing but the motor feels the gear's error.
            drive.values.load_inertia = short(drive.values.load_inertia * 40.0);
            drive.values.stiffness = short(drive.values.stiffness * 0.3);
        }
    }
    let top = (drive.rate / 25.0).min(3.0);
    let holdouts = 1 + d.below(2);
    let (mut motions, mut all_times) = (Vec::new(), Vec::new());
    let load_speed = drive.speed / drive.values.gear_ratio;
    for i in 0..3 + holdouts {
        let t = times(&drive, d);
        let span = t[t.len() - 1];
        let family = d_family(d, i);
        let mut m = Motion::draw(d, family, load_speed, top, span);
        match mimic {
            Some((_, Mimic::SmallMotion)) => {
                m = Motion::draw(d, Family::Multisine, 0.02 * load_speed.max(0.2), top, span);
            }
            Some((_, Mimic::ConstantPull)) => {
                m = Motion::draw(d, Family::Reversals, 0.2 * load_speed.min(0.3), top, span);
            }
            Some((_, Mimic::FastRipple)) => m.family = Family::Multisine,
            _ => {}
        }
        m.center = if mimic.is_some() { 0.0 } else { d.uniform(-0.3, 0.3) };
        motions.push(m);
        all_times.push(t);
    }
    let span = all_times.iter().map(|t| t[t.len() - 1]).fold(0.0, f64::max);
    let scene = Scene { drive, motions, times: all_times, seeds: seed ^ ((index as u64) << 20), span };
    let values = scene.drive.values;

    let plain = scene.run(values, false, &[], &[0, 1]);
    if plain.iter().any(|r| r.track.state.iter().any(|x| !x[0].is_finite())) {
        return None;
    }
    let s = scales(&plain[0], &values);
    if s.speed < 0.02 * scene.drive.speed {
        return None;
    }
    let current_noise = current_noise(&plain, d);
    let floor = floors(&scene, values, false, &plain, current_noise);

    // What is there, and what the owner believes.
    let ids: Vec<&'static str> = match split {
        Split::None | Split::Parameters => Vec::new(),
        Split::Single => vec![IDS[turn % IDS.len()]],
        Split::Pairs => {
            let few = &IDS[..IDS.len() - 2];
            let a = turn % few.len();
            let b = (a + 1 + d.below(few.len() - 1)) % few.len();
            vec![few[a], few[b]]
        }
        Split::Outside => vec![OUTSIDE[turn % OUTSIDE.len()]],
        Split::Unidentifiable => {
            let class = mimic.map(|(class, _)| class)?;
            vec![class[(turn / MIMICS.len()) % class.len()]]
        }
    };
    let mut choices = Vec::new();
    for id in &ids {
        choices.push(choose(id, d, &values, &s, scene.drive.small)?);
    }
    if let [a, b] = &choices[..]
        && (a.component == b.component || a.id == b.id)
    {
        return None;
    }
    if let (Some((_, kind)), [c]) = (mimic, &mut choices[..]) {
        imitate(kind, c, d, &values, &s)?;
    }
    let strongest = if split == Split::Single { 30.0 } else { 15.0 };
    let weakest = if split == Split::Single { 1.5 } else { 4.0 };
    let mut effects = Vec::new();
    let mut believed = Believed { values, rigid: false, frictionless: false };
    let mut truth = values;
    for c in &choices {
        believed.rigid |= c.id == "joint-flexibility";
        believed.frictionless |= c.id == "motor-friction";
    }
    if believed.frictionless {
        (truth.coulomb, truth.viscous) = (0.0, 0.0);
    }
    let mut ratio = 1.0;
    for c in &choices {
        let target = d.log(weakest, strongest);
        let (effect, reached) = size(&scene, truth, &believed, c, &floor, target)?;
        if reached < 0.85 * weakest || reached > 1.6 * strongest {
            return None;
        }
        ratio = reached;
        effects.push(effect);
    }
    let which: Vec<usize> = (0..scene.motions.len()).collect();
    let runs = scene.run(truth, false, &effects, &which);
    if runs.iter().any(|r| r.track.state.iter().any(|x| x.iter().any(|v| !v.is_finite()))) {
        return None;
    }
    if !effects.is_empty() {
        ratio = left(&scene, truth, &believed, &effects, &runs[..2], &floor, 3);
        if ratio < 0.8 * weakest {
            return None;
        }
    }
    let nominal = believe(split, &scene, &values, &runs, &floor, &mut ratio, d)?;
    let mut case = write(&scene, &effects, &runs, &nominal, &believed, current_noise, rests, d);
    case.key = key(split, seed, index, &choices, &effects, ratio, truth, &values, mimic.map(|m| m.0), &s);
    Some(case)
}

fn d_family(d: &mut Draw, i: usize) -> Family {
    // Slow motion at least once.
    if i == 0 {
        d.pick(&[Family::Triangles, Family::Reversals, Family::Multisine])
    } else {
        d.pick(&FAMILIES)
    }
}

/// What the owner's model has.
struct Believed {
    values: Values,
    rigid: bool,
    frictionless: bool,
}

/// Noise of the logged current: 0.05 to 0.5 % of what flows.
fn current_noise(plain: &[Done], d: &mut Draw) -> f64 {
    let rms = (plain[0].current.iter().map(|u| u * u).sum::<f64>() / plain[0].current.len() as f64).sqrt();
    short(rms * d.log(5e-4, 5e-3))
}

/// What noise of the current leaves in each channel after a refit.
fn carried(scene: &Scene, values: Values, rigid: bool, plain: &[Done], noise: f64) -> Vec<f64> {
    let mut d = Draw::new("carried", scene.seeds, 0, 0);
    let mut bench = Replays::new(&scene.drive, values, rigid, plain, true);
    bench.scale = scene.drive.channels.iter().map(|c| scene.drive.meters[*c].deviation()).collect();
    let measured = bench.measured(plain, &[], scene.span);
    for (_, current) in &mut bench.runs {
        current.iter_mut().for_each(|u| *u += noise * d.normal());
    }
    let left = bench.left(&measured, plain, 1);
    by_channel(&left, scene.drive.channels.len()).iter().zip(&bench.scale).map(|(r, s)| r * s).collect()
}

/// Root mean square per channel over all runs.
fn by_channel(left: &[Vec<f64>], channels: usize) -> Vec<f64> {
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
fn floors(scene: &Scene, values: Values, rigid: bool, plain: &[Done], noise: f64) -> Vec<f64> {
    let carried = carried(scene, values, rigid, plain, noise);
    let own = scene.drive.channels.iter().map(|c| scene.drive.meters[*c].deviation());
    own.zip(&carried).map(|(a, b)| a.hypot(*b)).collect()
}

/// Gap over floor, both overall as a diagnosis gives them: root mean square over channels of their NRMSE.
fn overall(left: &[f64], floor: &[f64], spread: &[f64]) -> f64 {
    let sum =
        |x: &dyn Fn(usize) -> f64| (0..spread.len()).map(|c| (x(c) / spread[c]).powi(2)).sum::<f64>().sqrt();
    sum(&|c| left[c].hypot(floor[c])) / sum(&|c| floor[c])
}

fn left(
    scene: &Scene,
    truth: Values,
    believed: &Believed,
    effects: &[Effect],
    runs: &[Done],
    floor: &[f64],
    rounds: usize,
) -> f64 {
    let base = if believed.frictionless { truth } else { believed.values };
    let mut bench = Replays::new(&scene.drive, base, believed.rigid, runs, true);
    bench.scale = floor.to_vec();
    let measured = bench.measured(runs, effects, scene.span);
    let residual = bench.left(&measured, runs, rounds);
    let rms: Vec<f64> =
        by_channel(&residual, floor.len()).iter().zip(&bench.scale).map(|(r, s)| r * s).collect();
    overall(&rms, floor, &spread(&scene.drive, runs))
}

/// The size at which a refit leaves `target` floors, as near as it gets.
fn size(
    scene: &Scene,
    truth: Values,
    believed: &Believed,
    c: &Choice,
    floor: &[f64],
    target: f64,
) -> Option<(Effect, f64)> {
    let wanted = (target * target - 1.0).sqrt();
    let mut size = (c.least * c.most).sqrt().max(c.least);
    let mut best: Option<(f64, Effect, f64)> = None;
    for _ in 0..7 {
        let mut truth = truth;
        if believed.frictionless && c.id != "motor-friction" {
            truth.coulomb = 0.0;
        }
        let effect = Effect::new(c.law.clone(), short(size));
        let runs = scene.run(truth, false, std::slice::from_ref(&effect), &[0, 1]);
        if runs.iter().any(|r| r.track.state.iter().any(|x| !x[0].is_finite() || !x[2].is_finite())) {
            size = (size * 0.3).max(c.least);
            continue;
        }
        let ratio = left(scene, truth, believed, std::slice::from_ref(&effect), &runs, floor, 1);
        if !ratio.is_finite() {
            return None;
        }
        let miss = (ratio / target).ln().abs();
        if best.as_ref().is_none_or(|b| miss < b.0) {
            best = Some((miss, effect, ratio));
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
    best.map(|(_, effect, ratio)| (effect, ratio))
}

/// Makes an effect look like another.
fn imitate(kind: Mimic, c: &mut Choice, d: &mut Draw, v: &Values, s: &super::choice::Scales) -> Option<()> {
    let g = v.gear_ratio * s.torque;
    match (kind, c.id) {
        (Mimic::OneChannel, "actuator-lag") => (c.law, c.name) = (Law::DeadTime, "dead-time"),
        (Mimic::OneChannel, _) => {
            c.law = Law::Late { channel: 0 };
            c.component = "sensor:motorAngle".into();
        }
        (Mimic::SmallMotion, "gravity-torque") => c.law = Law::Unbalance { x: g, y: 0.0 },
        (Mimic::SmallMotion, _) => {
            c.law = Law::Cable { torque: g, center: s.center, width: 20.0 * s.reach };
            c.most = 20.0;
        }
        (Mimic::ConstantPull, "gravity-torque") => {
            c.law = Law::Unbalance { x: 0.0, y: g * d.sign() };
        }
        (Mimic::FastRipple, "torque-ripple") => {
            c.law = Law::Ripple { torque: s.torque, order: 4.0, a: d.phase(), b: d.phase() };
        }
        (Mimic::FastRipple, _) => c.law = Law::GearError { order: 4.0, a: d.phase(), b: d.phase() },
        _ => {}
    }
    Some(())
}

/// The owner's values with their doubts, by name.
struct Nominal {
    values: [f64; 8],
    doubts: Vec<(usize, f64)>,
}

fn believe(
    split: Split,
    scene: &Scene,
    values: &Values,
    runs: &[Done],
    floor: &[f64],
    ratio: &mut f64,
    d: &mut Draw,
) -> Option<Nominal> {
    let truth = values.list();
    let mut nominal = Nominal { values: truth, doubts: Vec::new() };
    let declared = d.chance(0.75);
    match split {
        Split::None => {
            if declared {
                nominal.doubts =
                    [0, 1, 3, 4, 5, 6, 7].iter().map(|i| (*i, d.pick(&[0.02, 0.05, 0.1]))).collect();
            }
        }
        Split::Parameters => {
            let candidates = [0, 1, 3, 4, 6, 7];
            let count = 1 + d.below(3);
            let mut moved: Vec<(usize, f64)> = Vec::new();
            for _ in 0..count {
                let i = d.pick(&candidates);
                if moved.iter().all(|(j, _)| *j != i) {
                    moved.push((i, d.sign() * d.uniform(0.5, 1.0)));
                }
            }
            let target = d.log(2.0, 30.0);
            let mut size = 0.05;
            let mut reached = 0.0;
            for _ in 0..6 {
                let mut v = truth;
                moved.iter().for_each(|(i, m)| v[*i] = short(truth[*i] * (1.0 + size * m)));
                let mut bench = Replays::new(&scene.drive, Values::of(v), false, &runs[..2], false);
                bench.scale = floor.to_vec();
                let measured = bench.measured(&runs[..2], &[], scene.span);
                let residual = bench.left(&measured, &runs[..2], 1);
                let rms: Vec<f64> =
                    by_channel(&residual, floor.len()).iter().zip(floor).map(|(r, s)| r * s).collect();
                reached = overall(&rms, floor, &spread(&scene.drive, runs));
                nominal.values = v;
                if (reached / target).ln().abs() < 0.3 {
                    break;
                }
                let next = size
                    * ((target * target - 1.0) / (reached * reached - 1.0).max(1e-4)).sqrt().clamp(0.1, 8.0);
                size = next.clamp(2e-4, 0.3);
            }
            if reached < 1.5 {
                return None;
            }
            // The key's ratio is what a refit leaves: the floor.
            *ratio = 1.0;
            for (i, m) in &moved {
                if d.chance(0.85) {
                    nominal.doubts.push((*i, short((size * m.abs() / d.uniform(0.5, 2.0)).max(0.005))));
                }
            }
        }
        _ => {
            if d.chance(0.6) {
                for i in [0, 1, 3, 4, 5, 6, 7] {
                    let off = d.sign() * d.uniform(0.01, 0.05);
                    nominal.values[i] = short(truth[i] * (1.0 + off));
                    nominal.doubts.push((i, d.pick(&[0.03, 0.05, 0.1])));
                }
            } else if declared {
                nominal.doubts = [0, 1, 3, 4, 5, 6, 7].iter().map(|i| (*i, d.pick(&[0.02, 0.05]))).collect();
            }
        }
    }
    Some(nominal)
}

fn write(
    scene: &Scene,
    effects: &[Effect],
    runs: &[Done],
    nominal: &Nominal,
    believed: &Believed,
    current_noise: f64,
    rests: bool,
    d: &mut Draw,
) -> Case {
    let drive = &scene.drive;
    let reads = |name: String, run: &Done, d: &mut Draw| {
        let mut columns = vec![Column {
            name: "motorCurrent".into(),
            values: run.current.iter().map(|u| u + current_noise * d.normal()).collect(),
            unit_step: current_noise,
        }];
        for c in &drive.channels {
            let meter = drive.meters[*c];
            let mut last = d.normal();
            let mut values: Vec<f64> = run
                .time
                .iter()
                .map(|t| {
                    let y = super::bench::reading(effects, &run.track, *t, *c, scene.span);
                    meter.read(y, &mut last, d)
                })
                .collect();
            sense::drop_out(&mut values, drive.drop, d);
            columns.push(Column { name: CHANNELS[*c].into(), values, unit_step: meter.deviation() });
        }
        Recording { name, time: run.time.clone(), columns }
    };
    let train = (0..3).map(|i| reads(format!("train-{}.csv", i + 1), &runs[i], d)).collect();
    let holdout =
        (3..runs.len()).map(|i| reads(format!("holdout-{}.csv", i - 2), &runs[i], d)).collect::<Vec<_>>();
    let rest = if rests { vec![at_rest(scene, effects, current_noise, reads, d)] } else { Vec::new() };

    let mut parameters = toml::Table::new();
    for (i, name) in NAMES.iter().enumerate() {
        let spring = i == 4 || i == 5;
        if !(believed.rigid && spring) {
            let value = if believed.frictionless && i >= 6 { 0.0 } else { nominal.values[i] };
            parameters.insert((*name).into(), value.into());
        }
    }
    let level = if believed.frictionless { 0.0 } else { nominal.values[6] };
    parameters.insert("staticFriction".into(), level.into());
    if believed.rigid {
        parameters.insert("jointFlexible".into(), false.into());
    }
    let mut uncertain = toml::Table::new();
    for (i, doubt) in &nominal.doubts {
        let absent = (believed.rigid && (*i == 4 || *i == 5)) || (believed.frictionless && *i >= 6);
        if !absent {
            uncertain.insert(NAMES[*i].into(), (*doubt).into());
        }
    }
    let mut sensors = vec![Sensor {
        name: "motorCurrent".into(),
        noise: Some(current_noise),
        hold: true,
        ..Sensor::default()
    }];
    for c in &drive.channels {
        let m = drive.meters[*c];
        sensors.push(Sensor {
            name: CHANNELS[*c].into(),
            resolution: (m.step > 0.0).then_some(short(m.step)),
            noise: Some(short(m.noise)),
            ..Sensor::default()
        });
    }
    Case {
        model: "TwoMassJoint",
        train,
        holdout,
        rest,
        repeats: Vec::new(),
        parameters,
        uncertain,
        sensors,
        key: Key {
            case: String::new(),
            plant: Plant::Joint,
            split: Split::None,
            verdict: String::new(),
            effects: Vec::new(),
            components: Vec::new(),
            joints: Vec::new(),
            class: Vec::new(),
            ratio: 1.0,
            seed: 0,
            index: 0,
            law: Vec::new(),
            amplitudes: BTreeMap::new(),
            parameters: BTreeMap::new(),
        },
    }
}

/// Two seconds with the brake on: the current is 0 and nothing moves.
fn at_rest(
    scene: &Scene,
    _: &[Effect],
    _: f64,
    reads: impl Fn(String, &Done, &mut Draw) -> Recording,
    d: &mut Draw,
) -> Recording {
    let time: Vec<f64> =
        (0..(2.0 * scene.drive.rate) as usize).map(|i| i as f64 / scene.drive.rate).collect();
    let values = scene.drive.values;
    let current = vec![0.0; time.len()];
    let joint = Joint::new(values, false, Vec::new(), 1.0);
    let track = replay(joint, [0.0; 12], &time, &current, 1e-3);
    let done = Done { time, current, track, start: [0.0; 12] };
    reads("rest-1.csv".into(), &done, d)
}

fn key(
    split: Split,
    seed: u64,
    index: usize,
    choices: &[Choice],
    effects: &[Effect],
    ratio: f64,
    truth: Values,
    values: &Values,
    class: Option<&[&str]>,
    s: &super::choice::Scales,
) -> Key {
    let mut amplitudes: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
    for (c, e) in choices.iter().zip(effects) {
        let same: Option<(String, f64)> = match &e.law {
            Law::Play { .. } => Some(("backlashGap".into(), e.size)),
            Law::DeadTime => Some(("actuatorDelay".into(), e.size)),
            Law::Late { channel } => Some((format!("{}Delay", CHANNELS[*channel]), e.size)),
            Law::Creep { channel, bend: 0.0 } => {
                Some((format!("{}DriftRate", CHANNELS[*channel]), e.size / s.span))
            }
            Law::Unbalance { x, y } => Some(("gravityTorque".into(), e.size * x.hypot(*y))),
            Law::Asymmetry => Some(("coulombAsymmetry".into(), e.size * values.coulomb)),
            Law::LoadSlip { torque, .. } => Some(("loadFriction".into(), e.size * torque)),
            Law::Plain { coulomb, .. } => Some(("coulombFriction".into(), e.size * coulomb)),
            _ => None,
        };
        if let Some((name, value)) = same {
            amplitudes.entry(c.id.to_owned()).or_default().insert(name, value);
        }
    }
    let verdict = match split {
        Split::None => "no-gap",
        Split::Parameters => "parameters",
        Split::Single | Split::Pairs => "effects",
        Split::Outside => "unknown",
        Split::Unidentifiable => "ambiguous",
    };
    Key {
        case: String::new(),
        plant: Plant::Joint,
        split,
        verdict: verdict.into(),
        effects: choices.iter().map(|c| c.id.to_owned()).collect(),
        components: choices.iter().map(|c| c.component.clone()).collect(),
        joints: vec![1; choices.len()],
        class: class.unwrap_or_default().iter().map(|c| (*c).to_owned()).collect(),
        ratio,
        seed,
        index,
        law: choices.iter().zip(effects).map(|(c, e)| format!("{}, size {:.4e}", c.name, e.size)).collect(),
        amplitudes,
        parameters: NAMES.iter().map(|n| (*n).to_owned()).zip(truth.list()).collect(),
    }
}
