//! A load that is pushed twice in every recording: a half sine one way, a triangle the other.

#![allow(clippy::unwrap_used)]

use crate::made::Joint;
use trueup_diagnosis::diagnose::{DiagnoseOptions, diagnose};
use trueup_diagnosis::outcome::Verdict;
use trueup_signals::Loaded;

/// Begin and length of each push, s.
const FIRST: [f64; 2] = [1.1, 0.7];
const SECOND: [f64; 2] = [3.0, 0.6];
/// Largest torque, N.m on the load.
const TORQUE: f64 = 0.4;

fn push(t: f64) -> f64 {
    let [sine, triangle] = [FIRST, SECOND].map(|[begin, length]| (t - begin) / length);
    let within = |s: f64| s > 0.0 && s < 1.0;
    match () {
        () if within(sine) => TORQUE * (std::f64::consts::PI * sine).sin(),
        () if within(triangle) => -TORQUE * (1.0 - (2.0 * triangle - 1.0).abs()),
        () => 0.0,
    }
}

fn pushed() -> Loaded {
    let j = Joint::default();
    // The last state is the time.
    j.recorded(|current, [q, w, l, v, t]| {
        let drive = j.torque_constant * current - j.coulomb * (w / 0.05).tanh() - j.viscous * w;
        let spring = j.stiffness * (q - l) + j.damping * (w - v);
        [*w, (drive - spring) / j.motor_inertia, *v, (spring + push(*t) / j.gear) / j.reflected(), 1.0]
    })
}

#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn two_pushes_in_every_recording_are_one_cause() {
    let found = diagnose(&pushed(), &DiagnoseOptions::default(), &mut |_, _| ()).unwrap().diagnosis;
    let named: Vec<(&str, &str)> =
        found.effects.iter().map(|e| (e.id.as_str(), e.component.as_str())).collect();
    assert_eq!((found.verdict, &named[..]), (Verdict::Effects, &[("external-force", "load")][..]));
    let gap = found.gap.overall.unwrap();
    assert!(gap.after < 0.1 * gap.tuned, "{gap:?}");
    // Impulses: size times duration, whatever the edge. Which impulse is reported first is open.
    let value = |name: &str| found.effects[0].parameters[name].value;
    let of = |which: &str| {
        let [torque, start, duration] =
            ["Torque", "Start", "Duration"].map(|n| value(&format!("loadPush{which}{n}")));
        (start, torque * duration)
    };
    let reported = [of(""), of("Second"), of("Third")];
    for ([begin, length], impulse) in
        [(FIRST, TORQUE * 0.7 * std::f64::consts::FRAC_2_PI), (SECOND, -TORQUE * 0.3)]
    {
        let within = |start: f64| start > begin - 0.2 && start < begin + length;
        let sum: f64 = reported.iter().filter(|t| within(t.0)).map(|t| t.1).sum();
        assert!((sum / impulse - 1.0).abs() < 0.05, "{sum} of {impulse}: {reported:?}");
    }
}
