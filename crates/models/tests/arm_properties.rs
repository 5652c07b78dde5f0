//! The arm's equations against the energies that they come from, for random manipulators.
//!
//! The kinetic energy is written body by body here (S0 eq. 4-6, rotors as they turn), velocities by duals
//! of the positions: nothing of the closed form under test.
#![allow(clippy::unwrap_used)]

use crate::arm_common::{NO_EFFECTS, Random, Run};
use trueup_models::arm::chain::Chain;
use trueup_models::arm::{MAX_LINKS, PlanarManipulator, input, kinematics, output, parameter, rotor};
use trueup_models::effect::PlacedEffect;
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_numerics::{Dual, Scalar};

/// A random structure on a base that floats with random physical parameters, both couplings.
fn random_arm(random: &mut Random) -> (PlanarManipulator, Vec<f64>) {
    random_arm_on(false, random, NO_EFFECTS)
}
fn random_arm_on(fixed: bool, random: &mut Random, effects: &[&str]) -> (PlanarManipulator, Vec<f64>) {
    let n = random.within(1.0, 6.99) as usize;
    let flexible: Vec<bool> = (0..n).map(|_| random.within(0.0, 1.0) < 0.5).collect();
    let model = PlanarManipulator::on_base(fixed, &flexible, effects).unwrap();
    let mut p: Vec<f64> = (0..model.sizes().parameters).map(|_| random.within(0.1, 3.0)).collect();
    for i in 0..2 * n {
        p[parameter::link_center_of_mass(n) + i] = random.within(-0.5, 0.5);
    }
    p[parameter::mount_position(n)] = random.within(-0.5, 0.5);
    p[parameter::base_mass(n)] = 20.0;
    (0..n).for_each(|j| p[parameter::gear_ratio(n) + j] = random.within(1.0, 100.0));
    p[parameter::motor_coupling(n)] =
        if random.within(0.0, 1.0) < 0.5 { rotor::PAPER } else { rotor::GEARED };
    (model, p)
}

/// What the weight of all bodies would do on the way from the inertial origin to where they are: sum of m g . r.
fn lowered(p: &[f64], q: &[f64], n: usize) -> f64 {
    let g = [p[parameter::gravity(n)], p[parameter::gravity(n) + 1]];
    let along = |from: [f64; 2], a: f64, x: f64, y: f64| {
        [from[0] + a.cos() * x - a.sin() * y, from[1] + a.sin() * x + a.cos() * y]
    };
    let of = |mass: f64, at: [f64; 2]| mass * (g[0] * at[0] + g[1] * at[1]);
    let (mut joint, mut angle) = ([q[0], q[1]], q[2]);
    let mut sum = of(p[parameter::base_mass(n)], joint);
    joint = along(joint, angle, p[parameter::mount_position(n)], p[parameter::mount_position(n) + 1]);
    for j in 0..n {
        angle += q[3 + j];
        let com = parameter::link_center_of_mass(n) + 2 * j;
        sum += of(p[parameter::link_mass(n) + j], along(joint, angle, p[com], p[com + 1]));
        joint = along(joint, angle, p[parameter::link_length(n) + j], 0.0);
    }
    sum
}

/// Energy of the unbalanced loads: each link's goes with its attitude against the inertial frame.
fn hanging(model: &PlanarManipulator, p: &[f64], q: &[f64]) -> f64 {
    let own = |e: &PlacedEffect| {
        let at = e.begin.parameters;
        let attitude = |j: usize| q[2..=3 + j].iter().sum::<f64>();
        (0..e.sites).map(|j| -p[at + j] * (attitude(j) - p[at + e.sites + j]).cos()).sum::<f64>()
    };
    model.effects().iter().map(own).sum()
}

