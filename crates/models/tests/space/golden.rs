//! Golden facts B01-B33 (arm of S1 on a base) and C17-C28 (chaser of S2).

use nalgebra::DMatrix;
use trueup_models::space::analysis::{MomentumForm, SpatialColumn};
use trueup_models::space::articulated::{JointDrive, Moves, Rotor};
use trueup_models::space::attitude::rotation;
use trueup_models::space::composite::{forces, momentum};
use trueup_models::space::measures::{measures, singular};
use trueup_models::space::presets;
use trueup_models::space::snapshot::RobotSnapshot;
use trueup_models::space::spatial::{SpatialFrame, SpatialMotion};
use trueup_models::space::vector::{add, cross, scale, times, transposed_times};

use super::facts::fact;

/// The pose of C17-C28.
const POSITION: [f64; 3] = [0.4, -0.3, 0.2];
const QUATERNION: [f64; 4] = [0.9, 0.1, -0.3, 0.3];
const ANGLES: [f64; 6] = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5];
const BASE_VELOCITY: [f64; 3] = [0.02, -0.01, 0.03];
const BASE_RATE: [f64; 3] = [0.01, 0.02, -0.015];
const RATES: [f64; 6] = [0.1, -0.2, 0.15, 0.3, -0.1, 0.2];

fn near(id: &str, found: &[f64], tolerance: f64) {
    let wanted = fact(id);
    assert_eq!(wanted.len(), found.len(), "{id}");
    let off = wanted.iter().zip(found).map(|(w, f)| (w - f).abs()).fold(0.0, f64::max);
    println!("{id}: off by {off:.1e}");
    assert!(off <= tolerance, "{id}: {found:?}, not {wanted:?}");
}

fn rows(columns: &[SpatialColumn<f64>], part: fn(&SpatialColumn<f64>) -> [f64; 3]) -> Vec<f64> {
    (0..3).flat_map(|i| columns.iter().map(move |c| part(c)[i]).collect::<Vec<_>>()).collect()
}

/// Checks SFF-3 and SFF-4.
#[test]
fn b01_to_b33_the_arm_pulls_at_its_base_as_the_paper_says() {
    let robot = presets::table_1().robot();
    for (degrees, ids, worth) in [
        ([20.0_f64, 40.0, -60.0], ["B01", "B02", "B19", "B20", "B21", "B22"], "B31"),
        ([-75.0, 100.0, 30.0], ["B15", "B16", "B23", "B24", "B25", "B26"], "B32"),
        ([130.0, -25.0, 95.0], ["B17", "B18", "B27", "B28", "B29", "B30"], "B33"),
    ] {
        let r = robot.reaction(&degrees.map(f64::to_radians), [0.0; 3]);
        let pairs: Vec<SpatialColumn<f64>> = r.coriolis.iter().map(|c| c.2).collect();
        assert_eq!(r.coriolis.iter().map(|c| (c.0, c.1)).collect::<Vec<_>>(), [(0, 1), (0, 2), (1, 2)]);
        near(ids[0], &rows(&r.inertial, |c| c.force), 1e-10);
        near(ids[1], &rows(&r.inertial, |c| c.torque), 1e-10);
        near(ids[2], &rows(&pairs, |c| c.force), 1e-10);
        near(ids[3], &rows(&r.centrifugal, |c| c.force), 1e-10);
        near(ids[4], &rows(&pairs, |c| c.torque), 1e-10);
        near(ids[5], &rows(&r.centrifugal, |c| c.torque), 1e-10);
        let all = r.inertial.iter();
        for (found, wanted) in measures(all.clone(), all.clone().take(2)).iter().zip(fact(worth)) {
            assert!((found / wanted - 1.0).abs() < 1e-9, "{worth}: {found}, not {wanted}");
        }
        // B06: the columns of joints 2 and 3 are parallel.
        assert_eq!(measures(all.clone(), all)[1], 0.0);
    }
}

fn form(angles: &[f64]) -> MomentumForm {
    let design = presets::chaser();
    let base = SpatialFrame { rotation: rotation(QUATERNION), origin: POSITION };
    design.robot().momentum_form(base, angles, (design.tips[0].body, design.tips[0].offset))
}

