//! Momentum, energy and reactions at random states.

use trueup_models::space::appendage::Beam;
use trueup_models::space::attitude::rotation;
use trueup_models::space::bent::DeformedAppendages;
use trueup_models::space::flexible::Appendages;
use trueup_models::space::spatial::{SpatialFrame, SpatialMotion, SpatialWrench};
use trueup_models::space::tree::PlacedBody;
use trueup_models::space::vector::{add, cross, dot, scale, sub, times, transposed_times};
use trueup_numerics::Dual;

use super::{Flyer, everything, three, worst};
use crate::arm_common::Random;

/// What the appendages of [`everything`] turn into heat, W.
pub(crate) fn lost(f: &Flyer, y: &[f64]) -> f64 {
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
fn panels_on_base(f: &Flyer, x: &[f64], dx: &[f64]) -> SpatialWrench<f64> {
    let dual = |k: usize| Dual::<1> { re: x[k], eps: [dx[k]] };
    let turn = rotation([0, 1, 2, 3].map(|k| dual(f.at.base_quaternion + k)));
    let v = transposed_times(&turn, [0, 1, 2].map(|k| dual(f.at.base_velocity + k)));
    let frame = SpatialFrame { rotation: turn, origin: [0, 1, 2].map(|k| dual(f.at.base_position + k)) };
    let omega = [0, 1, 2].map(|k| dual(f.at.base_angular_velocity + k));
    let placed = [PlacedBody::base(frame, SpatialMotion { angular: omega, linear: v })];
    let constant = |v: f64| Dual::<1> { re: v, eps: [0.0] };
    let mut all = Appendages::<Dual<1>>::new();
    for a in everything(false, true).appendages {
        let b = a.beam();
        let beam = Beam {
            frame: SpatialFrame {
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
    let mut bent = DeformedAppendages::new();
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
    SpatialWrench { torque: transposed_times(&own, about), force: transposed_times(&own, force) }
}

/// Checks SFF-3: the reported force on the base is what moves it, and its arms together are all of it.
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
