//! The robot in space and the arm on the ground as plants: forces on their coordinates, forces that have the effect of a spring
//! or of a rotor. Cases are drawn; the seed is printed.

use crate::draws::Draws;
use trueup_models::flexible_arm::{self, FlexibleArm};
use trueup_models::plants;
use trueup_models::space::layout::{Inputs, Parameters, States};
use trueup_models::space::{RobotStructure, SpatialFreeFlyer, presets};
use trueup_numerics::hybrid::At;
use trueup_plant::{CoordinateKind, Plant, force_sensitivity};

/// States near the start, at speed; inputs of usual sizes; motors slide.
fn drawn(plant: &dyn Plant, draws: &mut Draws) -> (Vec<f64>, Vec<f64>, Vec<f64>, Vec<i32>) {
    let sizes = plant.sizes();
    let p: Vec<f64> = plant.table().parameters.iter().map(|q| q.start).collect();
    let mut x = vec![0.0; sizes.states];
    plant.start(&p, &mut x);
    x.iter_mut().for_each(|x| *x += draws.between(-0.2, 0.2));
    let u = (0..sizes.inputs).map(|_| draws.between(-0.5, 0.5)).collect();
    let modes = (0..sizes.modes).map(|_| if draws.between(0.0, 1.0) < 0.5 { -1 } else { 1 }).collect();
    (p, x, u, modes)
}

/// A unit quaternion where the base has one.
fn normalize(s: &RobotStructure, x: &mut [f64]) {
    if s.held {
        return;
    }
    let q = &mut x[States::new(s).base_quaternion..][..4];
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    q.iter_mut().for_each(|v| *v /= norm);
}

fn rates(plant: &dyn Plant, at: At<'_, f64>, force: &[f64]) -> Vec<f64> {
    let mut dx = vec![0.0; at.x.len()];
    plant.rates(at, force, &mut dx);
    dx
}

fn close(a: &[f64], b: &[f64], tolerance: f64, draws: &Draws) {
    let size = a.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < tolerance * size, "{draws} state {i}: {a} {b}");
    }
}

/// On motors and on the base they are what the inputs there do.
fn forces_are_inputs(
    plant: &dyn Plant,
    s: &RobotStructure,
    per_force: impl Fn(usize) -> f64,
    draws: &mut Draws,
) {
    let (p, mut x, u, modes) = drawn(plant, draws);
    normalize(s, &mut x);
    let (input, row) = (Inputs::new(s), States::new(s));
    let mut v = u.clone();
    let mut force = vec![0.0; plant.coordinates().len()];
    let mut base = 0;
    for (c, own) in plant.coordinates().iter().zip(&mut force) {
        match c.kind {
            CoordinateKind::Base => {
                // Torques in base axes are looked at where these are the inertial ones.
                if base < 3 {
                    *own = draws.between(-1.0, 1.0);
                    v[input.base_force + base] += *own;
                }
                base += 1;
            }
            CoordinateKind::Motor => {
                *own = draws.between(-1.0, 1.0);
                let joint = (0..s.bodies())
                    .find(|j| c.name == format!("motor[{}]", j + 1) || c.name == format!("joint[{}]", j + 1));
                let joint = joint.unwrap();
                v[input.joint_torque + joint] += *own * per_force(joint);
            }
            CoordinateKind::Link => {}
        }
    }
    let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
    close(&rates(plant, at, &force), &rates(plant, At { u: &v, ..at }, &[]), 1e-9, draws);
    if !s.held {
        x[row.base_quaternion..][..4].copy_from_slice(&[1.0, 0.0, 0.0, 0.0]);
        let (mut v, mut force) = (u.clone(), vec![0.0; force.len()]);
        for i in 0..3 {
            force[3 + i] = draws.between(-1.0, 1.0);
            v[input.base_torque + i] += force[3 + i];
        }
        let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
        close(&rates(plant, at, &force), &rates(plant, At { u: &v, ..at }, &[]), 1e-9, draws);
    }
}

/// A stiffer spring, a more damped one: forces on joint and motor.
fn parameters_are_forces(plant: &dyn Plant, s: &RobotStructure, draws: &mut Draws) {
    let (p, mut x, u, modes) = drawn(plant, draws);
    normalize(s, &mut x);
    let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
    let from = Parameters::new(s);
    let flexible: Vec<usize> = (0..s.bodies()).filter(|j| s.flexible[*j]).collect();
    let mut own: Vec<usize> =
        flexible.iter().flat_map(|j| [from.joint_stiffness + j, from.joint_damping + j]).collect();
    own.retain(|k| p[*k] > 0.0);
    assert!(!own.is_empty());
    let all = force_sensitivity(plant, at, &[], &own).unwrap();
    let base = rates(plant, at, &[]);
    for (k, force) in own.iter().zip(all.chunks(plant.coordinates().len())) {
        let h: f64 = 1e-4;
        let along = |h: f64| {
            let mut q = p.clone();
            q[*k] *= h.exp();
            rates(plant, At { p: &q, ..at }, &[])
        };
        let slope: Vec<f64> = along(h).iter().zip(along(-h)).map(|(a, b)| (a - b) / (2.0 * h)).collect();
        let pushed = rates(plant, at, force);
        let moved: Vec<f64> = pushed.iter().zip(&base).map(|(a, b)| a - b).collect();
        assert!(slope.iter().any(|v| v.abs() > 0.0));
        close(&slope, &moved, 1e-6, draws);
        // A spring acts between a joint and its motor.
        let sum: f64 = force.iter().sum();
        let size = force.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
        assert!(sum.abs() < 1e-7 * size, "{draws}: {force:?}");
    }
}

#[test]
fn the_robot_in_space_is_a_plant() {
    let mut draws = Draws::new(0x5face);
    for preset in [presets::table_1_with_panels(), presets::test_bed()] {
        let s = preset.structure();
        let plant = plants::flyer(SpatialFreeFlyer::new(s.clone()).unwrap());
        for _ in 0..5 {
            forces_are_inputs(&*plant, &s, |_| 1.0, &mut draws);
            if s.panels() == 0 && s.links() == 0 {
                parameters_are_forces(&*plant, &s, &mut draws);
            }
        }
        let more = plant.with(&["motor-friction"]).unwrap();
        let (own, with) = (plant.sizes(), more.sizes());
        assert_eq!((with.parameters - own.parameters, with.modes), (3 * s.bodies(), s.bodies()));
        assert_eq!(more.table().parameters.len(), with.parameters);
        assert!(plant.with(&["table-tilt"]).is_err() && plant.with(&[]).is_ok());
    }
}

#[test]
fn the_arm_on_the_ground_is_a_plant() {
    let mut draws = Draws::new(0xde11a);
    let design = flexible_arm::presets::delian();
    for by_current in [false, true] {
        let structure = flexible_arm::FlexibleArmStructure { robot: design.structure(), by_current };
        let arm = FlexibleArm::new(structure.clone()).unwrap();
        let plant = plants::flexible_arm(arm);
        let start: Vec<f64> = plant.table().parameters.iter().map(|q| q.start).collect();
        let gear = Parameters::new(&structure.robot).gear_ratio;
        let constant = plant.table().parameter("torqueConstant[1]");
        let per_force = |j: usize| constant.map_or(1.0, |k| 1.0 / (start[gear + j] * start[k + j]));
        for _ in 0..3 {
            forces_are_inputs(&*plant, &structure.robot, per_force, &mut draws);
        }
        let held = plant.coordinates().iter().filter(|c| c.friction_mode.is_some()).count();
        assert_eq!(held, structure.robot.springs());
    }
}
