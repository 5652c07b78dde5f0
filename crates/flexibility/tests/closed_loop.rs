//! The sampled loop about a rest: against figures of the reference study, the nonlinear arm, and the controller as it runs.

use super::beams::arm_of;
use nalgebra::{DMatrix, DVector};
use trueup_flexibility::closed_loop::{
    ClosedLoopError, LinearPlant, SampledController, closed, law, linearised, measured, poles,
};
use trueup_models::controller::{ManipulatorController, Strategy, parameter, state};
use trueup_models::flexible_arm::presets::{delian, parameters, structure};
use trueup_models::flexible_arm::{FlexibleArm, layout};
use trueup_models::space::design::{DesignLink, DesignMotor, RobotDesign};
use trueup_models::space::layout::States;
use trueup_models::space::tree::JointType;
use trueup_numerics::driver::{Driver, DriverMemory, DriverOptions, DriverState, Flow, Solver, StepInputs};
use trueup_numerics::hybrid::{At, Hybrid};

const RATIO: f64 = 21750.0;
/// Motor, hub and tip of the reference study, kg.m2 on the joint's side.
const INERTIA: [f64; 3] = [RATIO * RATIO * 1.2e-7, 0.5, 6.0];
/// Of the link, N.m/rad.
const LINK: f64 = 1555.0;

/// The reference plant: two joints on one axis, the second one's motor so heavy that it is part of the hub, its spring the link.
fn reference_plant() -> LinearPlant {
    let body = |k: usize, inertia: f64, motor: DesignMotor| DesignLink {
        name: format!("body {}", k + 1),
        parent: k,
        joint: JointType::Revolute,
        mass: 1.0,
        center_of_mass: [0.0; 3],
        inertia: [[inertia, 0.0, 0.0], [0.0, inertia, 0.0], [0.0, 0.0, inertia]],
        position: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
        axis: [0.0, 0.0, 1.0],
        motor,
    };
    let square = RATIO * RATIO;
    let joint = DesignMotor {
        flexible: true,
        inertia: INERTIA[0],
        gear_ratio: RATIO,
        stiffness: square * 2.2e-5,
        damping: square * 3.18e-8,
    };
    let damping = 2.0 * 0.005 * (LINK / INERTIA[2]).sqrt() * INERTIA[2];
    let link = DesignMotor { flexible: true, inertia: 1e12, gear_ratio: 1e12, stiffness: LINK, damping };
    let design = RobotDesign {
        links: vec![body(0, INERTIA[1], joint), body(1, INERTIA[2], link)],
        tips: vec![],
        flexures: vec![],
        ..delian()
    };
    let (arm, mut p) = arm_of(&design);
    let own = layout::Parameters::new(arm.structure()).behind(arm.bodies().sizes().parameters);
    p[own.viscous_friction] = square * 2.5e-8;
    // Dry friction is left out.
    (p[own.coulomb_friction], p[own.static_friction]) = (1.0, 2.0);
    let whole = linearised(&arm, &p, &[0.0; 2]).unwrap();
    // Without the second motor.
    let at = States::new(&arm.structure().robot);
    let keep: Vec<usize> =
        (0..whole.a.nrows()).filter(|i| ![at.motor_angle + 1, at.motor_velocity + 1].contains(i)).collect();
    let rows: Vec<usize> = (0..measured::COUNT).map(|i| 2 * i).collect();
    LinearPlant {
        a: whole.a.select_rows(&keep).select_columns(&keep),
        b: whole.b.select_rows(&keep).columns(0, 1).into_owned(),
        c: whole.c.select_rows(&rows).select_columns(&keep),
        state: keep.iter().map(|i| whole.state[*i]).collect(),
        drive: vec![whole.drive[0]],
    }
}

fn settings(motor: f64, position_gain: f64, omega: f64) -> [f64; parameter::COUNT] {
    [position_gain, motor * 60.0, 0.1, 1.0, 1.0, 1e9, omega, 1.0]
}

fn loop_of(plant: &LinearPlant, strategy: Strategy, gain: f64, period: f64) -> DMatrix<f64> {
    let own = law(strategy, &settings(INERTIA[0], gain, 41.648), period).unwrap();
    closed(&plant.sampled(period).unwrap(), &[own]).unwrap()
}

