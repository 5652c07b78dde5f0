//! `SpatialFreeFlyer` as a model: golden runs, balances of momentum and energy, the plane, a base that is held, rows that
//! are led.

use std::f64::consts::PI;

use trueup_models::arm::{self, PlanarManipulator};
use trueup_models::presets::cbk_pan;
use trueup_models::space::appendage::Beam;
use trueup_models::space::design::{Design, Motor, Thruster, Tip};
use trueup_models::space::flexible::{Appendages, Bent};
use trueup_models::space::layout::{Inputs, Outputs, Parameters, States};
use trueup_models::space::spatial::{Frame, Motion, Wrench};
use trueup_models::space::tree::Placed;
use trueup_models::space::vector::{add, cross, dot, scale, sub, times, transposed_times};
use trueup_models::space::{Led, SpatialFreeFlyer, attitude::rotation, presets};
use trueup_numerics::Dual;
use trueup_numerics::hybrid::{At, Hybrid};

use super::facts::fact;
use crate::arm_common::{NO_EFFECTS, Random, Run};

/// A model with the places and the values of its variables.
struct Flyer {
    model: SpatialFreeFlyer,
    at: States,
    input: Inputs,
    output: Outputs,
    parameter: Parameters,
    p: Vec<f64>,
}

impl Flyer {
    fn of(design: &Design) -> Self {
        let s = design.structure();
        let model = SpatialFreeFlyer::new(s.clone()).unwrap();
        let p = design.parameters();
        model.check(&p).unwrap();
        Self {
            at: States::new(&s),
            input: Inputs::new(&s),
            output: Outputs::new(&s),
            parameter: Parameters::new(&s),
            model,
            p,
        }
    }
    fn start(&mut self, begin: usize, values: &[f64]) {
        self.p[begin..][..values.len()].copy_from_slice(values);
    }
    fn now<'a>(&'a self, x: &'a [f64], u: &'a [f64]) -> At<'a, f64> {
        At { t: 0.0, x, u, p: &self.p, modes: &[] }
    }
    fn rates(&self, x: &[f64], u: &[f64]) -> Vec<f64> {
        let mut dx = vec![0.0; x.len()];
        self.model.rates(self.now(x, u), &mut dx);
        dx
    }
    fn outputs(&self, x: &[f64], u: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.output.count];
        self.model.outputs(self.now(x, u), &mut y);
        y
    }
    /// Outputs and their rates of change, the inputs held.
    fn moving(&self, x: &[f64], u: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let along = |v: &[f64], slope: &[f64]| -> Vec<Dual<1>> {
            v.iter().zip(slope).map(|(re, e)| Dual { re: *re, eps: [*e] }).collect()
        };
        let zeros = vec![0.0; self.p.len().max(u.len())];
        let (x, u, p) = (along(x, &self.rates(x, u)), along(u, &zeros), along(&self.p, &zeros));
        let mut y = vec![Dual { re: 0.0, eps: [0.0] }; self.output.count];
        self.model.outputs(At { t: Dual { re: 0.0, eps: [0.0] }, x: &x, u: &u, p: &p, modes: &[] }, &mut y);
        (y.iter().map(|y| y.re).collect(), y.iter().map(|y| y.eps[0]).collect())
    }
    /// A state in which everything moves, and inputs.
    fn anywhere(&self, random: &mut Random) -> (Vec<f64>, Vec<f64>) {
        let mut x = random.vector(self.at.count, 1.0);
        if !self.model.structure().held {
            // Its length does not matter.
            x[self.at.base_quaternion] += 2.0;
        }
        (x, random.vector(self.input.count, 3.0))
    }
}

fn three(v: &[f64], at: usize) -> [f64; 3] {
    [v[at], v[at + 1], v[at + 2]]
}
fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

const ANGLES: [f64; 6] = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5];

/// The chaser with its arm as in C17.
fn chaser() -> Flyer {
    let mut f = Flyer::of(&presets::chaser());
    f.start(f.parameter.initial_joint_angle, &ANGLES);
    f
}

