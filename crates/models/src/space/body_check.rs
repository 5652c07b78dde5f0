//! What no rigid body has: a quaternion that is not of length 1, an inertia that is none.

use super::attitude::{Quaternion, square};
use super::vector::{Matrix3, cross, dot};

/// How far rounding in a file may take an inertia off symmetry and off the triangle inequality, relative.
const ROUNDING: f64 = 1e-6;

/// |Q| may be off 1 by this much.
pub(super) const NOT_UNIT: f64 = 1e-3;

/// A quaternion is not of length 1.
pub(crate) fn off_unit(q: Quaternion<f64>) -> bool {
    let off = (square(q).sqrt() - 1.0).abs();
    off > NOT_UNIT || off.is_nan()
}

/// What keeps a matrix from being a body's inertia about its centre of mass.
pub(crate) fn inertia_fault(i: &Matrix3<f64>) -> Option<String> {
    let size = i[0][0].abs() + i[1][1].abs() + i[2][2].abs();
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        if (i[a][b] - i[b][a]).abs() > ROUNDING * size {
            return Some(format!(
                "inertia[{},{}] = {} but inertia[{},{}] = {}: an inertia is symmetric; give both the same value",
                a + 1,
                b + 1,
                i[a][b],
                b + 1,
                a + 1,
                i[b][a]
            ));
        }
    }
    let moments = principal(i);
    if moments[0] <= 0.0 {
        return Some(format!(
            "its principal moments of inertia are {:.4e}, {:.4e}, {:.4e}: all must be above 0; see the signs of the products (the off-diagonal elements are minus the integrals of x y)",
            moments[0], moments[1], moments[2]
        ));
    }
    None
}

/// What no body of matter has, though its motion can be computed: published tables and identified robots have it.
pub(super) fn inertia_doubt(i: &Matrix3<f64>) -> Option<String> {
    let moments = principal(i);
    (moments[2] > (moments[0] + moments[1]) * (1.0 + ROUNDING)).then(|| {
        format!(
            "its principal moments of inertia are {:.4e}, {:.4e}, {:.4e}: no body has one larger than the sum of the other two; is the inertia about another point than the centre of mass, or a unit wrong?",
            moments[0], moments[1], moments[2]
        )
    })
}

/// Eigenvalues of a symmetric matrix, ascending (Smith 1961).
fn principal(m: &Matrix3<f64>) -> [f64; 3] {
    let off = m[0][1] * m[0][1] + m[0][2] * m[0][2] + m[1][2] * m[1][2];
    let mean = (m[0][0] + m[1][1] + m[2][2]) / 3.0;
    let spread = (0..3).map(|k| (m[k][k] - mean).powi(2)).sum::<f64>() + 2.0 * off;
    let p = (spread / 6.0).sqrt();
    if p == 0.0 {
        return [mean; 3];
    }
    let b: Matrix3<f64> =
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| (m[i][j] - if i == j { mean } else { 0.0 }) / p));
    let det = dot(b[0], cross(b[1], b[2]));
    let angle = (0.5 * det).clamp(-1.0, 1.0).acos() / 3.0;
    let third = 2.0 * std::f64::consts::PI / 3.0;
    let largest = mean + 2.0 * p * angle.cos();
    let smallest = mean + 2.0 * p * (angle + third).cos();
    [smallest, 3.0 * mean - largest - smallest, largest]
}

#[cfg(test)]
mod tests {
    use super::{cross, dot, principal};

    #[test]
    fn principal_moments_are_those_of_the_invariants() {
        let m = [[4.0, 1.0, -2.0], [1.0, 3.0, 0.5], [-2.0, 0.5, 5.0]];
        let e = principal(&m);
        let det = dot(m[0], cross(m[1], m[2]));
        assert!((e.iter().sum::<f64>() - 12.0).abs() < 1e-13 && e[0] < e[1] && e[1] < e[2]);
        assert!((e.iter().product::<f64>() - det).abs() < 1e-12, "{e:?} {det}");
        assert_eq!(principal(&[[2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]]), [2.0; 3]);
    }
}
