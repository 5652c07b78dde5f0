//! A case as it is written down: recordings, the nominal model, the key.

use std::collections::BTreeMap;

use super::chain::JOINTS;
use super::channels::channel;
use super::choice::HeldEffectDraw;
use super::file::robot;
use super::law::{HeldLaw, HeldLawEffect};
use super::named::{HeldValue, free_values};
use super::nominal::HeldArmNominal;
use super::run::at;
use super::scene::{HeldRecord, HeldScene, TRAIN, reading};
use super::values::{HeldArmValues, RATE};
use crate::case::{DeclaredSensor, TrialCase, TrialColumn, TrialPlant, TrialRecording, TrialSplit, TruthKey};
use crate::draw::SeededDraw;
use crate::joint::short;
use crate::sense;

/// What a case was drawn from.
#[derive(Clone, Copy)]
pub(super) struct HeldOrigin {
    pub(super) split: TrialSplit,
    pub(super) seed: u64,
    pub(super) index: usize,
}

/// What happens in a case.
pub(super) struct HeldHappening<'a> {
    pub(super) choices: &'a [HeldEffectDraw],
    pub(super) effects: &'a [HeldLawEffect],
    pub(super) runs: &'a [HeldRecord],
    /// Of the torques read, N.m.
    pub(super) noise: [f64; JOINTS],
    /// Gap that a refit leaves, over the floor.
    pub(super) left: f64,
    /// What these data cannot separate by design.
    pub(super) class: &'a [&'a str],
}

fn channel_name(c: usize) -> String {
    let (variable, j) = channel(c);
    format!("{variable}[{}]", j + 1)
}

/// Names of the recordings by number.
fn recording(i: usize) -> String {
    if i < TRAIN { format!("train-{}.csv", i + 1) } else { format!("holdout-{}.csv", i - TRAIN + 1) }
}

pub(super) fn write(
    of: HeldOrigin,
    s: &HeldScene,
    happens: &HeldHappening<'_>,
    nominal: &HeldArmNominal,
    d: &mut SeededDraw,
) -> TrialCase {
    let (runs, effects, noise) = (happens.runs, happens.effects, happens.noise);
    let values = &s.arm.values;
    let mut reads = |i: usize| {
        let run = &runs[i];
        let mut columns: Vec<TrialColumn> = (0..JOINTS)
            .map(|j| TrialColumn {
                name: format!("jointTorque[{}]", j + 1),
                values: run.torque.iter().map(|u| u[j] + noise[j] * d.normal()).collect(),
                unit_step: noise[j],
            })
            .collect();
        for c in &s.channels {
            let (meter, mut last) = (s.meter(*c), d.normal());
            let mut read: Vec<f64> = Vec::with_capacity(run.time.len());
            for t in &run.time {
                let y = reading(values, effects, &run.track, *t, *c, s.span);
                read.push(meter.read(y, &mut last, d));
            }
            sense::drop_out(&mut read, s.drop, d);
            columns.push(TrialColumn { name: channel_name(*c), values: read, unit_step: meter.deviation() });
        }
        TrialRecording { name: recording(i), time: run.time.clone(), columns }
    };
    let train = (0..TRAIN).map(&mut reads).collect();
    let holdout = (TRAIN..runs.len()).map(&mut reads).collect();
    let mut sensors: Vec<DeclaredSensor> = (0..JOINTS)
        .map(|j| DeclaredSensor {
            name: format!("jointTorque[{}]", j + 1),
            noise: Some(noise[j]),
            hold: true,
            ..DeclaredSensor::default()
        })
        .collect();
    for c in &s.channels {
        let m = s.meter(*c);
        sensors.push(DeclaredSensor {
            name: channel_name(*c),
            resolution: (m.step > 0.0).then(|| short(m.step)),
            noise: Some(short(m.noise)),
            ..DeclaredSensor::default()
        });
    }
    // The file may be of another arm of the make: then the case has its own values by name.
    let (mut filed, mut parameters) = (nominal.values, toml::Table::new());
    let gravity = nominal.values.chain.gravity.map(toml::Value::from).to_vec();
    parameters.insert("gravity".into(), gravity.into());
    if d.chance(0.4) {
        for value in free_values(&nominal.values).into_iter().filter(|v| !v.of_friction()) {
            if d.chance(0.25) {
                let own = value.get(&nominal.values);
                value.set(&mut filed, short(own * (1.0 + d.uniform(-0.1, 0.1))));
                parameters.insert(value.name(), own.into());
            }
        }
    }
    TrialCase {
        model: "SpatialFreeFlyer",
        robot: Some(robot(&filed, &s.arm.name.to_lowercase())),
        train,
        holdout,
        rest: Vec::new(),
        repeats: Vec::new(),
        parameters,
        uncertain: nominal.uncertain.iter().map(|(name, x)| (name.clone(), (*x).into())).collect(),
        effects: friction(nominal),
        payload: toml::Table::new(),
        sensors,
        truth: runs.iter().enumerate().map(|(i, run)| truth(values, recording(i), run)).collect(),
        key: key(of, s, happens),
    }
}

