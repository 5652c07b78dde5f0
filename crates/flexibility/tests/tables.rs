//! Links by tables of modes, as a tool for structures reduces a beam, against the beam itself. The finite elements are the test's own.

use super::beams::{LENGTHS, arm_of, chain, output};
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use trueup_flexibility::elements::contributions;
use trueup_flexibility::equilibrium::equilibrium;
use trueup_flexibility::ground::{EARTH, standing};
use trueup_models::flexible_arm::presets::{RAISED, delian};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::{Flexure, RobotDesign};
use trueup_models::space::table::{LinkTable, ModeReach, ModeTable, TabledMode};

/// One plane of a beam, or its torsion, by finite elements; the first `clamped` rows are those of the root.
struct Plane {
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    clamped: usize,
    /// Rigid motions of all nodes: along the plane's direction and about the root; about the axis.
    rigid: Vec<DVector<f64>>,
}

/// Bending: deflection and slope at each node, Hermite's cubics.
fn bending(elements: usize, length: f64, mass_per_length: f64, stiffness: f64) -> Plane {
    let (h, size) = (length / elements as f64, 2 * (elements + 1));
    let m = [
        [156.0, 22.0 * h, 54.0, -13.0 * h],
        [22.0 * h, 4.0 * h * h, 13.0 * h, -3.0 * h * h],
        [54.0, 13.0 * h, 156.0, -22.0 * h],
        [-13.0 * h, -3.0 * h * h, -22.0 * h, 4.0 * h * h],
    ];
    let k = [
        [12.0, 6.0 * h, -12.0, 6.0 * h],
        [6.0 * h, 4.0 * h * h, -6.0 * h, 2.0 * h * h],
        [-12.0, -6.0 * h, 12.0, -6.0 * h],
        [6.0 * h, 2.0 * h * h, -6.0 * h, 4.0 * h * h],
    ];
    let mut all = Plane {
        mass: DMatrix::zeros(size, size),
        stiffness: DMatrix::zeros(size, size),
        clamped: 2,
        rigid: vec![
            DVector::from_fn(size, |r, _| if r % 2 == 0 { 1.0 } else { 0.0 }),
            DVector::from_fn(size, |r, _| if r % 2 == 0 { h * (r / 2) as f64 } else { 1.0 }),
        ],
    };
    for e in 0..elements {
        for i in 0..4 {
            for j in 0..4 {
                all.mass[(2 * e + i, 2 * e + j)] += mass_per_length * h / 420.0 * m[i][j];
                all.stiffness[(2 * e + i, 2 * e + j)] += stiffness / h.powi(3) * k[i][j];
            }
        }
    }
    all
}

/// Torsion: the angle at each node, linear between.
fn torsion(elements: usize, length: f64, polar: f64, stiffness: f64) -> Plane {
    let (h, size) = (length / elements as f64, elements + 1);
    let mut all = Plane {
        mass: DMatrix::zeros(size, size),
        stiffness: DMatrix::zeros(size, size),
        clamped: 1,
        rigid: vec![DVector::from_element(size, 1.0)],
    };
    for e in 0..elements {
        for i in 0..2 {
            for j in 0..2 {
                let same = i == j;
                all.mass[(e + i, e + j)] += polar * h / 6.0 * if same { 2.0 } else { 1.0 };
                all.stiffness[(e + i, e + j)] += stiffness / h * if same { 1.0 } else { -1.0 };
            }
        }
    }
    all
}

/// omega^2 ascending and mass-normalised columns of K s = omega^2 M s.
fn eigen(mass: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let inverse = mass.clone().cholesky().unwrap().l().try_inverse().unwrap();
    let found = SymmetricEigen::new(&inverse * stiffness * inverse.transpose());
    let mut order: Vec<usize> = (0..mass.nrows()).collect();
    order.sort_by(|a, b| found.eigenvalues[*a].total_cmp(&found.eigenvalues[*b]));
    let shapes = inverse.transpose() * found.eigenvectors.select_columns(&order);
    (order.iter().map(|k| found.eigenvalues[*k]).collect(), shapes)
}

/// How a tool reduces what is clamped at its root.
#[derive(Clone, Copy, Debug)]
enum Reduction {
    /// The first so many modes with a free end.
    Free(usize),
    /// Unit displacements of the end, and the first so many modes with that held (Craig and Bampton).
    CraigBampton(usize),
}

/// Elements of the mesh, and how they are reduced.
type Tool = (usize, Reduction);

/// A mode: omega, the momenta by the rigid motions, the end's own coordinates; all mass-normalised.
type Row = (f64, Vec<f64>, Vec<f64>);

