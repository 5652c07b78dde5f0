//! Mass matrix by composite bodies, forces by a sweep out and one back (Featherstone 2008, chapters 5, 6, 9), momenta and
//! energy: the other way to what [`super::articulated`] finds, for outputs, analysis and tests.
//!
//! Coordinates: velocity of the base's centre of mass and its rate (3 + 3, **base axes**), the joints, the rotors that
//! move by themselves, the modes of the appendages.

use super::MAX_APPENDAGES;
use super::end::Ends;
use super::joint_drive::{JointDrive, Rotor};
use super::snapshot::RobotSnapshot;
use super::spatial::{Rigid, SpatialMotion, SpatialWrench};
use super::tree::{PerBody, Tree, all, subspace};
use super::vector::{add, cross, dot, scale, times, zero};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

/// Coordinates of the base.
pub const BASE: usize = 6;

/// Row of each rotor that moves by itself, and the number of coordinates.
pub fn rotor_rows<T: Scalar>(
    tree: &Tree,
    drives: &[JointDrive<T>],
) -> ([Option<usize>; super::MAX_BODIES], usize) {
    let mut rows = [None; super::MAX_BODIES];
    let mut next = BASE + tree.bodies();
    for (row, drive) in rows.iter_mut().zip(drives).take(tree.bodies()) {
        if drive.rotor != Rotor::Geared {
            *row = Some(next);
            next += 1;
        }
    }
    (rows, next)
}

/// Of each body (own axes; index 0: the base) the rigid inertia of it and of all that it carries, appendages as they are bent.
pub(super) fn composite_bodies<T: Scalar>(now: &RobotSnapshot<'_, T>) -> PerBody<Rigid<T>> {
    composites(now).0
}

/// The same, and of the end of each link what it carries, own axes of the link's body.
fn composites<T: Scalar>(now: &RobotSnapshot<'_, T>) -> (PerBody<Rigid<T>>, LinkEndComposite<Rigid<T>>) {
    let RobotSnapshot { tree, base, bodies, placed, flexing, .. } = *now;
    let mut composite = all(tree.bodies(), *base);
    (1..=tree.bodies()).for_each(|i| composite[i] = bodies[i].rigid);
    for (part, bent) in flexing.parts.iter().zip(flexing.now) {
        composite[part.on] = composite[part.on].plus(&bent.rigid);
    }
    let nothing = Rigid { mass: T::zero(), first: zero(), inertia: [zero(); 3] };
    let mut carried: LinkEndComposite<_> =
        (0..flexing.ends.map_or(0, Ends::count)).map(|_| nothing).collect();
    for i in (1..=tree.bodies()).rev() {
        let parent = tree.parent[i - 1];
        let mine = composite[i].outwards(&placed[i].frame);
        composite[parent] = composite[parent].plus(&mine);
        if let Some(end) = flexing.end(parent) {
            carried[end.number] = carried[end.number].plus(&mine);
        }
    }
    (composite, carried)
}

/// Of all ends of links.
type LinkEndComposite<V> = ArrayVec<V, MAX_APPENDAGES>;

/// Of a wrench on body `at`, in its axes, what works on the coordinates of the joints and links that carry that body, and on
/// the base's: `put` gets the row and the value.
fn climb<T: Scalar>(
    now: &RobotSnapshot<'_, T>,
    modal: usize,
    mut f: SpatialWrench<T>,
    mut at: usize,
    mut put: impl FnMut(usize, T),
) {
    let RobotSnapshot { tree, bodies, placed, flexing, .. } = *now;
    while at > 0 {
        put(BASE + at - 1, subspace(tree.joint[at - 1], bodies[at].axis).power(f));
        f = placed[at].frame.outwards(f);
        at = tree.parent[at - 1];
        if let Some(end) = flexing.end(at) {
            end.columns().for_each(|(j, column)| put(modal + j, column.power(f))); // (LNK-3)
        }
    }
    (0..BASE).for_each(|k| put(k, component(f, k)));
}

