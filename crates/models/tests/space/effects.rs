//! Effects in a robot: each family against an independent result.

use trueup_models::arm::{self, PlanarManipulator};
use trueup_models::effect::{ALL, EffectChoice, ParameterRole, PlantKind, Scope};
use trueup_models::space::attitude::rotation;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::vector::{add, cross, scale, times};
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_numerics::hybrid::{At, Hybrid};

use super::affected::Affected;
use super::flyer::{Flyer, everything, three, worst};
use crate::arm_common::Random;
use crate::contact::run::{TIGHT, run};

/// All that is within the joints, the friction and the transmission of each.
const FRICTION: [&str; 7] = [
    "motor-friction",
    "stribeck-friction",
    "asymmetric-friction",
    "load-dependent-friction",
    "nonlinear-viscous-friction",
    "friction-drift",
    "presliding-friction",
];

/// Checks EF-1, EF-2, EF-21 in a robot: what friction takes is its torque times the rate that it brakes, whatever shapes it, and
/// momentum stays as it is.
#[test]
fn friction_takes_its_work_and_no_momentum() {
    let mut random = Random(41);
    for ids in FRICTION.map(|id| vec![id]).into_iter().chain([FRICTION.to_vec(), vec!["load-friction"]]) {
        let mut f = Affected::of(&everything(false, true), &ids);
        if ids == ["load-friction"] {
            f.set("load-friction", "loadFriction", &[0.4; 9]);
            f.set("load-friction", "loadViscousFriction", &[0.3; 9]);
        }
        let mut most = [0.0_f64; 3];
        for _ in 0..10 {
            let (x, u) = f.anywhere(&mut random);
            let modes = f.modes(2.0, &x, &u);
            let (y, dy) = f.moving(2.0, &x, &u, &modes);
            let mut power = f.power(&y, &u);
            if ids == ["load-friction"] {
                for j in 0..9 {
                    let rate = y[f.output.joint_velocity + j];
                    power -= (0.4 * x[f.states("load-friction") + j] + 0.3 * rate) * rate;
                }
            }
            let gained = dy[f.output.kinetic_energy] + dy[f.output.potential_energy];
            let [p, l] = [f.output.linear_momentum, f.output.angular_momentum].map(|at| three(&dy, at));
            let now = [worst(&p, &[0.0; 3]), worst(&l, &[0.0; 3]), (gained - power).abs()];
            most = [0, 1, 2].map(|i| most[i].max(now[i]));
        }
        println!("{}: dP {:.1e}, dL {:.1e}, power {:.1e} W", ids.join(" "), most[0], most[1], most[2]);
        assert!(most[0] < 1e-10 && most[1] < 1e-10 && most[2] < 1e-9, "{ids:?}: {most:?}");
    }
}

/// Checks EF-1 in a robot: drives that stick do not move, and what their friction balances is the torque that holds them: a robot without
/// friction moves as this one does when that is taken from its motors' torques.
#[test]
fn what_holds_a_drive_that_sticks_is_its_friction() {
    let mut random = Random(42);
    let design = everything(false, true);
    let plain = Flyer::of(&design);
    let mut f = Affected::of(&design, &["motor-friction"]);
    let (p, o) = f.friction();
    f.p[p.breakaway..][..9].fill(1e5);
    for _ in 0..20 {
        let (mut x, u) = f.anywhere(&mut random);
        // Of joints 1, 4, 7 (rigid) and 2, 5, 8 (flexible) every other one is at rest.
        for (row, k) in [
            (f.at.joint_velocity, 0),
            (f.at.joint_velocity, 6),
            (f.at.motor_velocity, 0),
            (f.at.motor_velocity, 2),
        ] {
            x[row + k] = 0.0;
        }
        let modes = f.modes(0.0, &x, &u);
        assert_eq!(modes.iter().filter(|m| **m == 0).count(), 4, "{modes:?}");
        let (dx, y) = (f.rates(0.0, &x, &u, &modes), f.outputs(0.0, &x, &u, &modes));
        let mut less = u.clone();
        (0..9).for_each(|j| less[f.input.joint_torque + j] -= y[o.torque + j]);
        let moved = plain.rates(&x, &less);
        for (row, k) in [
            (f.at.joint_velocity, 0),
            (f.at.joint_velocity, 6),
            (f.at.motor_velocity, 0),
            (f.at.motor_velocity, 2),
        ] {
            assert_eq!(dx[row + k], 0.0);
        }
        let off = worst(&dx, &moved) / moved.iter().fold(1.0, |m, v| v.abs().max(m));
        assert!(off < 1e-11, "{off:e}");
    }
}

