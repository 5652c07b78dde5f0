//! The predictor against the adaptive driver, its derivatives against central differences.

#![allow(clippy::unwrap_used)]

use trueup_identification::model::SimulatedPlant;
use trueup_identification::predict::{InputMap, PredictionPlan};
use trueup_identification::predictor::Predictor;
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_models::joint::{output, parameter as p};
use trueup_models::presets::delian;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes};

use crate::plants::joint;

/// Readings of motor and load angle at a rate, driven by `current`.
fn run(rate: f64, stop: f64, between: InputInterpolation, current: impl Fn(f64) -> f64) -> IdentificationRun {
    let t: Vec<f64> = (0..=(stop * rate) as usize).map(|k| k as f64 / rate).collect();
    let channel = |output| OutputChannel {
        output,
        t: t.clone(),
        y: vec![0.0; t.len()],
        sigma: 1.0,
        ..OutputChannel::default()
    };
    IdentificationRun {
        drives: vec![InputDrive {
            input: 0,
            t: t.clone(),
            u: t.iter().map(|t| current(*t)).collect(),
            between,
            ..InputDrive::default()
        }],
        channels: vec![
            channel(output::MOTOR_ANGLE),
            channel(output::LOAD_ANGLE),
            channel(output::MOTOR_VELOCITY),
        ],
        ..IdentificationRun::default()
    }
}

/// Sticks and slides many times in both directions.
fn rocking(t: f64) -> f64 {
    0.018 * (2.0 * std::f64::consts::PI * 1.3 * t).sin() + 0.006 * (9.1 * t).cos()
}

fn angles(model: &SimulatedPlant, run: &IdentificationRun, q: &[f64]) -> (Vec<f64>, usize) {
    let plan = PredictionPlan::new(run, 2);
    let found = model.predict(&plan, q, &InputMap::default(), false).unwrap();
    (found.y, found.events.len())
}

fn against_driver(model: &SimulatedPlant, q: &[f64], tolerance: f64) {
    let run = run(500.0, 4.0, InputInterpolation::Linear, rocking);
    let (y, events) = angles(model, &run, q);
    let drive = &run.drives[0];
    let input = |t: f64, u: &mut [f64]| {
        let k = ((t * 500.0) as usize).min(drive.t.len() - 2);
        u[0] = drive.u[k] + (drive.u[k + 1] - drive.u[k]) * (t - drive.t[k]) * 500.0;
    };
    let options = DriverOptions { tolerance: 1e-13, ..DriverOptions::default() };
    let reference =
        simulate(model.joint().unwrap(), q, &[1.0, 100.0, 1.0, 1e-3], options, &input, &run.channels[0].t)
            .unwrap();
    let changes = reference.events.windows(2).filter(|w| w[0].1 != w[1].1).count() + 1;
    assert!(events >= 10, "{events}");
    assert!(events.abs_diff(changes) <= 1, "{events} {changes}");
    let len = run.channels[0].t.len();
    let motion = reference.y.iter().map(|y| y[0].abs()).fold(0.0, f64::max);
    for (c, o) in [output::MOTOR_ANGLE, output::LOAD_ANGLE].into_iter().enumerate() {
        let scale = if c == 0 { motion } else { motion / q[p::GEAR_RATIO] };
        for k in 0..len {
            let error = (y[c * len + k] - reference.y[k][o]).abs();
            assert!(error < tolerance * scale, "channel {c} sample {k}: {error} of {scale}");
        }
    }
}

#[test]
fn exact_steps_agree_with_the_adaptive_driver_through_stick_slip() {
    against_driver(&joint(&[]), &delian(2).unwrap(), 1e-9);
}

#[test]
fn runge_kutta_steps_agree_with_the_adaptive_driver() {
    let model = joint(&["nonlinear-stiffness"]);
    assert!(!model.plant().affine());
    let mut q = delian(2).unwrap().to_vec();
    q.resize(model.sizes().parameters, 1e-7);
    against_driver(&model, &q, 1e-5);
}

