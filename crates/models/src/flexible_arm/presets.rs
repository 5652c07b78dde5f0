//! ESA's DELIAN arm (S3): what the paper prints, and what is assumed because it does not (`docs/flexible-arm.md`).

use super::layout::Parameters;
use super::model::FlexibleArm;
use super::structure::FlexibleArmStructure;
use crate::space::appendage::Shapes;
use crate::space::design::{DesignLink, DesignMotor, DesignTip, Flexure, RobotDesign};
use crate::space::layout as space;
use crate::space::tree::JointType;
use crate::space::vector::Vector3;

/// Name of the preset.
pub const DELIAN: &str = "delian";

/// Of the motors, kg.m2 (assumed).
const ROTOR: f64 = 1.2e-7;
/// Of the motors, N.m/A (assumed).
const TORQUE_CONSTANT: f64 = 0.02;
/// Of the modes of links (assumed).
const LINK_DAMPING: f64 = 0.005;
/// Where Table 4 was measured, as far as it can be had (LNK-8): the upper arm raised by this, rad, the forearm level.
pub const RAISED: f64 = 1.408_749;
/// Shapes of each link along x, along y, of torsion.
pub const SHAPES: Shapes = Shapes { x: 2, y: 2, torsion: 1 };

/// A joint as the paper has it, at the motor.
struct MotorSide {
    /// n (assumed within the printed range).
    gear_ratio: f64,
    /// K_eq, N.m/rad; D_eq, N.m.s/rad (Table 1).
    stiffness: f64,
    damping: f64,
    /// tau_c, tau_s, N.m; D_m, N.m.s/rad (Tables 1, 2).
    coulomb: f64,
    breakaway: f64,
    viscous: f64,
}

const fn motor_side(n: f64, spring: [f64; 2], friction: [f64; 3]) -> MotorSide {
    let ([stiffness, damping], [coulomb, breakaway, viscous]) = (spring, friction);
    MotorSide { gear_ratio: n, stiffness, damping, coulomb, breakaway, viscous }
}

/// Joints 1 to 3.
const PRINTED: [MotorSide; 3] = [
    motor_side(44340.0, [3.07e-5, 8.07e-8], [7.37e-5, 2.99e-4, 7.2e-8]),
    motor_side(21750.0, [2.2e-5, 3.18e-8], [1.2e-4, 2.6e-4, 2.5e-8]),
    motor_side(25000.0, [2.96e-5, 8.35e-8], [7.73e-5, 2.45e-4, 6.93e-8]),
];

/// Spring and friction of joints 4 to 6 as shares of joint 3's (assumed; that of joint 5 so that Table 4 comes out).
const CLASS: [f64; 3] = [0.8, 0.8354, 0.4];

/// A body that is nearly a point on the x axis: mass, its place, half the edge of a cube of that inertia.
fn block(mass: f64, x: f64, half: f64) -> (f64, Vector3<f64>, [[f64; 3]; 3]) {
    let moment = 2.0 / 3.0 * mass * half * half;
    (mass, [x, 0.0, 0.0], [[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]])
}

/// Bodies, motors, links of DELIAN: yaw and pitch at the shoulder, pitch and roll at the elbow, pitch and roll at the wrist. Axes
/// of all bodies at angle 0 are those of the base, z up, the arm stretched along x; a pitch turns it up. The hand carries 2.15 kg.
pub fn delian() -> RobotDesign {
    let yaw = [0.0, 0.0, 1.0];
    let pitch = [0.0, -1.0, 0.0];
    let roll = [1.0, 0.0, 0.0];
    let hand = {
        // 0.5 kg at 0.06 m and a payload of 2.15 kg at 0.15 m.
        let (own, load) = (0.5, 2.149_55);
        let mass = own + load;
        let x = (own * 0.06 + load * 0.15) / mass;
        let apart = own * load / mass * 0.09 * 0.09;
        let (_, center, mut inertia) = block(mass, x, 0.05);
        inertia[1][1] += apart;
        inertia[2][2] += apart;
        (mass, center, inertia)
    };
    let rows = [
        ("shoulder yaw", block(0.8, 0.0, 0.05), [0.0, 0.0, 0.0], yaw),
        ("shoulder pitch", block(0.6, 0.02, 0.04), [0.0, 0.0, 0.15], pitch),
        ("elbow pitch", block(0.6, 0.02, 0.04), [0.70, 0.0, 0.0], pitch),
        ("elbow roll", block(0.4, 0.02, 0.035), [0.06, 0.0, 0.0], roll),
        ("wrist pitch", block(0.4, 0.03, 0.035), [0.58, 0.0, 0.0], pitch),
        ("wrist roll", hand, [0.07, 0.0, 0.0], roll),
    ];
    let link = |(k, (name, (mass, center, inertia), position, axis))| DesignLink {
        name: String::from(name),
        parent: k,
        joint: JointType::Revolute,
        mass,
        center_of_mass: center,
        inertia,
        position,
        orientation: [1.0, 0.0, 0.0, 0.0],
        axis,
        motor: motor(k),
    };
    RobotDesign {
        name: DELIAN.into(),
        base_mass: 10.0,
        base_inertia: block(10.0, 0.0, 0.2).2,
        links: rows.into_iter().enumerate().map(link).collect(),
        tips: vec![DesignTip { name: "tool".into(), body: 6, offset: [0.15, 0.0, 0.0], mount: [0.0; 3] }],
        thrusters: Vec::new(),
        appendages: Vec::new(),
        tables: Vec::new(),
        // Moduli: S3 Table 3. Moments of area: so that Table 4's links bend as they do.
        flexures: vec![
            tube(2, [0.05, 0.0, 0.0], 0.6, 0.8, 93.47e9, 2.123_33e-8),
            tube(4, [0.04, 0.0, 0.0], 0.5, 0.5, 87.23e9, 4.300_94e-9),
        ],
        link_tables: Vec::new(),
        axial_stiffening: None,
        held: true,
        geared: true,
        analysis: false,
    }
}