/// Kinetic energy of all bodies and rotors.
fn kinetic(model: &PlanarManipulator, p: &[f64], q: &[f64], v: &[f64]) -> f64 {
    let n = model.links();
    let moving = |i: usize| Dual::<1>::new(q[i], [v[i]]);
    let body = |mass: f64, inertia: f64, at: [Dual<1>; 2], rate: f64| {
        0.5 * mass * (at[0].eps[0].powi(2) + at[1].eps[0].powi(2)) + 0.5 * inertia * rate * rate
    };
    let along = |from: [Dual<1>; 2], angle: Dual<1>, x: f64, y: f64| {
        [from[0] + angle.cos() * x - angle.sin() * y, from[1] + angle.sin() * x + angle.cos() * y]
    };
    let mut joint = [moving(0), moving(1)];
    let mut angle = moving(2);
    let mut sum = body(p[parameter::base_mass(n)], p[parameter::base_inertia(n)], joint, angle.eps[0]);
    joint = along(joint, angle, p[parameter::mount_position(n)], p[parameter::mount_position(n) + 1]);
    for j in 0..n {
        // The rotor: I_r = I_m / N^2 turns at Omega + N q_m', or I_m at Omega + q_m' as printed.
        let (inertia, gear) = (p[parameter::motor_inertia(n) + j], p[parameter::gear_ratio(n) + j]);
        let (carrier, own) = (angle.eps[0], v[model.motor(j)]);
        sum += if p[parameter::motor_coupling(n)] == rotor::PAPER {
            0.5 * inertia * (carrier + own).powi(2)
        } else {
            0.5 * inertia / gear.powi(2) * (carrier + gear * own).powi(2)
        };
        angle += moving(3 + j);
        let com = parameter::link_center_of_mass(n) + 2 * j;
        let center = along(joint, angle, p[com], p[com + 1]);
        let (mass, inertia) = (p[parameter::link_mass(n) + j], p[parameter::link_inertia(n) + j]);
        sum += body(mass, inertia, center, angle.eps[0]);
        joint = along(joint, angle, p[parameter::link_length(n) + j], 0.0);
    }
    sum
}

/// M from the kinetic energy: T is quadratic in v, so T(a + b) - T(a) - T(b) is exact.
fn mass(model: &PlanarManipulator, p: &[f64], q: &[f64], i: usize, j: usize) -> f64 {
    let t = |on: &[usize]| {
        let mut v = vec![0.0; model.dofs()];
        on.iter().for_each(|k| v[*k] += 1.0);
        kinetic(model, p, q, &v)
    };
    t(&[i, j]) - t(&[i]) - t(&[j])
}

#[test]
fn mass_matrix_energy_and_momenta_are_those_of_the_bodies() {
    let mut random = Random(3);
    let mut worst = 0.0f64;
    for _ in 0..200 {
        let (model, p) = random_arm(&mut random);
        let (n, d) = (model.links(), model.dofs());
        let (q, v) = (random.vector(d, 3.0), random.vector(d, 2.0));
        let x = [q.clone(), v.clone()].concat();
        let m = model.mass_matrix(&x, &p);
        let scale = (0..d).map(|i| m.at(i, i)).fold(0.0, f64::max);
        for i in 0..d {
            for j in 0..=i {
                worst = worst.max((m.at(i, j) - mass(&model, &p, &q, i, j)).abs() / scale);
            }
        }
        let mut y = vec![0.0; model.sizes().outputs];
        let u = vec![0.0; model.sizes().inputs];
        model.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut y);
        let t = kinetic(&model, &p, &q, &v);
        worst = worst.max((y[output::kinetic_energy(n)] / t - 1.0).abs());
        // A turn of the whole about the inertial origin at unit rate has the angular momentum as its momentum:
        // T(v + e turn) = T(v) + e L + ..
        let turn: Vec<f64> = (0..d).map(|i| [-q[1], q[0], 1.0].get(i).copied().unwrap_or(0.0)).collect();
        let plus: Vec<f64> = v.iter().zip(&turn).map(|(v, w)| v + w).collect();
        let l = kinetic(&model, &p, &q, &plus) - t - kinetic(&model, &p, &q, &turn);
        worst = worst.max((y[output::angular_momentum(n)] - l).abs() / (scale * 10.0));
    }
    println!("mass matrix, energy, momentum against the bodies: {worst:e}");
    assert!(worst < 1e-13);
}

