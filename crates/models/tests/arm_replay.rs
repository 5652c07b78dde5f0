//! Motors of prescribed motion (ARM-14), against the torques that would cause it and against the golden trajectory.
#![allow(clippy::unwrap_used)]

use crate::arm_common::{NO_EFFECTS, Random};
use trueup_models::arm::{InverseDynamics, PlanarManipulator, Replay, input, parameter};
use trueup_models::presets;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_numerics::hybrid::{At, Hybrid};

/// Checks ARM-14: whatever motion a torque causes, leading the motor along it moves everything else alike.
#[test]
fn a_led_motor_moves_the_rest_as_its_torque_does() {
    let mut random = Random(7);
    for flexible in [[true, false, false], [true, true, true], [false, false, false]] {
        let arm = PlanarManipulator::new(&flexible, NO_EFFECTS).unwrap();
        let (n, sizes) = (arm.links(), arm.sizes());
        let p = arm.defaults();
        for led in [&[0][..], &[1, 2], &[0, 1, 2], &[]] {
            let replay = Replay::new(arm.clone(), led).unwrap();
            for _ in 0..50 {
                let x: Vec<f64> = (0..sizes.states).map(|_| random.within(-1.0, 1.0)).collect();
                let mut u: Vec<f64> = (0..sizes.inputs).map(|_| random.within(-1.0, 1.0)).collect();
                let (mut by_torque, mut by_motion) = (vec![0.0; sizes.states], vec![0.0; sizes.states]);
                arm.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut by_torque);
                for j in led {
                    u[input::joint_torque(n) + j] = f64::NAN; // must not be read
                    u.push(by_torque[arm.dofs() + arm.motor(*j)]);
                }
                replay.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut by_motion);
                for (a, b) in by_torque.iter().zip(&by_motion) {
                    assert!((a - b).abs() <= 1e-10 * (1.0 + a.abs()), "{led:?}: {a} {b}");
                }
            }
        }
    }
}

/// Checks ARM-14: rows with a prescribed motion that is not their free one, satellite and links as well as motors. Whatever force
/// that takes acts in these rows alone, so that in the others M a is unchanged.
#[test]
fn the_force_that_leads_rows_acts_in_no_others() {
    let mut random = Random(8);
    let arm = PlanarManipulator::new(&[true, false, true], NO_EFFECTS).unwrap();
    let (sizes, dofs, p) = (arm.sizes(), arm.dofs(), arm.defaults());
    for led in [&[0, 1, 2, 3][..], &[6], &[0, 4, 7]] {
        let x: Vec<f64> = (0..sizes.states).map(|_| random.within(-1.0, 1.0)).collect();
        let u: Vec<f64> = (0..sizes.inputs).map(|_| random.within(-1.0, 1.0)).collect();
        let given: Vec<(usize, f64)> = led.iter().map(|row| (*row, random.within(-1.0, 1.0))).collect();
        let (mut free, mut bound) = (vec![0.0; sizes.states], vec![0.0; sizes.states]);
        let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] };
        arm.rates(at, &mut free);
        arm.rates_prescribed(at, &given, &mut bound);
        assert!(given.iter().all(|(row, a)| bound[dofs + row] == *a));
        let difference: Vec<f64> = bound[dofs..].iter().zip(&free[dofs..]).map(|(a, b)| a - b).collect();
        let mass = arm.mass_matrix(&x, &p);
        for row in 0..dofs {
            let force = mass.row_times(row, &difference);
            assert_eq!(force.abs() > 1e-9, led.contains(&row), "{led:?} row {row}: {force}");
        }
    }
}

/// Checks ARM-14 with golden fact A13: constant accelerations of the joints for 10 s turn the satellite so far.
#[test]
fn the_reference_trajectory_ends_where_it_should() {
    let arm = PlanarManipulator::new(&[false; 3], NO_EFFECTS).unwrap();
    let (n, mut p) = (3, presets::cbk_pan(&[false; 3]));
    for (j, angle) in [7.5f64, -15.0, -22.5].into_iter().enumerate() {
        p[parameter::initial_joint_angle(n) + j] = angle.to_radians();
    }
    let replay = Replay::new(arm, &[0, 1, 2]).unwrap();
    let first = replay.acceleration(0);
    let led = move |_: f64, u: &mut [f64]| {
        for (j, a) in [0.9f64, -0.6, -0.75].into_iter().enumerate() {
            u[first + j] = a.to_radians();
        }
    };
    let nominal = vec![1.0; replay.sizes().states];
    let options = DriverOptions { tolerance: 1e-11, ..DriverOptions::default() };
    let run = simulate(&replay, &p, &nominal, options, &led, &[0.0, 10.0]).unwrap();
    let end = &run.x[1];
    for (have, want) in end.iter().zip([0.017366523188224965, -0.009182827014584753, -0.2572613502943539]) {
        assert!((have - want).abs() < 1e-8, "{have} {want}");
    }
    for (j, want) in [52.5f64, -45.0, -60.0].into_iter().enumerate() {
        assert!((end[3 + j] - want.to_radians()).abs() < 1e-9);
    }
}

#[test]
fn friction_and_joints_that_are_not_there_are_refused() {
    let arm = PlanarManipulator::new(&[true; 2], NO_EFFECTS).unwrap();
    assert!(Replay::new(arm, &[2]).is_none());
    let rubbing = PlanarManipulator::new(&[true; 2], &["motor-friction"]).unwrap();
    assert!(Replay::new(rubbing, &[0]).is_none());
}

/// Checks ARM-17: the torques of any accelerations cause these accelerations, with forces on base and tip, base free and fixed.
#[test]
fn torques_of_a_prescribed_motion_cause_it() {
    let mut random = Random(9);
    for k in 0..60 {
        let n = random.within(1.0, 6.99) as usize;
        let flexible: Vec<bool> = (0..n).map(|_| random.within(0.0, 1.0) < 0.5).collect();
        let arm = PlanarManipulator::on_base(k % 3 == 0, &flexible, NO_EFFECTS).unwrap();
        let inverse = InverseDynamics::new(arm.clone()).unwrap();
        let (sizes, p) = (arm.sizes(), arm.defaults());
        let x: Vec<f64> = (0..sizes.states).map(|_| random.within(-1.0, 1.0)).collect();
        let mut u: Vec<f64> = (0..sizes.inputs).map(|_| random.within(-1.0, 1.0)).collect();
        let (mut led, mut caused) = (vec![0.0; sizes.states], vec![0.0; sizes.states]);
        let mut y = vec![0.0; inverse.sizes().outputs];
        let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] };
        inverse.rates(at, &mut led);
        inverse.outputs(at, &mut y);
        for j in 0..n {
            assert_eq!(led[arm.dofs() + arm.motor(j)], u[input::joint_torque(n) + j]);
        }
        let torque = y.split_off(sizes.outputs);
        u[input::joint_torque(n)..][..n].copy_from_slice(&torque);
        arm.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut caused);
        for (a, b) in led.iter().zip(&caused) {
            assert!((a - b).abs() <= 1e-9 * (1.0 + a.abs()), "{flexible:?}: {a} {b}");
        }
    }
    let effect = PlanarManipulator::new(&[false], &["motor-friction"]).unwrap();
    assert!(InverseDynamics::new(effect).unwrap_err().contains("motor-friction"));
}
