//! Robots of the papers. What they do not print is assumed: `docs/parameters.md` lists which.

use super::appendage::Beam;
use super::design::{Appendage, DesignLink, DesignMotor, DesignTip, RobotDesign, Thruster};
use super::shapes::Shapes;
use super::tree::JointType;
use super::vector::{Matrix3, Vector3};
use crate::arm::parameter as planar;
use crate::presets::cbk_pan;

/// A rotationally symmetric or other diagonal inertia.
fn diagonal(d: Vector3<f64>) -> Matrix3<f64> {
    [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]]
}

/// Mass, centre of mass, principal inertias, position of the joint, its axis; each on the one before.
type LinkRow = (f64, Vector3<f64>, Vector3<f64>, Vector3<f64>, Vector3<f64>);

fn chain(rows: &[LinkRow]) -> Vec<DesignLink> {
    let link = |(k, (mass, center, inertia, position, axis)): (usize, &LinkRow)| DesignLink {
        name: format!("link {}", k + 1),
        parent: k,
        joint: JointType::Revolute,
        mass: *mass,
        center_of_mass: *center,
        inertia: diagonal(*inertia),
        position: *position,
        orientation: [1.0, 0.0, 0.0, 0.0],
        axis: *axis,
        motor: DesignMotor::default(),
    };
    rows.iter().enumerate().map(link).collect()
}

fn tool(body: usize, offset: Vector3<f64>, mount: Vector3<f64>) -> Vec<DesignTip> {
    vec![DesignTip { name: "tool".into(), body, offset, mount }]
}

