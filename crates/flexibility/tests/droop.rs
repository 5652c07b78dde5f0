//! How velocity waves droop: a pendulum on a spring, and the poles of DELIAN's sampled loop.

use std::f64::consts::FRAC_PI_2;

use trueup_flexibility::closed_loop::{closed, law, linearised, poles};
use trueup_flexibility::droop::droop;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_flexibility::ground::{EARTH, Standing, loaded, standing};
use trueup_models::controller::Strategy;
use trueup_models::flexible_arm::presets::delian;
use trueup_models::space::design::{DesignLink, DesignMotor, RobotDesign};
use trueup_models::space::tree::JointType;

fn of(on: &Standing, pose: &[f64]) -> f64 {
    droop(&equilibrium(&on.arm, &on.parameters, pose, [0.0; 3]).unwrap()).unwrap()
}

/// Checks CTL-16: upright, a mass m at r on a spring k loses m g r / k of its angle as twist; hanging or level, nothing.
#[test]
fn ctl16_of_a_pendulum_is_its_weight_over_its_spring() {
    let (mass, reach, stiffness) = (3.0, 0.7, 900.0);
    let moment = mass * 1e-4;
    let body = DesignLink {
        name: "pendulum".into(),
        parent: 0,
        joint: JointType::Revolute,
        mass,
        center_of_mass: [reach, 0.0, 0.0],
        inertia: [[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]],
        position: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
        axis: [0.0, -1.0, 0.0],
        motor: DesignMotor { flexible: true, inertia: 1.0, gear_ratio: 1.0, stiffness, damping: 0.0 },
    };
    let on = standing(&RobotDesign { links: vec![body], tips: vec![], flexures: vec![], ..delian() }, EARTH)
        .unwrap();
    let want = mass * 9.81 * reach / stiffness;
    assert!((of(&on, &[FRAC_PI_2]) / want - 1.0).abs() < 1e-9, "{}", of(&on, &[FRAC_PI_2]));
    assert_eq!(of(&on, &[-FRAC_PI_2]), 0.0);
    // Motor level, the body hangs a little.
    assert_eq!(of(&on, &[0.0]), 0.0);
}

const GAIN: f64 = 2.0;
const STEP: f64 = 1e-3;

/// The largest real pole of DELIAN with `VWBC` on all joints, 1/s; slow ones only.
fn slowest(on: &Standing, pose: &[f64], omega: f64) -> f64 {
    let plant = linearised(&on.arm, &on.parameters, pose).unwrap().sampled(STEP).unwrap();
    let of = |l: &DesignLink| [GAIN, 60.0 * l.motor.inertia, 0.1, 1.0, 1.0, 1e9, omega, 1.0];
    let laws: Vec<_> = delian().links.iter().map(|l| law(Strategy::Vwbc, &of(l), STEP).unwrap()).collect();
    let found = poles(&closed(&plant, &laws).unwrap(), STEP).unwrap();
    found.moving().filter(|p| p.s.im.abs() < 0.1).map(|p| p.s.re).fold(f64::NEG_INFINITY, f64::max)
}

/// Checks CTL-16: a real pole crosses zero where CTL-16 gives it.
#[test]
fn ctl16_is_where_the_loop_runs_away() {
    for (payload, elbow) in [(10.0, 0.0), (2.15, 0.0), (10.0, -1.2)] {
        let on = standing(&loaded(&delian(), payload).unwrap(), EARTH).unwrap();
        let pose = [0.0, 0.9, elbow, 0.0, 0.0, 0.0];
        let bound = GAIN / of(&on, &pose);
        let [below, above] = [0.97, 1.03].map(|share| {
            let counts = share * bound;
            slowest(&on, &pose, counts / (1.0 - 0.5 * counts * STEP))
        });
        println!("{payload} kg, elbow {elbow} rad: {bound:.1} rad/s; {below:.4} and {above:.4} 1/s");
        assert!(below < 0.0 && above > 0.0, "{payload} kg, elbow {elbow} rad: {below} {above}");
    }
}
