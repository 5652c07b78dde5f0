//! A compliant joint, in a simulation that assumes it to be rigid: its spring stiffens with its deflection.

#![allow(clippy::unwrap_used)]

use crate::made::Joint;
use trueup_diagnosis::outcome::{Diagnosis, Verdict};

/// How much the spring stiffens, N.m/rad^3 on the motor's side.
const CUBIC: f64 = 0.05;

/// A drive with such a spring or without one.
fn diagnosed(rigid: bool) -> Diagnosis {
    let j = Joint { flexible: false, ..Joint::default() };
    j.diagnosed(|current, [q, w, l, v]| {
        let drive = j.torque_constant * current - j.coulomb * (w / 0.05).tanh() - j.viscous * w;
        if rigid {
            let a = drive / (j.motor_inertia + j.reflected());
            return [*w, a, *w, a];
        }
        let spring = j.stiffness * (q - l) + CUBIC * (q - l).powi(3) + j.damping * (w - v);
        [*w, (drive - spring) / j.motor_inertia, *v, spring / j.reflected()]
    })
}

#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn a_rigid_simulation_of_a_flexible_joint_lacks_its_flexibility() {
    let found = diagnosed(false);
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!((found.verdict, &named[..]), (Verdict::Effects, &["joint-flexibility"][..]));
    let stiffness = &found.effects[0].parameters["stiffness"];
    assert!((stiffness.value / Joint::default().stiffness - 1.0).abs() < 0.3, "{stiffness:?}");
    let gap = found.gap.overall.unwrap();
    assert!(gap.after < 0.5 * gap.tuned, "{gap:?}");
}

#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn a_rigid_joint_lacks_nothing() {
    let found = diagnosed(true);
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(found.verdict, Verdict::NoGap, "{named:?}");
}