/// Checks SFF-7, SFF-8 and SFF-10.
#[test]
fn c17_to_c22_matrices_of_the_chaser() {
    let m = form(&ANGLES);
    let upper: Vec<f64> =
        (0..12).flat_map(|i| (i..12).map(move |j| (i, j))).map(|(i, j)| m.mass[12 * i + j]).collect();
    near("C17", &upper, 1e-9);
    near("C19", &m.j_m, 1e-12);
    near("C20", &m.tip, 1e-12);
    let j_g = m.generalized_jacobian().unwrap();
    near("C21", &j_g, 1e-11);
    let [of_m, of_g] = [&m.j_m, &j_g].map(|j| DMatrix::from_row_slice(6, 6, j));
    let smallest = |j: &DMatrix<f64>| j.singular_values().min();
    near("C22", &[of_m.determinant(), of_g.determinant(), smallest(&of_m), smallest(&of_g)], 1e-10);
    let columns = |j: &[f64]| [0, 1, 2, 3, 4, 5].map(|c| [0, 1, 2, 3, 4, 5].map(|r| j[6 * r + c]));
    let [own, floating] = [&m.j_m, &j_g].map(|j| singular(&columns(j)));
    let signed = |(_, product): (f64, f64), det: f64| product * det.signum();
    let products = [signed(own, of_m.determinant()), signed(floating, of_g.determinant())];
    near("C22", &[products[0], products[1], own.0, floating.0], 1e-10);
    // H2^-1 H3 about the inertial origin is what the generalized Jacobian took from the masses.
    let (h2, h3) = (DMatrix::from_row_slice(6, 6, &m.h2), DMatrix::from_row_slice(6, 6, &m.h3));
    let by_h = &of_m - DMatrix::from_row_slice(6, 6, &m.j_s) * h2.lu().solve(&h3).unwrap();
    assert!((by_h - &of_g).amax() < 1e-11);
}

/// Checks SFF-9 and SFF-11.
#[test]
fn c18_and_c24_bias_and_momenta_of_the_chaser() {
    let robot = presets::chaser().robot();
    let turned = rotation(QUATERNION);
    let own = |v| transposed_times(&turned, v);
    let velocity = SpatialMotion { angular: own(BASE_RATE), linear: own(BASE_VELOCITY) };
    let placed = robot.tree.place(
        &robot.bodies,
        (SpatialFrame { rotation: turned, origin: POSITION }, velocity),
        &ANGLES,
        &RATES,
    );
    let drives = RATES.map(|rate| JointDrive {
        moves: Moves::Driven(0.0),
        rotor: Rotor::Geared,
        inertia: 0.0,
        share: 0.0,
        rate,
    });
    // The centre of mass does not accelerate: what the spatial acceleration has beyond it is omega x v.
    let still =
        SpatialMotion { angular: [0.0; 3], linear: scale(-1.0, cross(velocity.angular, velocity.linear)) };
    let mut c = [0.0; 12];
    let now = RobotSnapshot::rigid(&robot.tree, &robot.base, &robot.bodies, &placed, &drives);
    forces(&now, (still, &[0.0; 6], &[0.0; 6]), &[], &mut c);
    let (force, torque) = (times(&turned, [c[0], c[1], c[2]]), times(&turned, [c[3], c[4], c[5]]));
    near("C18", &[&force[..], &torque, &c[6..]].concat(), 1e-10);
    let (h, energy) = momentum(&now);
    let p = times(&turned, h.force);
    let l = add(times(&turned, h.torque), cross(POSITION, p));
    near("C24", &[&p[..], &l, &[energy]].concat(), 1e-9);
    // Checks (9): H2 (v, omega) + H3 theta' is that momentum.
    let m = form(&ANGLES);
    let twist = [BASE_VELOCITY, BASE_RATE].concat();
    for (i, wanted) in p.iter().chain(&l).enumerate() {
        let found: f64 = (0..6).map(|k| m.h2[6 * i + k] * twist[k] + m.h3[6 * i + k] * RATES[k]).sum();
        assert!((found - wanted).abs() < 1e-10, "{i}: {found}, not {wanted}");
    }
}

