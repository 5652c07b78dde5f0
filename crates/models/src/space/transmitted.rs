//! What the joints and the roots of appendages transmit: by Newton and Euler, from accelerations that are known (SFF-2,
//! SFF-3).

use super::snapshot::RobotSnapshot;
use super::spatial::{SpatialMotion, SpatialWrench};
use super::tree::{PerBody, all, subspace};
use super::vector::{add, cross, dot, scale};
use trueup_numerics::Scalar;

/// Per moving body (from 1) the wrench that its carrier puts on it and on its rotor, in the carrier's axes about its origin;
/// element 0: what the base puts on its appendages. Accelerations are those of the base (own axes, spatial), the joints, the
/// rotors, the modes.
pub fn transmitted<T: Scalar>(
    now: &RobotSnapshot<'_, T>,
    applied: &[SpatialWrench<T>],
    (base, joint, rotor, modal): (SpatialMotion<T>, &[T], &[T], &[T]),
) -> PerBody<SpatialWrench<T>> {
    let RobotSnapshot { tree, bodies, placed, drives, flexing, .. } = *now;
    let n = tree.bodies();
    let mut a = all(n, base);
    // Per joint of what carries it.
    let mut carrier = all(n, SpatialMotion::zero());
    let mut f = all(n, SpatialWrench::zero());
    for i in 1..=n {
        let own = subspace(tree.joint[i - 1], bodies[i].axis).times(joint[i - 1]);
        let parent = tree.parent[i - 1];
        carrier[i - 1] = now.carrier_acceleration(parent, a[parent], modal);
        a[i] = placed[i].frame.inwards(carrier[i - 1]).plus(placed[i].bias).plus(own);
        let (rigid, v) = (&bodies[i].rigid, placed[i].velocity);
        f[i] = v.cross_wrench(rigid.times(v)).plus(rigid.times(a[i])).minus(applied[i]);
    }
    for (part, bent) in flexing.parts.iter().zip(flexing.now) {
        f[part.on] = f[part.on].plus(bent.rigid.times(a[part.on])).plus(bent.bias);
    }
    for (j, on) in flexing.carried() {
        f[on] = f[on].plus(flexing.coupling[j].times(modal[j])); // (SFF-6)
    }
    let mut given = all(n, SpatialWrench::zero());
    given[0] = f[0];
    for i in (1..=n).rev() {
        let (parent, drive, k) = (tree.parent[i - 1], &drives[i - 1], placed[i].axis);
        let omega = now.carrier_rate(parent);
        let spin = drive.inertia * (drive.share * dot(k, omega) + drive.rate);
        let faster = drive.inertia * (drive.share * dot(k, carrier[i - 1].angular) + rotor[i - 1]);
        let mut w = placed[i].frame.outwards(f[i]);
        w.torque = add(w.torque, scale(drive.share, add(scale(faster, k), scale(spin, cross(omega, k))))); // (SFF-12)
        given[i] = w;
        f[parent] = f[parent].plus(w);
    }
    given
}
