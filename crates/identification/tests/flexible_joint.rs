//! Recovery of the flexible joint's parameters from runs made with known ones.
#![allow(clippy::unwrap_used)]

use crate::testbed::run;
use trueup_identification::flexible_joint::{JointSearchMethod, fit};

const TRUTH: [f64; 4] = [5.6, 5.47, 0.5, 0.048_869]; // 2.8 deg

#[test]
#[ignore = "long: ./test --full runs it"]
fn without_noise_the_truth_comes_back_by_both_methods() {
    comes_back(true);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn without_noise_the_truth_comes_back_from_the_motion() {
    comes_back(false);
}

#[test]
fn without_noise_the_truth_comes_back_by_the_gradient() {
    let found = fit(&run(TRUTH, true, 0.0, 1), JointSearchMethod::Gradient).unwrap();
    for (e, truth) in found.estimates.iter().zip(TRUTH) {
        assert!((e.value / truth - 1.0).abs() < 2e-3, "{found:?}");
    }
}

fn comes_back(by_torque: bool) {
    let run = run(TRUTH, by_torque, 0.0, 1);
    let mut costs = Vec::new();
    for method in [JointSearchMethod::Gradient, JointSearchMethod::NelderMead] {
        let found = fit(&run, method).unwrap();
        for (e, truth) in found.estimates.iter().zip(TRUTH) {
            assert!((e.value / truth - 1.0).abs() < 2e-3, "{method:?} torque {by_torque}: {found:?}");
        }
        costs.push((found.rms, found.evaluations));
    }
    // The gradient's minimum is no higher, and costs less than a third.
    assert!(costs[0].0 <= costs[1].0 * (1.0 + 1e-6) && costs[0].1 * 3 < costs[1].1, "{costs:?}");
}

/// The derivatives of the variational equations against differences.
#[test]
fn derivatives_are_those_of_the_angle() {
    for by_torque in [true, false] {
        let run = run(TRUTH, by_torque, 0.0, 1);
        let here = run.angle(TRUTH).unwrap();
        for k in 0..4 {
            let h = 1e-4 * TRUTH[k];
            let at = |sign: f64| {
                let mut v = TRUTH;
                v[k] += sign * h;
                run.angle(v).unwrap()
            };
            let (low, high) = (at(-1.0), at(1.0));
            let scale = here.iter().map(|a| a.eps[k].abs()).fold(0.0, f64::max);
            for i in 0..here.len() {
                let by_difference = (high[i].re - low[i].re) / (2.0 * h);
                assert!(
                    (by_difference - here[i].eps[k]).abs() < 1e-4 * scale,
                    "{k} {i} {by_difference} {:?}",
                    here[i]
                );
            }
        }
    }
}

/// S0's torque: the torque given as measured does not fit the manipulator.
#[test]
fn runs_that_do_not_fit_are_refused() {
    use trueup_identification::flexible_joint::{FlexibleJoint, RunError};
    use trueup_models::arm::PlanarManipulator;
    let good = run(TRUTH, true, 0.0, 1).run().clone();
    let refused =
        |flexible: &[bool], change: &dyn Fn(&mut trueup_identification::flexible_joint::TestBedRun)| {
            let arm = PlanarManipulator::new(flexible, &[] as &[&str]).unwrap();
            let mut bad = good.clone();
            change(&mut bad);
            match FlexibleJoint::new(&arm, &arm.defaults(), 0, 0.13, bad) {
                Err(RunError::Shape(why)) => why,
                other => format!("{other:?}"),
            }
        };
    assert!(refused(&[false; 3], &|_| {}).starts_with("joint 1 is not flexible"));
    assert!(refused(&[true, false, false], &|r| r.angle.truncate(7)).starts_with("7 angles at 201 times"));
    assert!(refused(&[true, false, false], &|r| r.others.truncate(1)).starts_with("1 other joints"));
    assert!(refused(&[true, true, false], &|_| {}).starts_with("more than one joint"));
}
