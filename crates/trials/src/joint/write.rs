//! A case as it is written down: recordings, the nominal model, the key.

use std::collections::BTreeMap;

use super::bench::{Done, reading};
use super::choice::{CHANNELS, Choice, Scales};
use super::drive::short;
use super::law::{Effect, Law};
use super::plant::Joint;
use super::run::replay;
use super::scene::{Believed, Nominal, Scene};
use super::values::{NAMES, Values};
use crate::case::{Case, Column, Key, Plant, Recording, Sensor, Split};
use crate::draw::Draw;
use crate::sense;

pub(super) fn write(
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
                    let y = reading(effects, &run.track, *t, *c, scene.span);
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
        effects: toml::Table::new(),
        payload: toml::Table::new(),
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
            drive: String::new(),
            ratio: 1.0,
            seed: 0,
            index: 0,
            law: Vec::new(),
            amplitudes: BTreeMap::new(),
            parameters: BTreeMap::new(),
            moved: BTreeMap::new(),
        },
    }
}

/// Two seconds with the brake on: the current is 0 and nothing moves.
pub(super) fn at_rest(
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

pub(super) fn key(
    split: Split,
    seed: u64,
    index: usize,
    choices: &[Choice],
    effects: &[Effect],
    ratio: f64,
    truth: Values,
    values: &Values,
    class: Option<&[&str]>,
    s: &Scales,
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
    Key {
        case: String::new(),
        plant: Plant::Joint,
        split,
        verdict: split.verdict().into(),
        effects: choices.iter().map(|c| c.id.to_owned()).collect(),
        components: choices.iter().map(|c| c.component.clone()).collect(),
        joints: vec![1; choices.len()],
        class: class.unwrap_or_default().iter().map(|c| (*c).to_owned()).collect(),
        drive: String::new(),
        ratio,
        seed,
        index,
        law: choices.iter().zip(effects).map(|(c, e)| format!("{}, size {:.4e}", c.name, e.size)).collect(),
        amplitudes,
        parameters: NAMES.iter().map(|n| (*n).to_owned()).zip(truth.list()).collect(),
        moved: BTreeMap::new(),
    }
}
