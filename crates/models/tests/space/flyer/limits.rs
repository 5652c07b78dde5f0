//! The limits: in the plane, on a heavy or a held base, with stiff panels, with prescribed rows; what is refused.

use trueup_models::arm::{self, PlanarManipulator};
use trueup_models::presets::cbk_pan;
use trueup_models::space::appendage::Beam;
use trueup_models::space::attitude::rotation;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::flexible::Appendages;
use trueup_models::space::spatial::SpatialFrame;
use trueup_models::space::vector::{add, cross, times};
use trueup_models::space::{PrescribedAccelerations, SpatialFreeFlyer, presets};
use trueup_numerics::hybrid::{At, Hybrid};

use super::{Flyer, everything, three, worst};
use crate::arm_common::{NO_EFFECTS, Random};

/// In the plane it is `PlanarManipulator`: rates and outputs of S0's test-bed, rotors either way.
#[test]
fn in_the_plane_it_is_the_planar_manipulator() {
    let mut random = Random(11);
    for geared in [false, true] {
        let f = Flyer::of(&RobotDesign { geared, ..presets::test_bed() });
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

/// Accelerations of joints, motors and modes on a base of so many times the mass against those on one that is held: the
/// largest difference by the largest of them, and each by its own size (at least 1).
fn heavy_against_held(times: f64) -> [f64; 2] {
    let mut random = Random(8);
    let held = Flyer::of(&everything(true, true));
    let mut heavy = everything(false, true);
    heavy.base_mass *= times;
    heavy.base_inertia = heavy.base_inertia.map(|row| row.map(|v| times * v));
    let heavy = Flyer::of(&heavy);
    let mut most = [0.0_f64; 2];
    for _ in 0..10 {
        let (x, mut u) = heavy.anywhere(&mut random);
        let mut y = x.clone();
        y[heavy.at.base_velocity..heavy.at.joint_velocity].fill(0.0);
        let rest = [&y[heavy.at.joint_angle..heavy.at.base_velocity], &y[heavy.at.joint_velocity..]].concat();
        y[heavy.at.base_quaternion..][..4].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        u[heavy.input.base_force..heavy.input.tip_force].fill(0.0);
        let less = [&u[..heavy.input.base_force], &u[heavy.input.tip_force..]].concat();
        let (a, b) = (heavy.rates(&y, &u), held.rates(&rest, &less));
        let (a, b) = (&a[heavy.at.joint_velocity..], &b[held.at.joint_velocity..]);
        assert_eq!(a.len(), b.len());
        let size = b.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        for (a, b) in a.iter().zip(b) {
            let off = (a - b).abs();
            most = [most[0].max(off / size), most[1].max(off / b.abs().max(1.0))];
        }
    }
    most
}

/// A base of a billion times the mass moves its arm as one that is held. What is left is the base's own motion, not rounding:
/// ten times the mass leave a tenth.
#[test]
fn a_heavy_base_is_one_that_is_held() {
    let [heavy, heavier] = [1e9, 1e10].map(heavy_against_held);
    println!("base of 1e9 times the mass: off by {:.1e} of the largest, {:.1e} each", heavy[0], heavy[1]);
    assert!(heavy[0] < 1e-8);
    for (a, b) in heavy.iter().zip(&heavier) {
        assert!((a / b - 10.0).abs() < 0.1, "{a:e} {b:e}");
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
        let led = PrescribedAccelerations {
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
        f.model.rates_prescribed(f.now(&x, &u), led, &mut dx);
        let size = wanted.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
        most = most.max(worst(&dx, &wanted) / size);
    }
    println!("prescribed: off by {most:.1e}");
    assert!(most < 1e-12);
}

/// What cannot be is refused with the variable and its value.
#[test]
fn what_cannot_be_is_refused() {
    let f = Flyer::of(&everything(false, true));
    let at = f.parameter;
    for (place, value, words) in [
        (at.body_inertia + 9, -1.0, "bodyInertia of body 2: its principal moments"),
        (at.base_inertia + 4, -9e9, "baseInertia: its principal moments"),
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
    assert_eq!(f.model.remark(&f.p), None);
    let mut p = f.p.clone();
    p[at.initial_base_quaternion] = 0.9;
    let said = f.model.remark(&p).unwrap();
    assert!(said.contains("initialBaseQuaternion = 0.9, 0, 0, 0 has length 0.9000"), "{said}");
    let mut s = everything(false, true).structure();
    s.tree.parent[2] = 5;
    assert!(SpatialFreeFlyer::new(s.clone()).unwrap_err().contains("parent[3] = 5"));
    s.tree.parent[2] = 2;
    s.tips[1] = 12;
    assert!(SpatialFreeFlyer::new(s).unwrap_err().contains("tip[2] = 12: the moving bodies are 1 to 9"));
}

/// Panels a million times as stiff are lumps of the same mass.
#[test]
fn stiff_panels_are_rigid() {
    let design = presets::table_1_with_panels();
    let (mut stiff, mut lumped) = (design.clone(), RobotDesign { appendages: Vec::new(), ..design.clone() });
    for a in &mut stiff.appendages {
        a.bending_stiffness = a.bending_stiffness.map(|v| 1e6 * v);
        a.torsion_stiffness *= 1e6;
        a.damping_ratio = 0.0;
    }
    // Two rods of 4 kg and 4 m along y at (0, +-0.6, 0.1): a body of its own on the base, which a joint with much inertia
    // behind it does not exist for; so the base takes them, and its centre of mass moves up by 8/128 of 0.1 m.
    let (rod, length, polar) = (8.0, 4.0_f64, 0.02 * 8.0);
    let up = rod * 0.1 / (lumped.base_mass + rod);
    let across = rod * (length * length / 12.0 + 2.6 * 2.6);
    let (low, high) = (lumped.base_mass * up * up, rod * (0.1 - up).powi(2));
    let mut i = lumped.base_inertia;
    i[0][0] += across + low + high;
    i[1][1] += polar + low + high;
    i[2][2] += across;
    lumped.base_inertia = i;
    lumped.base_mass += rod;
    lumped.links[0].position[2] -= up;
    let (stiff, lumped) = (Flyer::of(&stiff), Flyer::of(&lumped));
    let mut random = Random(21);
    let mut most = 0.0_f64;
    for _ in 0..20 {
        let (x, u) = lumped.anywhere(&mut random);
        let turn = rotation([0, 1, 2, 3].map(|k| x[3 + k]));
        let omega = three(&x, lumped.at.base_angular_velocity);
        let lever = [0.0, 0.0, -up];
        // Of the stiff one the base's own centre of mass, which is lower; its panels unbent but for what the motion takes,
        // which is as little as the stiffness is large: the modes' accelerations are what they are when nothing bends.
        let v = add(three(&x, lumped.at.base_velocity), times(&turn, cross(omega, lever)));
        let mut y = vec![0.0; stiff.at.count];
        y[..3].copy_from_slice(&add(three(&x, 0), times(&turn, lever)));
        y[3..10].copy_from_slice(&x[3..10]);
        y[stiff.at.base_velocity..][..3].copy_from_slice(&v);
        y[stiff.at.base_angular_velocity..][..6].copy_from_slice(&x[lumped.at.base_angular_velocity..][..6]);
        // Where the modes rest: eta that leaves them without acceleration. The base that yields makes them up to four times
        // as fast as they are clamped.
        let mut w = u.clone();
        w[stiff.input.base_force..][..6].fill(0.0);
        for _ in 0..400 {
            let dx = stiff.rates(&y, &w);
            for (k, mode) in frequencies(&stiff).iter().enumerate() {
                y[stiff.at.modal_coordinate + k] += 0.1 * dx[stiff.at.modal_velocity + k] / (mode * mode);
            }
        }
        let (a, b) = (stiff.rates(&y, &w), lumped.rates(&x, &w));
        let (from, to) = (stiff.at.base_angular_velocity, lumped.at.base_angular_velocity);
        most = most.max(worst(&a[from..from + 6], &b[to..to + 6]));
    }
    println!("stiff panels: off by {most:.1e}");
    assert!(most < 1e-5);
}

/// Of the modes, clamped, rad/s.
fn frequencies(f: &Flyer) -> Vec<f64> {
    let mut all = Appendages::<f64>::new();
    let s = f.model.structure();
    let p = &f.p;
    for k in 0..s.appendages.len() {
        let at = &f.parameter;
        let beam = Beam {
            frame: SpatialFrame { rotation: rotation([1.0, 0.0, 0.0, 0.0]), origin: [0.0; 3] },
            length: p[at.appendage_length + k],
            mass_per_length: p[at.mass_per_length + k],
            bending_stiffness: [p[at.bending_x + k], p[at.bending_y + k]],
            torsion_stiffness: p[at.torsion + k],
            polar_inertia_per_length: p[at.polar_inertia + k],
            damping_ratio: 0.0,
        };
        all.add_beam(0, s.appendages[k], &beam).unwrap();
    }
    all.modes().iter().map(|m| (m.stiffness / m.mass).sqrt()).collect()
}