/// Checks EF-1 over a run in which joints turn and come to rest, one after another: momentum within 1e-10, and the energy that is gone is the sum of
/// Coulomb's torque times the ways, within 1e-9 J.
#[test]
fn a_run_until_all_joints_stick_keeps_momentum_and_loses_the_work_of_friction() {
    let mut design = presets::chaser();
    design.links.iter_mut().for_each(|l| l.motor.inertia = 2.0);
    let mut f = Affected::of(&design, &["motor-friction"]);
    let (p, o) = f.friction();
    let coulomb = [4.0, 6.0, 3.0, 2.0, 1.5, 1.0];
    f.p[p.coulomb..][..6].copy_from_slice(&coulomb);
    f.p[p.breakaway..][..6].copy_from_slice(&coulomb.map(|c| 1.2 * c));
    f.p[p.viscous..][..6].fill(0.0);
    f.p[f.parameter.initial_joint_angle..][..6].copy_from_slice(&super::flyer::ANGLES);
    f.p[f.parameter.initial_joint_velocity..][..6].copy_from_slice(&[0.4, -0.3, 0.5, -0.6, 0.3, 0.7]);
    f.p[f.parameter.initial_base_velocity..][..3].copy_from_slice(&[0.02, -0.01, 0.03]);
    let times: Vec<f64> = (0..=60).map(|k| 0.5 * f64::from(k)).collect();
    let n = f.model.sizes();
    let all = run(&f.model, &f.p, &vec![0.0; n.inputs], &times, &vec![0.01; n.states], TIGHT);
    let (first, q) = (&all.y[0], f.output.joint_angle);
    let energy = |y: &[f64]| y[f.output.kinetic_energy] + y[f.output.potential_energy];
    let (mut work, mut drift, mut off) = (0.0, 0.0_f64, 0.0_f64);
    for k in 1..all.y.len() {
        let (a, y) = (&all.y[k - 1], &all.y[k]);
        // Between two moments no joint turns: that would be an event.
        work += (0..6).map(|j| coulomb[j] * (y[q + j] - a[q + j]).abs()).sum::<f64>();
        for begin in [f.output.linear_momentum, f.output.angular_momentum] {
            drift = drift.max(worst(&three(y, begin), &three(first, begin)));
        }
        off = off.max((energy(first) - energy(y) - work).abs());
    }
    let end = all.y.last().unwrap();
    let sticking = (0..6).filter(|j| end[o.sticking + j] == 1.0).count();
    println!(
        "{} moments, {sticking} stick, {:.3} J gone: momentum within {drift:.1e}, energy within {off:.1e} J",
        all.y.len(),
        energy(first) - energy(end)
    );
    assert!(sticking == 6 && energy(first) - energy(end) > 1.0);
    assert!(drift < 1e-10 && off < 1e-9);
}

/// Checks EF-1 and EF-25 on a free base by closed form: a joint on the line of both centres of mass, of the inertia J = I_0 I_1 / (I_0 + I_1),
/// sticks, breaks away by an impulse at its actuator, slides and sticks again.
#[test]
fn a_joint_that_breaks_away_slides_as_far_as_the_closed_form() {
    let diagonal = |d: [f64; 3]| [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]];
    let mut design = RobotDesign { tips: Vec::new(), base_inertia: diagonal([10.0; 3]), ..presets::chaser() };
    design.links.truncate(1);
    let link = &mut design.links[0];
    (link.position, link.center_of_mass, link.inertia) = ([0.0; 3], [0.0; 3], diagonal([1.0, 1.0, 2.0]));
    (link.orientation, link.axis, link.motor) = ([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0], Default::default());
    let mut f = Affected::of(&design, &["external-force:actuator", "motor-friction"]);
    let (p, o) = f.friction();
    let (coulomb, torque, duration, inertia) = (0.5, 1.5, 0.4, 10.0 * 2.0 / 12.0);
    (f.p[p.coulomb], f.p[p.breakaway], f.p[p.viscous]) = (coulomb, 1.0, 0.0);
    for (name, value) in [("torque", torque), ("start", 1.0), ("duration", duration), ("edge", 0.0)] {
        f.set("external-force:actuator", name, &[value]);
    }
    let n = f.model.sizes();
    let all = run(&f.model, &f.p, &vec![0.0; n.inputs], &[0.9, 5.0], &vec![0.01; n.states], TIGHT);
    let gained = (torque - coulomb) * duration;
    let way = gained * duration / (2.0 * inertia) + gained * gained / (2.0 * inertia * coulomb);
    let end = all.end();
    let off = (end[f.output.joint_angle] - way).abs();
    println!("slid by {way:.4} rad, off by {off:.1e}");
    let before = all.t.iter().rposition(|t| *t == 0.9).unwrap();
    assert_eq!((all.y[before][f.output.joint_angle], all.y[before][o.sticking]), (0.0, 1.0));
    assert!(off < 1e-10 && end[o.sticking] == 1.0);
    assert!(worst(&three(end, f.output.angular_momentum), &[0.0; 3]) < 1e-12);
}

