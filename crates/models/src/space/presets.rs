//! Robots of the papers. What they do not print is assumed: `docs/parameters.md` says which.

use super::appendage::{Beam, Shapes};
use super::design::{Design, Link, Tip};
use super::spatial::Frame;
use super::tree::Joint;
use super::vector::{Matrix, Vector};

/// A rotationally symmetric or other diagonal inertia.
fn diagonal(d: Vector<f64>) -> Matrix<f64> {
    [[d[0], 0.0, 0.0], [0.0, d[1], 0.0], [0.0, 0.0, d[2]]]
}

/// Mass, centre of mass, principal inertias, position of the joint, its axis; each on the one before.
type Row = (f64, Vector<f64>, Vector<f64>, Vector<f64>, Vector<f64>);

fn chain(rows: &[Row]) -> Vec<Link> {
    let link = |(k, (mass, center, inertia, position, axis)): (usize, &Row)| Link {
        name: format!("link {}", k + 1),
        parent: k,
        joint: Joint::Revolute,
        mass: *mass,
        center_of_mass: *center,
        inertia: diagonal(*inertia),
        position: *position,
        orientation: [1.0, 0.0, 0.0, 0.0],
        axis: *axis,
    };
    rows.iter().enumerate().map(link).collect()
}

fn tool(body: usize, offset: Vector<f64>, mount: Vector<f64>) -> Vec<Tip> {
    vec![Tip { name: "tool".into(), body, offset, mount }]
}

/// S1 table 1: yaw, pitch, pitch; the post that carries the first joint stands in the origin. The base is assumed.
pub fn table_1() -> Design {
    Design {
        name: "table-1".into(),
        base_mass: 120.0,
        base_inertia: diagonal([12.0, 14.0, 10.0]),
        links: chain(&[
            (1.0, [0.0, 0.0, 0.075], [0.015, 0.015, 0.007], [0.0, 0.0, 0.15], [0.0, 0.0, 1.0]),
            (5.0, [0.75, 0.0, 0.0], [0.002, 0.011, 0.011], [0.0, 0.0, 0.15], [0.0, -1.0, 0.0]),
            (3.0, [0.4, 0.0, 0.0], [0.001, 0.008, 0.008], [1.5, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ]),
        tips: tool(3, [0.8, 0.0, 0.0], [0.0; 3]),
    }
}

/// S1 table 1 on a bus with two panels: the arm without its post stands at (0, 0, 0.5); the panels are [`panels`]. Bus and
/// panels are assumed.
pub fn table_1_with_panels() -> Design {
    let mut design = table_1();
    design.name = "table-1-with-panels".into();
    design.links[0].position[2] += 0.5;
    design.tips[0].mount[2] = 0.5;
    design
}

/// The panels of [`table_1_with_panels`] at +y and -y of its base: along the base's +y and -y, their x along its +z, their y
/// along its +x (at +y) and -x (at -y). All values are assumed.
pub fn panels() -> [(Shapes, Beam<f64>); 2] {
    [1.0, -1.0].map(|side| {
        let beam = Beam {
            // Columns: x, y, z.
            frame: Frame {
                rotation: [[0.0, side, 0.0], [0.0, 0.0, side], [1.0, 0.0, 0.0]],
                origin: [0.0, 0.6 * side, 0.1],
            },
            length: 4.0,
            mass_per_length: 1.0,
            bending_stiffness: [200.0, 800.0],
            torsion_stiffness: 60.0,
            polar_inertia_per_length: 0.02,
            damping_ratio: 0.005,
        };
        (Shapes { x: 2, y: 1, torsion: 1 }, beam)
    })
}

/// S2 tables 2 and 7: 1500 kg and 762 kg.m2, an arm of 58.7 kg and 4.2 m with six joints. All other values are assumed.
pub fn chaser() -> Design {
    let (yaw, pitch, roll) = ([0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
    let slender = |along: f64, across: f64| [along, across, across];
    Design {
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
    }
}
