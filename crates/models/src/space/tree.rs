//! A tree of rigid bodies on joints of one degree of freedom, and its motion from the base to the tips (SFF-2).
//!
//! Body 0 is the base, whose axes lie in its centre of mass; bodies 1 .. n follow, each after the one that carries it.
//! Every body's axes lie in its joint and turn with it.

use super::MAX_BODIES;
use super::attitude::about;
use super::spatial::{Frame, Motion, Rigid};
use super::vector::{Vector, add, product, scale, times, zero};
use trueup_numerics::Scalar;

/// What a joint leaves free.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Joint {
    /// Turning about its axis, rad.
    #[default]
    Revolute,
    /// Sliding along its axis, m.
    Prismatic,
}

/// Which body hangs on which, by which joint.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tree {
    /// Per moving body the body that carries it; 0 is the base.
    pub parent: Vec<usize>,
    /// Per moving body its joint.
    pub joint: Vec<Joint>,
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
pub struct Body<T> {
    /// About its joint.
    pub rigid: Rigid<T>,
    /// The joint's axes at angle 0 in those of the body that carries it.
    pub mount: Frame<T>,
    /// Unit vector along the joint's axis, own axes.
    pub axis: Vector<T>,
}

/// Where a body is and how it moves.
#[derive(Clone, Copy, Debug)]
pub struct Placed<T> {
    /// Own axes in those of the body that carries it; of the base: in the inertial frame.
    pub frame: Frame<T>,
    /// Velocity, own axes.
    pub velocity: Motion<T>,
    /// What the acceleration has beyond those of the carrier and of the joint's own rate: products of rates, own axes.
    pub bias: Motion<T>,
    /// The joint's axis in the carrier's axes.
    pub axis: Vector<T>,
}

impl<T: Scalar> Placed<T> {
    /// A base: its frame in the inertial one, its velocity in own axes.
    pub fn base(frame: Frame<T>, velocity: Motion<T>) -> Self {
        Self { frame, velocity, bias: Motion::zero(), axis: zero() }
    }
}

/// The motion of one unit of a joint's rate, own axes.
#[inline]
pub fn subspace<T: Scalar>(joint: Joint, axis: Vector<T>) -> Motion<T> {
    match joint {
        Joint::Revolute => Motion { angular: axis, linear: zero() },
        Joint::Prismatic => Motion { angular: zero(), linear: axis },
    }
}

/// All bodies; element 0 is the base.
pub type All<V> = [V; MAX_BODIES + 1];

impl Tree {
    /// Places all bodies: `base` is the base's frame and velocity (own axes), `q` and `rates` those of the joints.
    pub fn place<T: Scalar>(
        &self,
        bodies: &All<Body<T>>,
        base: (Frame<T>, Motion<T>),
        q: &[T],
        rates: &[T],
    ) -> All<Placed<T>> {
        let mut all = [Placed::base(base.0, base.1); MAX_BODIES + 1];
        self.place_into(bodies, base, q, rates, &mut all);
        all
    }

    /// As [`Self::place`], into as much memory as there are bodies (one more, for the base).
    pub fn place_into<T: Scalar>(
        &self,
        bodies: &[Body<T>],
        base: (Frame<T>, Motion<T>),
        q: &[T],
        rates: &[T],
        all: &mut [Placed<T>],
    ) {
        all[0] = Placed::base(base.0, base.1);
        for i in 1..=self.bodies() {
            let (body, joint) = (&bodies[i], self.joint[i - 1]);
            let axis = times(&body.mount.rotation, body.axis);
            let frame = match joint {
                Joint::Revolute => Frame {
                    rotation: product(&body.mount.rotation, &about(body.axis, q[i - 1])),
                    origin: body.mount.origin,
                },
                Joint::Prismatic => Frame {
                    rotation: body.mount.rotation,
                    origin: add(body.mount.origin, scale(q[i - 1], axis)),
                },
            };
            let own = subspace(joint, body.axis).times(rates[i - 1]);
            let velocity = frame.inwards(all[self.parent[i - 1]].velocity).plus(own); // (SFF-2)
            all[i] = Placed { frame, velocity, bias: velocity.cross(own), axis };
        }
    }

    /// Frames of all bodies in the inertial one.
    pub fn inertial<T: Scalar>(&self, placed: &All<Placed<T>>) -> All<Frame<T>> {
        let mut all = [placed[0].frame; MAX_BODIES + 1];
        self.inertial_into(placed, &mut all);
        all
    }

    /// As [`Self::inertial`], into as much memory as there are bodies (one more, for the base).
    pub fn inertial_into<T: Scalar>(&self, placed: &[Placed<T>], all: &mut [Frame<T>]) {
        all[0] = placed[0].frame;
        for i in 1..=self.bodies() {
            all[i] = all[self.parent[i - 1]].then(&placed[i].frame);
        }
    }
}
