//! Stick-slip of several joints at once (ARM-9).
#![allow(clippy::unwrap_used)]

use crate::arm_common::{NO_EFFECTS, Random, Run};
use trueup_models::arm::{PlanarManipulator, output, parameter};
use trueup_models::friction::STUCK;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_numerics::hybrid::{At, Hybrid};

const FRICTION: &[&str] = &["motor-friction"];

fn model(flexible: &[bool]) -> PlanarManipulator {
    PlanarManipulator::new(flexible, FRICTION).unwrap()
}
fn set(p: &mut [f64], begin: usize, values: &[f64]) {
    p[begin..begin + values.len()].copy_from_slice(values);
}
fn inputs(torques: &[f64]) -> Vec<f64> {
    [torques, &[0.0; 6]].concat()
}

#[test]
fn sticking_joints_are_one_body_with_their_neighbours() {
    // Joints 2 and 3 never break away: one link made of three, on the flexible joint 1.
    let (three, one) = (model(&[true, false, false]), model(&[true]));
    let mut p = three.defaults();
    set(&mut p, parameter::initial_joint_angle(3), &[0.1, -0.6, 0.9]);
    set(&mut p, parameter::initial_motor_angle(3), &[0.15]);
    set(&mut p, parameter::static_friction(3), &[0.0, 1e3, 1e3]);
    set(&mut p, parameter::coulomb_friction(3), &[0.0, 1e3, 1e3]);
    let mut single = one.defaults();
    set(&mut single, parameter::initial_joint_angle(1), &[0.1]);
    set(&mut single, parameter::initial_motor_angle(1), &[0.15]);
    set(&mut single, parameter::static_friction(1), &[0.0, 0.01]); // static and viscous
    set(&mut single, parameter::coulomb_friction(1), &[0.0]);
    // Mass, centre and inertia of the three links in the axes of link 1.
    let (mut from, mut angle, mut parts) = ([0.0, 0.0], 0.0f64, Vec::new());
    for j in 0..3 {
        angle += [0.0, -0.6, 0.9][j];
        let (c, l) = (parameter::link_center_of_mass(3) + 2 * j, p[parameter::link_length(3) + j]);
        let (s, k) = angle.sin_cos();
        let center = [from[0] + k * p[c] - s * p[c + 1], from[1] + s * p[c] + k * p[c + 1]];
        parts.push((p[parameter::link_mass(3) + j], p[parameter::link_inertia(3) + j], center));
        from = [from[0] + k * l, from[1] + s * l];
    }
    let mass: f64 = parts.iter().map(|b| b.0).sum();
    let center = [0, 1].map(|i| parts.iter().map(|b| b.0 * b.2[i]).sum::<f64>() / mass);
    let inertia: f64 =
        parts.iter().map(|b| b.1 + b.0 * ((b.2[0] - center[0]).powi(2) + (b.2[1] - center[1]).powi(2))).sum();
    set(&mut single, parameter::link_mass(1), &[mass]);
    set(&mut single, parameter::link_inertia(1), &[inertia]);
    set(&mut single, parameter::link_center_of_mass(1), &center);

    let mut a = Run::new(&three, &p, |t| inputs(&[0.5 * t.sin(), 0.3, -0.2]));
    let mut b = Run::new(&one, &single, |t| inputs(&[0.5 * t.sin()]));
    a.to(6.0, 0.02);
    b.to(6.0, 0.02);
    // x_0, y_0, q_0, q_1, q_m1 of both.
    for (i, j) in [(0, 0), (1, 1), (2, 2), (3, 3), (6, 4)] {
        assert!((a.x[i] - b.x[j]).abs() < 1e-10, "coordinate {i}: {} {}", a.x[i], b.x[j]);
    }
    assert_eq!((a.x[4], a.x[5]), (-0.6, 0.9));
    let y = a.outputs();
    assert_eq!(y[output::sticking(3)..output::sticking(3) + 3], [0.0, 1.0, 1.0]);
}