/// Joint torques of C30.
fn torques(t: f64) -> [f64; 6] {
    let (amplitude, period) = ([2.0, 3.0, -1.5, 0.02, 0.02, 0.004], [20.0, 10.0, 20.0, 5.0, 4.0, 2.5]);
    [0, 1, 2, 3, 4, 5].map(|i| amplitude[i] * (2.0 * PI * t / period[i]).sin())
}

/// Checks SFF-1 and SFF-11 along a run: C30, and that nothing drifts (C31).
#[test]
fn c30_the_chaser_moves_its_arm() {
    let f = chaser();
    let input = |t: f64| {
        let mut u = vec![0.0; f.input.count];
        u[f.input.joint_torque..][..6].copy_from_slice(&torques(t));
        u
    };
    let power = |at: &At<f64>, _: &SpatialFreeFlyer| {
        (0..6).map(|j| at.u[f.input.joint_torque + j] * at.x[f.at.joint_velocity + j]).sum()
    };
    let mut run = Run::new(&f.model, &f.p, input).with_power(power);
    run.to(20.0, 0.05);
    let off = worst(&run.x[..13], fact("C30"));
    let y = run.outputs();
    let drift = worst(&y[f.output.linear_momentum..][..6], &[0.0; 6]);
    let energy = (y[f.output.kinetic_energy] - run.work).abs();
    println!("C30: off by {off:.1e}; P, L drift {drift:.1e}, energy {energy:.1e} J");
    assert!(off < 1e-8 && drift < 1e-9 && energy < 1e-9);
    let length = (0..4).map(|i| run.x[f.at.base_quaternion + i].powi(2)).sum::<f64>();
    assert!((length - 1.0).abs() < 1e-12, "{length}");
}

/// Checks SFF-9 along a run: C32, and the integrals of S2 (9) with what it leaves out (C33).
#[test]
fn c32_base_wrench_and_a_wrench_at_the_tip() {
    let mut f = chaser();
    f.start(f.parameter.initial_base_velocity, &[0.01, 0.0, 0.0]);
    f.start(f.parameter.initial_base_angular_velocity, &[0.0, 0.0, 0.01]);
    let input = |on: bool| {
        let (i, count) = (f.input, f.input.count);
        move |t: f64| {
            let mut u = vec![0.0; count];
            u[i.joint_torque..][..6].copy_from_slice(&torques(t));
            if on {
                u[i.base_force..][..3].copy_from_slice(&[5.0, 0.0, -2.0]);
                u[i.base_torque + 1] = 1.5;
            }
            u[i.tip_force + 1] = 0.1 * (0.4 * t).sin();
            u[i.tip_torque] = 0.002;
            u
        }
    };
    // One component of dL/dt = H_s + r_s x F_s + T_ee + r_ee x F_ee is integrated beside the states.
    let along = |k: usize| {
        let (i, o) = (f.input, f.output);
        let f = &f;
        move |at: &At<f64>, _: &SpatialFreeFlyer| {
            let y = f.outputs(at.x, at.u);
            let of_base = cross(three(&y, o.base_position), three(at.u, i.base_force));
            let of_tip = cross(three(&y, o.tip_position), three(at.u, i.tip_force));
            at.u[i.base_torque + k] + of_base[k] + at.u[i.tip_torque + k] + of_tip[k]
        }
    };
    for k in 0..3 {
        let mut run = Run::new(&f.model, &f.p, input(true)).with_power(along(k));
        let first = run.outputs();
        run.to(10.0, 0.025);
        run.input = Box::new(input(false));
        run.to(20.0, 0.025);
        let y = run.outputs();
        let found = [&run.x[..13], &y[f.output.linear_momentum..][..6]].concat();
        let off = worst(&found, fact("C32"));
        let turned = y[f.output.angular_momentum + k] - first[f.output.angular_momentum + k];
        // 0.1 (1 - cos 8) / 0.4 of the tip, 10 s of the base.
        let pushed = [50.0, 0.25 * (1.0 - 8.0_f64.cos()), -20.0][k];
        let moved = y[f.output.linear_momentum + k] - first[f.output.linear_momentum + k];
        println!("C32: off by {off:.1e}; C33: P {:.1e}, L {:.1e}", moved - pushed, turned - run.work);
        assert!(off < 1e-7 && (moved - pushed).abs() < 1e-9 && (turned - run.work).abs() < 1e-9);
    }
}