/// Checks EF-7 on the arm, too.
#[test]
fn accelerations_satisfy_lagranges_equations() {
    let mut random = Random(4);
    let mut worst = 0.0f64;
    for case in 0..100 {
        // On a fixed base every link has an unbalanced load of its own.
        let fixed = case % 2 == 1;
        let effects = if fixed { &["gravity-torque"][..] } else { NO_EFFECTS };
        let (model, p) = random_arm_on(fixed, &mut random, effects);
        let (n, d) = (model.links(), model.dofs());
        let (q, mut v) = (random.vector(d, 3.0), random.vector(d, 1.0));
        // A base that is fixed does not move, whatever force that takes (ARM-15).
        let held = if model.has_fixed_base() { 3 } else { 0 };
        v[..held].fill(0.0);
        let u = random.vector(model.sizes().inputs, 2.0);
        let x = [q.clone(), v.clone()].concat();
        let mut dx = vec![0.0; 2 * d];
        model.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut dx);
        assert!(dx[..held].iter().chain(&dx[d..][..held]).all(|r| *r == 0.0));
        let a = &dx[d..];
        let e = 1e-4;
        let moved = |direction: &[f64], s: f64| -> Vec<f64> {
            q.iter().zip(direction).map(|(q, w)| q + s * w).collect()
        };
        // Central differences, extrapolated: error of the order e^4.
        let slope = |f: &dyn Fn(f64) -> f64| {
            let d = |h: f64| (f(h) - f(-h)) / (2.0 * h);
            (4.0 * d(e) - d(2.0 * e)) / 3.0
        };
        for i in held..d {
            let unit: Vec<f64> = (0..d).map(|k| f64::from(u8::from(k == i))).collect();
            // d/dt (dT/dv_i) = sum_k M_ik a_k + (dM/dt v)_i
            let momentum = |s: f64| {
                let at = moved(&v, s);
                (0..d).map(|k| mass(&model, &p, &at, i, k) * v[k]).sum::<f64>()
            };
            let inertial: f64 = (0..d).map(|k| mass(&model, &p, &q, i, k) * a[k]).sum();
            let left = inertial + slope(&momentum) - slope(&|s| kinetic(&model, &p, &moved(&unit, s), &v));
            // Springs and dampers (eq. 7, 8), torques, and the wrenches by their virtual power.
            let mut right = match i {
                0 | 1 => u[input::base_force(n) + i],
                2 => u[input::base_torque(n)],
                _ => 0.0,
            };
            for j in 0..n {
                if model.motor(j) == i {
                    right += u[input::joint_torque(n) + j];
                }
                if model.flexible()[j] {
                    let (m, l) = (model.motor(j), 3 + j);
                    let torque = p[parameter::joint_stiffness(n) + j] * (q[m] - q[l])
                        + p[parameter::joint_damping(n) + j] * (v[m] - v[l]);
                    right += torque * (f64::from(u8::from(i == l)) - f64::from(u8::from(i == m)));
                }
            }
            let tip = |s: f64| {
                let at = moved(&unit, s);
                kinematics::tip(&Chain::new(n, &p).turned(&at, &v), &at, &v)
            };
            for axis in 0..2 {
                right += u[input::tip_force(n) + axis] * slope(&|s| tip(s).position[axis]);
            }
            right += u[input::tip_torque(n)] * slope(&|s| tip(s).attitude);
            right += slope(&|s| lowered(&p, &moved(&unit, s), n));
            right -= slope(&|s| hanging(&model, &p, &moved(&unit, s)));
            worst = worst.max((left - right).abs() / (1.0 + left.abs() + inertial.abs()));
        }
        // All that stores energy is reported (ARM-13).
        let springs = (0..n)
            .filter(|j| model.flexible()[*j])
            .map(|j| 0.5 * p[parameter::joint_stiffness(n) + j] * (q[model.motor(j)] - q[3 + j]).powi(2));
        let stored = springs.sum::<f64>() + hanging(&model, &p, &q) - lowered(&p, &q, n);
        let mut y = vec![0.0; model.sizes().outputs];
        model.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut y);
        assert!((y[output::potential_energy(n)] - stored).abs() < 1e-11 * (1.0 + stored.abs()));
    }
    println!("Lagrange's equations: {worst:e}");
    assert!(worst < 1e-8);
}

