//! Break-away from slow ramps, Young's modulus, shares of the first mode.

#![allow(clippy::unwrap_used)]

use nalgebra::DMatrix;
use trueup_identification::predict::{InputMap, PredictionPlan};
use trueup_identification::quasi_static::*;
use trueup_identification::run::{IdentificationRun, InputDrive, OutputChannel};
use trueup_models::joint::{output, parameter as p};
use trueup_models::presets::delian;

use crate::plants::joint;

#[test]
fn static_friction_from_slow_ramps_of_every_joint() {
    let model = joint(&[]);
    for joint in 1..=3 {
        let q = delian(joint).unwrap();
        let count = 2.0 * std::f64::consts::PI / 16.0;
        let mut all = Vec::new();
        // Ramps of 1 to 4 mA/s both ways, read by the poor encoder at 100 Hz.
        for slope in [1e-3, -2e-3, 4e-3] {
            let t: Vec<f64> = (0..2500).map(|k| f64::from(k) * 0.01).collect();
            let u: Vec<f64> = t.iter().map(|t| slope * t).collect();
            let channel = OutputChannel {
                output: output::MOTOR_ANGLE,
                t: t.clone(),
                y: vec![0.0; t.len()],
                ..OutputChannel::default()
            };
            let run = IdentificationRun {
                drives: vec![InputDrive { t: t.clone(), u: u.clone(), ..InputDrive::default() }],
                channels: vec![channel],
                ..IdentificationRun::default()
            };
            let angle =
                model.predict(&PredictionPlan::new(&run, 2), &q, &InputMap::default(), false).unwrap().y;
            let read: Vec<f64> = angle.iter().map(|q| (q / count).round() * count).collect();
            all.push(breakaway(&t, &u, &read, q[p::TORQUE_CONSTANT], 0.0, 2.0 * count).unwrap());
        }
        for b in &all {
            let error = b.static_friction - q[p::STATIC_FRICTION];
            // The encoder's first count passes within two samples at a thousand rad/s2.
            assert!(error.abs() <= 5.0 * b.late, "joint {joint}: {b:?} off by {error}");
        }
        let (mean, se) = static_friction(&all);
        assert!((mean / q[p::STATIC_FRICTION] - 1.0).abs() < 0.02, "{mean}");
        assert!(se.unwrap() > 0.0);
    }
}

#[test]
fn what_never_moves_is_said() {
    let t: Vec<f64> = (0..20).map(f64::from).collect();
    let e = breakaway(&t, &t, &[0.0; 20], 0.02, 0.0, 0.1).unwrap_err();
    assert!(e.to_string().contains("never breaks away"));
    assert!(breakaway(&t, &t[1..], &t, 0.02, 0.0, 0.1).is_err());
}

#[test]
fn youngs_modulus_of_a_cantilever() {
    // A steel ruler: 20 x 1 mm, 0.3 m, 0.1 kg; d = F L^3/(3 E J) = 0.025225... m by hand with E = 210 GPa.
    let (j, f) = (20e-3 * 1e-9 / 12.0, 0.1 * 9.81);
    let d = f * 0.027 / (3.0 * 210e9 * j);
    let (e, error) = youngs_modulus(f, 0.3, j, d, 0.01 * d).unwrap();
    assert!((e / 210e9 - 1.0).abs() < 1e-12 && (error / e - 0.01).abs() < 1e-12);
    // S3 table 3 against the nominal 78 GPa: +19.83 % and +11.83 % (printed 12.05).
    assert!((93.47f64 / 78.0 - 1.1983).abs() < 1e-4 && (87.23f64 / 78.0 - 1.1183).abs() < 1e-4);
    assert!(youngs_modulus(1.0, 1.0, 1.0, 0.0, 0.0).is_err());
}

#[test]
fn shares_of_the_first_mode_keep_rayleighs_bound() {
    // Two equal masses on two equal springs: omega^2 = (3 - sqrt 5)/2; shape (1, golden ratio).
    let mass = DMatrix::identity(2, 2);
    let springs = [
        DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 0.0]),
        DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -1.0, 1.0]),
    ];
    let m = first_mode(&mass, &springs, 0.2).unwrap();
    assert!((m.frequency.powi(2) - (3.0 - 5f64.sqrt()) / 2.0).abs() < 1e-12);
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let share = 1.0 / (1.0 + (golden - 1.0).powi(2));
    assert!((m.shares[0] - share).abs() < 1e-12 && (m.shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(FirstMode::within_rayleigh(&m.rises, 0.2), "{:?}", m.rises);
    // S3 table 5: 2.2, 1.7, 0.7, 7.9, 4.6 % cannot be of any linear conservative system.
    let printed: Vec<f64> =
        [4.45f64, 3.43, 1.40, 16.42, 9.41].map(|s| (1.0 + s / 100.0).sqrt() - 1.0).to_vec();
    assert!(!FirstMode::within_rayleigh(&printed, 0.2));
    assert!(first_mode(&mass, &springs[..1], 0.2).is_err(), "a mass without a spring");
}
