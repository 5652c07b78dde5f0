//! Motions, wrenches and inertias in six dimensions (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 2): the
//! angular part first, both parts at the origin of the axes in which they are written.

use super::vector::{
    Matrix3, Vector3, add, cross, cross_columns, dot, identity, plus, product, product_transposed, scale,
    sub, times, transposed_times, zero,
};
use trueup_numerics::Scalar;

/// Angular and linear velocity (rad/s, m/s), or acceleration.
#[derive(Clone, Copy, Debug)]
pub struct SpatialMotion<T> {
    /// Of the axes.
    pub angular: Vector3<T>,
    /// Of the body's point at the origin.
    pub linear: Vector3<T>,
}

/// Torque about the origin, N.m, and force, N; or angular and linear momentum.
#[derive(Clone, Copy, Debug)]
pub struct SpatialWrench<T> {
    /// About the origin.
    pub torque: Vector3<T>,
    /// Through it.
    pub force: Vector3<T>,
}

impl<T: Scalar> SpatialMotion<T> {
    /// At rest.
    pub fn zero() -> Self {
        Self { angular: zero(), linear: zero() }
    }
    /// Sum.
    #[inline]
    pub fn plus(self, o: Self) -> Self {
        Self { angular: add(self.angular, o.angular), linear: add(self.linear, o.linear) }
    }
    /// Times a number.
    #[inline]
    pub fn times(self, s: T) -> Self {
        Self { angular: scale(s, self.angular), linear: scale(s, self.linear) }
    }
    /// self x o: the rate of a motion `o` that is at rest in axes that move so.
    #[inline]
    pub fn cross(self, o: Self) -> Self {
        Self {
            angular: cross(self.angular, o.angular),
            linear: add(cross(self.angular, o.linear), cross(self.linear, o.angular)),
        }
    }
    /// self x* w: the rate of a wrench `w` that is at rest in axes that move so.
    #[inline]
    pub fn cross_wrench(self, w: SpatialWrench<T>) -> SpatialWrench<T> {
        SpatialWrench {
            torque: add(cross(self.angular, w.torque), cross(self.linear, w.force)),
            force: cross(self.angular, w.force),
        }
    }
    /// Power of a wrench at this motion, W.
    #[inline]
    pub fn power(self, w: SpatialWrench<T>) -> T {
        dot(self.angular, w.torque) + dot(self.linear, w.force)
    }
}

impl<T: Scalar> SpatialWrench<T> {
    /// None.
    pub fn zero() -> Self {
        Self { torque: zero(), force: zero() }
    }
    /// Sum.
    #[inline]
    pub fn plus(self, o: Self) -> Self {
        Self { torque: add(self.torque, o.torque), force: add(self.force, o.force) }
    }
    /// Difference.
    #[inline]
    pub fn minus(self, o: Self) -> Self {
        Self { torque: sub(self.torque, o.torque), force: sub(self.force, o.force) }
    }
    /// Times a number.
    #[inline]
    pub fn times(self, s: T) -> Self {
        Self { torque: scale(s, self.torque), force: scale(s, self.force) }
    }
}

/// Axes in those of the parent: their origin and rotation.
#[derive(Clone, Copy, Debug)]
pub struct SpatialFrame<T> {
    /// These axes to the parent's.
    pub rotation: Matrix3<T>,
    /// Their origin, parent's axes, m.
    pub origin: Vector3<T>,
}

impl<T: Scalar> SpatialFrame<T> {
    /// The parent's own axes.
    pub fn identity() -> Self {
        Self { rotation: identity(), origin: zero() }
    }
    /// A parent's motion as it is seen here.
    #[inline]
    pub fn inwards(&self, m: SpatialMotion<T>) -> SpatialMotion<T> {
        SpatialMotion {
            angular: transposed_times(&self.rotation, m.angular),
            linear: transposed_times(&self.rotation, add(m.linear, cross(m.angular, self.origin))),
        }
    }
    /// A wrench here as it acts on the parent.
    #[inline]
    pub fn outwards(&self, w: SpatialWrench<T>) -> SpatialWrench<T> {
        let force = times(&self.rotation, w.force);
        SpatialWrench { torque: add(times(&self.rotation, w.torque), cross(self.origin, force)), force }
    }
    /// A frame in these axes as the parent sees it.
    pub fn then(&self, inner: &Self) -> Self {
        Self {
            rotation: product(&self.rotation, &inner.rotation),
            origin: add(self.origin, times(&self.rotation, inner.origin)),
        }
    }
}

/// A rigid body's inertia about the origin of its axes.
#[derive(Clone, Copy, Debug)]
pub struct Rigid<T> {
    /// kg.
    pub mass: T,
    /// Mass times the centre of mass, kg.m.
    pub first: Vector3<T>,
    /// kg.m2.
    pub inertia: Matrix3<T>,
}

