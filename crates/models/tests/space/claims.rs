//! What S1 states of its arm and what holds of beams, at any pose: golden facts B03, B05, B09-B14, B35-B37; and the chaser's momentum
//! form and the plane at theirs: C23, C29.

use nalgebra::{DMatrix, DVector};
use trueup_models::space::analysis::{SpatialColumn, norm};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::attitude::rotation;
use trueup_models::space::measures::measure;
use trueup_models::space::presets;
use trueup_models::space::shapes::bending;
use trueup_models::space::spatial::{SpatialFrame, SpatialMotion};
use trueup_models::space::vector::{add, cross, times, transposed_times};

use super::flexible_golden::{arms, at_rest, bent, frequencies, panels, roots};
use crate::arm_common::Random;
use crate::arm_golden::A01;

/// Mass times distance of what hangs on joints 2 and 3 of S1's table 1, kg.m: 5 x 0.75 + 3 x 1.5, 3 x 0.4.
const HANGS: [f64; 2] = [8.25, 1.2];

fn forces(columns: &[SpatialColumn<f64>]) -> Vec<[f64; 3]> {
    columns.iter().map(|c| c.force).collect()
}

/// Checks SFF-4: B03, the force's measure in closed form; B05, it vanishes on theta_3 = 0 and 180 degrees and where
/// A2 cos(theta_2) + A3 cos(theta_2 + theta_3) = 0.
#[test]
fn b03_b05_the_measure_of_the_force_is_a_closed_form() {
    let robot = presets::table_1().robot();
    let [a2, a3] = HANGS;
    let worth = |q: &[f64; 3]| measure(forces(&robot.reaction(q, [0.0; 3]).inertial).into_iter());
    let formula =
        |q: &[f64; 3]| (a2 * a3 * q[2].sin() * (a2 * q[1].cos() + a3 * (q[1] + q[2]).cos())).powi(2);
    let mut random = Random(3);
    let mut off = 0.0_f64;
    for _ in 0..500 {
        let q = random.vector(3, 3.0).try_into().unwrap();
        off = off.max((worth(&q) - formula(&q)).abs() / 6945.0);
    }
    println!("B03: off by {off:.1e} of the largest");
    assert!(off < 1e-12);
    for k in 0..100 {
        let turned = 0.06 * f64::from(k);
        for q in [[0.3, turned, 0.0], [0.3, turned, std::f64::consts::PI]] {
            assert!(worth(&q).abs() < 1e-9, "{q:?}: {}", worth(&q));
        }
        // tan(theta_2) = (A2 + A3 cos theta_3) / (A3 sin theta_3)
        let q = [0.3, (a2 + a3 * turned.cos()).atan2(a3 * turned.sin()), turned];
        assert!(worth(&q).abs() < 1e-9, "{q:?}: {}", worth(&q));
    }
}

/// Checks SFF-3: B09, a joint that turns at 1 rad/s pulls as hard as one that begins to at 1 rad/s2.
#[test]
fn b09_centrifugal_columns_are_as_long_as_inertial_ones() {
    let robot = presets::table_1().robot();
    let mut random = Random(4);
    for _ in 0..200 {
        let r = robot.reaction(&random.vector(3, 3.0), [0.0; 3]);
        for (inertial, centrifugal) in forces(&r.inertial).iter().zip(forces(&r.centrifugal)) {
            let off = norm(&[*inertial]) - norm(&[centrifugal]);
            assert!(off.abs() < 1e-12 * HANGS[0].max(1.0) * 2.0, "{off:e}");
        }
    }
}

/// B10: how far the printed inertias of the links are from those of slender rods.
#[test]
fn b10_the_printed_inertias_are_no_rods() {
    let design = presets::table_1();
    let lengths = [design.links[2].position[0], design.tips[0].offset[0]];
    for (k, (length, wanted)) in [1, 2].into_iter().zip(lengths.into_iter().zip([85.2273, 20.0])) {
        let link = &design.links[k];
        let share = link.mass * length * length / 12.0 / link.inertia[1][1];
        assert!((share - wanted).abs() < 1e-3, "link {}: {share}", k + 1);
    }
}

