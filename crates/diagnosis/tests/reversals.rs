//! What acts in reversals alone, which balances bridge: free runs have to tell. The truth has Dahl's friction.

#![allow(clippy::unwrap_used)]

mod made;

use made::Joint;

const GEAR: f64 = 100.0;
const MOTOR_INERTIA: f64 = 1e-4;
const LOAD_INERTIA: f64 = 3.0;
const TORQUE_CONSTANT: f64 = 0.05;
const STIFFNESS: f64 = 0.4;
const DAMPING: f64 = 4e-4;
const COULOMB: f64 = 0.012;
const VISCOUS: f64 = 2e-4;
/// Torque per rad of bristles that the motor's friction bends before it slides.
const BRISTLES: f64 = 0.8;

#[test]
fn presliding_that_balances_bridge_is_named_by_free_runs() {
    let joint = Joint {
        flexible: true,
        gear: GEAR,
        parameters: &[
            ("motorInertia", MOTOR_INERTIA),
            ("loadInertia", LOAD_INERTIA),
            ("torqueConstant", TORQUE_CONSTANT),
            ("stiffness", STIFFNESS),
            ("damping", DAMPING),
            ("coulombFriction", COULOMB),
            ("viscousFriction", VISCOUS),
        ],
        current_noise: 2e-5,
        motor_noise: 5e-4,
        load_noise: 2e-5,
        substeps: 40,
    };
    let reflected = LOAD_INERTIA / GEAR.powi(2);
    let found = joint.diagnosed(
        |phase, t| 0.7 * (2.3 * t + phase).sin() + 0.35 * (5.9 * t + 2.0 * phase).cos(),
        |current, [q, w, l, v, friction]| {
            let spring = STIFFNESS * (q - l) + DAMPING * (w - v);
            let drive = TORQUE_CONSTANT * current - friction - VISCOUS * w;
            let bend = BRISTLES * w * (1.0 - friction / COULOMB * w.signum());
            [*w, (drive - spring) / MOTOR_INERTIA, *v, spring / reflected, bend]
        },
    );
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(named.first(), Some(&"presliding-friction"), "{:?} {named:?}", found.verdict);
    let gap = found.gap.overall.unwrap();
    assert!(gap.after < 0.5 * gap.tuned, "{gap:?}");
}
