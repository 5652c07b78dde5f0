//! A joint that gives way, in a simulation that holds it to be rigid: its spring stiffens with its deflection.

#![allow(clippy::unwrap_used)]

mod made;

use made::Joint;
use trueup_diagnosis::outcome::{Diagnosis, Verdict};

const GEAR: f64 = 100.0;
const MOTOR_INERTIA: f64 = 3e-5;
const LOAD_INERTIA: f64 = 0.6;
const TORQUE_CONSTANT: f64 = 0.06;
const STIFFNESS: f64 = 0.1;
const CUBIC: f64 = 0.05;
const DAMPING: f64 = 4e-5;
const COULOMB: f64 = 0.008;
const VISCOUS: f64 = 4e-5;

/// A drive with such a spring or without one.
fn diagnosed(rigid: bool) -> Diagnosis {
    let joint = Joint {
        flexible: false,
        gear: GEAR,
        parameters: &[
            ("motorInertia", MOTOR_INERTIA),
            ("loadInertia", LOAD_INERTIA),
            ("torqueConstant", TORQUE_CONSTANT),
            ("coulombFriction", COULOMB),
            ("viscousFriction", VISCOUS),
        ],
        current_noise: 2e-4,
        motor_noise: 2e-4,
        load_noise: 3e-6,
        substeps: 100,
    };
    let reflected = LOAD_INERTIA / GEAR.powi(2);
    joint.diagnosed(
        |phase, t| 0.5 * (4.3 * t + phase).sin() + 0.3 * (11.9 * t + 2.0 * phase).cos(),
        |current, [q, w, l, v]| {
            let drive = TORQUE_CONSTANT * current - COULOMB * (w / 0.05).tanh() - VISCOUS * w;
            if rigid {
                let a = drive / (MOTOR_INERTIA + reflected);
                return [*w, a, *w, a];
            }
            let spring = STIFFNESS * (q - l) + CUBIC * (q - l).powi(3) + DAMPING * (w - v);
            [*w, (drive - spring) / MOTOR_INERTIA, *v, spring / reflected]
        },
    )
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
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(found.verdict, Verdict::NoGap, "{named:?}");
}