/// Checks EF-3, EF-15, EF-16, EF-18, EF-19 in a robot: springs that only store keep energy, the others take some, none changes momentum.
#[test]
fn springs_keep_energy_or_take_some_and_no_momentum() {
    let mut random = Random(43);
    let stores = ["backlash", "nonlinear-stiffness", "kinematic-error"];
    let takes = ["nonlinear-damping", "transmission-hysteresis"];
    for (ids, keeps) in [(stores.to_vec(), true), (takes.to_vec(), false)] {
        let mut f = Affected::of(&everything(false, true), &ids);
        // Within a gap the damper rests, too.
        f.p[f.parameter.joint_damping..][..9].fill(0.0);
        let (mut most, mut taken) = ([0.0_f64; 3], 0.0_f64);
        for _ in 0..30 {
            let (x, u) = f.anywhere(&mut random);
            let modes = f.modes(0.0, &x, &u);
            let (y, dy) = f.moving(0.0, &x, &u, &modes);
            let gained = dy[f.output.kinetic_energy] + dy[f.output.potential_energy] - f.power(&y, &u);
            let [p, l] = [f.output.linear_momentum, f.output.angular_momentum].map(|at| three(&dy, at));
            let energy = if keeps { gained.abs() } else { gained.max(0.0) };
            let now = [worst(&p, &[0.0; 3]), worst(&l, &[0.0; 3]), energy];
            (most, taken) = ([0, 1, 2].map(|i| most[i].max(now[i])), taken.max(-gained));
        }
        println!(
            "{ids:?}: dP {:.1e}, dL {:.1e}, made {:.1e} W, took {taken:.1e} W",
            most[0], most[1], most[2]
        );
        assert!(most[0] < 1e-10 && most[1] < 1e-10 && most[2] < 1e-9, "{most:?}");
        assert_eq!(taken > 1e-3, !keeps);
    }
}

/// Checks EF-9, EF-23, EF-25 in space: momentum changes by what acts on base and tip.
#[test]
fn forces_on_base_and_tip_change_momentum_by_what_they_are() {
    let mut random = Random(44);
    let (push, twist) = ([3.0, -2.0, 1.5], [0.7, -0.4, 0.9]);
    for id in ["base-drag", "base-thrust", "external-force:base", "external-force:tip"] {
        let mut f = Affected::of(&everything(false, true), &[id]);
        match id {
            "base-drag" => {
                f.set(id, "baseDrag", &[1.7]);
                f.set(id, "baseRotationalDrag", &[0.8]);
            }
            "base-thrust" => f.set(id, "thrustForceX", &[push, twist].concat()),
            _ => {
                let names = ["forceX", "forceY", "forceZ", "torqueX", "torqueY", "torqueZ"];
                names.into_iter().zip([push, twist].concat()).for_each(|(name, v)| f.set(id, name, &[v]));
            }
        }
        let mut most = 0.0_f64;
        for _ in 0..20 {
            let (x, u) = f.anywhere(&mut random);
            // On the edge's end, and before it.
            for (t, share) in [(1.5, 1.0), (1.025, 0.5), (0.5, 0.0)] {
                let modes = f.modes(t, &x, &u);
                let (y, dy) = f.moving(t, &x, &u, &modes);
                let o = &f.output;
                let turn = rotation([0, 1, 2, 3].map(|k| y[o.base_quaternion + k]));
                let base = three(&y, o.base_position);
                let (force, torque, at) = match id {
                    "base-drag" => {
                        let rate = times(&turn, three(&y, o.base_angular_velocity));
                        (scale(-1.7, three(&y, o.base_velocity)), scale(-0.8, rate), base)
                    }
                    "base-thrust" => (times(&turn, push), times(&turn, twist), base),
                    _ => {
                        let at = if id.ends_with("tip") { three(&y, o.tip_position) } else { base };
                        (scale(share, push), scale(share, twist), at)
                    }
                };
                let about = add(torque, cross(at, force));
                most = most.max(worst(&three(&dy, o.linear_momentum), &force));
                most = most.max(worst(&three(&dy, o.angular_momentum), &about));
            }
        }
        println!("{id}: momentum's rate within {most:.1e}");
        assert!(most < 1e-10, "{id}: {most:e}");
    }
}

