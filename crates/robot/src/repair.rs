//! Inertias that no body of matter has, changed into the nearest ones that some body has.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::vector::Matrix3 as Inertia;

/// Share of the largest second moment that every other one has at least: a rod as thin as 1/30 of its length.
const THINNEST: f64 = 1e-3;

/// Repairs all inertias of a design; returns what it changed.
pub(super) fn repair(design: &mut RobotDesign) -> Vec<String> {
    let mut notes = Vec::new();
    let mut one = |name: &str, inertia: &mut Inertia<f64>| {
        if let Some((repaired, said)) = repaired(inertia) {
            notes.push(format!("`{name}`: {said}"));
            *inertia = repaired;
        }
    };
    if !design.held {
        one("base", &mut design.base_inertia);
    }
    design.links.iter_mut().for_each(|link| one(&link.name, &mut link.inertia));
    notes
}

/// The nearest inertia of a body, with what changed; `None`: it is one, or nothing can be made of it.
///
/// The second moments of the mass, Sigma = tr(I)/2 - I, of a body are not below 0 (Wensing and others 2018); those that are get the
/// least one.
fn repaired(inertia: &Inertia<f64>) -> Option<(Inertia<f64>, String)> {
    let given = Matrix3::from_fn(|i, k| inertia[i][k]);
    if !given.iter().all(|v| v.is_finite()) {
        return None;
    }
    let symmetric = 0.5 * (given + given.transpose());
    let askew = (given - symmetric).norm() > 1e-9 * symmetric.norm();
    let second = Matrix3::identity() * (0.5 * symmetric.trace()) - symmetric;
    let moments = SymmetricEigen::new(second);
    let largest = moments.eigenvalues.max();
    let least = THINNEST * largest;
    let bad = moments.eigenvalues.iter().any(|v| *v < -1e-9 * largest.abs());
    // A body without extent along an axis is one; a plate, a rod.
    let flat = SymmetricEigen::new(symmetric).eigenvalues.min() <= 0.0;
    if largest <= 0.0 || !(askew || bad || flat) {
        return None;
    }
    let clamped = moments.eigenvalues.map(|v| v.max(least));
    let second = moments.eigenvectors * Matrix3::from_diagonal(&clamped) * moments.eigenvectors.transpose();
    let whole = Matrix3::identity() * second.trace() - second;
    let shown = |m: &Matrix3<f64>| {
        let mut all: Vector3<f64> = SymmetricEigen::new(*m).eigenvalues;
        all.as_mut_slice().sort_by(f64::total_cmp);
        format!("{:.4e}, {:.4e}, {:.4e}", all[0], all[1], all[2])
    };
    let askew = if askew { "its inertia is made symmetric, and " } else { "" };
    let said =
        format!("{askew}its principal moments {} are changed to {} kg.m2", shown(&symmetric), shown(&whole));
    // Symmetric to the last bit.
    let exact = |i: usize, k: usize| 0.5 * (whole[(i, k)] + whole[(k, i)]);
    Some((std::array::from_fn(|i| std::array::from_fn(|k| exact(i, k))), said))
}