/// Checks SFF-1 where all tumbles: C34, C35.
#[test]
fn c34_tumbling_without_torques() {
    let mut f = chaser();
    f.start(f.parameter.initial_base_angular_velocity, &[0.1, 0.2, 0.15]);
    f.start(f.parameter.initial_joint_velocity, &[0.05, -0.04, 0.03, 0.1, -0.08, 0.06]);
    let count = f.input.count;
    let mut run = Run::new(&f.model, &f.p, |_| vec![0.0; count]);
    let first = run.outputs();
    run.to(30.0, 0.05);
    let y = run.outputs();
    let off = worst(&run.x[3..13], fact("C34"));
    // Small differences grow: 1e-12 rad/s of one joint at first are 4e-3 rad of another after 30 s. Two runs of full accuracy
    // differ by some 1e-4 there; the fact is met within what 1e-12 make.
    let mut beside = Run::new(&f.model, &f.p, |_| vec![0.0; count]);
    beside.x[f.at.joint_velocity + 1] += 1e-12;
    beside.to(30.0, 0.05);
    let grown = worst(&beside.x[3..13], &run.x[3..13]);
    println!("C34: 1e-12 has grown to {grown:.1e}");
    let energy = (y[f.output.kinetic_energy] / first[f.output.kinetic_energy] - 1.0).abs();
    let drift = worst(&y[f.output.linear_momentum..][..6], &first[f.output.linear_momentum..][..6]);
    println!("C34: off by {off:.1e}; energy {energy:.1e}, P, L {drift:.1e}");
    assert!(off < 0.2 * grown && grown < 1e-2);
    assert!(worst(&run.x[3..7], &fact("C34")[..4]) < 1e-7 && energy < 1e-10 && drift < 1e-10 * 1500.0);
}

/// Everything at once: two arms, a prismatic joint, springs, rotors, thrusters.
fn everything(held: bool, geared: bool) -> Design {
    let mut d = presets::chaser();
    for (k, position) in [[0.5, 0.4, -0.3], [-0.6, 0.2, 0.1], [0.0, -0.7, 0.2]].into_iter().enumerate() {
        let direction = [[1.0, 0.0, 2.0], [0.0, -1.0, 0.5], [0.3, 0.3, -1.0]][k];
        d.thrusters.push(Thruster { position, direction });
    }
    for k in 0..3 {
        let mut link = d.links[k].clone();
        link.parent = if k == 0 { 0 } else { 6 + k };
        link.position[1] -= 0.4;
        d.links.push(link);
    }
    d.links[7].joint = trueup_models::space::tree::Joint::Prismatic;
    d.links[7].orientation = [0.8, 0.0, 0.6, 0.0];
    d.tips.push(Tip { name: "other".into(), body: 9, offset: [0.1, 0.2, -0.3], mount: [0.0; 3] });
    for (k, link) in d.links.iter_mut().enumerate() {
        let flexible = k % 2 == 1;
        let gear_ratio = 3.0 + k as f64;
        link.motor = Motor { flexible, inertia: 0.3, gear_ratio, stiffness: 20.0, damping: 2.0 };
    }
    let mut panels = presets::table_1_with_panels().appendages;
    panels[1].shapes.y = 3;
    panels[1].orientation = [0.6, 0.0, 0.8, 0.0];
    Design { held, geared, appendages: panels, ..d }
}

/// What the appendages of [`everything`] turn into heat, W.
fn lost(f: &Flyer, y: &[f64]) -> f64 {
    let mut all = Appendages::<f64>::new();
    everything(false, true).appendages.iter().for_each(|a| all.add_beam(0, a.shapes, &a.beam()).unwrap());
    all.dissipation(&y[f.output.modal_velocity..])
}