fn derivatives(
    model: &SimulatedPlant,
    q: &[f64],
    run: &IdentificationRun,
    at_rest: bool,
    tolerance: f64,
) -> usize {
    const N: usize = 9;
    let plan = PredictionPlan::new(run, 2);
    let predict_f = |q: &[f64]| model.predict(&plan, q, &InputMap::default(), at_rest).unwrap();
    let plain = predict_f(q);
    // As many unknowns at once as a number has derivatives.
    let found: Vec<Vec<Lanes>> = (0..N)
        .step_by(LANES)
        .map(|begin| {
            let dual: Vec<Lanes> = (q.iter().enumerate())
                .map(|(i, v)| match i.checked_sub(begin) {
                    Some(lane) if i < N => Dual::variable(*v, lane),
                    _ => Dual::constant(*v),
                })
                .collect();
            model.readings_along(&plan, &dual, &InputMap::default(), at_rest).unwrap()
        })
        .collect();
    for found in &found {
        for (a, b) in found.iter().zip(&plain.y) {
            assert_eq!(a.re.to_bits(), b.to_bits());
        }
    }
    for i in (0..N).filter(|&i| q[i] != 0.0) {
        let at = |f: f64| {
            let mut moved = q.to_vec();
            moved[i] *= 1.0 + f;
            predict_f(&moved)
        };
        // Central difference of fourth order.
        let h = 1e-4;
        let moved = [at(2.0 * h), at(h), at(-h), at(-2.0 * h)];
        let [a, b, c, d] = [&moved[0].y, &moved[1].y, &moved[2].y, &moved[3].y];
        for channel in 0..run.channels.len() {
            let range = plan.channels()[channel]..plan.channels()[channel + 1];
            let exact: Vec<f64> = range.clone().map(|k| found[i / LANES][k].eps[i % LANES] * q[i]).collect();
            let scale = exact.iter().fold(0.0f64, |m, v| m.max(v.abs()));
            let motion = plain.y[range.clone()].iter().fold(0.0f64, |m, v| m.max(v.abs()));
            for (k, exact) in range.clone().zip(exact) {
                // An event that passes a reading while the parameter is moved leaves it without a difference quotient.
                let modes = plain.modes.len() / plain.y.len();
                let of = |p: &[i32]| p[k * modes..][..modes].to_vec();
                if moved.iter().any(|m| of(&m.modes) != of(&plain.modes)) {
                    continue;
                }
                let difference = (8.0 * (b[k] - c[k]) - (a[k] - d[k])) / (12.0 * h);
                // Rounding adds up to 1e-13 of what moves, over the step.
                assert!(
                    (difference - exact).abs() <= tolerance * scale + 1e-13 * motion / h,
                    "parameter {i} channel {channel} sample {}: {difference} {exact} {scale} {motion}",
                    k - range.start
                );
            }
        }
    }
    plain.events.len()
}

#[test]
fn derivatives_are_those_of_central_differences_through_many_events() {
    let model = joint(&[]);
    for joint in 1..=3 {
        let mut q = delian(joint).unwrap();
        q[p::STATIC_FRICTION] = 1.6e-4;
        let events =
            derivatives(&model, &q, &run(500.0, 6.0, InputInterpolation::Linear, rocking), false, 1e-5);
        assert!(events >= 15, "joint {joint}: {events} events");
    }
}

#[test]
fn derivatives_hold_with_runge_kutta_and_play() {
    let model = joint(&["backlash", "nonlinear-stiffness"]);
    let mut q = delian(2).unwrap().to_vec();
    q.extend([0.5, 1e-7, 0.0, 2.0]);
    let events = derivatives(&model, &q, &run(500.0, 3.0, InputInterpolation::Linear, rocking), false, 1e-4);
    assert!(events >= 10, "{events}");
}

#[test]
fn at_rest_the_spring_carries_the_load_torque_and_nothing_moves() {
    let model = joint(&[]);
    let mut run = run(100.0, 1.0, InputInterpolation::Hold, |_| 0.0);
    run.drives.push(InputDrive {
        input: 1,
        t: vec![0.0],
        u: vec![5.0],
        between: InputInterpolation::Hold,
        ..InputDrive::default()
    });
    let q = delian(2).unwrap();
    let plan = PredictionPlan::new(&run, 2);
    let found = model.predict(&plan, &q, &InputMap::default(), true).unwrap();
    let len = run.channels[0].t.len();
    let twist = -5.0 / (q[p::GEAR_RATIO] * q[p::STIFFNESS]);
    for k in 0..len {
        assert_eq!(found.y[k], 0.0);
        assert!((found.y[len + k] * q[p::GEAR_RATIO] + twist).abs() < 1e-9 * twist.abs());
    }
    let _ = derivatives(&model, &q, &run, true, 1e-7);
}