fn reduced(plane: &Plane, how: Reduction) -> Vec<Row> {
    let (c, all) = (plane.clamped, plane.mass.nrows());
    let free = |m: &DMatrix<f64>| m.view((c, c), (all - c, all - c)).into_owned();
    let (mass, stiffness) = (free(&plane.mass), free(&plane.stiffness));
    let n = mass.nrows();
    let basis = match how {
        Reduction::Free(count) => eigen(&mass, &stiffness).1.columns(0, count).into_owned(),
        Reduction::CraigBampton(count) => {
            let inner = n - c;
            let part =
                |m: &DMatrix<f64>, from: usize, width: usize| m.view((0, from), (inner, width)).into_owned();
            let inside = part(&stiffness, 0, inner);
            let constraint = -inside.clone().cholesky().unwrap().solve(&part(&stiffness, inner, c));
            let fixed = eigen(&part(&mass, 0, inner), &inside).1;
            let mut basis = DMatrix::zeros(n, c + count);
            basis.view_mut((0, 0), (inner, c)).copy_from(&constraint);
            basis.view_mut((inner, 0), (c, c)).fill_with_identity();
            basis.view_mut((0, c), (inner, count)).copy_from(&fixed.columns(0, count));
            basis
        }
    };
    let small = |m: &DMatrix<f64>| {
        let m = basis.transpose() * m * &basis;
        (&m + m.transpose()) * 0.5
    };
    let (squares, shapes) = eigen(&small(&mass), &small(&stiffness));
    let shapes = &basis * shapes;
    let momenta: Vec<DVector<f64>> = plane.rigid.iter().map(|r| &plane.mass * r).collect();
    let row = |j: usize| {
        let shape = shapes.column(j);
        let by = |m: &DVector<f64>| m.rows(c, n).dot(&shape);
        let end = (n - c..n).map(|r| shape[r]).collect();
        (squares[j].sqrt(), momenta.iter().map(by).collect(), end)
    };
    (0..shapes.ncols()).map(row).collect()
}

/// The table that a tool makes of a link; torsion by one mode, or by its end's angle.
fn tabled(f: &Flexure, (elements, how): Tool) -> LinkTable {
    let shear = f.youngs_modulus / (2.0 * (1.0 + f.poisson_ratio));
    let mut rows = Vec::new();
    for side in 0..2 {
        let plane = bending(elements, f.length, f.mass_per_length, f.youngs_modulus * f.area_moment[side]);
        // z x d: along y of what bends along x, along -x of what bends along y.
        let turn = [1.0, -1.0][side];
        for (omega, momenta, end) in reduced(&plane, how) {
            let (mut participation, mut reach) = ([0.0; 6], ModeReach { shift: [0.0; 3], turn: [0.0; 3] });
            participation[side] = momenta[0];
            participation[4 - side] = turn * momenta[1];
            reach.shift[side] = end[0];
            reach.turn[1 - side] = turn * end[1];
            rows.push((omega, participation, reach));
        }
    }
    let twisted = torsion(elements, f.length, f.polar_inertia_per_length, shear * f.torsion_constant);
    for (omega, momenta, end) in reduced(&twisted, Reduction::CraigBampton(0)) {
        let reach = ModeReach { shift: [0.0; 3], turn: [0.0, 0.0, end[0]] };
        rows.push((omega, [0.0, 0.0, 0.0, 0.0, 0.0, momenta[0]], reach));
    }
    let mass = f.mass_per_length * f.length;
    let across = mass * f.length.powi(2) / 12.0;
    let mode = |(frequency, participation, _): &(f64, [f64; 6], ModeReach)| TabledMode {
        frequency: *frequency,
        damping_ratio: f.damping_ratio,
        participation: *participation,
    };
    LinkTable {
        body: f.body,
        table: ModeTable {
            name: format!("link of body {}", f.body),
            position: f.position,
            orientation: f.orientation,
            mass,
            center_of_mass: [0.0, 0.0, 0.5 * f.length],
            inertia: [
                [across, 0.0, 0.0],
                [0.0, across, 0.0],
                [0.0, 0.0, f.polar_inertia_per_length * f.length],
            ],
            modes: rows.iter().map(mode).collect(),
        },
        end: [0.0, 0.0, f.length],
        reach: rows.iter().map(|r| r.2).collect(),
    }
}

/// The same robot with these of its links (from 0) by tables.
fn with_tables(design: &RobotDesign, links: &[usize], how: Tool) -> RobotDesign {
    let all = design.flexures.iter().enumerate();
    let (tables, beams): (Vec<_>, Vec<_>) = all.partition(|(k, _)| links.contains(k));
    let design = RobotDesign {
        flexures: beams.into_iter().map(|(_, f)| f.clone()).collect(),
        link_tables: tables.into_iter().map(|(_, f)| tabled(f, how)).collect(),
        ..design.clone()
    };
    design.check().unwrap();
    design
}

/// Two links with joints and a mass at the tip, beams with all shapes that there are.
fn two_links() -> RobotDesign {
    let mut design = chain(2, Shapes { x: 5, y: 5, torsion: 1 }, 0.5);
    // Of a microgram they would have frequencies so high that the first three are lost in rounding.
    for body in &mut design.links {
        body.mass += 0.2;
        (0..3).for_each(|k| body.inertia[k][k] = 2e-4);
    }
    design
}

