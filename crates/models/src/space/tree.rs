//! A tree of rigid bodies on joints of one degree of freedom, and its motion from the base to the tips (SFF-2).
//!
//! Body 0 is the base, whose axes have their origin in its centre of mass; bodies 1 .. n follow, each after the one that carries it.
//! Every body's axes have their origin in its joint and turn with it.

use super::MAX_BODIES;
use super::attitude::about;
use super::end::Ends;
use super::spatial::{Articulated, Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use super::vector::{Vector3, add, cross, dot, product, scale, sub, times, transposed_times, zero};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

/// What a joint leaves free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointType {
    /// Turning about its axis, rad.
    #[default]
    Revolute,
    /// Sliding along its axis, m.
    Prismatic,
}

/// What one unit of a joint's rate along `axis` (own axes) does, as [`subspace`] has it, without the products by its zeros.
impl JointType {
    /// The wrench that this acceleration takes: I s.
    #[inline]
    pub(super) fn column<T: Scalar>(self, of: &Articulated<T>, axis: Vector3<T>) -> SpatialWrench<T> {
        match self {
            Self::Revolute => {
                SpatialWrench { torque: times(&of.angular, axis), force: transposed_times(&of.mixed, axis) }
            }
            Self::Prismatic => {
                SpatialWrench { torque: times(&of.mixed, axis), force: times(&of.linear, axis) }
            }
        }
    }
    /// The part of a wrench that works on it.
    #[inline]
    pub(super) fn power<T: Scalar>(self, axis: Vector3<T>, of: &SpatialWrench<T>) -> T {
        match self {
            Self::Revolute => dot(axis, of.torque),
            Self::Prismatic => dot(axis, of.force),
        }
    }
    /// Adds so much of it.
    #[inline]
    pub(super) fn add_to<T: Scalar>(self, along: Vector3<T>, motion: &mut SpatialMotion<T>) {
        let part = match self {
            Self::Revolute => &mut motion.angular,
            Self::Prismatic => &mut motion.linear,
        };
        *part = add(*part, along);
    }
    /// velocity x so much of it.
    #[inline]
    fn turned<T: Scalar>(self, along: Vector3<T>, velocity: &SpatialMotion<T>) -> SpatialMotion<T> {
        let (omega, v) = (velocity.angular, velocity.linear);
        match self {
            Self::Revolute => SpatialMotion { angular: cross(omega, along), linear: cross(v, along) },
            Self::Prismatic => SpatialMotion { angular: zero(), linear: cross(omega, along) },
        }
    }
}

/// Which body hangs on which, by which joint.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree {
    /// Per moving body the body that carries it; 0 is the base.
    pub parent: Vec<usize>,
    /// Per moving body its joint.
    pub joint: Vec<JointType>,
}

impl Tree {
    /// Moving bodies.
    pub fn bodies(&self) -> usize {
        self.parent.len()
    }
    /// Bodies (from 1) from this one to the base, itself first.
    pub fn arm(&self, body: usize) -> impl Iterator<Item = usize> + '_ {
        let on = |b: &usize| (*b > 0).then_some(*b);
        std::iter::successors(on(&body), move |b| on(&self.parent[b - 1]))
    }
    /// The first body of the arm that this one (from 1) is on: the base carries it.
    pub fn first_of_arm(&self, body: usize) -> usize {
        self.arm(body).last().unwrap_or(body)
    }
}

/// A moving body with its joint, as parameters have it.
#[derive(Clone, Copy, Debug)]
pub struct TreeBody<T> {
    /// About its joint.
    pub rigid: Rigid<T>,
    /// The joint's axes at angle 0 in those of the body that carries it.
    pub mount: SpatialFrame<T>,
    /// Unit vector along the joint's axis, own axes.
    pub axis: Vector3<T>,
}

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct PlacedBody<T> {
    /// Own axes in those of the body that carries it; of the base: in the inertial frame.
    pub frame: SpatialFrame<T>,
    /// Velocity, own axes.
    pub velocity: SpatialMotion<T>,
    /// What the acceleration has beyond those of the carrier and of the joint's own rate: products of rates, own axes.
    pub bias: SpatialMotion<T>,
    /// The joint's axis in the carrier's axes.
    pub axis: Vector3<T>,
}

impl<T: Scalar> PlacedBody<T> {
    /// A base: its frame in the inertial one, its velocity in own axes.
    pub fn base(frame: SpatialFrame<T>, velocity: SpatialMotion<T>) -> Self {
        Self { frame, velocity, bias: SpatialMotion::zero(), axis: zero() }
    }
}

