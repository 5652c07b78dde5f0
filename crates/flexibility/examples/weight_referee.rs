//! An arm of two links at rest under its weight, for a referee in another language: where its end is, how it is turned, its three
//! lowest frequencies.
//!
//! Standard input, one line each: lengths of the links (m); E J of bending in the plane of x and y, out of it, G J_t of the first
//! link (N.m2); those of the second; masses per length (kg/m); polar inertias per length (kg.m); stiffness of the joints
//! (N.m/rad); masses at elbow and end (kg), the latter's place from the end (m, link's axes); gravity (m/s2); shapes of each kind;
//! then one line per posture: angles of both joints about z (rad). Standard output, two lines per posture, displacements of second
//! order off and on: the end's place (m) and quaternion against the frame of the ground, frequencies (rad/s).
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::{Read, stdin};
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure, presets};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, Flexure, RobotDesign};
use trueup_models::space::layout::{Outputs, Parameters};
use trueup_models::space::tree::JointType;
use trueup_numerics::hybrid::{At, Hybrid};

/// What must have no inertia, but as a body needs some, kg.
const NOTHING: f64 = 1e-7;
const POISSON: f64 = 0.3;

/// Body `k` of three (from 0); the third is on a joint that is held.
fn body(k: usize, position: f64, mass: f64, center_of_mass: [f64; 3], spring: Option<&f64>) -> DesignLink {
    let moment = mass * 1e-15;
    DesignLink {
        name: format!("body {}", k + 1),
        parent: k,
        joint: JointType::Revolute,
        mass,
        center_of_mass,
        inertia: [[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]],
        position: [position, 0.0, 0.0],
        orientation: [1.0, 0.0, 0.0, 0.0],
        axis: [0.0, 0.0, 1.0],
        motor: DesignMotor {
            flexible: spring.is_some(),
            inertia: if spring.is_some() { 1e-9 } else { 0.0 },
            gear_ratio: 1000.0,
            stiffness: spring.copied().unwrap_or(0.0),
            damping: 0.0,
        },
    }
}

fn link(k: usize, shapes: usize, length: f64, stiffness: &[f64], mass: f64, polar: f64) -> Flexure {
    Flexure {
        body: k + 1,
        shapes: Shapes { x: shapes, y: shapes, torsion: shapes },
        position: [0.0; 3],
        // Its x along the body's y, its y along the body's z.
        orientation: [0.5; 4],
        length,
        mass_per_length: mass,
        youngs_modulus: 1.0,
        area_moment: [stiffness[0], stiffness[1]],
        poisson_ratio: POISSON,
        torsion_constant: stiffness[2] * 2.0 * (1.0 + POISSON),
        polar_inertia_per_length: polar,
        damping_ratio: 0.0,
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    let parse = |l: &str| l.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>();
    let rows = text.lines().map(parse).collect::<Result<Vec<_>, _>>()?;
    let [length, first, second, density, polar, spring, load, gravity, shapes, postures @ ..] = &rows[..]
    else {
        return Err("nine lines of the arm come first".into());
    };
    let shapes = shapes[0] as usize;
    let stiffness = [first, second];
    let links = vec![
        body(0, 0.0, NOTHING, [0.0; 3], Some(&spring[0])),
        body(1, length[0], load[0], [0.0; 3], Some(&spring[1])),
        body(2, length[1], load[1], [load[2], load[3], load[4]], None),
    ];
    for posture in postures {
        for axial_stiffening in [false, true] {
            let design = RobotDesign {
                name: "two links".into(),
                links: links.clone(),
                tips: vec![DesignTip { name: "end".into(), body: 3, offset: [0.0; 3], mount: [0.0; 3] }],
                flexures: (0..2)
                    .map(|k| link(k, shapes, length[k], stiffness[k], density[k], polar[k]))
                    .collect(),
                axial_stiffening: Some(axial_stiffening),
                ..presets::delian()
            };
            design.check()?;
            let model =
                FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: false })?;
            let mut p = model.defaults();
            let mut of_bodies = design.parameters();
            let s = &model.structure().robot;
            of_bodies[Parameters::new(s).gravity..][..3].copy_from_slice(gravity);
            p[..of_bodies.len()].copy_from_slice(&of_bodies);
            let rest = equilibrium(&model, &p, &[posture[0], posture[1], 0.0], [0.0; 3])?;
            let bodies = model.bodies();
            let u = vec![0.0; bodies.sizes().inputs];
            let mut y = vec![0.0; bodies.sizes().outputs];
            bodies.outputs(At { t: 0.0, x: &rest.state, u: &u, p: &of_bodies, modes: &[] }, &mut y);
            let at = Outputs::new(s);
            let mut values = [&y[at.tip_position..][..3], &y[at.tip_quaternion..][..4]].concat();
            values.extend(rest.frequencies()?.iter().take(3));
            println!("{}", values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" "));
        }
    }
    Ok(())
}
