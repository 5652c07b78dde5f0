//! A case as it is written down: recordings, the nominal model, the key.

use std::collections::BTreeMap;

use super::bench::{JointRecord, reading};
use super::choice::{CHANNELS, JointEffectDraw, JointScales};
use super::drive::short;
use super::law::{JointLaw, JointLawEffect};
use super::plant::TrialJoint;
use super::run::replay;
use super::scene::{BelievedJoint, JointScene, NominalJoint};
use super::values::{JointValues, NAMES};
use crate::case::{DeclaredSensor, TrialCase, TrialColumn, TrialPlant, TrialRecording, TrialSplit, TruthKey};
use crate::draw::SeededDraw;
use crate::sense;

pub(super) fn write(
    scene: &JointScene,
    effects: &[JointLawEffect],
    runs: &[JointRecord],
    nominal: &NominalJoint,
    believed: &BelievedJoint,
    current_noise: f64,
    rests: bool,
    d: &mut SeededDraw,
) -> TrialCase {
    let drive = &scene.drive;
    let reads = |name: String, run: &JointRecord, d: &mut SeededDraw| {
        recorded(scene, effects, current_noise, name, run, d)
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
    let mut sensors = vec![DeclaredSensor {
        name: "motorCurrent".into(),
        noise: Some(current_noise),
        hold: true,
        ..DeclaredSensor::default()
    }];
    for c in &drive.channels {
        let m = drive.meters[*c];
        sensors.push(DeclaredSensor {
            name: CHANNELS[*c].into(),
            resolution: (m.step > 0.0).then_some(short(m.step)),
            noise: Some(short(m.noise)),
            ..DeclaredSensor::default()
        });
    }
    TrialCase {
        model: "TwoMassJoint",
        robot: None,
        train,
        holdout,
        rest,
        repeats: Vec::new(),
        parameters,
        uncertain,
        effects: toml::Table::new(),
        payload: toml::Table::new(),
        sensors,
        truth: Vec::new(),
        key: TruthKey {
            case: String::new(),
            plant: TrialPlant::Joint,
            split: TrialSplit::None,
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

/// What the sensors show of a run.
pub(super) fn recorded(
    scene: &JointScene,
    effects: &[JointLawEffect],
    current_noise: f64,
    name: String,
    run: &JointRecord,
    d: &mut SeededDraw,
) -> TrialRecording {
    let drive = &scene.drive;
    let mut columns = vec![TrialColumn {
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
        columns.push(TrialColumn { name: CHANNELS[*c].into(), values, unit_step: meter.deviation() });
    }
    TrialRecording { name, time: run.time.clone(), columns }
}

/// Two seconds with the brake on: the current is 0 and nothing moves.
pub(super) fn at_rest(
    scene: &JointScene,
    _: &[JointLawEffect],
    _: f64,
    reads: impl Fn(String, &JointRecord, &mut SeededDraw) -> TrialRecording,
    d: &mut SeededDraw,
) -> TrialRecording {
    let time: Vec<f64> =
        (0..(2.0 * scene.drive.rate) as usize).map(|i| i as f64 / scene.drive.rate).collect();
    let values = scene.drive.values;
    let current = vec![0.0; time.len()];
    let joint = TrialJoint::new(values, false, Vec::new(), 1.0);
    let track = replay(joint, [0.0; 12], &time, &current, 1e-3);
    let done = JointRecord { time, current, track, start: [0.0; 12] };
    reads("rest-1.csv".into(), &done, d)
}

pub(super) fn key(
    split: TrialSplit,
    seed: u64,
    index: usize,
    choices: &[JointEffectDraw],
    effects: &[JointLawEffect],
    ratio: f64,
    truth: JointValues,
    values: &JointValues,
    class: Option<&[&str]>,
    s: &JointScales,
) -> TruthKey {
    let mut amplitudes: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
    for (c, e) in choices.iter().zip(effects) {
        let same: Option<(String, f64)> = match &e.law {
            JointLaw::Play { .. } => Some(("backlashGap".into(), e.size)),
            JointLaw::DeadTime => Some(("actuatorDelay".into(), e.size)),
            JointLaw::Late { channel } => Some((format!("{}Delay", CHANNELS[*channel]), e.size)),
            JointLaw::Creep { channel, bend: 0.0 } => {
                Some((format!("{}DriftRate", CHANNELS[*channel]), e.size / s.span))
            }
            JointLaw::Unbalance { x, y } => Some(("gravityTorque".into(), e.size * x.hypot(*y))),
            JointLaw::Asymmetry => Some(("coulombAsymmetry".into(), e.size * values.coulomb)),
            JointLaw::LoadSlip { torque, .. } => Some(("loadFriction".into(), e.size * torque)),
            JointLaw::Plain { coulomb, .. } => Some(("coulombFriction".into(), e.size * coulomb)),
            _ => None,
        };
        if let Some((name, value)) = same {
            amplitudes.entry(c.id.to_owned()).or_default().insert(name, value);
        }
    }
    TruthKey {
        case: String::new(),
        plant: TrialPlant::Joint,
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
