//! A case as it is written down: recordings, the nominal model, the key.

use std::collections::BTreeMap;

use super::choice::{ArmEffectDraw, CHANNELS};
use super::law::{ArmLaw, ArmLawEffect};
use super::plant::{ArmValues, LINKS};
use super::scene::{ArmRecord, ArmScene, reading};
use super::size::{FREE, get};
use crate::case::{DeclaredSensor, TrialCase, TrialColumn, TrialPlant, TrialRecording, TrialSplit, TruthKey};
use crate::draw::SeededDraw;
use crate::joint::short;
use crate::sense;

pub(super) fn write(
    split: TrialSplit,
    seed: u64,
    index: usize,
    s: &ArmScene,
    choices: &[ArmEffectDraw],
    effects: &[ArmLawEffect],
    runs: &[ArmRecord],
    nominal: &ArmValues,
    doubts: &[(usize, f64)],
    noise: [f64; LINKS],
    left: f64,
    class: Option<&[&str]>,
    d: &mut SeededDraw,
) -> TrialCase {
    let mut reads = |name: String, run: &ArmRecord| {
        let mut columns: Vec<TrialColumn> = (0..LINKS)
            .map(|j| TrialColumn {
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
            columns.push(TrialColumn { name: CHANNELS[*c].into(), values, unit_step: meter.deviation() });
        }
        TrialRecording { name, time: run.time.clone(), columns }
    };
    let train = (0..3).map(|i| reads(format!("train-{}.csv", i + 1), &runs[i])).collect();
    let holdout = (3..runs.len()).map(|i| reads(format!("holdout-{}.csv", i - 2), &runs[i])).collect();
    let mut sensors: Vec<DeclaredSensor> = (0..LINKS)
        .map(|j| DeclaredSensor {
            name: format!("jointTorque[{}]", j + 1),
            noise: Some(noise[j]),
            hold: true,
            ..DeclaredSensor::default()
        })
        .collect();
    for c in &s.channels {
        let m = s.meters[*c];
        sensors.push(DeclaredSensor {
            name: CHANNELS[*c].into(),
            resolution: Some(short(m.step)),
            noise: Some(short(m.noise)),
            ..DeclaredSensor::default()
        });
    }
    let mut amplitudes: BTreeMap<String, BTreeMap<String, f64>> = BTreeMap::new();
    for (c, e) in choices.iter().zip(effects) {
        let base = |c: usize| CHANNELS[c].split('[').next().unwrap_or_default();
        let same: Vec<(String, f64)> = match &e.law {
            ArmLaw::Play { .. } => vec![("backlashGap".into(), e.size)],
            ArmLaw::DeadTime => vec![("actuatorDelay".into(), e.size)],
            ArmLaw::Late { channel } => vec![(format!("{}Delay", base(*channel)), e.size)],
            ArmLaw::Tilt { way } => vec![
                ("tiltAccelerationX".into(), e.size * way.cos()),
                ("tiltAccelerationY".into(), e.size * way.sin()),
            ],
            ArmLaw::Leak { way, lever } => vec![
                ("thrustForceX".into(), e.size * way.cos()),
                ("thrustForceY".into(), e.size * way.sin()),
                ("thrustTorque".into(), e.size * lever),
            ],
            ArmLaw::Panel { inertia, frequency, .. } => {
                vec![("appendageInertia".into(), e.size * inertia), ("appendageFrequency".into(), *frequency)]
            }
            _ => Vec::new(),
        };
        if !same.is_empty() {
            amplitudes.insert(c.id.to_owned(), same.into_iter().collect());
        }
    }
    TrialCase {
        model: "PlanarManipulator",
        robot: None,
        train,
        holdout,
        rest: Vec::new(),
        repeats: Vec::new(),
        parameters: parameters(nominal),
        uncertain: doubts.iter().map(|(i, x)| (FREE[*i].to_owned(), (*x).into())).collect(),
        effects: toml::Table::new(),
        payload: toml::Table::new(),
        sensors,
        truth: Vec::new(),
        key: TruthKey {
            case: String::new(),
            plant: TrialPlant::Manipulator,
            split,
            verdict: split.verdict().into(),
            effects: choices.iter().map(|c| c.id.to_owned()).collect(),
            components: choices.iter().map(|c| c.component.clone()).collect(),
            joints: choices.iter().map(|c| if c.of_joint { c.joint + 1 } else { 0 }).collect(),
            class: class.unwrap_or_default().iter().map(|c| (*c).to_owned()).collect(),
            drive: if s.values.flexible[0] { "flexible joint" } else { "rigid joints" }.into(),
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
            moved: BTreeMap::new(),
        },
    }
}

pub(super) fn parameters(v: &ArmValues) -> toml::Table {
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
