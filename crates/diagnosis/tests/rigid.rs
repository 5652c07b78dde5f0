//! A joint that gives way, in a simulation that holds it to be rigid.
//!
//! The truth comes from a solver of this file's own; its spring stiffens with its deflection.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::diagnose::{Options, diagnose};
use trueup_diagnosis::outcome::Verdict;

const H: f64 = 0.002;
const N: usize = 2500;
const GEAR: f64 = 100.0;
const MOTOR_INERTIA: f64 = 3e-5;
const LOAD_INERTIA: f64 = 0.6;
const TORQUE_CONSTANT: f64 = 0.06;
const STIFFNESS: f64 = 0.1;
const CUBIC: f64 = 0.05;
const DAMPING: f64 = 4e-5;
const COULOMB: f64 = 0.008;
const VISCOUS: f64 = 4e-5;
const MOTOR_NOISE: f64 = 2e-4;
const LOAD_NOISE: f64 = 3e-6;
const CURRENT_NOISE: f64 = 2e-4;

/// A recording as CSV, of a drive with such a spring or without one; explicit midpoint steps.
fn record(seed: u64, rigid: bool) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let phase = seed as f64;
    let current = |t: f64| 0.5 * (4.3 * t + phase).sin() + 0.3 * (11.9 * t + 2.0 * phase).cos();
    let reflected = LOAD_INERTIA / GEAR.powi(2);
    let rates = |u: f64, x: &[f64; 4]| {
        let [q, w, l, v] = *x; // the load's motion times the gear ratio
        let drive = TORQUE_CONSTANT * u - COULOMB * (w / 0.05).tanh() - VISCOUS * w;
        if rigid {
            let a = drive / (MOTOR_INERTIA + reflected);
            return [w, a, w, a];
        }
        let spring = STIFFNESS * (q - l) + CUBIC * (q - l).powi(3) + DAMPING * (w - v);
        [w, (drive - spring) / MOTOR_INERTIA, v, spring / reflected]
    };
    let mut x = [0.0; 4];
    let mut csv = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
    for k in 0..N {
        let t = k as f64 * H;
        let mut noise = |sd: f64| sd * rng.sample::<f64, _>(StandardNormal);
        let [u, m, l] =
            [current(t) + noise(CURRENT_NOISE), x[0] + noise(MOTOR_NOISE), x[2] / GEAR + noise(LOAD_NOISE)];
        writeln!(csv, "{t:?},{u:?},{m:?},{l:?}").unwrap();
        let sub = 100;
        let h = H / f64::from(sub);
        for i in 0..sub {
            let t = t + f64::from(i) * h;
            let a = rates(current(t), &x);
            let half = std::array::from_fn(|i| x[i] + 0.5 * h * a[i]);
            let b = rates(current(t + 0.5 * h), &half);
            x = std::array::from_fn(|i| x[i] + h * b[i]);
        }
    }
    csv
}

fn diagnosed(rigid: bool) -> trueup_diagnosis::outcome::Diagnosis {
    let folder = tempfile::tempdir().unwrap();
    for seed in 1..=4 {
        std::fs::write(folder.path().join(format!("{seed}.csv")), record(seed, rigid)).unwrap();
    }
    let case = format!(
        "model = \"TwoMassJoint\"\ntrain = [\"1.csv\", \"2.csv\", \"3.csv\"]\nholdout = [\"4.csv\"]\n\
         [parameters]\njointFlexible = false\nmotorInertia = {MOTOR_INERTIA:?}\nloadInertia = {LOAD_INERTIA:?}\n\
         gearRatio = {GEAR:?}\ntorqueConstant = {TORQUE_CONSTANT:?}\ncoulombFriction = {COULOMB:?}\n\
         viscousFriction = {VISCOUS:?}\n[channels.motorAngle]\nnoise = {MOTOR_NOISE:?}\n\
         [channels.loadAngle]\nnoise = {LOAD_NOISE:?}\n[channels.motorCurrent]\nnoise = {CURRENT_NOISE:?}\n"
    );
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let (loaded, _) = trueup_signals::Case::load(folder.path(), |_| Ok(Vec::new())).unwrap();
    diagnose(&loaded, &Options::default(), &mut |_, _| ()).unwrap().diagnosis
}

#[test]
fn a_rigid_simulation_of_a_flexible_joint_lacks_its_flexibility() {
    let found = diagnosed(false);
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!((found.verdict, &named[..]), (Verdict::Effects, &["joint-flexibility"][..]));
    let stiffness = &found.effects[0].parameters["stiffness"];
    assert!((stiffness.value / STIFFNESS - 1.0).abs() < 0.3, "{stiffness:?}");
    let gap = found.gap.overall.unwrap();
    assert!(gap.after < 0.5 * gap.tuned, "{gap:?}");
}

#[test]
fn a_rigid_joint_lacks_nothing() {
    let found = diagnosed(true);
    assert_eq!(
        found.verdict,
        Verdict::NoGap,
        "{:?}",
        found.effects.iter().map(|e| &e.id).collect::<Vec<_>>()
    );
}
