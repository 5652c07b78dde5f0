//! Shapes of a link between two joints (LNK-1, LNK-5): polynomials that are clamped at z = 0, among them those by which a
//! uniform beam bends under a force and a moment at its end. So deflection and slope of the end are exact at rest, whatever the
//! load, from two shapes on (in torsion from one), and what the link carries may be as heavy as it likes.
//!
//! As in [`super::shapes`], all is for a beam of length 1 and shapes of value 1 at the end. Of `n` shapes each is a mode of
//! the beam with a free end as the polynomials of that many terms have it (Rayleigh and Ritz), so they are orthogonal.

use super::shapes::BeamShape;
use std::sync::LazyLock;

/// Most shapes of one link in one direction.
pub const MAX_LINK_SHAPES: usize = 5;

/// Coefficients of powers of z, from the lowest that a clamped end leaves.
type Polynomial = [f64; MAX_LINK_SHAPES];

/// A shape of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkShape {
    /// Its integrals; `root` as its frequency has it.
    pub shape: BeamShape,
    /// Its slope at the end (bending).
    pub slope: f64,
    /// Coefficients of z^2 (torsion: z) and of the powers above.
    coefficients: Polynomial,
}

/// A value for each pair of shapes.
pub type Pairs = [[f64; MAX_LINK_SHAPES]; MAX_LINK_SHAPES];

/// Of h(z), the displacement by pairs of shapes of a link of length 1.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moments {
    /// h(1).
    pub end: Pairs,
    /// Integral of h.
    pub area: Pairs,
    /// Integral of z h.
    pub moment: Pairs,
}

/// What pairs of shapes of a link of length 1 displace to second order (LNK-4, LNK-11): phi of bending, psi of torsion.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShapeQuadratics {
    /// h the integral of phi_j' phi_k' from 0 to z.
    pub slopes: Moments,
    /// Integral of (1 - z) psi_k phi_j''; bending first.
    pub shift_twist: Pairs,
    /// Half the integral of phi_j' psi_k' - phi_j'' psi_k; bending first.
    pub turn_twist: Pairs,
    /// Half the integral of phi_j' phi_k'' - phi_j'' phi_k'.
    pub turn_bending: Pairs,
}

/// By numbers of shapes of bending and of torsion.
type Quadratics = [[ShapeQuadratics; MAX_LINK_SHAPES + 1]; MAX_LINK_SHAPES + 1];
static QUADRATICS: LazyLock<Quadratics> =
    LazyLock::new(|| std::array::from_fn(|n| std::array::from_fn(|m| quadratic_of(n, m))));

fn quadratic_of(bends: usize, twists: usize) -> ShapeQuadratics {
    let mut all = ShapeQuadratics::default();
    for (j, a) in (0..bends).filter_map(|j| bending(bends, j)).enumerate() {
        let a = (&a.coefficients, BENDING.power);
        for (k, b) in (0..bends).filter_map(|k| bending(bends, k)).enumerate() {
            let b = (&b.coefficients, BENDING.power);
            // By parts: h(1) less the integral of z h', and half of h(1) less that of z^2 h'.
            let [one, z, z2] = [0, 1, 2].map(|extra| integral(a, b, [1, 1], extra));
            all.slopes.end[j][k] = one;
            all.slopes.area[j][k] = one - z;
            all.slopes.moment[j][k] = 0.5 * (one - z2);
            all.turn_bending[j][k] = 0.5 * (integral(a, b, [1, 2], 0) - integral(a, b, [2, 1], 0));
        }
        for (k, b) in (0..twists).filter_map(|k| torsion(twists, k)).enumerate() {
            let b = (&b.coefficients, TORSION.power);
            let [one, z] = [0, 1].map(|extra| integral(a, b, [2, 0], extra));
            all.shift_twist[j][k] = one - z;
            all.turn_twist[j][k] = 0.5 * (integral(a, b, [1, 1], 0) - one);
        }
    }
    all
}

/// Of so many shapes of bending and of torsion; `None` where there is no bending.
pub fn quadratic(bends: usize, twists: usize) -> Option<&'static ShapeQuadratics> {
    QUADRATICS.get(bends)?.get(twists).filter(|_| bends > 0)
}

/// Bending or torsion: the lowest power of z, how often the strain is differentiated.
#[derive(Clone, Copy)]
struct DeformationKind {
    power: i32,
    strain: i32,
}
const BENDING: DeformationKind = DeformationKind { power: 2, strain: 2 };
const TORSION: DeformationKind = DeformationKind { power: 1, strain: 1 };

/// Shapes by their number, of 0 .. [`MAX_LINK_SHAPES`] of them.
type Sets = [[LinkShape; MAX_LINK_SHAPES]; MAX_LINK_SHAPES + 1];

static BENDING_SETS: LazyLock<Sets> = LazyLock::new(|| std::array::from_fn(|n| set(BENDING, n)));
static TORSION_SETS: LazyLock<Sets> = LazyLock::new(|| std::array::from_fn(|n| set(TORSION, n)));