#[test]
fn a_sticking_motor_leaves_the_link_its_frequency() {
    // A16, test 3 of S0 table 2: I_m 5.6, k 9.2 give 0.3083666998 Hz with the motor locked.
    let model = model(&[true, false, false]);
    let mut p = model.defaults();
    let angles = [7.5f64, -15.0, -22.5].map(f64::to_radians);
    set(&mut p, parameter::joint_stiffness(3), &[9.2]);
    set(&mut p, parameter::joint_damping(3), &[0.0]);
    set(&mut p, parameter::initial_motor_angle(3), &angles);
    set(&mut p, parameter::initial_joint_angle(3), &[angles[0] + 1e-5, angles[1], angles[2]]);
    set(&mut p, parameter::static_friction(3), &[1e3; 3]);
    let mut run = Run::new(&model, &p, |_| inputs(&[0.0; 3]));
    let period = 1.0 / 0.3083666998;
    run.to(10.0 * period, 0.02);
    // Back at the turning point after ten periods: the velocity's phase is the error of the frequency.
    let phase = run.x[model.dofs() + 3] / (1e-5 * std::f64::consts::TAU / period);
    println!("phase after ten periods {phase:e}");
    assert!(phase.abs() < 1e-5 && run.events.is_empty());
}

#[test]
fn break_away_is_when_the_level_is_reached_and_by_the_first_one() {
    let model = model(&[false; 3]);
    let mut p = model.defaults();
    set(&mut p, parameter::static_friction(3), &[0.3, 0.1, 0.2]);
    set(&mut p, parameter::coulomb_friction(3), &[0.2, 0.05, 0.1]);
    // At rest nothing moves, so that friction balances the torques themselves: 0.1 t each.
    let mut run = Run::new(&model, &p, |t| inputs(&[0.1 * t, -0.1 * t, 0.1 * t]));
    run.to(1.5, 0.02);
    let (time, modes) = &run.events[0];
    assert!((time - 1.0).abs() < 1e-10, "{time}");
    assert_eq!(modes[..3], [0, -1, 0]);
}

#[test]
fn two_at_once_break_away_together() {
    let model = model(&[false; 3]);
    let mut p = model.defaults();
    set(&mut p, parameter::static_friction(3), &[0.2, 0.2, 10.0]);
    set(&mut p, parameter::coulomb_friction(3), &[0.1, 0.1, 0.1]);
    let run = Run::new(&model, &p, |_| inputs(&[3.0, -3.0, 0.0]));
    assert_eq!(run.modes[..3], [1, -1, 0]);
    let mut run = Run::new(&model, &p, |t| inputs(&if t < 0.5 { [0.0; 3] } else { [3.0, -3.0, 0.0] }));
    assert_eq!(run.modes[..3], [0, 0, 0]);
    run.t = 0.5;
    run.iterate();
    assert_eq!(run.modes[..3], [1, -1, 0]);
}

#[test]
fn the_projects_own_driver_finds_the_same_run() {
    let model = PlanarManipulator::new(&[true, false, false], &["stribeck-friction", "backlash"]).unwrap();
    let p = model.defaults();
    let torque = |t: f64| inputs(&[0.3 * t.sin(), -0.1 * (2.0 * t).cos(), 0.05 * (3.0 * t).sin()]);
    let mut run = Run::new(&model, &p, torque);
    run.to(6.0, 0.02);
    let options = DriverOptions { tolerance: 1e-11, ..DriverOptions::default() };
    let nominal = vec![1.0; model.sizes().states];
    let other =
        simulate(&model, &p, &nominal, options, &|t, u| u.copy_from_slice(&torque(t)), &[0.0, 6.0]).unwrap();
    let last = other.x.last().unwrap();
    let worst = run.x.iter().zip(last).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("{} events; driver against extrapolation {worst:e}", run.events.len());
    assert!(run.events.len() > 10 && worst < 1e-8);
}

