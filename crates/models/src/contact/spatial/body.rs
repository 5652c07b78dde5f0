//! A body in space: a point of it with its axes, wrenches about points, and how it floats.

use crate::space::attitude::{self, rotation};
use crate::space::vector::{Matrix3, Vector3, add, cross, dot, scale, sub, times, transposed_times};
use trueup_numerics::Scalar;

/// A point of a body that moves in space. Inertial axes, SI, but for `rotation`.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyFrame<T> {
    /// The point, m.
    pub position: Vector3<T>,
    /// The body's axes to inertial ones.
    pub rotation: Matrix3<T>,
    /// Of the point, m/s.
    pub velocity: Vector3<T>,
    /// Of the body, rad/s.
    pub rate: Vector3<T>,
}

impl<T: Scalar> BodyFrame<T> {
    /// A vector of the body's axes in inertial ones.
    pub(super) fn out(&self, a: Vector3<T>) -> Vector3<T> {
        times(&self.rotation, a)
    }
    /// An inertial vector in the body's axes.
    pub(super) fn inward(&self, a: Vector3<T>) -> Vector3<T> {
        transposed_times(&self.rotation, a)
    }
    /// Another point of the body, `local` away in its axes.
    pub(super) fn at(&self, local: Vector3<T>) -> Self {
        let r = self.out(local);
        Self { position: add(self.position, r), velocity: add(self.velocity, cross(self.rate, r)), ..*self }
    }
    /// Without derivatives.
    pub(super) fn values(&self) -> BodyFrame<f64> {
        BodyFrame {
            position: self.position.map(Scalar::value),
            rotation: self.rotation.map(|row| row.map(Scalar::value)),
            velocity: self.velocity.map(Scalar::value),
            rate: self.rate.map(Scalar::value),
        }
    }
    /// Velocity of the body's matter at that place of the inertial frame.
    pub(super) fn velocity_at(&self, place: Vector3<T>) -> Vector3<T> {
        add(self.velocity, cross(self.rate, sub(place, self.position)))
    }
}

/// A force at a point, N, and a torque about it, N.m; inertial axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointWrench<T> {
    pub force: Vector3<T>,
    pub torque: Vector3<T>,
}

impl<T: Scalar> PointWrench<T> {
    pub(super) fn none() -> Self {
        Self { force: [T::zero(); 3], torque: [T::zero(); 3] }
    }
    /// Adds a force that acts `arm` away from the point.
    pub(super) fn add(&mut self, force: Vector3<T>, arm: Vector3<T>) {
        self.force = add(self.force, force);
        self.torque = add(self.torque, cross(arm, force));
    }
}

/// Mass, kg, and inertia about the centre of mass, body axes, kg.m2.
#[derive(Clone, Copy, Debug)]
pub(super) struct FloatingMass<T> {
    pub mass: T,
    pub inertia: Matrix3<T>,
}

/// Rates of position, quaternion, velocity and rate (body axes) of a body that floats.
pub(super) struct FloatingRates<T> {
    pub position: Vector3<T>,
    pub quaternion: [T; 4],
    pub velocity: Vector3<T>,
    pub rate: Vector3<T>,
}

impl<T: Scalar> FloatingMass<T> {
    /// Under a wrench about the centre of mass: m dv/dt = F, I d(omega)/dt = T - omega x (I omega), in body axes.
    pub(super) fn rates(
        &self,
        at: &BodyFrame<T>,
        quaternion: [T; 4],
        by: &PointWrench<T>,
    ) -> FloatingRates<T> {
        let rate = at.inward(at.rate);
        let gyroscopic = cross(rate, times(&self.inertia, rate));
        FloatingRates {
            position: at.velocity,
            quaternion: attitude::rate(quaternion, rate),
            velocity: by.force.map(|f| f / self.mass), // (CON-16)
            rate: solved(&self.inertia, sub(at.inward(by.torque), gyroscopic)), // (CON-16)
        }
    }
    /// Momentum, angular momentum about the inertial origin, kinetic energy, of a centre of mass that moves so.
    pub(super) fn momenta(&self, at: &BodyFrame<T>) -> (Vector3<T>, Vector3<T>, T) {
        let rate = at.inward(at.rate);
        let spin = times(&self.inertia, rate);
        let momentum = scale(self.mass, at.velocity);
        let angular = add(cross(at.position, momentum), at.out(spin));
        (momentum, angular, (self.mass * dot(at.velocity, at.velocity) + dot(rate, spin)) * 0.5)
    }
}

/// M x = v, by cofactors.
fn solved<T: Scalar>(m: &Matrix3<T>, v: Vector3<T>) -> Vector3<T> {
    let [a, b, c] = *m;
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let sum = add(add(scale(v[0], bc), scale(v[1], ca)), scale(v[2], ab));
    let whole = dot(a, bc);
    sum.map(|s| s / whole)
}

/// A body from its values: position, quaternion, velocity (inertial axes) and rate (body axes), which begin there.
pub(super) fn floating<T: Scalar>(
    x: &[T],
    [position, quaternion, velocity, rate]: [usize; 4],
) -> BodyFrame<T> {
    let three = |at: usize| [x[at], x[at + 1], x[at + 2]];
    let rotation = rotation([x[quaternion], x[quaternion + 1], x[quaternion + 2], x[quaternion + 3]]);
    BodyFrame {
        position: three(position),
        rotation,
        velocity: three(velocity),
        rate: times(&rotation, three(rate)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_of_three_rows_are_solved() {
        let m = [[3.0, -0.2, 0.1], [-0.2, 2.0, 0.3], [0.1, 0.3, 1.0]];
        let x = solved(&m, [1.0, -2.0, 0.5]);
        let back = times(&m, x);
        assert!((0..3).all(|i| (back[i] - [1.0, -2.0, 0.5][i]).abs() < 1e-15), "{back:?}");
    }
}
