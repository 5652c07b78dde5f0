//! Priors hold where much is missed: with one sensor, parameters are not biased to make up for a cause that is lacking.

#![allow(clippy::unwrap_used)]

use crate::made::Joint;
use trueup_diagnosis::engine::recordings::PreparedCase;
use trueup_diagnosis::engine::result::fit_options;
use trueup_diagnosis::engine::search::CaseSearch;

/// Gravity on the load, N.m on its side.
const GRAVITY: f64 = 0.12;

/// A link hangs in a field that the simulation lacks; the motor alone is measured, and some nominal parameters are off by 4 %.
#[test]
fn what_one_sensor_misses_does_not_bias_parameters() {
    let nominal = Joint {
        gear: 120.0,
        motor_inertia: 2.72e-5,
        load_inertia: 0.882,
        torque_constant: 0.0347,
        stiffness: 0.1116,
        damping: 4.3e-5,
        coulomb: 0.0235,
        viscous: 1.42e-4,
        current: [[0.55, 0.9], [0.3, 3.1]],
        current_noise: 3.6e-4,
        motor_noise: 2e-5,
        load_seen: false,
        doubt: 0.05,
        substeps: 40,
        ..Joint::default()
    };
    let (torque_constant, stiffness) = (0.963 * nominal.torque_constant, 0.96 * nominal.stiffness);
    let loaded = nominal.recorded(|current, [q, w, l, v]| {
        let spring = stiffness * (q - l) + nominal.damping * (w - v);
        let drive = torque_constant * current - nominal.coulomb * (w / 0.02).tanh() - nominal.viscous * w;
        let weight = GRAVITY * (l / nominal.gear).sin() / nominal.gear;
        [*w, (drive - spring) / nominal.motor_inertia, *v, (spring - weight) / nominal.reflected()]
    });
    let case = PreparedCase::new(&loaded).unwrap();
    let search = CaseSearch::new(&case, 1).unwrap();
    let stated = search.state(&[]).unwrap();
    let start = search.compare(&stated).start();
    let plain = search.fit(stated, &start, fit_options()).unwrap();
    assert!(plain.prior2 < 100.0, "{}", plain.prior2);
}
