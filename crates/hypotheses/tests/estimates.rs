//! Parameters of the model alone with their uncertainty. Checks EST-21, EST-22.

use trueup_estimation::innovations::estimate::InnovationsEstimate;
use trueup_estimation::innovations::joint_frame::joint_frame_to_estimate;
use trueup_estimation::innovations::null::fit_null;
use trueup_models::joint::parameter as q;
use trueup_signals::ParameterValue;

use crate::made::{ALL, MadeJoint};

/// What is estimated, with its true value.
const TRUE: [(&str, f64); 3] = [("stiffness", 0.084), ("damping", 7.7e-5), ("coulombFriction", 5.2e-3)];

/// The joint whose recordings are made with `seed`, its parameters assumed 15 % too large, without a prior.
fn estimate(seed: u64, channels: &[&str]) -> InnovationsEstimate {
    let believed: Vec<(&str, ParameterValue)> =
        TRUE.iter().map(|(name, value)| (*name, ParameterValue::Number(1.15 * value))).collect();
    let made =
        MadeJoint { seed, recordings: (2, 700), channels, believed: &believed, ..MadeJoint::default() };
    let mut case = made.case();
    case.case.uncertain = TRUE.iter().map(|(name, _)| ((*name).to_owned(), 3.0)).collect();
    case.case.parameters.remove(q::NAMES[q::STATIC_FRICTION].0);
    let (mut frame, _) = joint_frame_to_estimate(&case).unwrap();
    let names: Vec<&str> = frame.plant.parameters().iter().map(|p| p.name).collect();
    frame.unknown.retain(|k| TRUE.iter().any(|(name, _)| name == &names[*k]));
    let null = fit_null(&mut frame);
    frame.theta.clone_from(&null.theta);
    frame.q.clone_from(&null.q);
    frame.estimate(null.zeros)
}

/// Value and standard error of a number.
fn number(e: &InnovationsEstimate, name: &str) -> (f64, f64) {
    let at = e.numbers.iter().position(|n| n.name == name).unwrap();
    (e.numbers[at].value, e.covariance[(at, at)].sqrt())
}

/// Errors are those that the covariance has: over many recordings their squares in standard errors are 1 on average.
#[test]
fn errors_are_as_large_as_their_standard_errors() {
    // Six of them: chi-squared within its 0.1 and 99.9 % quantiles, over 6.
    have_their_standard_errors(2, 0.063..3.75);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn errors_of_eight_recordings_are_as_large_as_their_standard_errors() {
    // Twenty-four of them: chi-squared within its 0.1 and 99.9 % quantiles, over 24.
    have_their_standard_errors(8, 0.35..2.2);
}

/// Of so many recordings: the mean of the squares in standard errors is in this range.
fn have_their_standard_errors(recordings: u64, mean_square: core::ops::Range<f64>) {
    let (mut squares, mut count) = (0.0, 0);
    for seed in 0..recordings {
        let e = estimate(700 + 10 * seed, ALL);
        assert!(e.ended, "{}", e.rounds);
        for (name, truth) in TRUE {
            let (value, error) = number(&e, name);
            let z = (value - truth) / error;
            println!("{seed} {name}: {value:.6e} +- {error:.1e}, {z:.2} off");
            assert!(z.abs() < 4.5 && error < 0.05 * truth, "{name}: {value} +- {error}, truth {truth}");
            squares += z * z;
            count += 1;
        }
        let white = e
            .innovations
            .iter()
            .map(|c| c.whitened.iter().map(|x| x * x).sum::<f64>() / c.whitened.len() as f64);
        for power in white {
            assert!((0.8..1.25).contains(&power), "{power}");
        }
    }
    let mean = squares / f64::from(count);
    assert!(mean_square.contains(&mean), "{mean}");
}

/// The torque of the spring is a reading: it determines the stiffness by itself, with the same value.
#[test]
fn a_torque_sensor_is_read() {
    let with: Vec<&str> = ALL.iter().copied().chain(["transmissionTorque"]).collect();
    let [plain, read] = [estimate(731, ALL), estimate(731, &with)];
    let [(k, error), (with_torque, smaller)] = [&plain, &read].map(|e| number(e, "damping"));
    println!("damping {k:.6e} +- {error:.1e}, with the torque {with_torque:.6e} +- {smaller:.1e}");
    assert!(smaller < 0.97 * error, "{error} {smaller}");
    for (name, truth) in TRUE {
        let (value, error) = number(&read, name);
        assert!((value - truth).abs() < 4.5 * error, "{name}: {value} +- {error}, truth {truth}");
    }
}
