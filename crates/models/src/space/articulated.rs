//! Accelerations by articulated bodies, in one sweep from the tips and one back: O(n) (Featherstone 2008, chapter 7, with
//! given accelerations as in section 9.2; rotors as in SFF-12; modes of appendages as in SFF-6, of links as in LNK-3).

pub use super::joint_drive::{JointDrive, Moves, Rotor};
use super::link::{Bending, eliminate, resolve};
use super::snapshot::RobotSnapshot;
use super::spatial::{Articulated, SpatialMotion, SpatialWrench};
use super::tree::PerBody;
use super::vector::{cross, dot, scale};
use trueup_numerics::Scalar;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// What is kept of a body on the way from the tips.
#[derive(Clone, Copy)]
struct KeptBody<T> {
    /// Articulated inertia times the joint's axis.
    axis: SpatialWrench<T>,
    /// 1 / (what the joint's own acceleration meets).
    inverse: T,
    /// The torque that is left for it.
    rest: T,
}

/// Where [`accelerations`] puts what it found: as much memory as there are joints and modes, or more.
#[derive(Debug)]
pub struct SweepResult<'a, T> {
    /// Of the joints, rad/s2 (m/s2).
    pub joint: &'a mut [T],
    /// Of the rotors, joint side, rad/s2; of a prescribed one, and of one that turns with a prescribed joint: the torque that the
    /// motion takes, N.m (N).
    pub rotor: &'a mut [T],
    /// Of the modes, m/s2 (rad/s2).
    pub modal: &'a mut [T],
}

/// Accelerations of all coordinates (SFF-6, SFF-11); gives that of the base, own axes, spatial. `applied` acts on the bodies,
/// own axes and origins. `held`: the base does not accelerate but by this much (own axes; a field of gravity g is a base that
/// accelerates by -g).
pub fn accelerations<T: Scalar>(
    at: &RobotSnapshot<'_, T>,
    applied: &[SpatialWrench<T>],
    held: Option<SpatialMotion<T>>,
    mut out: SweepResult<'_, T>,
) -> SpatialMotion<T> {
    let mut m = SweepMemory {
        inertia: PerBody::new(),
        bias: PerBody::new(),
        kept: PerBody::new(),
        acceleration: PerBody::new(),
        bending: Bending::new(),
    };
    inwards(at, applied, &mut m);
    let root = held.unwrap_or_else(|| solve(&m.inertia[0], m.bias[0]));
    m.acceleration.push(root);
    if outwards(at, &m.kept, &m.bending, &mut m.acceleration, &mut out) {
        prescribed(at, &m, &mut out);
    }
    root
}

/// Memory of the sweeps.
struct SweepMemory<T> {
    inertia: PerBody<Articulated<T>>,
    bias: PerBody<SpatialWrench<T>>,
    kept: PerBody<KeptBody<T>>,
    acceleration: PerBody<SpatialMotion<T>>,
    bending: Bending<T>,
}

