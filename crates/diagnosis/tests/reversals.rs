//! What acts in reversals alone, which balances bridge: free runs have to decide. The truth has Dahl's friction.

#![allow(clippy::unwrap_used)]

use crate::made::Joint;

/// Torque per rad of bristles that the motor's friction bends before it slides.
const BRISTLES: f64 = 0.8;

#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn presliding_that_balances_bridge_is_named_by_free_runs() {
    let j = Joint {
        motor_inertia: 1e-4,
        load_inertia: 3.0,
        torque_constant: 0.05,
        stiffness: 0.4,
        damping: 4e-4,
        coulomb: 0.012,
        viscous: 2e-4,
        current: [[0.7, 2.3], [0.35, 5.9]],
        current_noise: 2e-5,
        motor_noise: 5e-4,
        load_noise: 2e-5,
        substeps: 40,
        ..Joint::default()
    };
    let found = j.diagnosed(|current, [q, w, l, v, friction]| {
        let spring = j.stiffness * (q - l) + j.damping * (w - v);
        let drive = j.torque_constant * current - friction - j.viscous * w;
        let bend = BRISTLES * w * (1.0 - friction / j.coulomb * w.signum());
        [*w, (drive - spring) / j.motor_inertia, *v, spring / j.reflected(), bend]
    });
    let named: Vec<&str> = found.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!(named.first(), Some(&"presliding-friction"), "{:?} {named:?}", found.verdict);
    let gap = found.gap.overall.unwrap();
    assert!(gap.after < 0.5 * gap.tuned, "{gap:?}");
}