/// Checks SFF-6, SFF-9, SFF-11 and SFF-12: momentum changes by what acts from outside, energy by its power and what damping takes.
#[test]
fn momentum_and_energy_change_by_what_acts() {
    let mut random = Random(3);
    for (held, geared) in [(false, true), (false, false), (true, true)] {
        let mut f = Flyer::of(&everything(held, geared));
        if held {
            f.start(f.parameter.gravity, &[1.0, -2.0, -9.0]);
            f.start(f.parameter.initial_base_quaternion, &[0.3, 0.5, -0.1, 0.7]);
        }
        let (mut most, mut size) = ([0.0_f64; 3], 0.0_f64);
        for _ in 0..20 {
            let (x, u) = f.anywhere(&mut random);
            let ((y, dy), o, i) = (f.moving(&x, &u), f.output, f.input);
            let s = f.model.structure();
            let turn = |v: [f64; 3]| times(&rotation([0, 1, 2, 3].map(|k| y[o.base_quaternion + k])), v);
            let r = three(&y, o.base_position);
            let (mut force, mut torque, mut power) = ([0.0; 3], [0.0; 3], 0.0);
            if !held {
                force = three(&u, i.base_force);
                torque = add(three(&u, i.base_torque), cross(r, force));
                power = dot(force, three(&y, o.base_velocity));
                power += dot(three(&u, i.base_torque), turn(three(&y, o.base_angular_velocity)));
                for k in 0..3 {
                    let along = three(&f.p, f.parameter.thruster_direction + 3 * k);
                    let own = scale(u[i.thruster_force + k] / dot(along, along).sqrt(), along);
                    let (at, own) = (turn(three(&f.p, f.parameter.thruster_position + 3 * k)), turn(own));
                    force = add(force, own);
                    torque = add(torque, cross(add(r, at), own));
                    let omega = turn(three(&y, o.base_angular_velocity));
                    power += dot(own, add(three(&y, o.base_velocity), cross(omega, at)));
                }
            }
            for a in 0..s.tips.len() {
                let (own, turning) = (three(&u, i.tip_force + 3 * a), three(&u, i.tip_torque + 3 * a));
                force = add(force, own);
                torque = add(torque, add(turning, cross(three(&y, o.tip_position + 3 * a), own)));
                power += dot(own, three(&y, o.tip_velocity + 3 * a));
                power += dot(turning, three(&y, o.tip_angular_velocity + 3 * a));
            }
            for j in 0..s.bodies() {
                power += u[i.joint_torque + j] * y[o.motor_velocity + j];
                let slip = y[o.motor_velocity + j] - y[o.joint_velocity + j];
                power -= f.p[f.parameter.joint_damping + j] * slip * slip;
            }
            power -= lost(&f, &y);
            if !held {
                most[0] = most[0].max(worst(&three(&dy, o.linear_momentum), &force));
                most[1] = most[1].max(worst(&three(&dy, o.angular_momentum), &torque));
            }
            let gained = dy[o.kinetic_energy] + dy[o.potential_energy];
            most[2] = most[2].max((gained - power).abs());
            size = size.max(power.abs());
        }
        println!(
            "held {held}, geared {geared}: P {:.1e}, L {:.1e}, energy {:.1e} of {size:.0} W",
            most[0], most[1], most[2]
        );
        assert!(size > 10.0 && most.iter().all(|m| *m < 1e-9), "{most:?}");
    }
}