/// M (SFF-6, SFF-8), row by row, into `m`: as many rows as [`rotor_rows`] gives, and those of the modes.
pub fn mass_matrix<T: Scalar>(now: &RobotSnapshot<'_, T>, m: &mut [T]) {
    let RobotSnapshot { tree, bodies, placed, drives, flexing, .. } = *now;
    let n = tree.bodies();
    let (rotors, modal) = rotor_rows(tree, drives);
    let size = modal + flexing.modes.len();
    m[..size * size].fill(T::zero());
    let mut put = |i: usize, j: usize, value: T| {
        m[i * size + j] += value;
        if i != j {
            m[j * size + i] += value;
        }
    };
    let (composite, carried) = composites(now);
    for k in 0..BASE {
        let f = composite[0].times(unit(k));
        for j in k..BASE {
            put(k, j, component(f, j));
        }
    }
    for i in 1..=n {
        let s = subspace(tree.joint[i - 1], bodies[i].axis);
        climb(now, modal, composite[i].times(s), i, |row, value| put(BASE + i - 1, row, value)); // (SFF-8)
    }
    for (j, on) in flexing.loose() {
        put(modal + j, modal + j, flexing.modes[j].mass);
        climb(now, modal, flexing.coupling[j], on, |row, value| put(modal + j, row, value)); // (SFF-6)
    }
    for (on, end) in (1..=n).filter_map(|i| Some((i, flexing.end(i)?))) {
        for (j, column) in end.columns() {
            put(modal + j, modal + j, flexing.modes[j].mass);
            let outer = carried[end.number].times(column); // (LNK-3)
            for (k, other) in end.columns().filter(|(k, _)| *k <= j) {
                put(modal + j, modal + k, other.power(outer));
            }
            let whole = flexing.coupling[j].plus(outer);
            climb(now, modal, whole, on, |row, value| put(modal + j, row, value));
        }
    }
    // The rotors: I g g^T, g being what their rate sees of every coordinate.
    for i in 1..=n {
        let mut g = [T::zero(); super::MAX_DOFS];
        let drive = &drives[i - 1];
        g[rotors[i - 1].unwrap_or(BASE + i - 1)] = T::one();
        let mut k = scale(drive.share, placed[i].axis);
        let mut at = tree.parent[i - 1];
        let mut bends = false;
        loop {
            if let Some(end) = flexing.end(at) {
                end.columns().for_each(|(j, column)| g[modal + j] += dot(k, column.angular)); // (LNK-3)
                bends = true;
            }
            if at == 0 {
                break;
            }
            g[BASE + at - 1] += dot(k, subspace(tree.joint[at - 1], bodies[at].axis).angular);
            k = times(&placed[at].frame.rotation, k);
            at = tree.parent[at - 1];
        }
        g[3..6].copy_from_slice(&k);
        let reached = if bends { size } else { modal };
        for a in (0..reached).filter(|a| !g[*a].vanishes()) {
            for b in a..reached {
                put(a, b, drive.inertia * g[a] * g[b]);
            }
        }
    }
}

/// The motion of one unit of a base coordinate.
fn unit<T: Scalar>(k: usize) -> SpatialMotion<T> {
    let mut m = SpatialMotion::zero();
    if k < 3 {
        m.linear[k] = T::one()
    } else {
        m.angular[k - 3] = T::one()
    }
    m
}
/// The part of a wrench that works on a base coordinate.
fn component<T: Scalar>(w: SpatialWrench<T>, k: usize) -> T {
    if k < 3 { w.force[k] } else { w.torque[k - 3] }
}

