//! What acts in reversals alone, which balances bridge: free runs have to tell.
//!
//! The truth comes from a solver and friction law of this file's own.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::diagnose::{Options, diagnose};

const H: f64 = 0.002;
const N: usize = 2500;
const GEAR: f64 = 100.0;
const MOTOR_INERTIA: f64 = 1e-4;
const LOAD_INERTIA: f64 = 3.0;
const TORQUE_CONSTANT: f64 = 0.05;
const STIFFNESS: f64 = 0.4;
const DAMPING: f64 = 4e-4;
const COULOMB: f64 = 0.012;
const VISCOUS: f64 = 2e-4;
const MOTOR_NOISE: f64 = 5e-4;
const LOAD_NOISE: f64 = 2e-5;
const CURRENT_NOISE: f64 = 2e-5;
/// Torque per rad of bristles that the motor's friction bends before it slides.
const BRISTLES: f64 = 0.8;

/// A recording as CSV: Dahl's friction, explicit midpoint steps.
fn record(seed: u64) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let phase = seed as f64;
    let current = |t: f64| 0.7 * (2.3 * t + phase).sin() + 0.35 * (5.9 * t + 2.0 * phase).cos();
    let reflected = LOAD_INERTIA / GEAR.powi(2);
    let rates = |u: f64, x: &[f64; 5]| {
        let [q, w, l, v, z] = *x; // the load's motion times the gear ratio; friction's torque
        let spring = STIFFNESS * (q - l) + DAMPING * (w - v);
        let drive = TORQUE_CONSTANT * u - z - VISCOUS * w;
        let bend = BRISTLES * w * (1.0 - z / COULOMB * w.signum());
        [w, (drive - spring) / MOTOR_INERTIA, v, spring / reflected, bend]
    };
    let mut x = [0.0; 5];
    let mut csv = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
    for k in 0..N {
        let t = k as f64 * H;
        let mut noise = |sd: f64| sd * rng.sample::<f64, _>(StandardNormal);
        let [u, m, l] =
            [current(t) + noise(CURRENT_NOISE), x[0] + noise(MOTOR_NOISE), x[2] / GEAR + noise(LOAD_NOISE)];
        writeln!(csv, "{t:?},{u:?},{m:?},{l:?}").unwrap();
        let sub = 40;
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

#[test]
fn presliding_that_balances_bridge_is_named_by_free_runs() {
    let folder = tempfile::tempdir().unwrap();
    for seed in 1..=4 {
        std::fs::write(folder.path().join(format!("{seed}.csv")), record(seed)).unwrap();
    }
    let case = format!(
        "model = \"TwoMassJoint\"\ntrain = [\"1.csv\", \"2.csv\", \"3.csv\"]\nholdout = [\"4.csv\"]\n\
         [parameters]\nmotorInertia = {MOTOR_INERTIA:?}\nloadInertia = {LOAD_INERTIA:?}\ngearRatio = {GEAR:?}\n\
         torqueConstant = {TORQUE_CONSTANT:?}\nstiffness = {STIFFNESS:?}\ndamping = {DAMPING:?}\n\
         coulombFriction = {COULOMB:?}\nviscousFriction = {VISCOUS:?}\n\
         [channels.motorAngle]\nnoise = {MOTOR_NOISE:?}\n[channels.loadAngle]\nnoise = {LOAD_NOISE:?}\n\
         [channels.motorCurrent]\nnoise = {CURRENT_NOISE:?}\n"
    );
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let (loaded, _) = trueup_signals::Case::load(folder.path(), |_| Ok(Vec::new())).unwrap();
    let found = diagnose(&loaded, &Options::default(), &mut |_, _| ()).unwrap().diagnosis;
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(named.first(), Some(&"presliding-friction"), "{:?} {named:?}", found.verdict);
    let gap = found.gap.overall.unwrap();
    assert!(gap.after < 0.5 * gap.tuned, "{gap:?}");
}