/// What the base puts on the panels, base axes: the rate of their momentum, by duals.
fn panels_on_base(f: &Flyer, x: &[f64], dx: &[f64]) -> Wrench<f64> {
    let dual = |k: usize| Dual::<1> { re: x[k], eps: [dx[k]] };
    let turn = rotation([0, 1, 2, 3].map(|k| dual(f.at.base_quaternion + k)));
    let v = transposed_times(&turn, [0, 1, 2].map(|k| dual(f.at.base_velocity + k)));
    let frame = Frame { rotation: turn, origin: [0, 1, 2].map(|k| dual(f.at.base_position + k)) };
    let omega = [0, 1, 2].map(|k| dual(f.at.base_angular_velocity + k));
    let placed = [Placed::base(frame, Motion { angular: omega, linear: v })];
    let constant = |v: f64| Dual::<1> { re: v, eps: [0.0] };
    let mut all = Appendages::<Dual<1>>::new();
    for a in everything(false, true).appendages {
        let b = a.beam();
        let beam = Beam {
            frame: Frame {
                rotation: b.frame.rotation.map(|row| row.map(constant)),
                origin: b.frame.origin.map(constant),
            },
            length: constant(b.length),
            mass_per_length: constant(b.mass_per_length),
            bending_stiffness: b.bending_stiffness.map(constant),
            torsion_stiffness: constant(b.torsion_stiffness),
            polar_inertia_per_length: constant(b.polar_inertia_per_length),
            damping_ratio: constant(b.damping_ratio),
        };
        all.add_beam(0, a.shapes, &beam).unwrap();
    }
    let modes = all.modes().len();
    let of = |begin: usize| (0..modes).map(|k| dual(begin + k)).collect::<Vec<_>>();
    let mut bent = Bent::new();
    all.bend(&placed, &of(f.at.modal_coordinate), &of(f.at.modal_velocity), &mut bent);
    let flexing = bent.of(&all);
    let (mut force, mut torque) = ([constant(0.0); 3], [constant(0.0); 3]);
    for part in &flexing.now[..flexing.parts.len()] {
        let p = times(&turn, part.momentum.force);
        force = add(force, p);
        torque = add(torque, add(times(&turn, part.momentum.torque), cross(frame.origin, p)));
    }
    // About the inertial origin at this instant; back to the base.
    let (force, torque) = (force.map(|v| v.eps[0]), torque.map(|v| v.eps[0]));
    let own = turn.map(|row| row.map(|v| v.re));
    let about = sub(torque, cross(frame.origin.map(|v| v.re), force));
    Wrench { torque: transposed_times(&own, about), force: transposed_times(&own, force) }
}

/// Checks SFF-3: what the base is told to feel is what moves it, and its arms together are all of it.
#[test]
fn the_reaction_is_what_moves_the_base() {
    let mut random = Random(5);
    let f = Flyer::of(&everything(false, true));
    let (o, i) = (f.output, f.input);
    let mut most = 0.0_f64;
    for _ in 0..20 {
        let (x, u) = f.anywhere(&mut random);
        let (y, dx) = (f.outputs(&x, &u), f.rates(&x, &u));
        let turn = rotation([0, 1, 2, 3].map(|k| x[f.at.base_quaternion + k]));
        let (mut force, mut torque) = (three(&u, i.base_force), three(&u, i.base_torque));
        for k in 0..3 {
            let along = three(&f.p, f.parameter.thruster_direction + 3 * k);
            let own = scale(u[i.thruster_force + k] / dot(along, along).sqrt(), along);
            let at = three(&f.p, f.parameter.thruster_position + 3 * k);
            force = add(force, times(&turn, own));
            torque = add(torque, times(&turn, cross(at, own)));
        }
        let needed = scale(f.p[f.parameter.base_mass], three(&dx, f.at.base_velocity));
        most = most.max(worst(&sub(needed, force), &three(&y, o.reaction_force)));
        let own = [0, 3, 6].map(|r| three(&f.p, f.parameter.base_inertia + r));
        let omega = three(&x, f.at.base_angular_velocity);
        let spin = times(&own, three(&dx, f.at.base_angular_velocity));
        let needed = add(spin, cross(omega, times(&own, omega)));
        let felt = transposed_times(&turn, sub(three(&y, o.reaction_torque), scale(-1.0, torque)));
        most = most.max(worst(&needed, &felt));
        let (mut whole, mut about) = ([0.0; 3], [0.0; 3]);
        for (a, first) in [(0, 0), (1, 6)] {
            let arm = three(&y, o.arm_force + 3 * a);
            let mount = times(&turn, three(&f.p, f.parameter.joint_position + 3 * first));
            whole = add(whole, arm);
            about = add(about, add(three(&y, o.arm_torque + 3 * a), cross(mount, arm)));
        }
        // The rest is the panels'.
        let panels = panels_on_base(&f, &x, &dx);
        whole = sub(whole, times(&turn, panels.force));
        about = sub(about, times(&turn, panels.torque));
        most = most.max(worst(&whole, &three(&y, o.reaction_force)));
        most = most.max(worst(&about, &three(&y, o.reaction_torque)));
    }
    println!("reaction: off by {most:.1e}");
    assert!(most < 1e-10);
}

