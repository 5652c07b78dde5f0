//! Output error on noise-free recordings made by the adaptive driver: the truth comes back.

#![allow(clippy::unwrap_used)]

use trueup_identification::lsq::{SolverOptions, solve};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_identification::unknown::{FitTarget, FitUnknown};
use trueup_models::joint::{output, parameter as p};
use trueup_models::presets::delian;
use trueup_numerics::driver::{DriverOptions, simulate};

use crate::plants::joint;

const FITTED: [(&str, usize); 6] = [
    ("stiffness", p::STIFFNESS),
    ("damping", p::DAMPING),
    ("coulombFriction", p::COULOMB_FRICTION),
    ("viscousFriction", p::VISCOUS_FRICTION),
    ("staticFriction", p::STATIC_FRICTION),
    ("loadInertia", p::LOAD_INERTIA),
];

/// Positive and negative pulses with coasting in between, as ramps between samples.
fn recording(model: &SimulatedPlant, q: &[f64], amplitude: f64) -> IdentificationRun {
    let t: Vec<f64> = (0..1500).map(|k| k as f64 * 2e-3).collect();
    let u: Vec<f64> = t.iter().map(|t| amplitude * (2.0 * (7.3 * t).sin()).clamp(-1.0, 1.0)).collect();
    let input = |time: f64, v: &mut [f64]| {
        let k = ((time * 500.0) as usize).min(t.len() - 2);
        v[0] = u[k] + (u[k + 1] - u[k]) * (time - t[k]) * 500.0;
    };
    let options = DriverOptions { tolerance: 1e-13, ..DriverOptions::default() };
    let truth = simulate(model.joint().unwrap(), q, &[1.0, 100.0, 1.0, 1e-3], options, &input, &t).unwrap();
    let channel = |output: usize, sigma: f64| OutputChannel {
        output,
        t: t.clone(),
        y: truth.y.iter().map(|y| y[output]).collect(),
        sigma,
        ..OutputChannel::default()
    };
    IdentificationRun {
        name: format!("{amplitude} A"),
        channels: vec![channel(output::MOTOR_ANGLE, 0.004), channel(output::LOAD_ANGLE, 5e-6)],
        drives: vec![InputDrive {
            input: 0,
            t: t.clone(),
            u,
            between: InputInterpolation::Linear,
            ..InputDrive::default()
        }],
        ..IdentificationRun::default()
    }
}

#[test]
fn truth_comes_back_from_noise_free_recordings() {
    let model = joint(&[]);
    for joint in 1..=3 {
        let q = delian(joint).unwrap();
        let runs = [recording(&model, &q, 0.018), recording(&model, &q, 0.025)];
        let mut nominal = q;
        let mut unknowns: Vec<FitUnknown> = FITTED
            .iter()
            .zip([1.1, 0.7, 1.1, 0.8, 0.97, 0.95])
            .map(|((name, i), wrong)| FitUnknown::positive(name, *i, q[*i] * wrong))
            .collect();
        for run in 0..runs.len() {
            unknowns.push(FitUnknown::free(
                "loadAngle",
                FitTarget::Offset(output::LOAD_ANGLE),
                Some(run),
                1e-4,
            ));
        }
        FITTED.iter().for_each(|(_, i)| nominal[*i] = f64::NAN);
        let problem = OutputError::new(&model, &nominal, &runs, unknowns);
        let options = SolverOptions { cost_tolerance: 1e-14, ..SolverOptions::default() };
        let found = solve(&problem, &problem.start(), options).unwrap();
        let values = problem.values(&found.x);
        for ((name, i), value) in FITTED.iter().zip(&values) {
            let error = value / q[*i] - 1.0;
            assert!(
                error.abs() < 1e-6,
                "joint {joint} {name}: {error:e} after {} ({:?})",
                found.iterations,
                found.stop
            );
        }
        assert!(values[6].abs() < 1e-10 && values[7].abs() < 1e-10, "{values:?}");
    }
}