/// Wrench and torques that accelerations take: of the base (own axes, spatial acceleration), the joints, the rotors that move
/// by themselves, and the modes, springs and dampers not counted; in the order of the coordinates (SFF-2, SFF-6, SFF-11). With
/// all 0 this is C v.
pub fn forces<T: Scalar>(
    now: &RobotSnapshot<'_, T>,
    acceleration: (SpatialMotion<T>, &[T], &[T]),
    modes: &[T],
    out: &mut [T],
) {
    let RobotSnapshot { tree, base, bodies, placed, drives, flexing } = *now;
    let n = tree.bodies();
    let (rotors, modal) = rotor_rows(tree, drives);
    let mut a = all(n, acceleration.0);
    // Per joint of what carries it.
    let mut carrier = all(n, SpatialMotion::zero());
    let mut f = all(n, SpatialWrench::zero());
    f[0] = placed[0].velocity.cross_wrench(base.times(placed[0].velocity)).plus(base.times(a[0]));
    for i in 1..=n {
        let own = subspace(tree.joint[i - 1], bodies[i].axis).times(acceleration.1[i - 1]);
        let parent = tree.parent[i - 1];
        carrier[i - 1] = now.carrier_acceleration(parent, a[parent], modes);
        a[i] = placed[i].frame.inwards(carrier[i - 1]).plus(placed[i].bias).plus(own);
        let (rigid, v) = (&bodies[i].rigid, placed[i].velocity);
        f[i] = v.cross_wrench(rigid.times(v)).plus(rigid.times(a[i]));
    }
    for (part, bent) in flexing.parts.iter().zip(flexing.now) {
        f[part.on] = f[part.on].plus(bent.bias).plus(bent.rigid.times(a[part.on]));
    }
    for (j, on) in flexing.carried() {
        f[on] = f[on].plus(flexing.coupling[j].times(modes[j]));
        let met = flexing.modes[j].mass * modes[j] + a[on].power(flexing.coupling[j]);
        out[modal + j] = met + flexing.bias[j]; // (SFF-6)
    }
    for i in (1..=n).rev() {
        let (parent, drive, k) = (tree.parent[i - 1], &drives[i - 1], placed[i].axis);
        let omega = now.carrier_rate(parent);
        let spin = drive.inertia * (drive.share * dot(k, omega) + drive.rate);
        let mine = if rotors[i - 1].is_some() { acceleration.2[i - 1] } else { acceleration.1[i - 1] };
        let faster = drive.inertia * (drive.share * dot(k, carrier[i - 1].angular) + mine);
        let torque = subspace(tree.joint[i - 1], bodies[i].axis).power(f[i]);
        match rotors[i - 1] {
            Some(row) => {
                out[BASE + i - 1] = torque;
                out[row] = faster;
            }
            None => out[BASE + i - 1] = torque + faster,
        }
        let mut given = placed[i].frame.outwards(f[i]);
        let rotor = add(scale(faster, k), scale(spin, cross(omega, k)));
        given.torque = add(given.torque, scale(drive.share, rotor));
        if let Some(end) = flexing.end(parent) {
            end.columns().for_each(|(j, column)| out[modal + j] += column.power(given)); // (LNK-3)
        }
        f[parent] = f[parent].plus(given);
    }
    for k in 0..BASE {
        out[k] = component(f[0], k);
    }
}

/// Momentum of all bodies, appendages and rotors about the base's centre of mass, base axes (SFF-9), and the kinetic energy, J.
pub fn momentum<T: Scalar>(now: &RobotSnapshot<'_, T>) -> (SpatialWrench<T>, T) {
    let RobotSnapshot { tree, base, bodies, placed, drives, flexing } = *now;
    let n = tree.bodies();
    let mut h = all(n, base.times(placed[0].velocity));
    let mut twice = placed[0].velocity.power(h[0]);
    for i in 1..=n {
        h[i] = bodies[i].rigid.times(placed[i].velocity);
        twice += placed[i].velocity.power(h[i]);
    }
    for (part, bent) in flexing.parts.iter().zip(flexing.now) {
        h[part.on] = h[part.on].plus(bent.momentum);
        twice += placed[part.on].velocity.power(bent.momentum);
    }
    for (j, on) in flexing.carried() {
        let own = flexing.modes[j].mass * flexing.rates[j] + placed[on].velocity.power(flexing.coupling[j]);
        twice += flexing.rates[j] * own;
    }
    for i in (1..=n).rev() {
        let (parent, drive, k) = (tree.parent[i - 1], &drives[i - 1], placed[i].axis);
        let rate = drive.share * dot(k, now.carrier_rate(parent)) + drive.rate;
        twice += drive.inertia * rate * rate;
        h[parent] = h[parent].plus(placed[i].frame.outwards(h[i])); // (SFF-9)
        h[parent].torque = add(h[parent].torque, scale(drive.share * drive.inertia * rate, k));
    }
    (h[0], twice * 0.5)
}
