//! What the joints transmit: by Newton and Euler, from accelerations that are known (SFF-2, SFF-3).

use super::MAX_BODIES;
use super::articulated::{Accelerations, Drive};
use super::spatial::Wrench;
use super::tree::{All, Body, Placed, Tree, subspace};
use super::vector::{add, cross, dot, scale};
use trueup_numerics::Scalar;

/// Per moving body the wrench that its carrier puts on it and on its rotor, in the carrier's axes about its origin.
pub fn transmitted<T: Scalar>(
    tree: &Tree,
    bodies: &All<Body<T>>,
    placed: &All<Placed<T>>,
    applied: &All<Wrench<T>>,
    drives: &[Drive<T>],
    found: &Accelerations<T>,
) -> All<Wrench<T>> {
    let n = tree.bodies();
    let mut a = [found.base; MAX_BODIES + 1];
    let mut f = [Wrench::zero(); MAX_BODIES + 1];
    for i in 1..=n {
        let own = subspace(tree.joint[i - 1], bodies[i].axis).times(found.joint[i - 1]);
        a[i] = placed[i].frame.inwards(a[tree.parent[i - 1]]).plus(placed[i].bias).plus(own);
        let (rigid, v) = (&bodies[i].rigid, placed[i].velocity);
        f[i] = v.cross_wrench(rigid.times(v)).plus(rigid.times(a[i])).minus(applied[i]);
    }
    let mut given = [Wrench::zero(); MAX_BODIES + 1];
    for i in (1..=n).rev() {
        let (parent, drive, k) = (tree.parent[i - 1], &drives[i - 1], placed[i].axis);
        let omega = placed[parent].velocity.angular;
        let spin = drive.inertia * (drive.share * dot(k, omega) + drive.rate);
        let faster = drive.inertia * (drive.share * dot(k, a[parent].angular) + found.rotor[i - 1]);
        let mut w = placed[i].frame.outwards(f[i]);
        w.torque = add(w.torque, scale(drive.share, add(scale(faster, k), scale(spin, cross(omega, k))))); // (SFF-12)
        given[i] = w;
        f[parent] = f[parent].plus(w);
    }
    given
}
