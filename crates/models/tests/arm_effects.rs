//! Balances of the arm with effects: what goes in stays as energy or is dissipated; momenta obey the wrenches.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use crate::arm_common::{NO_EFFECTS, Run};
use trueup_models::arm::{PlanarManipulator, output, parameter, rotor};
use trueup_numerics::hybrid::{At, Hybrid};

fn torque(t: f64) -> Vec<f64> {
    let mut u = vec![0.0; 9];
    (u[0], u[1], u[2]) = (0.4 * (1.3 * t).sin(), -0.15 * (2.0 * t).cos(), 0.08 * (3.0 * t).sin());
    u
}
/// Begin of an effect's parameters and states.
fn begin(model: &PlanarManipulator, id: &str) -> (usize, usize) {
    let e = model.effects().iter().find(|e| e.spec().id == id).unwrap();
    (e.begin.parameters, e.begin.states)
}
fn energy(y: &[f64]) -> f64 {
    y[output::kinetic_energy(3)] + y[output::potential_energy(3)]
}
fn momenta(y: &[f64]) -> [f64; 3] {
    [y[output::linear_momentum(3)], y[output::linear_momentum(3) + 1], y[output::angular_momentum(3)]]
}
/// Power of the motors less that lost in the dampers that are in contact.
fn motors_and_dampers(at: &At<f64>, m: &PlanarManipulator, contact: impl Fn(usize) -> bool) -> f64 {
    let v = &at.x[m.dofs()..];
    let mut power = 0.0;
    for j in 0..3 {
        power += at.u[j] * v[m.motor(j)];
        if contact(j) {
            power -= at.p[parameter::joint_damping(3) + j] * (v[m.motor(j)] - v[3 + j]).powi(2);
        }
    }
    power
}
/// Largest error of the energy balance and of the momenta (without wrenches) over 10 s.
fn balances(mut run: Run) -> (f64, f64) {
    let first = run.outputs();
    let (mut lost, mut drift) = (0.0f64, 0.0f64);
    for k in 1..=50 {
        run.to(0.2 * f64::from(k), 0.02);
        let y = run.outputs();
        lost = lost.max((energy(&y) - energy(&first) - run.work).abs());
        for (now, then) in momenta(&y).iter().zip(momenta(&first)) {
            drift = drift.max((now - then).abs());
        }
    }
    println!("energy {lost:e} J, momenta {drift:e}, {} events", run.events.len());
    (lost, drift)
}

#[test]
fn backlash_keeps_energy_and_momenta() {
    let model = PlanarManipulator::new(&[true; 3], &["backlash", "nonlinear-stiffness"]).unwrap();
    let mut p = model.defaults();
    p[parameter::motor_inertia(3)..][..3].copy_from_slice(&[0.3, 0.2, 0.1]);
    p[begin(&model, "backlash").0..][..3].copy_from_slice(&[0.02, 0.01, 0.0]);
    let run = Run::new(&model, &p, torque)
        .with_power(|at, m| motors_and_dampers(at, m, |j| j == 2 || at.modes[j] != 0));
    let (lost, drift) = balances(run);
    assert!(lost < 1e-9 && drift < 1e-10);
}

#[test]
fn hysteresis_takes_out_what_its_torque_does() {
    let model = PlanarManipulator::new(&[true, true, false], &["transmission-hysteresis"]).unwrap();
    let mut p = model.defaults();
    let (hp, hx) = begin(&model, "transmission-hysteresis");
    p[hp + 3..hp + 6].copy_from_slice(&[0.05; 3]);
    let run = Run::new(&model, &p, torque).with_power(move |at, m| {
        let v = &at.x[m.dofs()..];
        let hysteresis: f64 = (0..2).map(|j| at.p[hp + j] * at.x[hx + j] * (v[m.motor(j)] - v[3 + j])).sum();
        motors_and_dampers(at, m, |_| true) - hysteresis
    });
    let (lost, drift) = balances(run);
    // Dahl's law has a kink where the deflection turns back, without an event: the integrator notices it.
    assert!(lost < 1e-6 && drift < 1e-10);
}

#[test]
fn flexible_links_keep_energy_and_momenta() {
    let model = PlanarManipulator::new(&[true, false, false], &["flexible-link"]).unwrap();
    let p = model.defaults();
    let (fp, fx) = begin(&model, "flexible-link");
    let run = Run::new(&model, &p, torque).with_power(move |at, m| {
        let v = &at.x[m.dofs()..];
        let mut rate = v[2];
        let mut lost = 0.0;
        for j in 0..3 {
            rate += v[3 + j];
            lost += at.p[fp + 6 + j] * (at.x[fx + 3 + j] - rate).powi(2);
        }
        motors_and_dampers(at, m, |_| true) - lost
    });
    let (lost, drift) = balances(run);
    assert!(lost < 1e-9 && drift < 1e-10);
}

#[test]
fn a_tilted_table_pulls_the_whole_like_a_stone() {
    let model = PlanarManipulator::new(&[true, false, false], &["table-tilt"]).unwrap();
    let mut p = model.defaults();
    let at = begin(&model, "table-tilt").0;
    p[at..at + 2].copy_from_slice(&[0.03, -0.02]);
    let mut run = Run::new(&model, &p, torque).with_power(|at, m| motors_and_dampers(at, m, |_| true));
    let first = run.outputs();
    run.to(10.0, 0.02);
    let y = run.outputs();
    let mass = 58.69 + 2.81 + 2.82 + 4.64;
    assert!((momenta(&y)[0] - mass * 0.3).abs() < 1e-10 && (momenta(&y)[1] + mass * 0.2).abs() < 1e-10);
    assert!((energy(&y) - energy(&first) - run.work).abs() < 1e-9);
}

