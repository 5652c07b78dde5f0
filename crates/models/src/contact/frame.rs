//! A point of a body in the plane, with the body's axes.

use trueup_numerics::Scalar;

/// A vector in some axes.
pub type ContactVector<T> = [T; 2];

/// a . b.
#[inline]
pub fn dot<T: Scalar>(a: ContactVector<T>, b: ContactVector<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}
/// a x b, about z.
#[inline]
pub fn cross<T: Scalar>(a: ContactVector<T>, b: ContactVector<T>) -> T {
    a[0] * b[1] - a[1] * b[0]
}
/// a + b.
#[inline]
pub fn add<T: Scalar>(a: ContactVector<T>, b: ContactVector<T>) -> ContactVector<T> {
    [a[0] + b[0], a[1] + b[1]]
}
/// a - b.
#[inline]
pub fn sub<T: Scalar>(a: ContactVector<T>, b: ContactVector<T>) -> ContactVector<T> {
    [a[0] - b[0], a[1] - b[1]]
}
/// s a.
#[inline]
pub fn scale<T: Scalar>(s: T, a: ContactVector<T>) -> ContactVector<T> {
    [s * a[0], s * a[1]]
}
/// omega x r, omega about z.
#[inline]
pub fn turned<T: Scalar>(rate: T, r: ContactVector<T>) -> ContactVector<T> {
    [-rate * r[1], rate * r[0]]
}

/// A point of a body that moves in the plane: where it is, how fast it goes, and the body's axes. Inertial frame, SI; angles are
/// positive from x to y.
#[derive(Clone, Copy, Debug)]
pub struct PointFrame<T> {
    /// The point, m.
    pub position: ContactVector<T>,
    /// Of the body, rad.
    pub attitude: T,
    /// Of the point, m/s.
    pub velocity: ContactVector<T>,
    /// Of the body, rad/s.
    pub rate: T,
    cos: T,
    sin: T,
}

impl<T: Scalar> PointFrame<T> {
    /// From the four that describe it.
    pub fn new(position: ContactVector<T>, attitude: T, velocity: ContactVector<T>, rate: T) -> Self {
        let (sin, cos) = attitude.sin_cos();
        Self { position, attitude, velocity, rate, cos, sin }
    }
    /// A vector of the body's axes in inertial ones.
    #[inline]
    pub fn out(&self, a: ContactVector<T>) -> ContactVector<T> {
        [self.cos * a[0] - self.sin * a[1], self.sin * a[0] + self.cos * a[1]]
    }
    /// An inertial vector in the body's axes.
    #[inline]
    pub fn inward(&self, a: ContactVector<T>) -> ContactVector<T> {
        [self.cos * a[0] + self.sin * a[1], self.cos * a[1] - self.sin * a[0]]
    }
    /// Another point of the body, `local` away in its axes.
    pub fn at(&self, local: ContactVector<T>) -> Self {
        let r = self.out(local);
        Self { position: add(self.position, r), velocity: add(self.velocity, turned(self.rate, r)), ..*self }
    }
    /// Velocity of the body's matter at that place of the inertial frame.
    pub fn velocity_at(&self, place: ContactVector<T>) -> ContactVector<T> {
        add(self.velocity, turned(self.rate, sub(place, self.position)))
    }
}

/// Two values from there on.
pub(super) fn two<T: Scalar>(values: &[T], at: usize) -> ContactVector<T> {
    [values[at], values[at + 1]]
}

/// A body from its position in m, attitude in rad, velocity in m/s and rate in rad/s, which are from these indices on.
pub(super) fn frame<T: Scalar>(
    values: &[T],
    [position, attitude, velocity, rate]: [usize; 4],
) -> PointFrame<T> {
    PointFrame::new(two(values, position), values[attitude], two(values, velocity), values[rate])
}

/// A force at a point, N, and a torque, N.m; inertial axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactWrench<T> {
    /// Force.
    pub force: ContactVector<T>,
    /// Torque about the point.
    pub torque: T,
}

impl<T: Scalar> ContactWrench<T> {
    /// Adds a force that acts `arm` away from the point.
    pub fn add(&mut self, force: ContactVector<T>, arm: ContactVector<T>) {
        self.force = add(self.force, force);
        self.torque += cross(arm, force);
    }
}