/// Checks EF-25 in space: whatever the robot does, an external force at its tip changes its momentum by its impulse, one at an actuator
/// by nothing.
#[test]
fn the_impulse_of_an_external_force_is_what_momentum_changes_by() {
    let ids = ["external-force:tip", "external-force:actuator", "motor-friction", "load-friction"];
    let mut f = Affected::of(&presets::chaser(), &ids);
    f.set("external-force:tip", "forceX", &[30.0]);
    f.set("external-force:tip", "forceZ", &[-20.0]);
    f.set("external-force:tip", "duration", &[0.6]);
    f.set("external-force:actuator", "torque", &[5.0; 6]);
    f.p[f.parameter.initial_joint_angle..][..6].copy_from_slice(&super::flyer::ANGLES);
    let options = DriverOptions { tolerance: 1e-12, ..DriverOptions::default() };
    let n = f.model.sizes();
    let run = simulate(&f.model, &f.p, &vec![0.01; n.states], options, &|_, _| {}, &[0.0, 1.0, 1.7]).unwrap();
    let momentum = |k: usize| three(&run.y[k], f.output.linear_momentum);
    let off = worst(&momentum(2), &[30.0 * 0.6, 0.0, -20.0 * 0.6]);
    println!("impulse within {off:.1e} N.s, {:.1e} before it", worst(&momentum(1), &[0.0; 3]));
    assert!(off < 1e-9 && worst(&momentum(1), &[0.0; 3]) < 1e-10);
    let moved = (0..6).map(|j| (run.x[2][f.at.joint_velocity + j] - run.x[0][f.at.joint_velocity + j]).abs());
    assert!(moved.fold(0.0, f64::max) > 1e-3, "something has to happen");
}

/// Checks EF-30 and EF-32 in space: readings are late, or move, and what is read from does not.
#[test]
fn sensors_change_readings_and_no_motion() {
    let channels =
        ["basePosition", "baseVelocity", "baseAngularVelocity", "jointAngle", "motorVelocity", "tipVelocity"];
    let ids: Vec<String> =
        channels.iter().flat_map(|c| [format!("sensor-delay:{c}"), format!("sensor-drift:{c}")]).collect();
    let ids: Vec<&str> = ids.iter().map(String::as_str).collect();
    let design = RobotDesign { links: Vec::new(), tips: Vec::new(), ..presets::chaser() };
    let (f, plain) = (Affected::of(&presets::chaser(), &ids), Flyer::of(&presets::chaser()));
    // No motion depends on a reading.
    let mut random = Random(45);
    let (x, u) = f.anywhere(&mut random);
    let (dx, y) = (f.rates(0.7, &x, &u, &[]), f.outputs(0.7, &x, &u, &[]));
    let own = &x[..plain.at.count];
    assert_eq!(dx[..plain.at.count], plain.rates(own, &u));
    let true_y = plain.outputs(own, &u);
    let changed: Vec<bool> = y.iter().zip(&true_y).map(|(a, b)| a != b).collect();
    let o = &f.output;
    let read = [
        (o.base_position, 3),
        (o.base_velocity, 3),
        (o.base_angular_velocity, 3),
        (o.joint_angle, 6),
        (o.motor_velocity, 6),
        (o.tip_velocity, 3),
    ];
    for (k, c) in changed.iter().enumerate() {
        assert_eq!(*c, read.iter().any(|(at, n)| (*at..at + n).contains(&k)), "output {k}");
    }
    // A base that glides: its position is read where it was.
    let mut g = Affected::of(&design, &["sensor-delay:basePosition"]);
    g.set("sensor-delay:basePosition", "delay", &[0.2; 3]);
    g.p[g.parameter.initial_base_velocity..][..3].copy_from_slice(&[0.3, -0.2, 0.1]);
    let n = g.model.sizes();
    let run = simulate(
        &g.model,
        &g.p,
        &vec![0.01; n.states],
        DriverOptions { tolerance: 1e-12, ..DriverOptions::default() },
        &|_, _| {},
        &[0.0, 5.0],
    )
    .unwrap();
    let late = worst(&three(&run.y[1], 0), &[0.3 * 4.8, -0.2 * 4.8, 0.1 * 4.8]);
    println!("a reading that is 0.2 s late: within {late:.1e} m");
    assert!(late < 1e-9);
}

