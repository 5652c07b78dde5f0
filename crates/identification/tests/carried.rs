//! Noise of a measured current, carried through the simulation: estimates are as sure as they say, residuals white.

#![allow(clippy::unwrap_used)]

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use trueup_identification::fit::{FitOptions, fit, fit_carried};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::predict::{InputMap, PredictionPlan};
use trueup_identification::recorded::nuisance;
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_identification::unknown::FitUnknown;
use trueup_models::joint::{input, output, parameter as p};

use crate::plants::joint;

const NAMES: [&str; 4] = ["stiffness", "damping", "coulombFriction", "viscousFriction"];
/// A small geared drive.
fn truth(model: &SimulatedPlant) -> Vec<f64> {
    let mut q = model.defaults();
    for (i, v) in [
        (p::MOTOR_INERTIA, 1.7e-5),
        (p::LOAD_INERTIA, 0.8),
        (p::STIFFNESS, 0.084),
        (p::DAMPING, 7.7e-5),
        (p::COULOMB_FRICTION, 5.2e-3),
        (p::VISCOUS_FRICTION, 5.6e-5),
        (p::STATIC_FRICTION, 5.2e-3),
        (p::GEAR_RATIO, 160.0),
        (p::TORQUE_CONSTANT, 0.04),
    ] {
        q[i] = v;
    }
    q
}

fn recording(model: &SimulatedPlant, q: &[f64], seed: u64, k: usize) -> IdentificationRun {
    let mut rng = StdRng::seed_from_u64(seed * 10 + k as u64);
    let t: Vec<f64> = (0..1500).map(|k| f64::from(k) * 2e-3).collect();
    let current = |t: &f64| 0.5 * (6.0 * t + k as f64).sin() + 0.15 * (37.0 * t).sin();
    let u: Vec<f64> = t.iter().map(current).collect();
    let channel = |name: &str, output, resolution: f64, noise: f64| OutputChannel {
        name: name.into(),
        output,
        t: t.clone(),
        y: vec![0.0; t.len()],
        sigma: noise.hypot(resolution / 12f64.sqrt()),
        resolution,
        ..OutputChannel::default()
    };
    let drive = InputDrive {
        input: input::MOTOR_CURRENT,
        t: t.clone(),
        u,
        between: InputInterpolation::Hold,
        sigma: 1e-3,
        offset: None,
        gain: None,
        late: None,
    };
    let mut run = IdentificationRun {
        name: format!("{k}"),
        drives: vec![drive],
        channels: vec![
            channel("motorAngle", output::MOTOR_ANGLE, 1.5e-3, 4.4e-4),
            channel("loadAngle", output::LOAD_ANGLE, 1.7e-5, 1.0e-5),
        ],
        ..IdentificationRun::default()
    };
    let plan = PredictionPlan::new(&run, 2);
    let shown = model.predict(&plan, q, &InputMap::default(), false).unwrap();
    for (c, channel) in run.channels.iter_mut().enumerate() {
        let noise = Normal::new(0.0, [4.4e-4, 1.0e-5][c]).unwrap();
        for (y, s) in channel.y.iter_mut().zip(&shown.y[plan.channels()[c]..]) {
            *y = ((s + noise.sample(&mut rng)) / channel.resolution).round() * channel.resolution;
        }
    }
    let noise = Normal::new(0.0, 1e-3).unwrap();
    run.drives[0].u.iter_mut().for_each(|u| *u += noise.sample(&mut rng));
    run
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn estimates_are_as_sure_as_they_say() {
    let model = joint(&[]);
    let q = truth(&model);
    let (mut z, mut worse, mut floor) = (Vec::new(), 0.0, Vec::new());
    for seed in 0..12 {
        let runs: Vec<IdentificationRun> = (0..2).map(|k| recording(&model, &q, seed, k)).collect();
        let index = |n: &str| model.parameter(n).unwrap();
        let mut unknowns: Vec<FitUnknown> =
            NAMES.iter().map(|n| FitUnknown::positive(n, index(n), 1.1 * q[index(n)])).collect();
        unknowns.extend(nuisance(&model, &q, &runs));
        let mut problem = OutputError::new(&model, &q, &runs, unknowns);
        let plain = fit(&problem, &FitOptions::default()).unwrap();
        let f = fit_carried(&mut problem, &FitOptions::default()).unwrap();
        for (k, n) in NAMES.iter().enumerate() {
            let error = f.theta[k] - q[index(n)].ln();
            z.push(error / f.information.covariance[(k, k)].sqrt());
            worse += f64::from(u8::from((plain.theta[k] - q[index(n)].ln()).abs() > error.abs())) / 48.0;
        }
        floor.extend(f.comparisons.iter().map(trueup_identification::fit::ChannelComparison::above_floor));
        println!("{seed}: {:?} {:?}", &z[z.len() - 4..], &floor[floor.len() - 4..]);
    }
    // 48 values of N(0, 1): their mean square is within 0.6 .. 1.5 with 98 %.
    let mean = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
    assert!((0.6..1.5).contains(&mean), "{mean}: {z:?}");
    assert!(worse > 0.6, "the plain fit is worse in only {worse}");
    assert!(floor.iter().all(|f| (0.9..1.15).contains(f)), "{floor:?}");
}