/// The friction that the nominal model has.
fn friction(nominal: &HeldArmNominal) -> toml::Table {
    let v = &nominal.values;
    let list = |x: [f64; JOINTS]| toml::Value::Array(x.map(toml::Value::from).to_vec());
    let table = toml::Table::from_iter([
        ("coulombFriction".to_owned(), list(v.coulomb)),
        ("staticFriction".to_owned(), list(v.breakaway)),
        ("viscousFriction".to_owned(), list(v.viscous)),
        ("doubt".to_owned(), nominal.friction.into()),
    ]);
    toml::Table::from_iter([("motor-friction".to_owned(), toml::Value::Table(table))])
}

/// A run free of noise.
fn truth(v: &HeldArmValues, name: String, run: &HeldRecord) -> TrialRecording {
    let mut columns = Vec::new();
    let mut column = |name: String, values: Vec<f64>| {
        columns.push(TrialColumn { name, values, unit_step: 1e-13 });
    };
    for j in 0..JOINTS {
        column(format!("jointTorque[{}]", j + 1), run.torque.iter().map(|u| u[j]).collect());
    }
    let (joint, rate) = (|j: usize| j, |j: usize| RATE + j);
    let (motor, speed) = (|j: usize| v.motor(j), |j: usize| RATE + v.motor(j));
    let all: [(&str, &dyn Fn(usize) -> usize); 4] =
        [("jointAngle", &joint), ("jointVelocity", &rate), ("motorAngle", &motor), ("motorVelocity", &speed)];
    for (variable, index) in all {
        for j in 0..JOINTS {
            let values = run.time.iter().map(|t| at(&run.track, *t, index(j))).collect();
            column(format!("{variable}[{}]", j + 1), values);
        }
    }
    TrialRecording { name, time: run.time.clone(), columns }
}

fn key(of: HeldOrigin, s: &HeldScene, happens: &HeldHappening<'_>) -> TruthKey {
    let HeldHappening { choices, effects, .. } = *happens;
    let v = &s.arm.values;
    let mut amplitudes: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
    for (c, e) in choices.iter().zip(effects) {
        let same = match &e.law {
            HeldLaw::Play { .. } => ("backlashGap".to_owned(), e.size),
            HeldLaw::DeadTime => ("actuatorDelay".to_owned(), e.size),
            HeldLaw::Late { channel: c } => (format!("{}Delay", channel(*c).0), e.size),
            _ => continue,
        };
        amplitudes.insert(c.id.to_owned(), BTreeMap::from([same]));
    }
    let mut parameters = BTreeMap::new();
    let mut put = |value: HeldValue| parameters.insert(value.name(), value.get(v));
    for j in 0..JOINTS {
        for value in [
            HeldValue::Mass(j),
            HeldValue::Motor(j),
            HeldValue::Coulomb(j),
            HeldValue::Breakaway(j),
            HeldValue::Viscous(j),
        ] {
            put(value);
        }
        for i in 0..3 {
            put(HeldValue::Center(j, i));
            (0..3).for_each(|k| {
                put(HeldValue::Inertia(j, i, k));
            });
        }
        if v.flexible[j] {
            put(HeldValue::Stiffness(j));
            put(HeldValue::Damping(j));
        }
    }
    let sprung = v.flexible.iter().filter(|f| **f).count();
    TruthKey {
        case: String::new(),
        plant: TrialPlant::HeldArm,
        split: of.split,
        verdict: of.split.verdict().into(),
        effects: choices.iter().map(|c| c.id.to_owned()).collect(),
        components: choices.iter().map(|c| c.component.clone()).collect(),
        joints: choices.iter().map(|c| if c.of_joint { c.joint + 1 } else { 0 }).collect(),
        class: happens.class.iter().map(|c| (*c).to_owned()).collect(),
        drive: format!("{}, {}", s.arm.name, if sprung > 0 { "springs" } else { "rigid joints" }),
        ratio: happens.left,
        seed: of.seed,
        index: of.index,
        law: choices.iter().zip(effects).map(|(c, e)| format!("{}, size {:.4e}", c.name, e.size)).collect(),
        amplitudes,
        parameters,
        moved: BTreeMap::new(),
    }
}