/// Bending shape `j` (from 0) of `n`; `None` where there is none.
pub fn bending(n: usize, j: usize) -> Option<LinkShape> {
    BENDING_SETS.get(n)?.get(j).copied().filter(|_| j < n)
}
/// Torsion shape `j` (from 0) of `n`; `None` where there is none.
pub fn torsion(n: usize, j: usize) -> Option<LinkShape> {
    TORSION_SETS.get(n)?.get(j).copied().filter(|_| j < n)
}

impl LinkShape {
    /// Of bending, at z in 0 .. 1.
    pub fn bending_at(&self, z: f64) -> f64 {
        value(&self.coefficients, BENDING.power, 0, z)
    }
    /// Slope of bending, at z in 0 .. 1.
    pub fn slope_at(&self, z: f64) -> f64 {
        value(&self.coefficients, BENDING.power, 1, z)
    }
    /// Second derivative of bending, at z in 0 .. 1.
    pub fn curvature_at(&self, z: f64) -> f64 {
        value(&self.coefficients, BENDING.power, 2, z)
    }
    /// Of torsion, at z in 0 .. 1.
    pub fn torsion_at(&self, z: f64) -> f64 {
        value(&self.coefficients, TORSION.power, 0, z)
    }
    /// Derivative of torsion, at z in 0 .. 1.
    pub fn twist_at(&self, z: f64) -> f64 {
        value(&self.coefficients, TORSION.power, 1, z)
    }
}

/// Derivative `d` of sum c_k z^(k + power) at z.
fn value(c: &Polynomial, power: i32, d: i32, z: f64) -> f64 {
    c.iter().enumerate().fold(0.0, |sum, (k, c)| {
        let p = k as i32 + power;
        sum + c * falling(p, d) * if p < d { 0.0 } else { z.powi(p - d) }
    })
}
/// p (p - 1) .. of `d` factors.
fn falling(p: i32, d: i32) -> f64 {
    (0..d).map(|i| f64::from(p - i)).product()
}
/// Integral over 0 .. 1 of z^extra times a derivative of each, of polynomials with their lowest powers.
fn integral(a: (&Polynomial, i32), b: (&Polynomial, i32), d: [i32; 2], extra: i32) -> f64 {
    let mut sum = 0.0;
    for (i, ca) in a.0.iter().enumerate() {
        for (j, cb) in b.0.iter().enumerate() {
            let (p, q) = (i as i32 + a.1, j as i32 + b.1);
            let factor = ca * cb * falling(p, d[0]) * falling(q, d[1]);
            if factor != 0.0 {
                sum += factor / f64::from(p + q - d[0] - d[1] + extra + 1);
            }
        }
    }
    sum
}

/// Integral over 0 .. 1 of derivative `d` of both.
fn product(kind: DeformationKind, a: &Polynomial, b: &Polynomial, d: i32) -> f64 {
    integral((a, kind.power), (b, kind.power), [d, d], 0)
}

fn binomial(n: i32, k: i32) -> f64 {
    (1..=k).map(|i| f64::from(n - k + i) / f64::from(i)).product::<f64>().round()
}

/// Polynomials that are orthonormal over 0 .. 1, z^power times those of Jacobi: whole coefficients, so nothing is lost.
fn orthonormal(kind: DeformationKind, n: usize) -> Vec<Polynomial> {
    if (kind.power, n) == (BENDING.power, 1) {
        // A single shape is the deflection by a force at the end.
        let c = [3.0, -1.0, 0.0, 0.0, 0.0];
        return vec![scaled(&c, 1.0 / product(kind, &c, &c, 0).sqrt())];
    }
    let weight = 2 * kind.power;
    let jacobi = |k: i32| {
        let mut c = [0.0; MAX_LINK_SHAPES];
        for s in 0..=k {
            let sign = if (k + s) % 2 == 0 { 1.0 } else { -1.0 };
            c[s as usize] = sign * binomial(k, s) * binomial(k + weight + s, k);
        }
        scaled(&c, f64::from(2 * k + weight + 1).sqrt())
    };
    (0..n as i32).map(jacobi).collect()
}

fn scaled(c: &Polynomial, by: f64) -> Polynomial {
    c.map(|c| c * by)
}

fn set(kind: DeformationKind, n: usize) -> [LinkShape; MAX_LINK_SHAPES] {
    let basis = orthonormal(kind, n);
    let mut stiffness = [[0.0; MAX_LINK_SHAPES]; MAX_LINK_SHAPES];
    for (i, a) in basis.iter().enumerate() {
        for (j, b) in basis.iter().enumerate() {
            stiffness[i][j] = product(kind, a, b, kind.strain);
        }
    }
    let mut vectors = eigenvectors(stiffness, n);
    let quotient = |v: &[f64]| {
        let row = |i: usize| stiffness[i].iter().zip(v).map(|(k, v)| k * v).sum::<f64>();
        (0..n).map(|i| v[i] * row(i)).sum::<f64>()
    };
    vectors.sort_by(|a, b| quotient(a).total_cmp(&quotient(b)));
    let mut all = [LinkShape::default(); MAX_LINK_SHAPES];
    for (to, v) in all.iter_mut().zip(&vectors) {
        let mut c = [0.0; MAX_LINK_SHAPES];
        for (b, share) in basis.iter().zip(v) {
            c.iter_mut().zip(b).for_each(|(c, b)| *c += share * b);
        }
        *to = shape(kind, scaled(&c, 1.0 / value(&c, kind.power, 0, 1.0)));
    }
    all
}