/// D23 and D29 are figures of the continuous loop; they are approached in proportion to the sample period.
#[test]
fn reference_study_comes_out_in_the_limit() {
    let plant = reference_plant();
    for (strategy, want) in
        [(Strategy::PPi, 0.003_489), (Strategy::Wbc, 0.012_249), (Strategy::Vwbc, 0.144_059)]
    {
        let off = [1e-4, 1e-5].map(|h| {
            let found = poles(&loop_of(&plant, strategy, 2.5, h), h).unwrap();
            assert!(found.largest() < 1.0);
            let damping = found.least_damped(100.0).unwrap().damping();
            println!("D29 {strategy:?}, {h} s: {damping:.6} against {want}");
            damping / want - 1.0
        });
        assert!(off[1].abs() < 3e-4 && off[0].abs() < 3e-3, "{strategy:?}: {off:?}");
    }
    for (h, tolerance) in [(1e-4, 1.5e-3), (1e-5, 1e-3)] {
        let stable = |gain| poles(&loop_of(&plant, Strategy::PPi, gain, h), h).unwrap().largest() < 1.0;
        let (mut low, mut high) = (2.0, 4.0);
        assert!(stable(low) && !stable(high));
        while high - low > 1e-5 {
            let middle = 0.5 * (low + high);
            *(if stable(middle) { &mut low } else { &mut high }) = middle;
        }
        println!("D23, {h} s: {low:.4}");
        assert!((low - 3.132).abs() < tolerance, "D23 at {h} s: {low}");
    }
}

const POSE: [f64; 6] = [0.2, 0.9, -1.2, 0.3, 0.4, 0.0];
const STEP: f64 = 1e-3;

/// The linear plant follows the nonlinear arm; half the push, a quarter of the difference.
#[test]
fn small_motions_are_those_of_the_arm() {
    let arm = FlexibleArm::new(structure(false)).unwrap();
    let mut p = parameters(&arm, &delian());
    let plant = linearised(&arm, &p, &POSE).unwrap();
    let own = layout::Parameters::new(arm.structure()).behind(arm.bodies().sizes().parameters);
    p[own.coulomb_friction..][..6].fill(0.0);
    p[own.static_friction..][..6].fill(0.0);
    let sampled = plant.sampled(STEP).unwrap();
    let sizes = arm.sizes();
    let off = [1.0, 0.5].map(|share| {
        let options =
            DriverOptions { solver: Solver::Explicit, tolerance: 1e-10, ..DriverOptions::default() };
        let mut driver = Driver::new(sizes, &[], options);
        let (mut t, mut x, mut u) = (0.0, plant.state.clone(), vec![0.0; sizes.inputs]);
        let (mut modes, mut memory) = (vec![0; sizes.modes], DriverMemory::default());
        let push = DVector::from_fn(6, |j, _| share * 2.0 * (1.0 - 0.3 * j as f64));
        (0..6).for_each(|j| u[j] = plant.drive[j] + push[j]);
        let mut s =
            DriverState { t: &mut t, x: &mut x, u: &mut u, p: &p, modes: &mut modes, memory: &mut memory };
        driver.initialise_from(&arm, &mut s).unwrap();
        let mut linear = DVector::zeros(sizes.states);
        for k in 0..200 {
            driver
                .advance_to(&arm, &mut s, f64::from(k + 1) * STEP, StepInputs::Hold, &mut |_| Flow::Continue)
                .unwrap();
            linear = &sampled.a * linear + &sampled.b * &push;
        }
        let moved = DVector::from_fn(sizes.states, |i, _| s.x[i] - plant.state[i]);
        println!("moved {:.3e}, off {:.3e}", moved.amax(), (&moved - &linear).amax());
        ((&moved - &linear).amax(), moved.amax())
    });
    assert!(off[0].0 < 0.02 * off[0].1, "{off:?}");
    assert!((off[0].0 / off[1].0 - 4.0).abs() < 0.4, "{off:?}");
}