/// Checks SFF-5 and SFF-6: B11, a hub of 20 kg.m2 and 0.6 m with two beams; B12 and B13, assumed modes come down on its frequencies.
#[test]
fn b11_to_b13_a_hub_with_two_beams() {
    let exact = roots(bent(200.0, 20.0, 0.0, 1.0));
    let wanted = [5.758943149470699, 20.9270585298704, 55.38735753115567];
    for (found, wanted) in exact.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-6, "B11: {found}, not {wanted}");
    }
    let mut last = [f64::INFINITY; 3];
    for shapes in 1..=6 {
        let mut m = arms(0);
        m.base.inertia[0][0] = 20.0;
        m.beams = panels(0.0, Shapes { x: shapes, y: shapes, torsion: 0 });
        let found = frequencies(&m, &at_rest(&m.layout()));
        for (k, last) in last.iter_mut().enumerate().take(shapes.min(3)) {
            let nearest = |a: &&f64, b: &&f64| (**a - wanted[k]).abs().total_cmp(&(**b - wanted[k]).abs());
            let error = found.iter().min_by(nearest).unwrap() / wanted[k] - 1.0;
            assert!(error > 0.0 && error < *last, "B12: {shapes} shapes, frequency {}: {error:e}", k + 1);
            *last = error;
        }
    }
    println!("B13: {:.1e} with six shapes", last[0]);
    assert!(last[0] < 1e-6);
}

/// Checks SFF-5: B14, the roots of a clamped beam.
#[test]
fn b14_clamped_roots() {
    for j in 0..4 {
        let root = bending(j).unwrap().root;
        let left = 1.0 + root.cos() * root.cosh();
        assert!(left.abs() < 1e-9, "{j}: {left:e}");
    }
}

/// Checks SFF-3: B34-B37, the largest pulls of rates of 1 rad/s, where they are.
#[test]
fn b34_to_b37_the_largest_pulls_of_rates() {
    let robot = presets::table_1().robot();
    let pulls = |angles: [f64; 2]| {
        let r = robot.reaction(&[0.0, angles[0].to_radians(), angles[1].to_radians()], [0.0; 3]);
        let pairs: Vec<SpatialColumn<f64>> = r.coriolis.iter().map(|c| c.2).collect();
        let torques = |columns: &[SpatialColumn<f64>]| columns.iter().map(|c| c.torque).collect::<Vec<_>>();
        [norm(&forces(&r.centrifugal)), norm(&torques(&pairs)), norm(&torques(&r.centrifugal))]
    };
    for (k, (id, wanted, at)) in [
        ("B35", 13.418084811179275, [179.99999884109945, 1.436416837571838e-06]),
        ("B36", 33.41223017100176, [89.99999944534216, 1.8231020347459975e-06]),
        ("B37", 9.163003958085527, [40.03703835791672, 0.9476001651992754]),
    ]
    .into_iter()
    .enumerate()
    {
        // The fact has their magnitudes.
        let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
        let found = signs.map(|s| pulls([s[0] * at[0], s[1] * at[1]])[k]).into_iter().fold(0.0, f64::max);
        println!("{id}: off by {:.1e}", found - wanted);
        assert!((found - wanted).abs() < 1e-7, "{id}: {found}");
        for i in 0..72 {
            for j in 0..72 {
                let elsewhere = pulls([5.0 * f64::from(i), 5.0 * f64::from(j)])[k];
                assert!(elsewhere < wanted + 1e-9, "{id}: {elsewhere} at {i}, {j}");
            }
        }
    }
}

