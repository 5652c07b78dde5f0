//! What a pose is worth, over any scalar and without allocation: S1's measures, singular values of the Jacobians (SFF-4,
//! SFF-10). All of it is of the arms at their present pose; rotors do not count, appendages do as they are bent.

use super::MAX_BODIES;
use super::composite::{BASE, composite_bodies};
use super::snapshot::RobotSnapshot;
use super::spatial::{Articulated, SpatialFrame, SpatialWrench};
use super::tree::{PerBody, all, subspace};
use super::vector::{Vector3, add, cross, sub, times};
use trueup_numerics::Scalar;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// A column whose part across those before it is shorter than this share of it (squared) depends on them.
pub(super) const DEPENDENT: f64 = 1e-26;
/// A singular value below this share of the largest is 0.
pub(super) const NOTHING: f64 = 1e-14;
/// Sweeps of Jacobi rotations at most; six are what it takes.
const SWEEPS: usize = 30;

/// det(A^T A) of columns (SFF-4), by Gram-Schmidt: columns that depend on each other give 0, not a difference of large
/// numbers. More columns than rows always do.
pub fn measure<T: Scalar, const R: usize>(columns: impl Iterator<Item = [T; R]>) -> T {
    let product = |a: &[T; R], b: &[T; R]| a.iter().zip(b).fold(T::zero(), |sum, (a, b)| sum + *a * *b);
    let (mut kept, mut count) = ([[T::zero(); R]; R], 0);
    let mut all = T::one();
    for column in columns {
        let mut rest = column;
        for _ in 0..2 {
            for k in &kept[..count] {
                let along = product(k, &rest);
                rest.iter_mut().zip(k).for_each(|(r, k)| *r -= along * *k);
            }
        }
        let square = product(&rest, &rest);
        if count == R || square.value() <= DEPENDENT * product(&column, &column).value() {
            // A sum of squares at its least: its derivative is 0, too.
            return T::zero();
        }
        all *= square; // (SFF-4)
        let length = square.sqrt();
        kept[count] = rest.map(|r| r / length);
        count += 1;
    }
    all
}

/// S1's measures of force, torque, both, of these columns; the torque's of some of them alone, if need be.
pub fn measures<'a, T: Scalar>(
    columns: impl Iterator<Item = &'a SpatialWrench<T>> + Clone,
    torque: impl Iterator<Item = &'a SpatialWrench<T>>,
) -> [T; 3] {
    let both = |w: &SpatialWrench<T>| {
        let ([a, b, c], [d, e, f]) = (w.force, w.torque);
        [a, b, c, d, e, f]
    };
    [measure(columns.clone().map(|w| w.force)), measure(torque.map(|w| w.torque)), measure(columns.map(both))]
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>()
}

/// The largest square of a row's length.
fn largest<const L: usize>(a: &[[f64; L]]) -> f64 {
    a.iter().map(|v| product(v, v)).fold(0.0, f64::max)
}

/// Rotates rows until they are orthogonal, and the rows of `w` with them (one-sided Jacobi): lengths of the rows are the singular
/// values of `a`.
pub(super) fn orthogonal_rows<const L: usize, const S: usize>(a: &mut [[f64; L]], w: &mut [[f64; S]]) {
    for _ in 0..SWEEPS {
        let (mut turned, least) = (false, NOTHING * NOTHING * largest(a));
        for p in 0..a.len() {
            for q in p + 1..a.len() {
                let (x, y, xy) = (product(&a[p], &a[p]), product(&a[q], &a[q]), product(&a[p], &a[q]));
                if xy.abs() <= f64::EPSILON * (x * y).sqrt() || x.min(y) <= least {
                    continue;
                }
                turned = true;
                let half = (y - x) / (2.0 * xy);
                let t = half.signum() / (half.abs() + half.hypot(1.0));
                let c = 1.0 / t.hypot(1.0);
                let turn = |x: &mut f64, y: &mut f64| (*x, *y) = (c * (*x - t * *y), c * (t * *x + *y));
                let (before, after) = a.split_at_mut(q);
                before[p].iter_mut().zip(&mut after[0]).for_each(|(x, y)| turn(x, y));
                let (before, after) = w.split_at_mut(q);
                before[p].iter_mut().zip(&mut after[0]).for_each(|(x, y)| turn(x, y));
            }
        }
        if !turned {
            break;
        }
    }
}