#[test]
fn on_a_fixed_base_one_link_is_a_pendulum_and_gravity_wants_such_a_base() {
    let (mass, lever, inertia, g) = (2.0, 0.4, 0.1, 9.81);
    let pendulum = PlanarManipulator::on_base(true, &[false], NO_EFFECTS).unwrap();
    let mut p = pendulum.defaults();
    p[parameter::link_mass(1)] = mass;
    p[parameter::link_inertia(1)] = inertia;
    p[parameter::link_center_of_mass(1)..][..2].copy_from_slice(&[lever, 0.0]);
    p[parameter::gravity(1) + 1] = -g;
    p[parameter::initial_base_attitude(1)] = 0.3;
    // What a fixed base is given as a velocity it does not have.
    p[parameter::initial_base_rate(1)] = 1.0;
    p[parameter::initial_joint_angle(1)] = 0.5;
    let u = |_: f64| vec![0.0; input::count(1)];
    let mut run = Run::new(&pendulum, &p, u);
    let mut dx = vec![0.0; 8];
    pendulum.rates(At { t: 0.0, x: &run.x, u: &u(0.0), p: &p, modes: &[] }, &mut dx);
    let expected = -mass * g * lever * 0.8f64.cos() / (inertia + mass * lever * lever);
    assert!((dx[7] / expected - 1.0).abs() < 1e-14 && dx[..3] == [0.0; 3]);
    let energy = |y: &[f64]| y[output::kinetic_energy(1)] + y[output::potential_energy(1)];
    let before = energy(&run.outputs());
    run.to(3.0, 1e-3);
    assert!((energy(&run.outputs()) / before - 1.0).abs() < 1e-11);
    assert!(pendulum.check(&p).is_ok());
    let free = PlanarManipulator::new(&[false], NO_EFFECTS).unwrap();
    let (at, said) = free.check(&p).unwrap_err();
    assert_eq!(at, parameter::gravity(1) + 1);
    assert!(said.contains("gravity[2] = -9.81") && said.contains("base = fixed"), "{said}");
}

#[test]
fn centers_of_mass_and_tip_velocity() {
    let mut random = Random(5);
    for _ in 0..100 {
        let (model, p) = random_arm(&mut random);
        let (n, d) = (model.links(), model.dofs());
        let (q, v) = (random.vector(d, 3.0), random.vector(d, 2.0));
        // Positions on duals along the motion: their derivative is the velocity.
        let qd: Vec<_> = q.iter().zip(&v).map(|(q, v)| Dual::<1>::new(*q, [*v])).collect();
        let vd: Vec<_> = v.iter().map(|v| Dual::constant(*v)).collect();
        let pd: Vec<_> = p.iter().map(|p| Dual::constant(*p)).collect();
        let t = Chain::new(n, &pd).turned(&qd, &vd);
        let tip = kinematics::tip(&t, &qd, &vd);
        let mut y = vec![0.0; model.sizes().outputs];
        let u = vec![0.0; model.sizes().inputs];
        let x = [q, v].concat();
        model.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut y);
        assert!((tip.attitude.eps[0] - y[output::tip_rate(n)]).abs() < 1e-12);
        let mut momentum = [0.0; 2];
        for axis in 0..2 {
            momentum[axis] = p[parameter::base_mass(n)] * x[d + axis];
            for link in 1..=n {
                let c = kinematics::center_of_mass(&t, &qd, &pd, link);
                momentum[axis] += p[parameter::link_mass(n) + link - 1] * c[axis].eps[0];
            }
            assert!((tip.position[axis].eps[0] - y[output::tip_velocity(n) + axis]).abs() < 1e-12);
            assert!((momentum[axis] - y[output::linear_momentum(n) + axis]).abs() < 1e-11);
        }
    }
}

