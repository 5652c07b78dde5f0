//! Where the tip and the links are (S0 eq. 21-23), and a joint's angle from the tip's position.

use super::chain::{LinkDirections, PlanarVector, add, dot, quarter, rotate, times};
use super::layout::parameter;
use trueup_numerics::Scalar;

/// Position, attitude and velocity of a point; inertial frame.
#[derive(Clone, Copy, Debug)]
pub struct TipMotion<T> {
    /// m.
    pub position: PlanarVector<T>,
    /// rad.
    pub attitude: T,
    /// m/s.
    pub velocity: PlanarVector<T>,
}

/// The end-effector (eq. 21, ARM-10); `q`, `v`: x_0, y_0 and their rates first.
pub fn tip<T: Scalar>(t: &LinkDirections<T>, q: &[T], v: &[T]) -> TipMotion<T> {
    let (mut position, mut velocity) = ([q[0], q[1]], [v[0], v[1]]);
    for k in 0..=t.links {
        position = add(position, t.arm[k]);
        velocity = add(velocity, times(quarter(t.arm[k]), t.rate[k]));
    }
    TipMotion { position, attitude: t.angle[t.links], velocity }
}

/// Centre of mass of link `link` (from 1), inertial frame, m.
pub fn center_of_mass<T: Scalar>(t: &LinkDirections<T>, q: &[T], p: &[T], link: usize) -> PlanarVector<T> {
    let begin = parameter::link_center_of_mass(t.links) + 2 * (link - 1);
    let own = rotate(t.angle[link].sin_cos(), [p[begin], p[begin + 1]]);
    (0..link).fold(add([q[0], q[1]], own), |sum, k| add(sum, t.arm[k]))
}

/// A joint's angle as the tip shows it.
#[derive(Clone, Copy, Debug)]
pub struct SightedPoint<T> {
    /// The joint's angle, rad, within (-pi, pi].
    pub angle: T,
    /// Measured less known distance from the joint to the tip, m: 0 but for errors of measurement or model.
    pub mismatch: T,
}

/// The angle of joint `joint` (from 1) from the tip's position, the base's pose and the other joints' angles
/// (eq. 21 solved for it, ARM-11). `q` is x_0, y_0, q_0, q_1 .. q_n; its entry for that joint is not read.
pub fn joint_angle<T: Scalar>(p: &[T], q: &[T], tip: PlanarVector<T>, joint: usize) -> SightedPoint<T> {
    let n = q.len() - 3;
    let arm = |k: usize| match k {
        0 => [p[parameter::mount_position(n)], p[parameter::mount_position(n) + 1]],
        k => [p[parameter::link_length(n) + k - 1], T::zero()],
    };
    // From the joint to the tip as measured, in the axes of the body before the joint.
    let (mut from, mut angle) = ([q[0], q[1]], T::zero());
    for k in 0..joint {
        angle += q[2 + k];
        from = add(from, rotate(angle.sin_cos(), arm(k)));
    }
    let seen = rotate((-angle).sin_cos(), [tip[0] - from[0], tip[1] - from[1]]);
    // The same in the link's own axes, by the angles beyond it.
    let (mut known, mut angle) = ([T::zero(); 2], T::zero());
    for k in joint..=n {
        if k > joint {
            angle += q[2 + k];
        }
        known = add(known, rotate(angle.sin_cos(), arm(k)));
    }
    // atan2(seen) - atan2(known) as one angle, so that it does not leave (-pi, pi].
    let across = known[0] * seen[1] - known[1] * seen[0];
    SightedPoint {
        angle: across.atan2(dot(known, seen)),
        mismatch: dot(seen, seen).sqrt() - dot(known, known).sqrt(),
    }
}