/// By how much the first three frequencies are off those of the beams at most, over postures.
fn off(beams: &RobotDesign, links: &[usize], tool: Tool) -> [f64; 3] {
    let tables = with_tables(beams, links, tool);
    let mut worst = [0.0_f64; 3];
    for fold in [0.0, 0.6, 1.4, -2.3, 3.0] {
        let frequencies = |design: &RobotDesign| {
            let (arm, p) = arm_of(design);
            equilibrium(&arm, &p, &[0.2, fold, 0.1], [0.0; 3]).unwrap().frequencies().unwrap()
        };
        let (wanted, found) = (frequencies(beams), frequencies(&tables));
        for (k, worst) in worst.iter_mut().enumerate() {
            let off = found[k] / wanted[k] - 1.0;
            *worst = if off.abs() > worst.abs() { off } else { *worst };
        }
    }
    let [a, b, c] = worst;
    println!("{tool:?} of links {links:?}: first three off by {a:.1e}, {b:.1e}, {c:.1e}");
    worst
}

/// Checks LNK-5: tables swing as beams do, both links or one of them. Craig and Bampton's sets and all modes of a coarse mesh have the
/// end's displacement and slope among their shapes, as the beam's polynomials do.
#[test]
fn lnk5_tables_of_finite_elements_swing_as_beams() {
    let beams = two_links();
    for (tool, links, bound) in [
        ((2, Reduction::Free(4)), &[0, 1][..], 1e-3),
        ((20, Reduction::CraigBampton(3)), &[0, 1], 1e-5),
        ((20, Reduction::CraigBampton(3)), &[1], 1e-5),
    ] {
        let worst = off(&beams, links, tool);
        assert!(worst.iter().all(|w| w.abs() < bound), "{tool:?}: {worst:?}");
    }
}

/// Checks LNK-5: the first modes with a free end have no moment there, so that links on which others hang are too stiff: frequencies
/// come from above, and slowly.
#[test]
fn lnk5_few_modes_with_a_free_end_are_too_stiff() {
    let beams = two_links();
    let [few, more] = [3, 6].map(|count| off(&beams, &[0, 1], (20, Reduction::Free(count))));
    for (few, more) in few.iter().zip(more) {
        assert!(more > 1e-3 && *few > 1.5 * more, "{few:e} {more:e}");
    }
}

/// Checks LNK-5: d = F L^3 / (3 E J) (S3 eq. 9) of Craig and Bampton's set, whose end is exact at rest; modes with a free end lack
/// what those left out would give.
#[test]
fn lnk5_a_cantilever_by_a_table_bends_as_eq_9_has_it() {
    let (force, l) = (1e-3, LENGTHS[0]);
    let beam = chain(1, Shapes { x: 2, y: 2, torsion: 1 }, 0.1);
    let off = |how: Reduction| {
        let design = with_tables(&beam, &[0], (20, how));
        let (arm, p) = arm_of(&design);
        let rest = equilibrium(&arm, &p, &[0.0; 2], [0.0, force, 0.0]).unwrap();
        let found = output(&arm, &p, &rest.state, "tipDeflection")[1];
        let f = &beam.flexures[0];
        let exact = force * l.powi(3) / (3.0 * f.youngs_modulus * f.area_moment[0])
            + force * l * l / beam.links[0].motor.stiffness;
        found / exact - 1.0
    };
    let (exact, few) = (off(Reduction::CraigBampton(2)), off(Reduction::Free(2)));
    println!("Craig-Bampton off by {exact:.1e}, two modes with a free end by {few:.1e}");
    assert!(exact.abs() < 1e-6 && few < -1e-4, "{exact:e} {few:e}");
}

/// Checks LNK-9 with a table: DELIAN in the posture of Table 4 deflects by the same shares, and the stiffer link lifts the first
/// frequency as much.
#[test]
fn lnk9_a_table_contributes_as_its_beam() {
    let all = |design: &RobotDesign| {
        let on = standing(design, EARTH).unwrap();
        let motors = [0.0, RAISED, -RAISED, 0.0, 0.0, 0.0];
        let rest = equilibrium(&on.arm, &on.parameters, &motors, [0.0; 3]).unwrap();
        contributions(&on.arm, &on.parameters, &rest, [0.0; 3]).unwrap()
    };
    // A table does not give the shortening of its link by bending, so the beam must do without that, too.
    let beams = RobotDesign { axial_stiffening: Some(false), ..delian() };
    let wanted = all(&beams);
    let found = all(&with_tables(&beams, &[1], (20, Reduction::CraigBampton(1))));
    assert_eq!(wanted.len(), found.len());
    for (a, b) in wanted.iter().zip(&found) {
        println!(
            "{}: {:.6} {:.6} rad, rise {:.5} {:.5}, energy {:.5} {:.5}",
            a.element, a.deflection, b.deflection, a.rise, b.rise, a.energy, b.energy
        );
        assert_eq!(a.element, b.element);
        assert!((a.deflection - b.deflection).abs() < 1e-4 * a.deflection.abs() + 1e-9);
        assert!((a.rise - b.rise).abs() < 1e-4 && (a.energy - b.energy).abs() < 1e-3);
    }
}