#[test]
fn what_cannot_be_built_is_refused_with_the_mend() {
    let message =
        |n: usize, ids: &[&str]| PlanarManipulator::new(&vec![true; n], ids).unwrap_err().to_string();
    assert!(message(0, NO_EFFECTS).contains("1 to 8"));
    assert!(message(MAX_LINKS + 1, NO_EFFECTS).contains("9 links"));
    let said = message(3, &["gravity-torque"]);
    assert!(
        ["floats", "--structure base=fixed", "base = \"fixed\""].iter().all(|s| said.contains(s)),
        "{said}"
    );
    assert!(PlanarManipulator::on_base(true, &[true], &["gravity-torque"]).is_ok());
    let model = PlanarManipulator::new(&[true, false, false], NO_EFFECTS).unwrap();
    let refused = |at: usize, value: f64| {
        let mut p = model.defaults();
        p[at] = value;
        model.check(&p).unwrap_err()
    };
    let (at, text) = refused(parameter::joint_stiffness(3), 0.0);
    assert!(at == parameter::joint_stiffness(3) && text.contains("jointStiffness[1]"), "{text}");
    let (at, text) = refused(parameter::motor_inertia(3), 0.0);
    assert!(at == parameter::motor_inertia(3) && text.contains("motorInertia[1]"), "{text}");
    let (at, text) = refused(parameter::link_inertia(3) + 2, -5.0);
    assert!(at == parameter::link_inertia(3) + 2 && text.contains("linkInertia[3]"), "{text}");
    let (at, _) = refused(parameter::motor_inertia(3), f64::NAN);
    assert_eq!(at, parameter::motor_inertia(3));
    // The stiffness of a rigid joint is of no account.
    let mut p = model.defaults();
    p[parameter::joint_stiffness(3) + 1] = 0.0;
    assert!(model.check(&p).is_ok());
}

#[test]
fn every_number_of_links_has_start_values_that_fit() {
    for n in 1..=MAX_LINKS {
        for effects in [&[][..], &["motor-friction", "backlash", "flexible-link", "base-drag"]] {
            let model = PlanarManipulator::new(&vec![true; n], effects).unwrap();
            let p = model.defaults();
            assert_eq!(p.len(), model.sizes().parameters);
            assert!(model.check(&p).is_ok());
        }
    }
}

/// A link that carries a body moves as one body of both does (ARM-16), flexible or not, on either base, in gravity.
#[test]
fn a_payload_is_a_part_of_its_link() {
    let mut random = Random(16);
    let mut worst = 0.0f64;
    for case in 0..100 {
        let (bare, mut p) = random_arm_on(case % 2 == 1, &mut random, NO_EFFECTS);
        let (n, d) = (bare.links(), bare.dofs());
        let model = bare.clone().with_payload(Some(case % n));
        assert_eq!(model.sizes().parameters, bare.sizes().parameters + 4);
        let held = if bare.has_fixed_base() { 3 } else { 0 };
        let (q, mut v) = (random.vector(d, 3.0), random.vector(d, 1.0));
        v[..held].fill(0.0);
        let x = [q, v].concat();
        let u = random.vector(model.sizes().inputs, 2.0);
        p.extend([
            random.within(0.1, 3.0),
            random.within(-0.5, 0.5),
            random.within(-0.5, 0.5),
            random.within(0.01, 0.5),
        ]);
        let merged = model.merged(&p);
        assert_eq!(merged.len(), bare.sizes().parameters);
        let (mut dx, mut wanted) = (vec![0.0; 2 * d], vec![0.0; 2 * d]);
        model.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut dx);
        bare.rates(At { t: 0.0, x: &x, u: &u, p: &merged, modes: &[] }, &mut wanted);
        let size = wanted.iter().fold(1.0, |m: f64, r| m.max(r.abs()));
        worst = dx.iter().zip(&wanted).fold(worst, |m, (a, b)| m.max((a - b).abs() / size));
        let (mut y, mut wanted) = (vec![0.0; bare.sizes().outputs], vec![0.0; bare.sizes().outputs]);
        model.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut y);
        bare.outputs(At { t: 0.0, x: &x, u: &u, p: &merged, modes: &[] }, &mut wanted);
        let size = wanted.iter().fold(1.0, |m: f64, r| m.max(r.abs()));
        worst = y.iter().zip(&wanted).fold(worst, |m, (a, b)| m.max((a - b).abs() / size));
    }
    println!("a payload against one body of both: {worst:e}");
    assert!(worst < 1e-11);
}