/// The smallest singular value of a matrix of six rows, given by its columns (32 at most), and the product of all
/// (Yoshikawa's manipulability, sqrt det J J^T). Directions come from the values, by one-sided Jacobi rotations; a singular
/// value is u . J w, whose derivative is that of the singular value where it is single and not 0. Where several coincide,
/// that of the smallest is one of theirs, and that of the product is right all the same; where one is 0, both are 0.
pub fn singular<T: Scalar>(columns: &[[T; BASE]]) -> (T, T) {
    let n = columns.len().min(MAX_BODIES);
    // The short side's vectors are rotated until they are orthogonal.
    let tall = n <= BASE;
    let (short, long) = if tall { (n, BASE) } else { (BASE, n) };
    let element = |s: usize, l: usize| if tall { columns[s][l] } else { columns[l][s] };
    let mut a = [[0.0; MAX_BODIES]; BASE];
    let mut w = [[0.0; BASE]; BASE];
    for s in 0..short {
        (0..long).for_each(|l| a[s][l] = element(s, l).value());
        w[s][s] = 1.0;
    }
    orthogonal_rows(&mut a[..short], &mut w[..short]);
    let most = largest(&a[..short]).sqrt();
    let (mut least, mut all) = (None::<T>, T::one());
    for (v, w) in a.iter().zip(&w).take(short) {
        let length = product(v, v).sqrt();
        let mut value = T::zero();
        if length > NOTHING * most {
            for (l, v) in v.iter().enumerate().take(long) {
                (0..short).for_each(|s| value += element(s, l) * (w[s] * v / length));
            }
        }
        all *= value;
        least = Some(least.map_or(value, |least| least.min(value)));
    }
    (least.unwrap_or(T::zero()), all)
}

/// A robot's arms at a pose, base axes: how each joint pulls at the base, and what the base makes of it.
pub(super) struct Arms<T> {
    /// Of the bodies.
    frames: PerBody<SpatialFrame<T>>,
    /// Per joint (from 1) the wrench on the base at rest per unit of its acceleration, about the base's centre of mass.
    pull: PerBody<SpatialWrench<T>>,
    /// Factors of the whole's inertia, angular part first; `None`: the base is held, or nothing can be solved with it.
    inertia: Option<[T; BASE * BASE]>,
}

impl<T: Scalar> Arms<T> {
    pub(super) fn of(now: &RobotSnapshot<'_, T>, held: bool) -> Self {
        let RobotSnapshot { tree, bodies, placed, .. } = *now;
        let n = tree.bodies();
        let frames = tree.frames(SpatialFrame::identity(), placed);
        let composite = composite_bodies(now);
        let mut pull = all(n, SpatialWrench::zero());
        for i in 1..=n {
            let w = composite[i].times(subspace(tree.joint[i - 1], bodies[i].axis));
            pull[i] = frames[i].outwards(w); // (SFF-3)
        }
        let whole = Articulated::rigid(&composite[0]);
        let mut m = [T::zero(); BASE * BASE];
        for i in 0..3 {
            for j in 0..3 {
                m[BASE * i + j] = whole.angular[i][j];
                m[BASE * (i + 3) + j] = whole.mixed[j][i];
                m[BASE * (i + 3) + j + 3] = whole.linear[i][j];
            }
        }
        let solvable = !held && ldl_factor(&mut m, BASE).is_ok();
        Self { frames, pull, inertia: solvable.then_some(m) }
    }

    /// Measures of force, torque and both (SFF-4) of the arm that carries `tip`: B of its joints, torques about `mount`.
    pub(super) fn measures(&self, now: &RobotSnapshot<'_, T>, tip: usize, mount: Vector3<T>) -> [T; 3] {
        let about_mount = |i: usize| {
            let SpatialWrench { force, torque } = self.pull[i];
            SpatialWrench { force, torque: sub(torque, cross(mount, force)) }
        };
        let columns: PerBody<_> = now.tree.arm(tip).map(about_mount).collect();
        measures(columns.iter(), columns.iter())
    }

    /// Smallest singular value and manipulability of J_g (SFF-10) of the point `offset` of body `tip`; where the base is held, of
    /// J_M.
    pub(super) fn dexterity(&self, now: &RobotSnapshot<'_, T>, tip: usize, offset: Vector3<T>) -> (T, T) {
        let tree = now.tree;
        let at = &self.frames[tip];
        let point = add(at.origin, times(&at.rotation, offset));
        let mut columns = all(tree.bodies(), [T::zero(); BASE]);
        for i in tree.arm(tip) {
            columns[i] = tree.point_by_joint(i, &self.frames[i], now.bodies[i].axis, point); // (SFF-7)
        }
        if let Some(inertia) = &self.inertia {
            for (column, pull) in columns.iter_mut().zip(&self.pull).skip(1) {
                let ([a, b, c], [d, e, f]) = (pull.torque, pull.force);
                let mut base = [a, b, c, d, e, f];
                ldl_solve(inertia, BASE, &mut base);
                let angular = [base[0], base[1], base[2]];
                let linear = add([base[3], base[4], base[5]], cross(angular, point));
                for k in 0..3 {
                    column[k] -= linear[k]; // (SFF-10)
                    column[k + 3] -= angular[k];
                }
            }
        }
        singular(&columns[1..])
    }
}