/// In the plane a robot with effects is the planar manipulator with them, whose drives are other code: rates of motion and of effects.
#[test]
fn in_the_plane_effects_act_as_in_the_planar_manipulator() {
    let mut random = Random(46);
    let flexible = [true, false, false];
    let shared = EffectChoice::all(PlantKind::Space)
        .filter(|c| c.scope() == Scope::Joint || c.spec().id == "base-drag");
    let mut compared = 0;
    for id in shared.map(|c| c.id()) {
        let flat = PlanarManipulator::new(&flexible, std::slice::from_ref(&id)).unwrap();
        let f = Affected::of(&presets::test_bed(), &[&id]);
        let (q, motors) = (flat.defaults(), flat.flexible().iter().filter(|f| **f).count());
        // The test-bed's joints have their springs' stiffness only where they are flexible.
        let mut f = f;
        for (to, from) in [
            (f.parameter.motor_inertia, arm::parameter::motor_inertia(3)),
            (f.parameter.joint_stiffness, arm::parameter::joint_stiffness(3)),
            (f.parameter.joint_damping, arm::parameter::joint_damping(3)),
        ] {
            f.p[to..to + 3].copy_from_slice(&q[from..from + 3]);
        }
        let dofs = flat.dofs();
        f.model.check(&f.p).unwrap();
        let (more, n) = (flat.sizes().states - 2 * dofs, f.at.count);
        assert_eq!((motors, more), (f.model.structure().springs(), f.model.sizes().states - n), "{id}");
        let mut most = 0.0_f64;
        for _ in 0..20 {
            let z = [random.vector(2 * dofs, 0.5), random.vector(more, 0.5)].concat();
            let v = [random.vector(3, 0.5), vec![0.0; flat.sizes().inputs - 3]].concat();
            let (mut x, mut u) = (vec![0.0; n + more], vec![0.0; f.model.sizes().inputs]);
            x[..2].copy_from_slice(&z[..2]);
            let (sin, cos) = (z[2] / 2.0).sin_cos();
            (x[f.at.base_quaternion], x[f.at.base_quaternion + 3]) = (cos, sin);
            x[f.at.joint_angle..][..3 + motors].copy_from_slice(&z[3..dofs]);
            x[f.at.base_velocity..][..2].copy_from_slice(&z[dofs..dofs + 2]);
            x[f.at.base_angular_velocity + 2] = z[dofs + 2];
            x[f.at.joint_velocity..][..3 + motors].copy_from_slice(&z[dofs + 3..2 * dofs]);
            x[n..].copy_from_slice(&z[2 * dofs..]);
            u[f.input.joint_torque..][..3].copy_from_slice(&v[..3]);
            let modes = f.modes(1.02, &x, &u);
            let mut its = vec![0; flat.sizes().modes];
            flat.start_modes(At { t: 1.02, x: &z, u: &v, p: &q, modes: &[] }, &mut its);
            assert_eq!(modes, its, "{id}");
            let (dx, mut dz) = (f.rates(1.02, &x, &u, &modes), vec![0.0; z.len()]);
            flat.rates(At { t: 1.02, x: &z, u: &v, p: &q, modes: &its }, &mut dz);
            let moved = [&dx[f.at.base_velocity..][..2], &dx[f.at.base_angular_velocity + 2..][..4 + motors]];
            let rows = [&moved.concat()[..], &dx[n..]].concat();
            let size = dz[dofs..].iter().fold(1.0, |m, d| d.abs().max(m));
            most = most.max(worst(&rows, &dz[dofs..]) / size);
        }
        assert!(most < 1e-11, "{id}: {most:e}");
        compared += 1;
    }
    assert!(compared > 17, "{compared} effects were compared");
}