/// Checks SFF-8 to SFF-10: C23, S2 (9), (12) and (14) at the pose of C17.
#[test]
fn c23_the_momentum_form_at_a_pose() {
    let design = presets::chaser();
    let (robot, tip) = (design.robot(), (design.tips[0].body, design.tips[0].offset));
    let turned = rotation([0.9, 0.1, -0.3, 0.3]);
    let base = SpatialFrame { rotation: turned, origin: [0.4, -0.3, 0.2] };
    let (angles, rates) = ([0.3, -0.9, 1.4, 0.2, -0.6, 0.5], [0.1, -0.2, 0.15, 0.3, -0.1, 0.2]);
    let (velocity, omega) = ([0.02, -0.01, 0.03], [0.01, 0.02, -0.015]);
    let form = robot.momentum_form(base, &angles, tip);
    let own = |v| transposed_times(&turned, v);
    let moving = SpatialMotion { angular: own(omega), linear: own(velocity) };
    let placed = robot.tree.place(&robot.bodies, (base, moving), &angles, &rates);
    // Momenta body by body, in inertial axes: the frames one after the other.
    let (mut here, mut p, mut l) = (base, [0.0; 3], [0.0; 3]);
    let mut tip_twist = ([0.0; 3], [0.0; 3]);
    for k in 0..=6 {
        if k > 0 {
            here = here.then(&placed[k].frame);
        }
        let (body, own) = (if k == 0 { &robot.base } else { &robot.bodies[k].rigid }, placed[k].velocity);
        let turn = times(&here.rotation, own.angular);
        let center = body.first.map(|f| f / body.mass);
        let at = add(here.origin, times(&here.rotation, center));
        let speed = times(&here.rotation, add(own.linear, cross(own.angular, center)));
        let push = speed.map(|v| v * body.mass);
        // About the origin of the body less what its centre carries: the spin about the centre.
        let about = add(times3(&body.inertia, own.angular), cross(body.first, own.linear));
        let carried = cross(center, transposed_times(&here.rotation, push));
        let spin = times(&here.rotation, [0, 1, 2].map(|i| about[i] - carried[i]));
        p = add(p, push);
        l = add(l, add(spin, cross(at, push)));
        if k == tip.0 {
            tip_twist = (times(&here.rotation, add(own.linear, cross(own.angular, tip.1))), turn);
        }
    }
    let by = |m: &[f64], v: &[f64], i: usize| (0..6).map(|k| m[6 * i + k] * v[k]).sum::<f64>();
    let twist = [velocity, omega].concat();
    let momentum = [p, l].concat();
    let at_tip = [tip_twist.0, tip_twist.1].concat();
    let h2 = DMatrix::from_row_slice(6, 6, &form.h2);
    let left: Vec<f64> = (0..6).map(|i| momentum[i] - by(&form.h3, &rates, i)).collect();
    let base_twist = h2.lu().solve(&DVector::from_row_slice(&left)).unwrap();
    let mut off = [0.0_f64; 3];
    for i in 0..6 {
        off[0] = off[0].max((by(&form.h2, &twist, i) + by(&form.h3, &rates, i) - momentum[i]).abs());
        off[1] = off[1].max((by(&form.j_s, &twist, i) + by(&form.j_m, &rates, i) - at_tip[i]).abs());
        off[2] = off[2].max((base_twist[i] - twist[i]).abs());
    }
    println!("C23: (9) {:.1e}, (12) {:.1e}, (14) {:.1e}", off[0], off[1], off[2]);
    assert!(off.iter().all(|o| *o < 1e-10), "{off:?}");
    assert!(norm(&[p]) > 0.1 && norm(&[l]) > 0.1);
}

fn times3(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// C29: in the plane, S0's test-bed has the mass matrix of A01, with rigid joints.
#[test]
fn c29_the_mass_matrix_in_the_plane_is_a01() {
    let design = presets::test_bed();
    let angles = [7.5_f64, -15.0, -22.5].map(f64::to_radians);
    let base = SpatialFrame { rotation: rotation([1.0, 0.0, 0.0, 0.0]), origin: [0.0; 3] };
    let m = design.robot().momentum_form(base, &angles, (design.tips[0].body, design.tips[0].offset)).mass;
    let rows = [0, 1, 5, 6, 7, 8];
    let mut want = A01.iter();
    let mut off = 0.0_f64;
    for i in 0..6 {
        for j in i..6 {
            off = off.max((m[9 * rows[i] + rows[j]] - want.next().unwrap()).abs());
        }
    }
    println!("C29: off by {off:.1e}");
    assert!(off < 1e-12 * A01[0]);
}