/// The motion of one unit of a joint's rate, own axes.
#[inline]
pub fn subspace<T: Scalar>(joint: JointType, axis: Vector3<T>) -> SpatialMotion<T> {
    match joint {
        JointType::Revolute => SpatialMotion { angular: axis, linear: zero() },
        JointType::Prismatic => SpatialMotion { angular: zero(), linear: axis },
    }
}

/// Of all bodies; element 0 is the base.
pub type PerBody<V> = ArrayVec<V, { MAX_BODIES + 1 }>;

/// Of all joints, from 0.
pub type Joints<V> = ArrayVec<V, MAX_BODIES>;

/// Of `n` bodies and the base the same.
pub(super) fn all<V: Copy>(n: usize, value: V) -> PerBody<V> {
    (0..=n).map(|_| value).collect()
}

impl Tree {
    /// Places all bodies: `base` is the base's frame and velocity (own axes), `q` and `rates` those of the joints.
    pub fn place<T: Scalar>(
        &self,
        bodies: &[TreeBody<T>],
        base: (SpatialFrame<T>, SpatialMotion<T>),
        q: &[T],
        rates: &[T],
    ) -> PerBody<PlacedBody<T>> {
        let mut all = PerBody::new();
        self.place_into(bodies, base, (q, rates), None, &mut all);
        all
    }

    /// As [`Self::place`], in place: a list that is moved costs as much as a sweep. `ends` are those of links that bend.
    pub fn place_into<T: Scalar>(
        &self,
        bodies: &[TreeBody<T>],
        base: (SpatialFrame<T>, SpatialMotion<T>),
        (q, rates): (&[T], &[T]),
        ends: Option<&Ends<T>>,
        all: &mut PerBody<PlacedBody<T>>,
    ) {
        all.clear();
        all.push(PlacedBody::base(base.0, base.1));
        for i in 1..=self.bodies() {
            let (body, joint) = (&bodies[i], self.joint[i - 1]);
            let mut axis = times(&body.mount.rotation, body.axis);
            let mut frame = match joint {
                JointType::Revolute => SpatialFrame {
                    rotation: product(&body.mount.rotation, &about(body.axis, q[i - 1])),
                    origin: body.mount.origin,
                },
                JointType::Prismatic => SpatialFrame {
                    rotation: body.mount.rotation,
                    origin: add(body.mount.origin, scale(q[i - 1], axis)),
                },
            };
            let own = scale(rates[i - 1], body.axis);
            let parent = self.parent[i - 1];
            let mut carrier = all[parent].velocity;
            if let Some((_, end)) = ends.and_then(|e| e.of(parent)) {
                carrier = carrier.plus(end.velocity); // (LNK-2)
                frame = end.frame.then(&frame); // (LNK-2)
                axis = times(&end.frame.rotation, axis);
            }
            let mut velocity = frame.inwards(carrier);
            joint.add_to(own, &mut velocity); // (SFF-2)
            all.push(PlacedBody { frame, velocity, bias: joint.turned(own, &velocity), axis });
        }
    }

    /// Frames of all bodies in the inertial one.
    pub fn inertial<T: Scalar>(&self, placed: &[PlacedBody<T>]) -> PerBody<SpatialFrame<T>> {
        self.frames(placed[0].frame, placed)
    }

    /// Frames of all bodies in the axes in which the base's is `base`.
    pub(super) fn frames<T: Scalar>(
        &self,
        base: SpatialFrame<T>,
        placed: &[PlacedBody<T>],
    ) -> PerBody<SpatialFrame<T>> {
        let mut all = PerBody::new();
        all.push(base);
        for i in 1..=self.bodies() {
            let frame = all[self.parent[i - 1]].then(&placed[i].frame);
            all.push(frame);
        }
        all
    }

    /// The velocity and the angular velocity of a point by one unit of the rate of body `i`'s joint, which carries it: a column of
    /// J_M (SFF-7). `frame` is the body's in the axes of the point and of the result, `axis` the joint's in the body's own axes.
    pub(super) fn point_by_joint<T: Scalar>(
        &self,
        i: usize,
        frame: &SpatialFrame<T>,
        axis: Vector3<T>,
        point: Vector3<T>,
    ) -> [T; 6] {
        let axis = times(&frame.rotation, axis);
        let ([a, b, c], [d, e, f]) = match self.joint[i - 1] {
            JointType::Revolute => (cross(axis, sub(point, frame.origin)), axis), // (SFF-7)
            JointType::Prismatic => (axis, zero()),
        };
        [a, b, c, d, e, f]
    }
}