/// Unbalanced loads on every link of an arm on the ground: what they give and take is in the potential energy; a link that
/// hangs at rest stays so.
#[test]
fn gravity_torques_keep_energy() {
    let model = PlanarManipulator::on_base(true, &[true, false, false], &["gravity-torque"]).unwrap();
    let mut p = model.defaults();
    let at = begin(&model, "gravity-torque").0;
    p[at..at + 3].copy_from_slice(&[1.3, 0.7, 0.4]);
    p[at + 3..at + 6].copy_from_slice(&[0.5, -1.2, 2.0]);
    p[parameter::initial_base_attitude(3)] = 0.3;
    p[parameter::initial_joint_angle(3) + 1] = -0.8;
    let run = Run::new(&model, &p, torque).with_power(|at, m| motors_and_dampers(at, m, |j| j == 0));
    let (lost, _) = balances(run);
    assert!(lost < 1e-9);

    // Attitudes 0.5, -1.2 and 2.0.
    p[parameter::initial_joint_angle(3)..][..3].copy_from_slice(&[0.2, -1.7, 3.2]);
    p[parameter::initial_motor_angle(3)] = 0.2;
    let run = Run::new(&model, &p, |_| vec![0.0; 9]);
    let mut dx = vec![0.0; model.sizes().states];
    model.rates(At { t: 0.0, x: &run.x, u: &[0.0; 9], p: &p, modes: &[] }, &mut dx);
    assert!(dx.iter().all(|r| r.abs() < 1e-14), "{dx:?}");
    assert!((run.outputs()[output::potential_energy(3)] + 2.4).abs() < 1e-14);
}

#[test]
fn base_drag_takes_out_energy_and_momentum() {
    let model = PlanarManipulator::new(&[false; 3], &["base-drag"]).unwrap();
    let mut p = model.defaults();
    p[parameter::initial_base_velocity(3)..][..2].copy_from_slice(&[0.1, -0.05]);
    p[parameter::initial_base_rate(3)] = 0.2;
    let (c_t, c_r) = (2.0, 0.2);
    let mut run = Run::new(&model, &p, torque).with_power(move |at, m| {
        let v = &at.x[m.dofs()..];
        motors_and_dampers(at, m, |_| true) - c_t * (v[0] * v[0] + v[1] * v[1]) - c_r * v[2] * v[2]
    });
    let first = run.outputs();
    run.to(10.0, 0.02);
    let y = run.outputs();
    assert!((energy(&y) - energy(&first) - run.work).abs() < 1e-9);
    // Force -c_t v_0 over the time is -c_t times the way of the satellite.
    for i in 0..2 {
        assert!(
            (momenta(&y)[i] - momenta(&first)[i]
                + c_t * (run.x[i] - p[parameter::initial_base_position(3) + i]))
                .abs()
                < 1e-10
        );
    }
}

/// Checks ARM-8.
#[test]
fn wrenches_do_work_and_change_momenta() {
    let model = PlanarManipulator::new(&[true, false, true], NO_EFFECTS).unwrap();
    let p = model.defaults();
    let (fb, tb, ft, tt) = ([0.3, -0.2], 0.05, [-0.1, 0.15], -0.02);
    let input = move |t: f64| [&torque(t)[..3], &fb, &[tb], &ft, &[tt]].concat();
    let mut run = Run::new(&model, &p, input).with_power(move |at, m| {
        let mut y = vec![0.0; m.sizes().outputs];
        m.outputs(*at, &mut y);
        let v = &at.x[m.dofs()..];
        let tip = &y[output::tip_velocity(3)..];
        let rate: f64 = v[2..6].iter().sum();
        motors_and_dampers(at, m, |j| j != 1)
            + (fb[0] * v[0] + fb[1] * v[1] + tb * v[2])
            + (ft[0] * tip[0] + ft[1] * tip[1] + tt * rate)
    });
    let first = run.outputs();
    run.to(5.0, 0.02);
    let y = run.outputs();
    assert!((energy(&y) - energy(&first) - run.work).abs() < 1e-9);
    for i in 0..2 {
        assert!((momenta(&y)[i] - 5.0 * (fb[i] + ft[i])).abs() < 1e-10);
    }
}

#[test]
fn geared_rotors_keep_momenta_and_move_the_base_less() {
    let turned = |coupling: f64| {
        let model = PlanarManipulator::new(&[true, false, false], NO_EFFECTS).unwrap();
        let mut p = model.defaults();
        p[parameter::motor_coupling(3)] = coupling;
        let run = Run::new(&model, &p, torque).with_power(|at, m| motors_and_dampers(at, m, |_| true));
        let (lost, drift) = balances(run);
        assert!(lost < 1e-9 && drift < 1e-10);
        // Only the rotor turns: with everything at rest, the base's first acceleration is by its reaction.
        let mut dx = vec![0.0; model.sizes().states];
        let mut x = dx.clone();
        model.start(&p, &mut x);
        model.rates(
            At { t: 0.0, x: &x, u: &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], p: &p, modes: &[] },
            &mut dx,
        );
        dx[model.dofs() + 2]
    };
    let (paper, geared) = (turned(rotor::PAPER), turned(rotor::GEARED));
    assert!(paper < 0.0 && geared < 0.0 && paper / geared > 50.0, "{paper} {geared}");
}
