//! A planar arm of two links that bend, for a referee in another language: frequencies with the motors held, accelerations of
//! the joints and the tip.
//!
//! Standard input, one line each: lengths of the links (m), E J (N.m2), mass per length (kg/m), stiffness of the joints
//! (N.m/rad), masses at elbow and tip (kg), gravity along x and y (m/s2), shapes of each link; then one line per state: angles
//! of both joints (rad) and their rates. Standard output, two lines per state: frequencies (rad/s), ascending, weight
//! left out; accelerations of the joints (rad/s2) and of the tip (m/s2, x and y) under gravity, links straight, springs slack.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::io::{Read, stdin};
use trueup_flexibility::equilibrium::equilibrium;
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure, presets};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, Flexure, RobotDesign};
use trueup_models::space::layout::{Outputs, Parameters, States};
use trueup_models::space::tree::JointType;
use trueup_models::space::{PrescribedAccelerations, SpatialFreeFlyer};
use trueup_numerics::Dual;
use trueup_numerics::hybrid::{At, Hybrid};

/// What a line of standard input has two of.
type Pair = [f64; 2];

/// The arm, all in the plane of x and y.
struct Arm {
    length: Pair,
    stiffness: Pair,
    mass_per_length: Pair,
    spring: Pair,
    mass: Pair,
    shapes: usize,
}

/// What must have no inertia, but as a body needs some, kg.
const NOTHING: f64 = 1e-7;

impl Arm {
    fn body(&self, k: usize, mass: f64) -> DesignLink {
        let moment = mass * 1e-15;
        let flexible = k < 2;
        DesignLink {
            name: format!("body {}", k + 1),
            parent: k,
            joint: JointType::Revolute,
            mass,
            center_of_mass: [0.0; 3],
            inertia: [[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]],
            position: [if k == 0 { 0.0 } else { self.length[k - 1] }, 0.0, 0.0],
            orientation: [1.0, 0.0, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            motor: DesignMotor {
                flexible,
                inertia: if flexible { 1e-9 } else { 0.0 },
                gear_ratio: 1000.0,
                stiffness: if flexible { self.spring[k] } else { 0.0 },
                damping: 0.0,
            },
        }
    }
    fn link(&self, k: usize) -> Flexure {
        Flexure {
            body: k + 1,
            shapes: Shapes { x: self.shapes, y: 0, torsion: 0 },
            position: [0.0; 3],
            // Its x along the body's y.
            orientation: [0.5; 4],
            length: self.length[k],
            mass_per_length: self.mass_per_length[k],
            youngs_modulus: 1.0,
            area_moment: [self.stiffness[k]; 2],
            poisson_ratio: 0.3,
            torsion_constant: 1.0,
            polar_inertia_per_length: 1e-4,
            damping_ratio: 0.0,
        }
    }
    /// The tip is the third body, on a joint that is held.
    fn design(&self) -> RobotDesign {
        RobotDesign {
            name: "two links".into(),
            links: vec![self.body(0, NOTHING), self.body(1, self.mass[0]), self.body(2, self.mass[1])],
            tips: vec![DesignTip { name: "tip".into(), body: 3, offset: [0.0; 3], mount: [0.0; 3] }],
            flexures: (0..2).map(|k| self.link(k)).collect(),
            ..presets::delian()
        }
    }
}

/// Accelerations of both joints and of the tip of the straight arm.
fn accelerations(bodies: &SpatialFreeFlyer, p: &[f64], state: &[f64]) -> [f64; 4] {
    let at = States::new(bodies.structure());
    let mut x = vec![0.0; bodies.sizes().states];
    for k in 0..2 {
        x[at.joint_angle + k] = state[k];
        x[at.motor_angle + k] = state[k];
        x[at.joint_velocity + k] = state[2 + k];
        x[at.motor_velocity + k] = state[2 + k];
    }
    let u = vec![0.0; bodies.sizes().inputs];
    let led = PrescribedAccelerations { base: None, joints: &[(2, 0.0)], motors: &[] };
    let mut dx = vec![0.0; x.len()];
    bodies.rates_prescribed(At { t: 0.0, x: &x, u: &u, p, modes: &[] }, led, &mut dx);
    // The tip's acceleration is how its velocity changes along the motion.
    let lift = |v: &[f64]| v.iter().map(|v| Dual { re: *v, eps: [0.0] }).collect::<Vec<Dual<1>>>();
    let along: Vec<Dual<1>> = x.iter().zip(&dx).map(|(x, dx)| Dual { re: *x, eps: [*dx] }).collect();
    let (u, p) = (lift(&u), lift(p));
    let mut y = lift(&vec![0.0; bodies.sizes().outputs]);
    bodies.outputs(At { t: Dual { re: 0.0, eps: [0.0] }, x: &along, u: &u, p: &p, modes: &[] }, &mut y);
    let tip = Outputs::new(bodies.structure()).tip_velocity;
    [dx[at.joint_velocity], dx[at.joint_velocity + 1], y[tip].eps[0], y[tip + 1].eps[0]]
}

fn line(values: &[f64]) {
    println!("{}", values.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(" "));
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut text = String::new();
    stdin().read_to_string(&mut text)?;
    let parse = |l: &str| l.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>();
    let rows = text.lines().map(parse).collect::<Result<Vec<_>, _>>()?;
    let pair = |k: usize| Pair::try_from(rows[k].as_slice());
    let arm = Arm {
        length: pair(0)?,
        stiffness: pair(1)?,
        mass_per_length: pair(2)?,
        spring: pair(3)?,
        mass: pair(4)?,
        shapes: rows[6][0] as usize,
    };
    let gravity = pair(5)?;
    let design = arm.design();
    design.check()?;
    let model = FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: false })?;
    let mut p = model.defaults();
    let of_bodies = design.parameters();
    p[..of_bodies.len()].copy_from_slice(&of_bodies);
    let mut heavy = of_bodies;
    heavy[Parameters::new(&model.structure().robot).gravity..][..2].copy_from_slice(&gravity);
    for state in &rows[7..] {
        let [first, second, ..] = state[..] else { return Err("a state has four values".into()) };
        let rest = equilibrium(&model, &p, &[first, second, 0.0], [0.0; 3])?;
        line(&rest.frequencies()?);
        line(&accelerations(model.bodies(), &heavy, state));
    }
    Ok(())
}
