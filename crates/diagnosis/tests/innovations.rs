//! Whole diagnoses of joints by the innovations engine.

use crate::made::Joint;
use trueup_diagnosis::diagnose::{DiagnoseOptions, Diagnosed, DiagnosisEngine, diagnose};
use trueup_diagnosis::outcome::Verdict;
use trueup_diagnosis::shipped;
use trueup_signals::Loaded;

fn by_innovations(loaded: &Loaded) -> Diagnosed {
    let options = DiagnoseOptions {
        engine: Some(DiagnosisEngine::Innovations),
        verdict_only: true,
        ..DiagnoseOptions::default()
    };
    diagnose(loaded, &options, &mut |_, _| ()).unwrap()
}

/// N.m at the motor, twice a turn.
const RIPPLE: f64 = 1.5e-3;

/// A joint whose motor's torque has a ripple, which the nominal model lacks.
fn rippled(joint: &Joint) -> Loaded {
    joint.recorded(|current, [q, w, l, v]| {
        let drive = joint.torque_constant * current + RIPPLE * (2.0 * q).sin()
            - joint.coulomb * (w / 0.02).tanh()
            - joint.viscous * w;
        let spring = joint.stiffness * (q - l) + joint.damping * (w - v);
        [*w, (drive - spring) / joint.motor_inertia, *v, spring / joint.reflected()]
    })
}

/// The engine names the ripple, windows come near the floor, the size holds the truth, and the model that is shipped has the
/// page's values.
#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn a_ripple_is_named_with_its_size_and_what_is_shipped_has_it() {
    let joint = Joint { substeps: 40, ..Joint::default() };
    let found = by_innovations(&rippled(&joint));
    let d = &found.diagnosis;
    let named: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!((d.verdict, &named[..]), (Verdict::Effects, &["torque-ripple"][..]), "{:?}", d.notes);
    let gap = d.gap.overall.as_ref().unwrap();
    let window = gap.window.as_ref().unwrap();
    assert!(window.after < 1.5 * window.floor && window.after < 0.2 * window.tuned, "{window:?}");
    let size = &d.effects[0].parameters["rippleSine"];
    let [low, high] = size.ci95.map(Option::unwrap);
    assert!(low <= RIPPLE && RIPPLE <= high && high - low < 0.4 * RIPPLE, "{size:?}");
    let augmented = found.augmented.as_ref().unwrap();
    shipped::check(d, augmented, &augmented.values).unwrap();
    let reported = d.parameters.iter().chain(&d.effects[0].parameters);
    let mut compared = 0;
    for (name, value) in &augmented.values {
        if let Some((_, amount)) = reported.clone().find(|(n, _)| *n == name) {
            assert_eq!(amount.value, *value, "{name}");
            compared += 1;
        }
    }
    assert!(compared > 7, "{compared} values of the page are in the model");
    let record = found.record.unwrap();
    assert!(record.innovations.is_some() && record.instead.is_none());
    assert!(record.decide(&Default::default()).unwrap_err().contains("innovations"));
    assert!(d.candidates[0].id == "torque-ripple" && d.candidates[0].evidence > 100.0);
}
