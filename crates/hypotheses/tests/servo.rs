//! A joint that its servo drives: the reference is recorded, no current. Checks EST-18 with states and a loop.

use trueup_estimation::innovations::joint_frame::joint_frame;
use trueup_hypotheses::innovations::findings::search_case;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_models::joint::parameter as q;
use trueup_signals::{Loaded, ParameterValue, PriorGuess};

use crate::made::MadeJoint;
use crate::rig::{channels, known, value};

const GAIN: f64 = 6e-3;
const DAMPING: f64 = 6e-4;
const CHANNELS: &[&str] = &["positionReference", "motorAngle", "loadAngle"];

/// A servo with this gain and rate of its integral.
fn servo(gain: f64, rate: f64) -> [f64; 3] {
    [gain, DAMPING, rate]
}

fn made<'a>(seed: u64, effects: &'a [(&'a str, &'a [f64])]) -> MadeJoint<'a> {
    MadeJoint {
        seed,
        recordings: (2, 500),
        effects,
        reference: 0.3,
        channels: CHANNELS,
        ..MadeJoint::default()
    }
}

/// The case of a servo that is assumed to have these numbers.
fn assumed(l: Loaded, gain: f64, rate: f64, doubt: f64) -> Loaded {
    let values =
        [("servoProportionalGain", gain), ("servoDerivativeGain", DAMPING), ("servoIntegralRate", rate)];
    known(l, &[("position-servo", &values)], doubt)
}

/// Forces by the law, its integral summed along the trajectory, and columns that are differences of the forces.
#[test]
fn a_servo_is_a_force_by_its_law_and_its_numbers_are_columns() {
    let numbers = servo(GAIN, 1.5);
    let effects: [(&str, &[f64]); 1] = [("position-servo", &numbers)];
    let mut case = assumed(MadeJoint { recordings: (1, 300), ..made(51, &effects) }.case(), GAIN, 1.5, 0.1);
    for c in channels(&mut case, "positionReference") {
        c.sensor.gain = Some(PriorGuess { value: 1.0, doubt: Some(0.1) });
        c.sensor.offset = Some(PriorGuess { value: 0.0, doubt: Some(0.1) });
    }
    let (mut f, _) = joint_frame(&case).unwrap();
    f.settle(true);
    let names: Vec<String> = f.intake.rig.terms.iter().map(|t| t.name.clone()).collect();
    assert_eq!(names.len(), 5, "{names:?}");
    let (r, forces) = (f.runs[0].clone(), f.known_forces(0));
    let (psi, v, reference) = (r.state(2), r.state(1), f.input_means(0, 2));
    let (mut z, mut most) = (0.0, 0.0f64);
    for t in 0..r.nodes - 1 {
        let mean = |x: &[f64]| 0.5 * (x[t] + x[t + 1]);
        let pd = GAIN * (160.0 * reference[t] - mean(&psi)) - DAMPING * mean(&v);
        let law = pd + 1.5 * (z + 0.5 * r.dt * pd);
        z += r.dt * pd;
        most = most.max(law.abs());
        assert!((forces[0][t] - law).abs() < 1e-9, "{t}: {} of {law}", forces[0][t]);
        assert!(forces[1][t].abs() < 1e-12, "{t}: {}", forces[1][t]);
    }
    assert!(most > 5e-3, "{most}");
    let own = f.plant.parameters().len();
    let columns = f.nuisances().0;
    for k in own..f.theta.len() {
        let at = f.unknown.iter().position(|u| *u == k).unwrap();
        let moved = |by: f64| {
            let mut f = f.clone();
            f.theta[k] *= 1.0 + by;
            f.known_forces(0)
        };
        let (up, down) = (moved(1e-5), moved(-1e-5));
        let mut column = vec![vec![0.0; r.nodes]; 2];
        for s in &columns[at][0].forces {
            column[s.on].iter_mut().zip(s.values.iter()).for_each(|(x, v)| *x += s.weight * v);
        }
        let size = column.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
        assert!(size > 0.0, "{}", names[k - own]);
        for (c, t) in (0..2).flat_map(|c| (0..r.nodes).map(move |t| (c, t))) {
            let difference = (up[c][t] - down[c][t]) / 2e-5;
            assert!((difference - column[c][t]).abs() < 1e-6 * size, "{} at {t}", names[k - own]);
        }
    }
}

/// Verdict of a servo of this gain that is assumed to have [`GAIN`].
fn judged(seed: u64, rate: f64, flexible: bool, gain: f64) {
    let numbers = servo(gain, rate);
    let effects: [(&str, &[f64]); 1] = [("position-servo", &numbers)];
    let case = MadeJoint { flexible, recordings: (1, 300), ..made(seed, &effects) }.case();
    let found = search_case(&assumed(case, GAIN, rate, 0.2)).unwrap();
    let at = value(&found, "servoProportionalGain");
    println!("{seed}: {:?}, {at} of {gain}, {:?}", found.judged.verdict, found.judged.set);
    if gain == GAIN {
        assert_eq!(found.judged.verdict, EvidenceVerdict::NoGap, "{seed}");
    } else {
        assert_eq!(found.judged.verdict, EvidenceVerdict::Parameters, "{seed}");
        assert!((at / gain - 1.0).abs() < 0.03, "{seed}: {at} of {gain}");
    }
}

/// A stiffer servo is another parameter.
#[test]
fn the_gain_of_a_servo_is_found() {
    judged(54, 1.5, false, 1.25 * GAIN);
}

/// A servo as it is assumed is no gap; a stiffer one is another parameter; with and without an integral, with and without a spring.
#[test]
#[ignore = "eight searches"]
fn a_servo_as_it_is_is_no_gap_and_its_gain_is_found() {
    for (seed, rate, flexible) in [(52, 0.0, true), (53, 1.5, true), (54, 0.0, false), (55, 1.5, false)] {
        for gain in [GAIN, 1.25 * GAIN] {
            judged(seed, rate, flexible, gain);
        }
    }
}

/// A weight that a servo holds.
#[test]
#[ignore = "a search"]
fn a_weight_behind_a_servo_is_named() {
    let numbers = servo(GAIN, 0.0);
    let effects: [(&str, &[f64]); 2] = [("position-servo", &numbers), ("gravity-torque", &[0.8, 0.2])];
    let found = search_case(&assumed(made(56, &effects).case(), GAIN, 0.0, 0.1)).unwrap();
    println!("{:?}, {:?}", found.judged.verdict, found.judged.set);
    assert!(found.judged.set.iter().any(|s| s.0 == "gravity-torque"), "{:?}", found.judged.set);
}

/// Without dry friction the usual torque is that of the servo.
#[test]
#[ignore = "a search"]
fn a_servo_without_dry_friction_is_no_gap() {
    let numbers = servo(GAIN, 0.0);
    let effects: [(&str, &[f64]); 1] = [("position-servo", &numbers)];
    let none = [(q::COULOMB_FRICTION, 0.0), (q::STATIC_FRICTION, 0.0)];
    let zero = ParameterValue::Number(0.0);
    let believed = [("coulombFriction", zero.clone()), ("staticFriction", zero)];
    let case = MadeJoint { values: &none, believed: &believed, ..made(57, &effects) }.case();
    let found = search_case(&assumed(case, GAIN, 0.0, 0.1)).unwrap();
    println!("{:?}, {:?}", found.judged.verdict, found.judged.set);
    assert_eq!(found.judged.verdict, EvidenceVerdict::NoGap);
}