/// S1 table 1: yaw, pitch, pitch; the post that carries the first joint is in the origin. The base is assumed.
pub fn table_1() -> RobotDesign {
    RobotDesign {
        name: "table-1".into(),
        base_mass: 120.0,
        base_inertia: diagonal([12.0, 14.0, 10.0]),
        links: chain(&[
            (1.0, [0.0, 0.0, 0.075], [0.015, 0.015, 0.007], [0.0, 0.0, 0.15], [0.0, 0.0, 1.0]),
            (5.0, [0.75, 0.0, 0.0], [0.002, 0.011, 0.011], [0.0, 0.0, 0.15], [0.0, -1.0, 0.0]),
            (3.0, [0.4, 0.0, 0.0], [0.001, 0.008, 0.008], [1.5, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ]),
        tips: tool(3, [0.8, 0.0, 0.0], [0.0; 3]),
        thrusters: Vec::new(),
        appendages: Vec::new(),
        tables: Vec::new(),
        flexures: Vec::new(),
        link_tables: Vec::new(),
        axial_stiffening: None,
        held: false,
        geared: true,
        analysis: false,
    }
}

/// S1 table 1 on a bus with two panels: the arm without its post is at (0, 0, 0.5). Bus and panels are assumed. The panels
/// at +y and -y are along the base's +y and -y, their x along its +z, their y along its +x (at +y) and -x (at -y).
pub fn table_1_with_panels() -> RobotDesign {
    let mut design = table_1();
    design.name = "table-1-with-panels".into();
    design.links[0].position[2] += 0.5;
    design.tips[0].mount[2] = 0.5;
    let panel = |side: f64| Appendage {
        name: if side > 0.0 { "panel +y".into() } else { "panel -y".into() },
        shapes: Shapes { x: 2, y: 1, torsion: 1 },
        position: [0.0, 0.6 * side, 0.1],
        orientation: [0.5, -0.5 * side, -0.5, -0.5 * side],
        length: 4.0,
        mass_per_length: 1.0,
        bending_stiffness: [200.0, 800.0],
        torsion_stiffness: 60.0,
        polar_inertia_per_length: 0.02,
        damping_ratio: 0.005,
    };
    design.appendages = [1.0, -1.0].map(panel).to_vec();
    design
}

/// The panels of [`table_1_with_panels`].
pub fn panels() -> [(Shapes, Beam<f64>); 2] {
    let all = table_1_with_panels().appendages;
    [0, 1].map(|p| (all[p].shapes, all[p].beam()))
}

/// Thrusters both ways along every axis, one on each side of the centre of mass: together they push, apart they turn.
fn pairs(lever: f64) -> Vec<Thruster> {
    let mut all = Vec::new();
    for axis in 0..3 {
        for (side, way) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
            let (mut position, mut direction) = ([0.0; 3], [0.0; 3]);
            position[(axis + 1) % 3] = side * lever;
            direction[axis] = way;
            all.push(Thruster { position, direction });
        }
    }
    all
}

/// S2 tables 2 and 7: 1500 kg and 762 kg.m2, an arm of 58.7 kg and 4.2 m with six joints. All other values are assumed.
pub fn chaser() -> RobotDesign {
    let (yaw, pitch, roll) = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let slender = |along: f64, across: f64| [along, across, across];
    RobotDesign {
        name: "chaser".into(),
        base_mass: 1500.0,
        base_inertia: [[650.0, -12.0, 8.0], [-12.0, 700.0, 5.0], [8.0, 5.0, 762.0]],
        links: chain(&[
            (8.0, [0.0, 0.0, 0.1], [0.033866666666667, 0.033866666666667, 0.0144], [0.9, 0.0, 0.6], yaw),
            (18.0, [0.95, -0.01, 0.0], slender(0.0324, 5.4312), [0.0, 0.0, 0.2], pitch),
            (14.7, [0.8, 0.01, 0.0], slender(0.02646, 3.14923), [1.9, 0.0, 0.0], pitch),
            (7.0, [0.1, -0.01, 0.0], slender(0.0126, 0.029633333333333), [1.6, 0.0, 0.0], roll),
            (6.0, [0.075, 0.01, 0.0], slender(0.0108, 0.01665), [0.2, 0.0, 0.0], pitch),
            (5.0, [0.075, -0.01, 0.0], slender(0.009, 0.013875), [0.15, 0.0, 0.0], roll),
        ]),
        tips: tool(6, [0.15, 0.0, 0.0], [0.9, 0.0, 0.6]),
        thrusters: pairs(0.8),
        appendages: Vec::new(),
        tables: Vec::new(),
        flexures: Vec::new(),
        link_tables: Vec::new(),
        axial_stiffening: None,
        held: false,
        geared: true,
        analysis: false,
    }
}

/// The structure of the CBK PAN test-bed: joint 1 flexible, joints 2 and 3 rigid.
const TEST_BED: [bool; 3] = [true, false, false];

/// S0's test-bed with its motor as printed: all joints turn about z. Moments of inertia about x and y are assumed to be those
/// about z: in the plane they do not matter.
pub fn test_bed() -> RobotDesign {
    let (n, p) = (TEST_BED.len(), cbk_pan(&TEST_BED));
    let link = |k: usize| {
        let before = if k == 0 { planar::mount_position(n) } else { planar::link_length(n) + k - 1 };
        let center = planar::link_center_of_mass(n) + 2 * k;
        DesignLink {
            name: format!("link {}", k + 1),
            parent: k,
            joint: JointType::Revolute,
            mass: p[planar::link_mass(n) + k],
            center_of_mass: [p[center], p[center + 1], 0.0],
            inertia: diagonal([p[planar::link_inertia(n) + k]; 3]),
            position: [p[before], if k == 0 { p[before + 1] } else { 0.0 }, 0.0],
            orientation: [1.0, 0.0, 0.0, 0.0],
            axis: [0.0, 0.0, 1.0],
            motor: DesignMotor {
                flexible: TEST_BED[k],
                inertia: p[planar::motor_inertia(n) + k],
                gear_ratio: p[planar::gear_ratio(n) + k],
                stiffness: p[planar::joint_stiffness(n) + k],
                damping: p[planar::joint_damping(n) + k],
            },
        }
    };
    let mount = planar::mount_position(n);
    RobotDesign {
        name: "test-bed".into(),
        base_mass: p[planar::base_mass(n)],
        base_inertia: diagonal([p[planar::base_inertia(n)]; 3]),
        links: (0..n).map(link).collect(),
        tips: tool(n, [p[planar::link_length(n) + n - 1], 0.0, 0.0], [p[mount], p[mount + 1], 0.0]),
        thrusters: Vec::new(),
        appendages: Vec::new(),
        tables: Vec::new(),
        flexures: Vec::new(),
        link_tables: Vec::new(),
        axial_stiffening: None,
        held: false,
        geared: false,
        analysis: false,
    }
}

/// A robot by its name.
#[derive(Clone, Copy, Debug)]
pub struct RobotPreset {
    /// As requested.
    pub name: &'static str,
    /// Where its values are from.
    pub source: &'static str,
    /// Makes it.
    pub design: fn() -> RobotDesign,
}

/// All of them.
pub const PRESETS: &[RobotPreset] = &[
    RobotPreset {
        name: "table-1",
        source: "three-link arm of free-flying robots' dynamics, Table 1, on an assumed base",
        design: table_1,
    },
    RobotPreset {
        name: "table-1-with-panels",
        source: "the same arm on an assumed base with two assumed panels that swing",
        design: table_1_with_panels,
    },
    RobotPreset {
        name: "chaser",
        source: "servicer of 1500 kg with a six-joint arm, on-orbit contact, Tables 2 and 7; the rest is assumed",
        design: chaser,
    },
    RobotPreset {
        name: "test-bed",
        source: "CBK PAN air-bearing test-bed in space, all axes along z",
        design: test_bed,
    },
];