/// In the plane it is `PlanarManipulator`: rates and outputs of S0's test-bed, rotors either way.
#[test]
fn in_the_plane_it_is_the_planar_manipulator() {
    let mut random = Random(11);
    for geared in [false, true] {
        let f = Flyer::of(&Design { geared, ..presets::test_bed() });
        let flat = PlanarManipulator::new(&[true, false, false], NO_EFFECTS).unwrap();
        let mut q = cbk_pan(&[true, false, false]);
        if geared {
            q[arm::parameter::motor_coupling(3)] = arm::rotor::GEARED;
        }
        let mut most = 0.0_f64;
        for _ in 0..50 {
            let z = random.vector(14, 1.0); // x, y, q_0, q_1 .. q_3, q_m, and their rates
            let v = random.vector(9, 2.0);
            let (mut x, mut u) = (vec![0.0; f.at.count], vec![0.0; f.input.count]);
            x[..2].copy_from_slice(&z[..2]);
            let (sin, cos) = (z[2] / 2.0).sin_cos();
            x[f.at.base_quaternion] = cos;
            x[f.at.base_quaternion + 3] = sin;
            x[f.at.joint_angle..][..4].copy_from_slice(&z[3..7]); // and the motor's behind them
            x[f.at.base_velocity..][..2].copy_from_slice(&z[7..9]);
            x[f.at.base_angular_velocity + 2] = z[9];
            x[f.at.joint_velocity..][..4].copy_from_slice(&z[10..14]);
            u[f.input.joint_torque..][..3].copy_from_slice(&v[..3]);
            u[f.input.base_force..][..2].copy_from_slice(&v[3..5]);
            u[f.input.base_torque + 2] = v[5];
            u[f.input.tip_force..][..2].copy_from_slice(&v[6..8]);
            u[f.input.tip_torque + 2] = v[8];
            let (dx, y) = (f.rates(&x, &u), f.outputs(&x, &u));
            let at = At { t: 0.0, x: &z, u: &v, p: &q, modes: &[] };
            let (mut dz, mut w) = (vec![0.0; 14], vec![0.0; flat.sizes().outputs]);
            flat.rates(at, &mut dz);
            flat.outputs(at, &mut w);
            let rows = [&dx[f.at.base_velocity..][..2], &dx[f.at.base_angular_velocity + 2..][..5]].concat();
            most = most.max(worst(&rows, &dz[7..]) / dz[7..].iter().fold(1.0, |m, d| d.abs().max(m)));
            let off_plane = [2, 5, 6].map(|k| {
                dx[f.at.base_velocity + [2, 3, 4][[2, 5, 6].iter().position(|i| *i == k).unwrap_or(0)]]
            });
            assert!(worst(&off_plane, &[0.0; 3]) < 1e-12, "{off_plane:?}");
            let o = f.output;
            let n = 3;
            for (mine, its) in [
                (y[o.tip_position], w[arm::output::tip_position(n)]),
                (y[o.tip_position + 1], w[arm::output::tip_position(n) + 1]),
                (y[o.tip_velocity + 1], w[arm::output::tip_velocity(n) + 1]),
                (y[o.linear_momentum], w[arm::output::linear_momentum(n)]),
                (y[o.angular_momentum + 2], w[arm::output::angular_momentum(n)]),
                (y[o.kinetic_energy], w[arm::output::kinetic_energy(n)]),
                (y[o.potential_energy], w[arm::output::potential_energy(n)]),
            ] {
                most = most.max((mine - its).abs() / its.abs().max(1.0));
            }
        }
        println!("plane, geared {geared}: off by {most:.1e}");
        assert!(most < 1e-12);
    }
}