/// From the tips to the base.
#[inline(never)]
fn inwards<T: Scalar>(
    now: &RobotSnapshot<'_, T>,
    applied: &[SpatialWrench<T>],
    SweepMemory { inertia, bias, kept, bending, .. }: &mut SweepMemory<T>,
) {
    let RobotSnapshot { tree, bodies, placed, drives, flexing, .. } = *now;
    let n = tree.bodies();
    let nothing = KeptBody { axis: SpatialWrench::zero(), inverse: T::zero(), rest: T::zero() };
    for i in 0..=n {
        let (rigid, velocity) = (if i == 0 { now.base } else { &bodies[i].rigid }, placed[i].velocity);
        inertia.push(Articulated::rigid(rigid));
        bias.push(velocity.cross_wrench(rigid.times(velocity)).minus(applied[i]));
        kept.push(nothing);
    }
    // A body with its modes is one body of less inertia: their mass is diagonal, so they go first.
    for (part, bent) in flexing.parts.iter().zip(flexing.now) {
        inertia[part.on].add(&Articulated::rigid(&bent.rigid));
        bias[part.on] = bias[part.on].plus(bent.bias);
    }
    for (j, on) in flexing.loose() {
        let (coupling, inverse) = (&flexing.coupling[j], flexing.modes[j].inverse);
        inertia[on].take(coupling, inverse); // (SFF-6)
        let own = (flexing.force[j] - flexing.bias[j]) * inverse;
        bias[on] = bias[on].plus(coupling.times(own)); // (SFF-6)
    }
    bending.begin(now);
    for i in (1..=n).rev() {
        if let Some(end) = flexing.end(i) {
            eliminate(now, i, end, (&mut inertia[i], &mut bias[i]), bending);
        }
        let (parent, drive, at) = (tree.parent[i - 1], &drives[i - 1], &placed[i]);
        let (joint, axis) = (tree.joint[i - 1], bodies[i].axis);
        let (before, after) = inertia.split_at_mut(i);
        let mine = &after[0];
        let (resting, own) = bias.split_at_mut(i);
        // What is on a link that bends is on its end.
        let (carrier, carrier_bias) = match flexing.end(parent) {
            Some(end) => bending.carried(&end),
            None => (&mut before[parent], &mut resting[parent]),
        };
        let mut force = own[0].plus(mine.times(at.bias));
        // The rotor turns in the carrier: sigma (ds/dt k + s omega x k), s = I (sigma k . omega + rate) (SFF-12).
        let (k, sigma) = (at.axis, drive.share);
        let reach = sigma * drive.inertia;
        let omega = now.carrier_rate(parent);
        let spin = reach * (sigma * dot(k, omega) + drive.rate); // (SFF-12)
        let mut rotor = scale(spin, cross(omega, k));
        let mut stiff = T::zero();
        match drive.rotor {
            Rotor::Driven(torque) => rotor = axpy(sigma * torque, k, rotor),
            Rotor::Prescribed(acceleration) => {
                rotor = axpy(reach * acceleration, k, rotor);
                stiff = sigma * reach;
            }
            Rotor::Geared => stiff = sigma * reach,
        }
        let geared = drive.rotor == Rotor::Geared;
        carrier.add_outwards(mine, &at.frame);
        let mut on_parent;
        match drive.moves {
            Moves::Prescribed(acceleration) => {
                force = force.plus(joint.column(mine, axis).times(acceleration));
                on_parent = at.frame.outwards(force);
                if geared {
                    rotor = axpy(reach * acceleration, k, rotor);
                }
            }
            Moves::Driven(torque) => {
                let column = joint.column(mine, axis);
                let mut met = joint.power(axis, &column);
                let mut out = at.frame.outwards(column);
                if geared {
                    met += drive.inertia;
                    out.torque = axpy(reach, k, out.torque);
                }
                let (inverse, rest) = (T::one() / met, torque - joint.power(axis, &force));
                kept[i] = KeptBody { axis: out, inverse, rest };
                carrier.take(&out, inverse); // (SFF-11)
                on_parent = at.frame.outwards(force).plus(out.times(rest * inverse));
            }
        }
        on_parent.torque = axpy(T::one(), rotor, on_parent.torque);
        if stiff.value() != 0.0 {
            for a in 0..3 {
                for b in 0..3 {
                    carrier.angular[a][b] += stiff * k[a] * k[b];
                }
            }
        }
        *carrier_bias = carrier_bias.plus(on_parent);
    }
}