#[test]
fn a_velocity_set_from_outside_makes_a_sticking_motor_slide() {
    let model = model(&[true]);
    let p = model.defaults();
    let mut run = Run::new(&model, &p, |_| inputs(&[0.0]));
    assert_eq!(run.modes[0], STUCK);
    run.x[model.dofs() + model.motor(0)] = -0.1;
    run.iterate();
    assert_eq!(run.modes[0], -1);
}

#[test]
fn without_friction_effects_there_are_no_events() {
    let s = PlanarManipulator::new(&[true; 3], NO_EFFECTS).unwrap().sizes();
    assert_eq!((s.modes, s.indicators), (0, 0));
}

/// Sticking motors below their level, sliding ones against their friction.
fn consistent(run: &Run) {
    let n = run.model.links();
    let y = run.outputs();
    for j in 0..n {
        let (omega, torque) = (y[output::motor_velocity(n) + j], y[output::friction_torque(n) + j]);
        if run.modes[j] == STUCK {
            let level =
                run.p[parameter::static_friction(n) + j].max(run.p[parameter::coulomb_friction(n) + j]);
            assert!(torque.abs() <= level, "joint {j} sticks at {torque} above {level} at {}", run.t);
            assert_eq!(omega, 0.0);
        } else {
            assert!(f64::from(run.modes[j]) * omega >= -1e-9);
            assert!(torque * f64::from(run.modes[j]) > 0.0);
        }
    }
}

#[test]
fn random_runs_keep_momenta_and_energy_and_do_not_chatter() {
    random_runs(4);
}

#[test]
#[ignore = "twenty runs: ./test --full runs it"]
fn many_random_runs_keep_momenta_and_energy_and_do_not_chatter() {
    random_runs(20);
}

fn random_runs(cases: usize) {
    let mut random = Random(6);
    let (mut most, mut events, mut lost, mut drift) = (0, 0, 0.0f64, 0.0f64);
    for case in 0..cases {
        let n = random.within(1.0, 6.99) as usize;
        let flexible: Vec<bool> = (0..n).map(|_| random.within(0.0, 1.0) < 0.5).collect();
        let ids: &[&str] = if case % 2 == 0 { FRICTION } else { &["stribeck-friction"] };
        let model = PlanarManipulator::new(&flexible, ids).unwrap();
        let mut p = model.defaults();
        for j in 0..n {
            p[parameter::motor_inertia(n) + j] = random.within(0.05, 1.0);
            let coulomb = random.within(0.01, 0.1);
            p[parameter::coulomb_friction(n) + j] = coulomb;
            p[parameter::static_friction(n) + j] = coulomb * random.within(1.0, 2.0);
        }
        let (size, rate) = (random.vector(n, 0.4), random.vector(n, 2.0));
        let input = move |t: f64| {
            inputs(&(0..n).map(|j| size[j] * (rate[j] * t + j as f64).sin()).collect::<Vec<_>>())
        };
        let mut run = Run::new(&model, &p, input).with_power(|at, m| {
            let v = &at.x[m.dofs()..];
            let mut y = vec![0.0; m.sizes().outputs];
            m.outputs(At { ..*at }, &mut y);
            (0..n)
                .map(|j| {
                    let slip = v[m.motor(j)] - v[3 + j];
                    (at.u[j] - y[output::friction_torque(n) + j]) * v[m.motor(j)]
                        - at.p[parameter::joint_damping(n) + j] * slip * slip
                })
                .sum()
        });
        let energy = |y: &[f64]| y[output::kinetic_energy(n)] + y[output::potential_energy(n)];
        for k in 1..=40 {
            run.to(0.25 * f64::from(k), 0.025);
            consistent(&run);
            let y = run.outputs();
            lost = lost.max((energy(&y) - run.work).abs());
            for i in [output::linear_momentum(n), output::linear_momentum(n) + 1, output::angular_momentum(n)]
            {
                drift = drift.max(y[i].abs());
            }
        }
        most = most.max(run.events.len());
        events += run.events.len();
    }
    println!("{events} events, at most {most} in a run; energy {lost:e} J, momenta {drift:e}");
    assert!(most < 200 && events > 10 * cases);
    assert!(lost < 1e-8 && drift < 1e-10);
}
