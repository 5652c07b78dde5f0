//! Shapes of a uniform beam that is clamped at z = 0 and free at z = L: bending (Euler-Bernoulli) and torsion, and their
//! integrals over the length, which are what the equations of motion need of them (SFF-5).
//!
//! All is for a beam of length 1 and shapes of value 1 at the tip, so that a modal coordinate is what the shape adds to the
//! tip's deflection, m (torsion: rad). Shapes are orthogonal, and those of bending depend on no stiffness: bending in both
//! directions has the same ones.

use std::f64::consts::PI;
use std::sync::LazyLock;

/// Most shapes of one beam in one direction.
pub const MAX_SHAPES: usize = 12;

/// Numbers of shapes: structure, no values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shapes {
    /// Bending along x.
    pub x: usize,
    /// Bending along y.
    pub y: usize,
    /// Torsion about z.
    pub torsion: usize,
}

impl Shapes {
    /// Modal coordinates: those along x first, then y, then torsion.
    pub fn modes(&self) -> usize {
        self.x + self.y + self.torsion
    }
}

/// A shape's integrals over a beam of length 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BeamShape {
    /// Wave number times length: the frequency clamped is root^2 sqrt(E I / (rho A L^4)); of torsion root sqrt(G J / (rho I_p L^2)).
    pub root: f64,
    /// Of the shape.
    pub area: f64,
    /// Of z times the shape.
    pub moment: f64,
    /// Of its square.
    pub square: f64,
    /// Of the square of its curvature; of torsion, of its slope.
    pub stiffness: f64,
    /// Critical damping of a beam of mass and stiffness 1: 2 sqrt(square stiffness).
    pub critical: f64,
}

/// +1, -1, +1 ..: the sign that makes the shape `j` (from 0) positive at the tip.
fn sign(j: usize) -> f64 {
    if j.is_multiple_of(2) { 1.0 } else { -1.0 }
}

/// 1 - sigma, sigma being the share of sinh - sin in cosh - cos - sigma (sinh - sin); no difference of large numbers.
fn off_one(root: f64) -> f64 {
    ((-root).exp() + root.cos() + root.sin()) / (root.cosh() + root.cos())
}

static BENDING: LazyLock<[BeamShape; MAX_SHAPES]> = LazyLock::new(|| {
    std::array::from_fn(|j| {
        // cos + 1 / cosh has its roots near odd multiples of pi / 2; the first one is furthest off.
        let mut root = if j == 0 { 1.875 } else { (j as f64 + 0.5) * PI };
        for _ in 0..6 {
            let cosh = root.cosh();
            root += (root.cos() + 1.0 / cosh) / (root.sin() + root.tanh() / cosh);
        }
        let sigma = 1.0 - off_one(root);
        // By parts, with phi'''' = root^4 phi and the conditions at both ends.
        BeamShape {
            root,
            area: sign(j) * sigma / root,
            moment: sign(j) / (root * root),
            square: 0.25,
            stiffness: 0.25 * root.powi(4),
            critical: 0.5 * root * root,
        }
    })
});

/// Bending shape `j`, from 0; `None` from [`MAX_SHAPES`] on.
pub fn bending(j: usize) -> Option<BeamShape> {
    BENDING.get(j).copied()
}

/// Torsion shape `j`, from 0: sin of an odd quarter of waves; `None` from [`MAX_SHAPES`] on.
pub fn torsion(j: usize) -> Option<BeamShape> {
    let root = (j as f64 + 0.5) * PI;
    let shape = BeamShape {
        root,
        area: sign(j) / root,
        moment: 1.0 / (root * root),
        square: 0.5,
        stiffness: 0.5 * root * root,
        critical: root,
    };
    (j < MAX_SHAPES).then_some(shape)
}

/// Bending shape `j` at z in 0 .. 1; 0 from [`MAX_SHAPES`] on.
pub fn bending_at(j: usize, z: f64) -> f64 {
    let Some(BeamShape { root, .. }) = bending(j) else { return 0.0 };
    let (off, x) = (off_one(root), root * z);
    let growing = 0.5 * off * x.exp();
    let falling = (1.0 - 0.5 * off) * (-x).exp();
    0.5 * sign(j) * (growing + falling - x.cos() + (1.0 - off) * x.sin())
}

/// Torsion shape `j` at z in 0 .. 1; 0 from [`MAX_SHAPES`] on.
pub fn torsion_at(j: usize, z: f64) -> f64 {
    torsion(j).map_or(0.0, |s| sign(j) * (s.root * z).sin())
}