/// From the base, whose acceleration is the first of `all`, to the tips. Whether a joint is prescribed.
#[inline(never)]
fn outwards<T: Scalar>(
    now: &RobotSnapshot<'_, T>,
    kept: &[KeptBody<T>],
    bending: &Bending<T>,
    all: &mut PerBody<SpatialMotion<T>>,
    found: &mut SweepResult<'_, T>,
) -> bool {
    let mut some = false;
    let RobotSnapshot { tree, bodies, placed, drives, flexing, .. } = *now;
    for i in 1..=tree.bodies() {
        let (carrier, drive, at) = (tree.parent[i - 1], &drives[i - 1], &placed[i]);
        let parent = now.carrier_acceleration(carrier, all[carrier], found.modal);
        let k = &kept[i];
        let joint = match drive.moves {
            Moves::Prescribed(acceleration) => {
                some = true;
                acceleration
            }
            // `axis` is as the carrier sees it, its rotor included.
            Moves::Driven(_) => (k.rest - parent.power(k.axis)) * k.inverse,
        };
        found.joint[i - 1] = joint;
        found.rotor[i - 1] = match drive.rotor {
            Rotor::Geared => joint,
            Rotor::Prescribed(acceleration) => {
                drive.inertia * (acceleration + drive.share * dot(at.axis, parent.angular))
            }
            Rotor::Driven(torque) => torque / drive.inertia - drive.share * dot(at.axis, parent.angular),
        };
        let mut own = at.frame.inwards(parent).plus(at.bias);
        tree.joint[i - 1].add_to(scale(joint, bodies[i].axis), &mut own);
        if let Some(end) = flexing.end(i) {
            resolve(&end, own, bending, found.modal);
        }
        all.push(own);
    }
    for (j, on) in flexing.loose() {
        let met = flexing.force[j] - flexing.bias[j] - all[on].power(flexing.coupling[j]);
        found.modal[j] = met * flexing.modes[j].inverse; // (SFF-6)
    }
    some
}

/// What prescribed joints with geared rotors take: the articulated inertia is what each of them meets.
#[cold]
#[inline(never)]
fn prescribed<T: Scalar>(now: &RobotSnapshot<'_, T>, m: &SweepMemory<T>, found: &mut SweepResult<'_, T>) {
    let RobotSnapshot { tree, bodies, placed, drives, .. } = *now;
    for i in 1..=tree.bodies() {
        let drive = &drives[i - 1];
        if let (Moves::Prescribed(acceleration), Rotor::Geared) = (drive.moves, drive.rotor) {
            let carrier = tree.parent[i - 1];
            let parent = now.carrier_acceleration(carrier, m.acceleration[carrier], found.modal);
            let met = m.inertia[i].times(m.acceleration[i]).plus(m.bias[i]);
            let turned = drive.inertia * (acceleration + drive.share * dot(placed[i].axis, parent.angular));
            found.rotor[i - 1] = tree.joint[i - 1].power(bodies[i].axis, &met) + turned; // (SFF-11)
        }
    }
}

/// s a + b.
#[inline]
fn axpy<T: Scalar>(s: T, a: [T; 3], b: [T; 3]) -> [T; 3] {
    [s * a[0] + b[0], s * a[1] + b[1], s * a[2] + b[2]]
}

/// The acceleration at which an articulated inertia needs no wrench beyond -bias. Not positive definite: NaN, which the caller
/// steps the model refuses.
fn solve<T: Scalar>(inertia: &Articulated<T>, bias: SpatialWrench<T>) -> SpatialMotion<T> {
    let mut m = [T::zero(); 36];
    for i in 0..3 {
        for j in 0..3 {
            m[6 * i + j] = inertia.angular[i][j];
            m[6 * (i + 3) + j] = inertia.mixed[j][i];
            m[6 * (i + 3) + j + 3] = inertia.linear[i][j];
        }
    }
    let (t, f) = (bias.torque, bias.force);
    let mut a = [-t[0], -t[1], -t[2], -f[0], -f[1], -f[2]];
    if ldl_factor(&mut m, 6).is_ok() {
        ldl_solve(&m, 6, &mut a);
    } else {
        a = [T::constant(f64::NAN); 6];
    }
    SpatialMotion { angular: [a[0], a[1], a[2]], linear: [a[3], a[4], a[5]] }
}