/// A joint's values at the motor, joint 4 to 6 by their share of joint 3's.
fn values(joint: usize) -> (&'static MotorSide, f64) {
    let share = joint.checked_sub(3).map_or(1.0, |k| CLASS[k]);
    (&PRINTED[joint.min(2)], share)
}

fn motor(joint: usize) -> DesignMotor {
    let (m, share) = values(joint);
    let square = m.gear_ratio * m.gear_ratio;
    DesignMotor {
        flexible: true,
        inertia: ROTOR * square,
        gear_ratio: m.gear_ratio,
        stiffness: share * m.stiffness * square,
        damping: share * m.damping * square,
    }
}

/// A tube along the body's x whose own x is the body's z, so that it first bends up.
fn tube(body: usize, position: Vector3<f64>, length: f64, mass: f64, modulus: f64, moment: f64) -> Flexure {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    Flexure {
        body,
        shapes: SHAPES,
        position,
        orientation: [0.0, half, 0.0, half],
        length,
        mass_per_length: mass,
        youngs_modulus: modulus,
        area_moment: [moment; 2],
        poisson_ratio: 0.33,
        torsion_constant: 2.0 * moment,
        // Of a tube of a wall of 1.5 mm: r^2 = (moment / (pi t))^(2/3).
        polar_inertia_per_length: mass * (moment / (std::f64::consts::PI * 1.5e-3)).powf(2.0 / 3.0),
        damping_ratio: LINK_DAMPING,
    }
}

/// The structure of DELIAN; the motors driven by currents, or by torques.
pub fn structure(by_current: bool) -> FlexibleArmStructure {
    FlexibleArmStructure { robot: delian().structure(), by_current }
}

/// Values of all parameters of DELIAN as a model with this structure: on the ground, in the posture of Table 4 and at rest.
pub fn parameters(model: &FlexibleArm, design: &RobotDesign) -> Vec<f64> {
    let s = model.structure();
    let (own, body) = (&model.parameter, space::Parameters::new(&s.robot));
    let mut p = model.defaults();
    let of_bodies = design.parameters();
    p[..of_bodies.len()].copy_from_slice(&of_bodies);
    put(&mut p, body.gravity, &[0.0, 0.0, -9.81]);
    put(&mut p, body.initial_joint_angle, &[0.0, RAISED, -RAISED, 0.0, 0.0, 0.0]);
    put(&mut p, body.initial_motor_angle, &[0.0, RAISED, -RAISED, 0.0, 0.0, 0.0]);
    frictions(own, s, &mut p);
    p
}

fn put(p: &mut [f64], begin: usize, values: &[f64]) {
    p[begin..][..values.len()].copy_from_slice(values);
}

fn frictions(at: &Parameters, s: &FlexibleArmStructure, p: &mut [f64]) {
    for j in 0..s.robot.bodies().min(PRINTED.len() + CLASS.len()) {
        let (m, share) = values(j);
        let n = m.gear_ratio;
        if s.by_current {
            p[at.torque_constant + j] = TORQUE_CONSTANT;
        }
        p[at.coulomb_friction + j] = share * m.coulomb * n;
        p[at.static_friction + j] = share * m.breakaway * n;
        p[at.viscous_friction + j] = share * m.viscous * n * n;
    }
}
