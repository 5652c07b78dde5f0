//! The stiff part of `FlexibleArm` (LNK-10): against its whole Jacobian where that is all there is, and its steps against exact ones.

use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::flexible_arm::layout::Parameters as Own;
use trueup_models::flexible_arm::presets::{RAISED, delian, parameters, structure};
use trueup_models::friction::STUCK;
use trueup_models::space::layout::{Inputs, Outputs, Parameters, States};
use trueup_numerics::Dual;
use trueup_numerics::driver::{
    Driver, DriverMemory, DriverOptions, DriverState, Flow, Solver, StepInputs as Signals,
};
use trueup_numerics::hybrid::{At, Hybrid, StiffPart};
use trueup_numerics::linear::{lu_factor, lu_solve};

fn arm() -> (FlexibleArm, Vec<f64>) {
    let arm = FlexibleArm::new(structure(false)).unwrap();
    let p = parameters(&arm, &delian());
    (arm, p)
}

/// Checks LNK-10: at rest without weight nothing but springs, dampers and brakes is in df/dx.
#[test]
fn lnk10_the_stiff_part_of_an_arm_at_rest_is_its_jacobian() {
    let (arm, mut p) = arm();
    let robot = &arm.structure().robot;
    let at = States::new(robot);
    p[Parameters::new(robot).gravity..][..3].fill(0.0);
    // Dry friction would accelerate it.
    let own = Own::new(arm.structure()).behind(arm.bodies().sizes().parameters);
    [own.coulomb_friction, own.static_friction].into_iter().for_each(|begin| p[begin..][..6].fill(0.0));
    let (n, u) = (arm.sizes().states, vec![0.0; arm.sizes().inputs]);
    let mut x = vec![0.0; n];
    for (j, angle) in [0.3, RAISED, -1.1, 0.4, -0.7, 0.2].into_iter().enumerate() {
        (x[at.joint_angle + j], x[at.motor_angle + j]) = (angle, angle);
    }
    for modes in [[1, 1, -1, 1, -1, 1], [STUCK, 1, STUCK, STUCK, -1, 1], [STUCK; 6]] {
        let mut dfdx = vec![0.0; n * n];
        for k in 0..n {
            let lift = |v: &[f64]| v.iter().map(|v| Dual::<1>::new(*v, [0.0])).collect::<Vec<_>>();
            let (mut wide, mut rates) = (lift(&x), lift(&vec![0.0; n]));
            wide[k].eps[0] = 1.0;
            let here = At { t: Dual::new(0.0, [0.0]), x: &wide, u: &lift(&u), p: &lift(&p), modes: &modes };
            arm.rates(here, &mut rates);
            (0..n).for_each(|i| dfdx[i * n + k] = rates[i].eps[0]);
        }
        for g in [1e-6, 3e-4, 0.1] {
            let (mut room, mut here, mut alone) = (vec![f64::NAN; arm.room()], vec![0.0; n], vec![0.0; n]);
            let at = At { t: 0.0, x: &x[..], u: &u[..], p: &p[..], modes: &modes[..] };
            arm.factor(at, g, &mut room, &mut here).unwrap();
            arm.rates(at, &mut alone);
            assert_eq!(here, alone, "the rates that come with the factors");
            let mut whole: Vec<f64> = dfdx.iter().map(|j| -g * j).collect();
            (0..n).for_each(|i| whole[i * n + i] += 1.0);
            let mut pivots = vec![0; n];
            lu_factor(&mut whole, n, &mut pivots).unwrap();
            let mut own: Vec<f64> = (0..n).map(|k| (1.7 * k as f64).sin()).collect();
            let mut wanted = own.clone();
            arm.solve(&room, &mut own);
            lu_solve(&whole, n, &pivots, &mut wanted);
            let size = wanted.iter().fold(0.0, |most: f64, w| most.max(w.abs()));
            for k in 0..n {
                let off = (own[k] - wanted[k]).abs() / size;
                assert!(off < 1e-9, "{modes:?}, g = {g}: state {k} {} where {} is exact", own[k], wanted[k]);
            }
        }
    }
}

/// Where the tip is and how many events there were, after three times so many s from rest with torques that break some motors away.
fn moved(part: f64, options: DriverOptions) -> ([f64; 3], usize) {
    let (arm, p) = arm();
    let (sizes, robot) = (arm.sizes(), &arm.structure().robot);
    let nominal: Vec<f64> = States::list(robot).iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect();
    let mut driver = Driver::new(sizes, &nominal, options);
    let (mut t, mut x, mut u) = (0.0, vec![0.0; sizes.states], vec![0.0; sizes.inputs]);
    let (mut modes, mut memory) = (vec![0; sizes.modes], DriverMemory::default());
    let torques = [20.0, -45.0, 30.0, 9.0, 0.0, 6.0];
    u[Inputs::new(robot).joint_torque..][..6].copy_from_slice(&torques);
    let mut s =
        DriverState { t: &mut t, x: &mut x, u: &mut u, p: &p, modes: &mut modes, memory: &mut memory };
    driver.initialise(&arm, &mut s).unwrap();
    let mut events = 0;
    for k in 1..=3 {
        // The torques turn half way.
        s.u[Inputs::new(robot).joint_torque..][..6]
            .iter_mut()
            .zip(torques)
            .for_each(|(u, torque)| *u = if k == 2 { -torque } else { torque });
        let end = part * f64::from(k);
        events +=
            driver.advance_to(&arm, &mut s, end, Signals::Hold, &mut |_| Flow::Continue).unwrap().events;
    }
    let mut y = vec![0.0; sizes.outputs];
    arm.outputs(At { t: *s.t, x: s.x, u: s.u, p: s.p, modes: s.modes }, &mut y);
    let tip = Outputs::new(robot).tip_position;
    ([y[tip], y[tip + 1], y[tip + 2]], events)
}

/// Checks LNK-10: steps far longer than the arm's fastest decay are of second order, stick-slip included.
#[test]
fn lnk10_fixed_implicit_steps_are_of_second_order() {
    of_second_order(0.02, 1e-8);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn lnk10_fixed_implicit_steps_are_of_second_order_for_longer() {
    of_second_order(0.1, 1e-9);
}

fn of_second_order(part: f64, tolerance: f64) {
    let (exact, events) =
        moved(part, DriverOptions { tolerance, solver: Solver::Stiff, ..DriverOptions::default() });
    assert!(events > 3, "{events}");
    let off = |step: f64| {
        let (tip, count) = moved(
            part,
            DriverOptions { solver: Solver::FixedStiff, max_step: step, ..DriverOptions::default() },
        );
        assert_eq!(count, events);
        tip.iter().zip(&exact).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let errors = [1e-3, 5e-4].map(off);
    eprintln!("tip off by {errors:?} m, {events} events");
    assert!(errors[0] < 3e-5, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((3.0..6.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}