fn shape(kind: DeformationKind, c: Polynomial) -> LinkShape {
    let one_over = |extra: i32| {
        c.iter().enumerate().map(|(k, c)| c / f64::from(k as i32 + kind.power + extra + 1)).sum::<f64>()
    };
    let square = product(kind, &c, &c, 0);
    let stiffness = product(kind, &c, &c, kind.strain);
    let root = (stiffness / square).powf(0.5 / f64::from(kind.strain));
    let critical = 2.0 * (square * stiffness).sqrt();
    LinkShape {
        shape: BeamShape { root, area: one_over(0), moment: one_over(1), square, stiffness, critical },
        slope: value(&c, kind.power, 1, 1.0),
        coefficients: c,
    }
}

/// Eigenvectors of a symmetric matrix of `n` rows, by Jacobi's rotations.
fn eigenvectors(mut a: [[f64; MAX_LINK_SHAPES]; MAX_LINK_SHAPES], n: usize) -> Vec<Vec<f64>> {
    let mut v: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    for _ in 0..30 {
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] == 0.0 {
                    continue;
                }
                let half = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
                let t = half.signum() / (half.abs() + half.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let s = t * c;
                for row in &mut a {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
                for k in 0..n {
                    (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                    // Rows of `v` are the vectors.
                    (v[p][k], v[q][k]) = (c * v[p][k] - s * v[q][k], s * v[p][k] + c * v[q][k]);
                }
                (a[p][q], a[q][p]) = (0.0, 0.0);
            }
        }
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_orthogonal_in_mass_and_stiffness() {
        for kind in [BENDING, TORSION] {
            for n in 1..=MAX_LINK_SHAPES {
                let all = set(kind, n);
                for i in 0..n {
                    for j in 0..i {
                        let (a, b) = (&all[i], &all[j]);
                        for (d, own) in [
                            (0, [a.shape.square, b.shape.square]),
                            (kind.strain, [a.shape.stiffness, b.shape.stiffness]),
                        ] {
                            let off = product(kind, &a.coefficients, &b.coefficients, d);
                            // Sums of powers lose digits.
                            assert!(off.abs() < 1e-9 * (own[0] * own[1]).sqrt(), "{n} {i} {j} {d}: {off:e}");
                        }
                    }
                }
            }
        }
    }

    /// Of unit loads at the end: sum value(end) / stiffness and so on.
    #[test]
    fn lnk5_the_end_is_exact_at_rest() {
        for n in 2..=MAX_LINK_SHAPES {
            let sum = |of: fn(&LinkShape) -> f64| {
                (0..n).filter_map(|j| bending(n, j)).map(|s| of(&s) / s.shape.stiffness).sum::<f64>()
            };
            // 1/3, 1/2, 1 of a force and a moment; 1/8 and 1/6 of a weight that is spread.
            let found = [
                sum(|_| 1.0),
                sum(|s| s.slope),
                sum(|s| s.slope * s.slope),
                sum(|s| s.shape.area),
                sum(|s| s.shape.area * s.slope),
            ];
            for (found, exact) in found.iter().zip([1.0 / 3.0, 0.5, 1.0, 0.125, 1.0 / 6.0]) {
                assert!((found - exact).abs() < 1e-12, "{n}: {found} {exact}");
            }
        }
        let single: f64 = bending(1, 0).map(|s| 1.0 / s.shape.stiffness).unwrap();
        assert!((single - 1.0 / 3.0).abs() < 1e-14);
        for n in 1..=MAX_LINK_SHAPES {
            let twist: f64 = (0..n).filter_map(|j| torsion(n, j)).map(|s| 1.0 / s.shape.stiffness).sum();
            assert!((twist - 1.0).abs() < 1e-12, "{n}: {twist}");
        }
    }

    #[test]
    fn lnk5_free_frequencies_are_those_of_the_beam() {
        let worst = |n: usize, most: usize| {
            (0..most)
                .map(|j| {
                    bending(n, j).unwrap().shape.root / super::super::shapes::bending(j).unwrap().root - 1.0
                })
                .fold(0.0, f64::max)
        };
        assert!(worst(5, 2) < 2e-4 && worst(4, 2) < 3e-3, "{} {}", worst(5, 2), worst(4, 2));
        // One element of finite elements' cubics: 3.5327 where the beam has 3.5160.
        let two = bending(2, 0).unwrap().shape.root.powi(2);
        assert!((two - 3.5327).abs() < 5e-5, "{two}");
        let root = torsion(4, 0).unwrap().shape.root;
        assert!((root / std::f64::consts::FRAC_PI_2 - 1.0).abs() < 1e-6, "{root}");
        assert_eq!((bending(3, 3), torsion(7, 0)), (None, None));
    }
}