impl<T: Scalar> Rigid<T> {
    /// Of a body with this mass, centre of mass and inertia about that centre.
    pub fn new(mass: T, center: Vector3<T>, central: &Matrix3<T>) -> Self {
        let first = scale(mass, center);
        let square = dot(center, first);
        let mut inertia = *central;
        for (i, row) in inertia.iter_mut().enumerate() {
            for (j, e) in row.iter_mut().enumerate() {
                *e -= first[i] * center[j];
            }
            row[i] += square;
        }
        Self { mass, first, inertia }
    }
    /// Momentum at this velocity; force at this acceleration.
    #[inline]
    pub fn times(&self, v: SpatialMotion<T>) -> SpatialWrench<T> {
        SpatialWrench {
            torque: add(times(&self.inertia, v.angular), cross(self.first, v.linear)),
            force: sub(scale(self.mass, v.linear), cross(self.first, v.angular)),
        }
    }
    /// As the parent sees it.
    pub fn outwards(&self, f: &SpatialFrame<T>) -> Self {
        let inertia = product_transposed(&product(&f.rotation, &self.inertia), &f.rotation);
        Self { mass: self.mass, first: times(&f.rotation, self.first), inertia }.shifted(f.origin)
    }
    /// About the origin of axes that are not turned, from which this origin is at `p`.
    pub fn shifted(&self, p: Vector3<T>) -> Self {
        // I + m p^2 + 2 p . h, less (p h^T + h p^T + m p p^T)
        let first = add(self.first, scale(self.mass, p));
        let mut inertia = self.inertia;
        let square = dot(p, add(first, self.first));
        for i in 0..3 {
            for j in 0..3 {
                inertia[i][j] -= p[i] * first[j] + self.first[i] * p[j];
            }
            inertia[i][i] += square;
        }
        Self { mass: self.mass, first, inertia }
    }
    /// Of both together.
    pub fn plus(&self, o: &Self) -> Self {
        Self {
            mass: self.mass + o.mass,
            first: add(self.first, o.first),
            inertia: plus(&self.inertia, &o.inertia),
        }
    }
}

/// An articulated inertia: wrench = this times acceleration, where what hangs on the body may yield.
/// [`Self::angular`] and [`Self::linear`] are symmetric.
#[derive(Clone, Copy, Debug)]
pub struct Articulated<T> {
    /// Torque by angular acceleration.
    pub angular: Matrix3<T>,
    /// Torque by linear acceleration; force by angular acceleration is its transpose.
    pub mixed: Matrix3<T>,
    /// Force by linear acceleration.
    pub linear: Matrix3<T>,
}

impl<T: Scalar> Articulated<T> {
    /// Of a rigid body.
    pub fn rigid(r: &Rigid<T>) -> Self {
        let (o, [x, y, z], m) = (T::zero(), r.first, r.mass);
        Self {
            angular: r.inertia,
            mixed: [[o, -z, y], [z, o, -x], [-y, x, o]],
            linear: [[m, o, o], [o, m, o], [o, o, m]],
        }
    }
    /// Wrench at an acceleration.
    #[inline]
    pub fn times(&self, a: SpatialMotion<T>) -> SpatialWrench<T> {
        SpatialWrench {
            torque: add(times(&self.angular, a.angular), times(&self.mixed, a.linear)),
            force: add(transposed_times(&self.mixed, a.angular), times(&self.linear, a.linear)),
        }
    }
    /// Adds another one, in the same axes.
    #[inline]
    pub fn add(&mut self, o: &Self) {
        self.angular = plus(&self.angular, &o.angular);
        self.mixed = plus(&self.mixed, &o.mixed);
        self.linear = plus(&self.linear, &o.linear);
    }
    /// Takes w w^T s away.
    #[inline]
    pub fn take(&mut self, w: &SpatialWrench<T>, s: T) {
        let (a, b) = (w.torque, w.force);
        for i in 0..3 {
            let (ai, bi) = (a[i] * s, b[i] * s);
            for j in 0..3 {
                self.angular[i][j] -= ai * a[j];
                self.mixed[i][j] -= ai * b[j];
                self.linear[i][j] -= bi * b[j];
            }
        }
    }
    /// Adds one that hangs in the axes `f`: with P = \[p x\], M = R M R^T, b = R B R^T, B = b + P M,
    /// A = R A R^T + P B^T + b P^T.
    #[inline]
    pub fn add_outwards(&mut self, o: &Self, f: &SpatialFrame<T>) {
        let (r, p) = (&f.rotation, f.origin);
        let row = |m: &Matrix3<T>, i: usize| times(r, transposed_times(m, r[i]));
        let half = |m: &Matrix3<T>| {
            let [t0, t1, t2] =
                [transposed_times(m, r[0]), transposed_times(m, r[1]), transposed_times(m, r[2])];
            let (d01, d02, d12) = (dot(t0, r[1]), dot(t0, r[2]), dot(t1, r[2]));
            [[dot(t0, r[0]), d01, d02], [d01, dot(t1, r[1]), d12], [d02, d12, dot(t2, r[2])]]
        };
        let m = half(&o.linear);
        let b = [row(&o.mixed, 0), row(&o.mixed, 1), row(&o.mixed, 2)];
        let a = half(&o.angular);
        let pm = cross_columns(p, &m);
        let mixed = [add(b[0], pm[0]), add(b[1], pm[1]), add(b[2], pm[2])];
        // (P B^T)_ij = (p x B_j)_i, (b P^T)_ij = (p x b_i)_j
        let x = [cross(p, mixed[0]), cross(p, mixed[1]), cross(p, mixed[2])];
        for i in 0..3 {
            let y = cross(p, b[i]);
            for j in 0..3 {
                self.angular[i][j] += a[i][j] + (x[j][i] + y[j]);
                self.mixed[i][j] += mixed[i][j];
                self.linear[i][j] += m[i][j];
            }
        }
    }
}