/// The loop's matrix against the controller as it runs, sample by sample, on the same plant.
#[test]
fn loop_is_what_the_controller_does() {
    let arm = FlexibleArm::new(structure(false)).unwrap();
    let p = parameters(&arm, &delian());
    let plant = linearised(&arm, &p, &POSE).unwrap();
    let sampled = plant.sampled(STEP).unwrap();
    let n = 6;
    let joints: Vec<_> = delian().links.iter().map(|l| settings(l.motor.inertia, 2.0, 60.0)).collect();
    for (strategy, first, count) in [
        (Strategy::PPi, 0, 0),
        (Strategy::Wbc, state::POSITION_WAVES, 4),
        (Strategy::Vwbc, state::VELOCITY_WAVES, 4),
        (Strategy::VwbcWashout, state::VELOCITY_WAVES, 5),
    ] {
        let laws: Vec<SampledController> = joints.iter().map(|p| law(strategy, p, STEP).unwrap()).collect();
        let m = closed(&sampled, &laws).unwrap();
        let controller = ManipulatorController { joints: n };
        let own = controller.sizes();
        let mut control = vec![0.0; own.parameters];
        for (j, p) in joints.iter().enumerate() {
            p.iter().enumerate().for_each(|(i, v)| control[i * n + j] = *v);
        }
        control[parameter::COUNT * n] = STEP;
        control[parameter::COUNT * n + 1] = f64::from(strategy as u8);
        let (mut cx, mut modes) = (vec![0.0; own.states], vec![0; own.modes]);
        let mut x = plant.rest(&[0.01, -0.02, 0.015, 0.005, 0.01, 0.02]).unwrap().0;
        let inputs = |x: &DVector<f64>| {
            let y = &sampled.c * x;
            let mut u = vec![0.0; own.inputs];
            u[2 * n..6 * n].copy_from_slice(&y.as_slice()[..4 * n]);
            u
        };
        // States from the inputs; the first sample is due one period later.
        controller.start_modes(At { t: STEP, x: &cx, u: &[], p: &control, modes: &[] }, &mut modes);
        controller.update(0.0, &mut cx, &inputs(&x), &control, &mut modes);
        let used: Vec<usize> = (first..first + count).chain([state::INTEGRAL_TORQUE]).collect();
        let together = |x: &DVector<f64>, cx: &[f64]| {
            let of = (0..n).flat_map(|j| used.iter().map(move |i| cx[i * n + j]));
            DVector::from_iterator(x.len() + n * used.len(), x.iter().copied().chain(of))
        };
        let mut whole = together(&x, &cx);
        for k in 1..=500 {
            controller.update(f64::from(k) * STEP, &mut cx, &inputs(&x), &control, &mut modes);
            let u = DVector::from_column_slice(&cx[state::HELD_OUTPUT * n..][..n]);
            x = &sampled.a * x + &sampled.b * u;
            whole = &m * whole;
        }
        let off = (&whole - together(&x, &cx)).amax() / whole.amax();
        println!("{strategy:?}: off by {off:.1e} of {:.3e}", whole.amax());
        assert!(off < 1e-9, "{strategy:?}: {off}");
    }
}

/// A rest of the linear plant stays, with its motors where they were commanded to be.
#[test]
fn rest_stays() {
    let arm = FlexibleArm::new(structure(true)).unwrap();
    let plant = linearised(&arm, &parameters(&arm, &delian()), &POSE).unwrap();
    let asked = [0.1, -0.1, 0.2, 0.0, 0.05, 0.0];
    let (x, u) = plant.rest(&asked).unwrap();
    let sampled = plant.sampled(STEP).unwrap();
    let left = (&sampled.a * &x + &sampled.b * &u - &x).amax();
    // Rounding of springs that are in balance: accelerations of 1e4 rad/s2 and more cancel.
    println!("{left:e} left, of {:e}", plant.a.amax() * x.amax());
    assert!(left < 1e-14 * plant.a.amax() * x.amax());
    let y = &sampled.c * &x;
    (0..6).for_each(|j| assert!((y[measured::MOTOR_ANGLE * 6 + j] - asked[j]).abs() < 1e-12));
}

#[test]
fn what_cannot_be_is_refused() {
    let plant = reference_plant();
    let p = settings(1.0, 2.0, 40.0);
    assert_eq!(
        law(Strategy::WbcAdaptive, &p, STEP).unwrap_err(),
        ClosedLoopError::Adapts(Strategy::WbcAdaptive)
    );
    assert!(matches!(law(Strategy::Wbc, &p, f64::NAN), Err(ClosedLoopError::NotPositive(_))));
    assert!(matches!(
        law(Strategy::Wbc, &settings(1.0, 2.0, 0.0), STEP),
        Err(ClosedLoopError::NotPositive(_))
    ));
    assert!(matches!(plant.sampled(0.0), Err(ClosedLoopError::NotPositive(_))));
    let sampled = plant.sampled(STEP).unwrap();
    assert_eq!(closed(&sampled, &[]).unwrap_err(), ClosedLoopError::Controllers { given: 0, joints: 1 });
    assert!(plant.rest(&[]).is_err());
    assert_eq!(poles(&DMatrix::from_element(1, 1, f64::NAN), STEP).unwrap_err(), ClosedLoopError::Singular);
}
