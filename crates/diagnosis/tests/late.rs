//! Noise predicts no delay: half of a shift is the mean of two readings, which has less noise than either.

#![allow(clippy::unwrap_used)]

use crate::made::Joint;
use trueup_diagnosis::engine::recordings::PreparedCase;
use trueup_diagnosis::engine::search::CaseSearch;
use trueup_diagnosis::engine::select::SearchEffort;

/// A joint with known parameters, behind a coarse load encoder. What predicts less than 2 is not fitted; as a share of the change
/// that a look brings the delay of that encoder promised 4.5, as it was looked at it does 0.4.
#[test]
fn a_noisy_reading_gives_no_delay() {
    let nominal = Joint { load_noise: 5e-5, motor_noise: 2e-5, ..Joint::default() };
    let loaded = nominal.recorded(|current, [q, w, l, v]| {
        let spring = nominal.stiffness * (q - l) + nominal.damping * (w - v);
        let drive =
            nominal.torque_constant * current - nominal.coulomb * (w / 0.02).tanh() - nominal.viscous * w;
        [*w, (drive - spring) / nominal.motor_inertia, *v, spring / nominal.reflected()]
    });
    let case = PreparedCase::new(&loaded).unwrap();
    let search = CaseSearch::new(&case, 1).unwrap();
    let stated = search.state(&[]).unwrap();
    let start = search.compare(&stated).start();
    let plain = search.fit(stated, &start, SearchEffort::default().options()).unwrap();
    let screened = search.screen(&plain);
    let late: Vec<_> = screened.iter().filter(|s| search.causes[s.index].id == "sensor-delay").collect();
    assert_eq!(late.len(), 2);
    for s in late {
        assert!(s.gain < 2.0, "{}: {}", search.causes[s.index].label(), s.gain);
    }
}
