//! A hand in contact with a wall.

use super::loops::BENT;
use super::{Controlled, RunSample, run_with};
use crate::space::flyer::Flyer;
use trueup_models::contact::law::{ContactLaw, FREE, next_mode, plate};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::presets;

/// A robot at the size `lambda` (CON-7).
fn scaled(design: &RobotDesign, lambda: f64) -> RobotDesign {
    let mut small = design.clone();
    let [one, three, five] = [1, 3, 5].map(|e| lambda.powi(e));
    small.base_mass *= three;
    small.base_inertia = small.base_inertia.map(|row| row.map(|v| v * five));
    for link in &mut small.links {
        link.mass *= three;
        link.inertia = link.inertia.map(|row| row.map(|v| v * five));
        link.center_of_mass = link.center_of_mass.map(|v| v * one);
        link.position = link.position.map(|v| v * one);
        link.motor.inertia *= five;
    }
    for tip in &mut small.tips {
        tip.offset = tip.offset.map(|v| v * one);
        tip.mount = tip.mount.map(|v| v * one);
    }
    small.thrusters.iter_mut().for_each(|t| t.position = t.position.map(|v| v * one));
    small
}

/// Force on the wall over the time, at the size `lambda`: the hand goes to a wall 2 cm ahead and has a force of 5 N for 8 s of full size.
fn pushed(lambda: f64, base: f64, holds: bool) -> (Vec<(f64, f64)>, Vec<RunSample>, Flyer) {
    let design = scaled(&presets::chaser(), lambda);
    let (mut plant, mut control) = (Flyer::of(&design), Controlled::of(&design));
    plant.start(plant.parameter.initial_joint_angle, &BENT);
    let (own, n) = (control.own, design.links.len());
    control.p[own.base_control] = base;
    control.p[own.task_weight + 3..][..3].fill(lambda);
    for i in [own.threshold, own.damping] {
        control.p[i] *= lambda;
    }
    for (begin, exponent) in
        [(own.rate_limit, -1), (own.velocity_gain, -1), (own.tracking_gain, -2), (own.torque_limit, 3)]
    {
        control.p[begin..][..n].iter_mut().for_each(|v| *v *= lambda.powi(exponent));
    }
    control.p[own.base_velocity_gain] /= lambda;
    control.p[own.base_tracking_gain] /= lambda * lambda;
    control.p[own.base_torque_limit] *= lambda.powi(3);
    control.p[own.contact_damping] = 250.0 * lambda * lambda;
    let begin = plant.outputs(&started(&plant), &vec![0.0; plant.input.count])[plant.output.tip_position];
    let wall = begin + 0.02 * lambda;
    let law = ContactLaw {
        stiffness: 20_000.0 * lambda,
        damping: 900.0 * lambda * lambda,
        reference: Some(1e-3 * lambda),
    };
    let (tip, speed, force) = (plant.output.tip_position, plant.output.tip_velocity, plant.input.tip_force);
    let meets = move |y: &[f64]| {
        let pair = plate([wall - y[tip], 0.0], [-y[speed], 0.0], [-1.0, 0.0], 0.0);
        law.force(next_mode(FREE, &pair), pair.penetration, pair.approach)
    };
    let wanted = if holds { 5.0 * lambda * lambda } else { 0.0 };
    let (reference, at) = (control.input.contact_force_reference, control.input.tip_velocity_reference);
    let rows = run_with(
        &mut plant,
        &mut control,
        (8.0 * lambda, 0.005 * lambda),
        // Without the force the hand would go on at what the damping lets it.
        |_, u| {
            u[reference] = wanted;
            u[at] = if holds { 0.0 } else { 0.02 };
        },
        Some(&|_, y, u| u[force] = -meets(y)),
    );
    let forces = rows.iter().map(|r| (r.0, meets(&r.1))).collect();
    (forces, rows, plant)
}

fn started(plant: &Flyer) -> Vec<f64> {
    let mut x = vec![0.0; plant.at.count];
    trueup_numerics::hybrid::Hybrid::start(&plant.model, &plant.p, &mut x);
    x
}

/// Checks CTS-14: a constant force along the normal for the scaled time (S2 section 4), base free and controlled, at full size and at
/// 0.3, and equal after scaling; the force of a hand that follows velocities alone grows.
#[test]
fn a_hand_pushes_by_a_constant_force_at_either_size() {
    pushes(&[2.0]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_hand_of_a_free_base_pushes_by_a_constant_force_at_either_size() {
    pushes(&[1.0, 2.0]);
}

/// On a base that is free (1) or controlled (2).
fn pushes(bases: &[f64]) {
    for &base in bases {
        let mut seen: Vec<Vec<(f64, f64)>> = Vec::new();
        for lambda in [1.0, 0.3_f64] {
            let (forces, rows, plant) = pushed(lambda, base, true);
            let wanted = 5.0 * lambda * lambda;
            // From two seconds of full size after the first touch on.
            let touched = forces.iter().position(|f| f.1 > 0.0).unwrap();
            let steady = &forces[touched + 400..];
            let worst = steady.iter().map(|f| (f.1 / wanted - 1.0).abs()).fold(0.0, f64::max);
            let last = &rows[rows.len() - 1].1;
            let first = &rows[touched].1;
            let slid = (1..3).map(|i| {
                (last[plant.output.tip_position + i] - first[plant.output.tip_position + i]).powi(2)
            });
            let slid = slid.sum::<f64>().sqrt() / lambda;
            println!(
                "base {base}, lambda {lambda}: touched after {:.3} s, held for {:.2} s to {:.2} %, slid by {slid:.1e} m of full size",
                forces[touched].0,
                steady.len() as f64 * 0.005 * lambda,
                100.0 * worst
            );
            assert!(steady.len() > 400 && worst < 0.05, "{base} {lambda}: {} {worst}", steady.len());
            assert!(slid < 1e-3, "{slid}");
            seen.push(forces);
        }
        let square = 0.3_f64.powi(2);
        let apart = seen[0].iter().zip(&seen[1]).map(|(a, b)| (a.1 - b.1 / square).abs()).fold(0.0, f64::max);
        println!("base {base}: {apart:.1e} N apart after scaling");
        assert!(apart < 1e-6, "{apart}");
    }
    let (forces, _, _) = pushed(1.0, 1.0, false);
    let most = forces.iter().map(|f| f.1).fold(0.0, f64::max);
    println!("without: {most:.1} N at most");
    assert!(most > 50.0, "{most}");
}