/// Checks (13) of S2: joint rates for a twist of the tip, with a momentum that is not 0.
#[test]
fn c25_and_c26_inverse_kinematics_and_effective_mass() {
    let m = form(&ANGLES);
    let matrix = |v: &[f64]| DMatrix::from_row_slice(6, v.len() / 6, v);
    let momentum = DMatrix::from_column_slice(6, 1, &fact("C24")[..6]);
    let by_momentum = matrix(&m.j_s) * matrix(&m.h2).lu().solve(&momentum).unwrap();
    let twist = DMatrix::from_column_slice(6, 1, &[0.02, 0.01, -0.015, 0.01, -0.005, 0.02]);
    let rates = matrix(&m.generalized_jacobian().unwrap()).lu().solve(&(twist - by_momentum)).unwrap();
    near("C25", rates.as_slice(), 1e-9);
    // 1 / (e^T J M^-1 J^T e): base free with all coordinates, base held with the joints alone.
    let all = DMatrix::from_row_slice(12, 12, &m.mass);
    let whole = DMatrix::from_fn(6, 12, |i, j| if j < 6 { m.j_s[6 * i + j] } else { m.j_m[6 * i + j - 6] });
    let held = all.view((6, 6), (6, 6)).clone_owned();
    let mass = |j: &DMatrix<f64>, m: &DMatrix<f64>| {
        let mobility = j * m.clone().lu().solve(&j.transpose()).unwrap();
        [0, 1, 2].map(|k| 1.0 / mobility[(k, k)])
    };
    near("C26", &[mass(&whole, &all), mass(&matrix(&m.j_m), &held)].concat(), 1e-8);
}

/// Singularities of the arm and of the floating robot are not the same (SFF-10).
#[test]
fn c27_and_c28_dynamic_singularities() {
    type Of = fn(&MomentumForm) -> Vec<f64>;
    let kinds: [(&str, Of); 2] = [("C27", |m| m.j_m.clone()), ("C28", |m| m.generalized_jacobian().unwrap())];
    for (id, of) in kinds {
        let det = |third: f64| {
            let mut angles = ANGLES;
            angles[2] = third;
            DMatrix::from_row_slice(6, 6, &of(&form(&angles))).determinant()
        };
        let mut roots = Vec::new();
        for k in 0..60 {
            // Off the round numbers: det J_M is 0 at 0.
            let (mut a, mut b) = (-3.0 + 0.1 * f64::from(k) + 0.013, -2.9 + 0.1 * f64::from(k) + 0.013);
            if det(a) * det(b) > 0.0 {
                continue;
            }
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if det(a) * det(middle) <= 0.0 { b = middle } else { a = middle }
            }
            roots.push(0.5 * (a + b));
        }
        near(id, &roots, 1e-9);
    }
}

/// SPART's H0, H0m, Hm, Jacobians and generalized Jacobian: an implementation of others (in Matlab), run once.
/// Checks SFF-7, SFF-8 and SFF-10.
#[test]
fn the_matrices_of_the_chaser_are_those_of_spart() {
    let values = include_str!("spart-chaser.csv");
    let spart = |name: &str| {
        let line = values.lines().find(|l| l.split(',').next() == Some(name)).unwrap();
        let numbers: Vec<f64> = line.split(',').skip(3).map(|v| v.parse().unwrap()).collect();
        DMatrix::from_row_slice(6, 6, &numbers)
    };
    let m = form(&ANGLES);
    let all = DMatrix::from_row_slice(12, 12, &m.mass);
    let part = |i: usize, j: usize| all.view((i, j), (6, 6)).clone_owned();
    // Angular parts first, there.
    let turned = |k: usize| (k + 3) % 6;
    let rows = |m: &DMatrix<f64>| DMatrix::from_fn(6, 6, |i, j| m[(turned(i), j)]);
    let both = |m: &DMatrix<f64>| DMatrix::from_fn(6, 6, |i, j| m[(turned(i), turned(j))]);
    let matrix = |v: &[f64]| DMatrix::from_row_slice(6, 6, v);
    let j_g = matrix(&m.generalized_jacobian().unwrap());
    for (name, mine) in [
        ("H0", both(&part(0, 0))),
        ("H0m", rows(&part(0, 6))),
        ("Hm", part(6, 6)),
        ("J0", both(&matrix(&m.j_s))),
        ("Jm", rows(&matrix(&m.j_m))),
        ("Jg", rows(&j_g)),
    ] {
        let off = (spart(name) - &mine).amax() / mine.amax();
        println!("SPART's {name}: off by {off:.1e}");
        assert!(off < 1e-13, "{name}: {off:e}");
    }
}