/// A base of a billion times the mass moves its arm as one that is held.
#[test]
fn a_heavy_base_is_one_that_is_held() {
    let mut random = Random(8);
    let held = Flyer::of(&everything(true, true));
    let mut heavy = everything(false, true);
    heavy.base_mass *= 1e9;
    heavy.base_inertia = heavy.base_inertia.map(|row| row.map(|v| 1e9 * v));
    let heavy = Flyer::of(&heavy);
    for _ in 0..10 {
        let (x, mut u) = heavy.anywhere(&mut random);
        let mut y = x.clone();
        y[heavy.at.base_velocity..heavy.at.joint_velocity].fill(0.0);
        let rest = [&y[heavy.at.joint_angle..heavy.at.base_velocity], &y[heavy.at.joint_velocity..]].concat();
        y[heavy.at.base_quaternion..][..4].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        u[heavy.input.base_force..heavy.input.tip_force].fill(0.0);
        let less = [&u[..heavy.input.base_force], &u[heavy.input.tip_force..]].concat();
        let (a, b) = (heavy.rates(&y, &u), held.rates(&rest, &less));
        let size = b.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        let off = worst(&a[heavy.at.joint_velocity..], &b[held.at.joint_velocity..]);
        assert!(off < 1e-7 * size, "{off} of {size}");
    }
}

/// Whatever motion torques cause, leading rows along it moves everything else alike, and their torques are not read.
#[test]
fn rows_that_are_led_move_the_rest_as_their_torques_do() {
    let mut random = Random(9);
    let f = Flyer::of(&everything(false, true));
    let mut most = 0.0_f64;
    for case in 0..40 {
        let (x, mut u) = f.anywhere(&mut random);
        let wanted = f.rates(&x, &u);
        let joint = |j: usize| wanted[f.at.joint_velocity + j];
        let joints: Vec<(usize, f64)> = [0, 2, 6].map(|j| (j, joint(j))).to_vec();
        let motors: Vec<(usize, f64)> =
            [(1, wanted[f.at.motor_velocity]), (5, wanted[f.at.motor_velocity + 2])].to_vec();
        let led = Led {
            base: (case % 2 == 0)
                .then(|| (three(&wanted, f.at.base_velocity), three(&wanted, f.at.base_angular_velocity))),
            joints: if case % 4 < 3 { &joints } else { &[] },
            motors: if case % 4 > 0 { &motors } else { &[] },
        };
        led.joints.iter().chain(led.motors).for_each(|(j, _)| u[f.input.joint_torque + j] = f64::NAN);
        if led.base.is_some() {
            u[f.input.base_force..][..6].fill(f64::NAN);
        }
        let mut dx = vec![0.0; x.len()];
        f.model.rates_led(f.now(&x, &u), led, &mut dx);
        let size = wanted.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        most = most.max(worst(&dx, &wanted) / size);
    }
    println!("led: off by {most:.1e}");
    assert!(most < 1e-12);
}

/// What cannot be is refused with the variable and its value.
#[test]
fn what_cannot_be_is_refused() {
    let f = Flyer::of(&everything(false, true));
    let at = f.parameter;
    for (place, value, words) in [
        (at.body_inertia + 9, -1.0, "bodyInertia of body 2: its principal moments"),
        (at.base_inertia + 4, 9e9, "baseInertia: its principal moments"),
        (at.base_inertia + 1, 3.0, "inertia[1,2] = 3"),
        (at.joint_orientation, 0.5, "jointOrientation of body 1 = 0.5, 0, 0, 0 has length 0.5000"),
        (at.joint_axis + 2, 0.0, "jointAxis of body 1 has length 0"),
        (at.joint_stiffness + 1, 0.0, "jointStiffness[2] = 0 is refused: the joint is flexible"),
        (at.initial_base_quaternion, 0.0, "initialBaseQuaternion is 0, 0, 0, 0"),
    ] {
        let mut p = f.p.clone();
        p[place] = value;
        let (_, message) = f.model.check(&p).unwrap_err();
        assert!(message.contains(words), "{message}");
    }
    let mut s = everything(false, true).structure();
    s.tree.parent[2] = 5;
    assert!(SpatialFreeFlyer::new(s.clone()).unwrap_err().contains("parent[3] = 5"));
    s.tree.parent[2] = 2;
    s.tips[1] = 12;
    assert!(SpatialFreeFlyer::new(s).unwrap_err().contains("tip[2] = 12: the moving bodies are 1 to 9"));
}
