//! Outputs of what a pose is worth: against the matrices of the papers, their derivatives against differences.

use nalgebra::DMatrix;
use trueup_models::space::attitude::rotation;
use trueup_models::space::design::{DesignTip, RobotDesign};
use trueup_models::space::measures::{measure, singular};
use trueup_models::space::presets;
use trueup_models::space::spatial::SpatialFrame;

use super::{Flyer, everything};
use crate::arm_common::Random;

/// Measures of force, torque and both of a tip, smallest singular value and product of all, by the long way.
fn by_matrices(design: &RobotDesign, tip: &DesignTip, x: &[f64], f: &Flyer) -> [(f64, f64); 5] {
    let (robot, s) = (design.unbent(), design.structure());
    let q = &x[f.at.joint_angle..][..s.bodies()];
    let all = robot.reaction(q, tip.mount).inertial;
    let arm: Vec<usize> = s.tree.arm(tip.body).collect();
    // The determinant, and what it would be with columns across each other: of what has no rank it is rounding of that.
    let gram = |rows: usize, of: &dyn Fn(usize, usize) -> f64| {
        let b = DMatrix::from_fn(rows, arm.len(), |i, j| of(i, arm[j] - 1));
        let most: f64 = b.column_iter().map(|c| c.norm_squared()).product();
        ((b.transpose() * b).determinant(), most)
    };
    let force = gram(3, &|i, j| all[j].force[i]);
    let torque = gram(3, &|i, j| all[j].torque[i]);
    let both = gram(6, &|i, j| if i < 3 { all[j].force[i] } else { all[j].torque[i - 3] });
    let origin = if s.held { [0.0; 3] } else { [0.4, -0.3, 0.2] };
    let frame = SpatialFrame { rotation: rotation([0.9, 0.1, -0.3, 0.3]), origin };
    let form = robot.momentum_form(frame, q, (tip.body, tip.offset));
    let j = if s.held { form.j_m.clone() } else { form.generalized_jacobian().unwrap() };
    let values = DMatrix::from_row_slice(6, s.bodies(), &j).singular_values();
    let product: f64 = values.iter().product();
    [force, torque, both, (values.min(), values.max()), (product, product.max(1.0))]
}

fn analysed(design: RobotDesign) -> RobotDesign {
    RobotDesign { analysis: true, ..design }
}

/// Checks SFF-4 and SFF-10, unbent, with base free and held, of one arm and of two (one of nine joints).
#[test]
fn outputs_are_what_the_matrices_say() {
    let mut random = Random(21);
    let mut most = 0.0_f64;
    for design in [
        presets::table_1(),
        presets::table_1_with_panels(),
        presets::chaser(),
        presets::test_bed(),
        everything(false, true),
        everything(true, false),
    ] {
        // Rotors are no part of S1 and S2.
        let mut design = analysed(design);
        design.links.iter_mut().for_each(|l| l.motor.inertia = if l.motor.flexible { 0.3 } else { 0.0 });
        let f = Flyer::of(&design);
        for _ in 0..20 {
            let (mut x, u) = f.anywhere(&mut random);
            x[f.at.modal_coordinate..][..design.structure().modes()].fill(0.0);
            let y = f.outputs(&x, &u);
            let o = &f.output;
            for (a, tip) in design.tips.iter().enumerate() {
                let places = [
                    o.force_measure,
                    o.torque_measure,
                    o.combined_measure,
                    o.jacobian_smallest,
                    o.manipulability,
                ];
                let wanted = by_matrices(&design, tip, &x, &f);
                for (k, (place, (wanted, size))) in places.into_iter().zip(wanted).enumerate() {
                    let found = y[place + a];
                    let off = (found - wanted).abs() / size;
                    assert!(off < 1e-12, "{} tip {a}: {k}: {found:e}, not {wanted:e}", design.name);
                    most = most.max(off);
                }
            }
        }
    }
    println!("analysis: off by {most:.1e}");
}

/// Exact derivatives against central differences; bent, so that panels count.
#[test]
fn their_derivatives_are_exact() {
    let mut random = Random(22);
    let mut most = 0.0_f64;
    for design in [presets::table_1_with_panels(), presets::chaser(), everything(false, true)] {
        let f = Flyer::of(&analysed(design));
        let (first, last) = (f.output.force_measure, f.output.count);
        for _ in 0..20 {
            let (x, u) = f.anywhere(&mut random);
            let slope = random.vector(x.len(), 1.0);
            let (y, rate) = f.along(&x, &slope, &u);
            assert_eq!(y[first..last], f.outputs(&x, &u)[first..last]);
            let at = |h: f64| {
                let x: Vec<f64> = x.iter().zip(&slope).map(|(x, d)| x + h * d).collect();
                f.outputs(&x, &u)
            };
            let h = 5e-4;
            let [a, b, c, d] = [at(-2.0 * h), at(-h), at(h), at(2.0 * h)];
            for k in first..last {
                let wanted = (a[k] - 8.0 * b[k] + 8.0 * c[k] - d[k]) / (12.0 * h);
                let size = rate[k].abs().max(y[k].abs()).max(1e-3);
                most = most.max((rate[k] - wanted).abs() / size);
            }
        }
    }
    println!("derivatives of the analysis: off by {most:.1e}");
    assert!(most < 1e-6);
}

/// Columns that depend on each other, values that coincide, an arm of more joints than the twist has parts.
#[test]
fn what_has_no_rank_is_nothing_and_finite() {
    let flat = [[1.0, 2.0, 0.0], [2.0, 4.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(measure(flat.into_iter()), 0.0);
    assert_eq!(measure([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].into_iter()), 0.0);
    let unit = |k: usize| {
        let mut e = [0.0; 6];
        e[k] = 2.0;
        e
    };
    assert_eq!(singular(&[0, 1, 2, 3, 4, 5].map(unit)), (2.0, 64.0));
    assert_eq!(singular(&[unit(0), unit(0)]).0, 0.0);
    let (least, all) = singular(&[0, 1, 2, 3, 4, 5, 5].map(unit));
    assert!((least - 2.0).abs() < 1e-15 && (all - 64.0 * 2.0_f64.sqrt()).abs() < 1e-13);
    // Of seven joints in a plane three singular values are left.
    assert_eq!(singular(&[0, 1, 5, 0, 1, 5, 1].map(unit)), (0.0, 0.0));
}
