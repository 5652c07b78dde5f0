//! A coarse encoder's readings as counts: what their edges know, and an error that is no white noise.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::f64::consts::{LN_2, TAU};

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_identification::covariance::Information;
use trueup_identification::fit::{cost, refine};
use trueup_identification::lsq::{LeastSquares, Loss, SolverOptions, solve};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_identification::unknown::{FitTarget, FitUnknown};
use trueup_models::joint::{output, parameter as p};
use trueup_models::presets::delian;
use trueup_numerics::driver::{DriverOptions, simulate};

use crate::plants::joint;

const FITTED: [(&str, usize); 4] = [
    ("stiffness", p::STIFFNESS),
    ("damping", p::DAMPING),
    ("coulombFriction", p::COULOMB_FRICTION),
    ("viscousFriction", p::VISCOUS_FRICTION),
];
const AMR: f64 = TAU / 360.0 * 1e-3;

/// Four runs of the joint at 1 kHz by the adaptive driver, without noise; 16 counts per turn of the motor.
fn exact(model: &SimulatedPlant, q: &[f64], level: f64) -> IdentificationRun {
    let t: Vec<f64> = (0..1500).map(|k| f64::from(k) * 1e-3).collect();
    let current = |t: f64| if t < 0.05 || (0.55..0.9).contains(&t) { 0.0 } else { level };
    let input = |time: f64, v: &mut [f64]| v[0] = current(((time * 1000.0 + 1e-9).floor()) / 1000.0);
    let options = DriverOptions { tolerance: 1e-12, ..DriverOptions::default() };
    let truth = simulate(model.joint().unwrap(), q, &[1.0, 100.0, 1.0, 1e-3], options, &input, &t).unwrap();
    let channel = |output: usize, resolution: f64| OutputChannel {
        output,
        t: t.clone(),
        y: truth.y.iter().map(|y| y[output]).collect(),
        sigma: resolution / 12f64.sqrt(),
        resolution,
        ..OutputChannel::default()
    };
    IdentificationRun {
        channels: vec![channel(output::MOTOR_ANGLE, TAU / 16.0), channel(output::LOAD_ANGLE, AMR)],
        drives: vec![InputDrive {
            t: t.clone(),
            u: t.iter().map(|t| current(*t)).collect(),
            between: InputInterpolation::Hold,
            ..InputDrive::default()
        }],
        at_rest: true,
        ..IdentificationRun::default()
    }
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn counts_know_more_than_white_noise_of_their_size() {
    let model = joint(&[]);
    let q = delian(2).unwrap();
    let clean: Vec<IdentificationRun> =
        [0.018, 0.021, 0.025, -0.03].map(|level| exact(&model, &q, level)).to_vec();
    let mut rng = StdRng::seed_from_u64(7);
    let (mut plain, mut counted, seeds) = ([0.0; 4], [0.0; 4], 8);
    for _ in 0..seeds {
        let mut runs = clean.clone();
        let mut truth: Vec<f64> = FITTED.iter().map(|(_, i)| q[*i].ln()).collect();
        let mut unknowns: Vec<FitUnknown> =
            FITTED.iter().map(|(name, i)| FitUnknown::positive(name, *i, 1.1 * q[*i])).collect();
        for (r, run) in runs.iter_mut().enumerate() {
            let phase = rng.random_range(-0.5..0.5);
            for channel in &mut run.channels {
                let step = channel.resolution;
                channel.y.iter_mut().for_each(|y| *y = (*y / step + phase).round() * step);
                channel.weigh_rests();
                let target = FitTarget::Offset(channel.output);
                unknowns.push(FitUnknown {
                    prior: Some((0.0, 1.0 / 12f64.sqrt())),
                    ..FitUnknown::free("offset", target, Some(r), step)
                });
                truth.push(phase);
            }
        }
        let problem = OutputError::new(&model, &q, &runs, unknowns);
        let bound = Information::new(&problem.evaluate(&truth, true).unwrap().jacobian.unwrap());
        let first = solve(&problem, &problem.start(), SolverOptions::default()).unwrap();
        let (slack, finer) = refine(&problem, &first, Loss::Squares).unwrap();
        assert!(slack < 0.1, "{slack}");
        for k in 0..4 {
            let sd = bound.covariance[(k, k)].sqrt();
            plain[k] += ((first.x[k] - truth[k]) / sd).powi(2) / f64::from(seeds);
            counted[k] += ((finer.x[k] - truth[k]) / sd).powi(2) / f64::from(seeds);
        }
    }
    for (k, (name, _)) in FITTED.iter().enumerate() {
        let (plain, counted) = (plain[k].sqrt(), counted[k].sqrt());
        println!("{name}: rms over the bound of independent errors {plain:.2}, as counts {counted:.2}");
        assert!(counted < 1.0 && counted < 0.8 * plain, "{name}: {counted} against {plain}");
    }
}

/// Where the model is not as right as a count, nothing is read into the counts.
#[test]
fn a_wrong_model_is_left_with_normal_errors() {
    let model = joint(&[]);
    let q = delian(2).unwrap();
    let mut run = exact(&model, &q, 0.021);
    for channel in &mut run.channels {
        let step = channel.resolution;
        // An error of the drive at twice its angle, eight counts large.
        channel.y.iter_mut().for_each(|y| *y = (*y / step + 8.0 * (2.0 * *y).sin()).round() * step);
    }
    let runs = [run];
    let unknowns = FITTED.iter().map(|(name, i)| FitUnknown::positive(name, *i, q[*i])).collect();
    let problem = OutputError::new(&model, &q, &runs, unknowns);
    let first = solve(&problem, &problem.start(), SolverOptions::default()).unwrap();
    assert!(refine(&problem, &first, Loss::Squares).is_none());
}

/// A sensor at rest has one reading, however often.
#[test]
fn a_rest_says_no_more_for_lasting() {
    let model = joint(&[]);
    let q = delian(2).unwrap();
    let step = TAU / 16.0;
    for length in [100, 1000] {
        let mut channel = OutputChannel {
            output: output::MOTOR_ANGLE,
            t: (0..length).map(|k| f64::from(k) * 1e-3).collect(),
            y: (0..length).map(|_| 0.0).collect(),
            sigma: step / 12f64.sqrt(),
            resolution: step,
            ..OutputChannel::default()
        };
        channel.weigh_rests();
        let drives = vec![InputDrive { t: vec![0.0], u: vec![0.0], ..InputDrive::default() }];
        let runs = [IdentificationRun {
            channels: vec![channel],
            drives,
            at_rest: true,
            ..IdentificationRun::default()
        }];
        let offset = FitUnknown::free("offset", FitTarget::Offset(output::MOTOR_ANGLE), None, step);
        let mut problem = OutputError::new(&model, &q, &runs, vec![offset]);
        problem.read_intervals(Some(0.025));
        // On the edge of its count each reading is half as likely as within, and there are two of them.
        let found = cost(&problem, &[0.5], Loss::Squares).unwrap();
        assert!((found - 2.0 * LN_2).abs() < 1e-9, "{length}: {found}");
    }
}