/// An effect whose amplitudes are neutral is not there.
#[test]
fn effects_vanish_where_they_are_neutral() {
    let mut random = Random(47);
    let design = everything(false, true);
    let plain = Flyer::of(&design);
    let all: Vec<String> =
        EffectChoice::all(PlantKind::Space).map(|c| c.id()).filter(|id| id != "joint-flexibility").collect();
    let ids: Vec<&str> = all.iter().map(String::as_str).collect();
    for few in ids.iter().map(|id| vec![*id]).chain([ids.clone()]) {
        let mut f = Affected::of(&design, &few);
        let neutral: Vec<(usize, usize, f64)> = f
            .model
            .effects()
            .iter()
            .flat_map(|e| {
                let specs = e.choice.parameters().iter().enumerate();
                let sizes = specs.filter(|(_, s)| s.role == ParameterRole::Amplitude);
                sizes.map(|(k, s)| (e.begin.parameters + k * e.sites, e.sites, s.neutral))
            })
            .collect();
        neutral.into_iter().for_each(|(begin, n, value)| f.p[begin..begin + n].fill(value));
        if f.model.sizes().outputs > f.output.count {
            let own = f.friction().0;
            f.p[own.coulomb..own.count].fill(0.0);
        }
        let (mut x, u) = f.anywhere(&mut random);
        let begin = plain.at.count;
        x[begin..].fill(0.0);
        let modes = f.modes(1.1, &x, &u);
        let (dx, y) = (f.rates(1.1, &x, &u, &modes), f.outputs(1.1, &x, &u, &modes));
        let (v, w) = (
            plain.rates(&x[..begin], &u[..plain.input.count]),
            plain.outputs(&x[..begin], &u[..plain.input.count]),
        );
        let size = |v: &[f64]| v.iter().fold(1.0, |m: f64, v| v.abs().max(m));
        let off = (worst(&dx[..begin], &v) / size(&v)).max(worst(&y[..w.len()], &w) / size(&w));
        assert!(off < 1e-12, "{few:?}: {off:e}");
    }
}

/// What cannot act is refused by its name, with the reason and the remedy.
#[test]
fn effects_that_cannot_act_are_refused_with_the_reason() {
    let refused = |design: &RobotDesign, id: &str| {
        SpatialFreeFlyer::with_effects(design.structure(), &[id]).map(|_| ()).unwrap_err()
    };
    let all: Vec<_> = ALL.iter().map(|k| k.spec()).collect();
    let elsewhere: Vec<_> = all.iter().filter(|s| !s.plants.contains(&PlantKind::Space)).collect();
    assert_eq!(elsewhere.len(), 5);
    for spec in &all {
        assert_eq!(spec.not_in_space.is_empty(), spec.plants.contains(&PlantKind::Space), "{}", spec.id);
    }
    for spec in elsewhere {
        let why = refused(&presets::chaser(), spec.id);
        assert!(why.contains(spec.id) && why.contains(spec.not_in_space), "{why}");
    }
    let held = RobotDesign { held: true, ..presets::chaser() };
    let bare = RobotDesign { tips: Vec::new(), ..presets::chaser() };
    for (design, id, remedy) in [
        (&held, "base-thrust", "let the base float"),
        (&held, "external-force:base", "let the base float"),
        (&bare, "external-force:tip", "give it one"),
        (&bare, "sensor-drift:tipVelocity", "give the robot a tip"),
        (&presets::chaser(), "backlash", "joint-flexibility"),
        (&presets::chaser(), "sensor-drift:baseRate", "sensor-drift:baseAngularVelocity"),
        (&presets::chaser(), "slack", "choose from"),
    ] {
        let why = refused(design, id);
        assert!(why.contains(id.split(':').next().unwrap()) && why.contains(remedy), "{why}");
    }
    let loose =
        SpatialFreeFlyer::with_effects(presets::chaser().structure(), &["backlash", "joint-flexibility"]);
    assert_eq!(loose.unwrap().structure().springs(), 6);
}
