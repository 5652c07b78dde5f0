//! The first end effector of [`SpatialFreeFlyer`] at one instant, without what its outputs have beyond (SFF-7).

use super::attitude::{Quaternion, product};
use super::instant::RobotInstant;
use super::model::SpatialFreeFlyer;
use super::spatial::SpatialFrame;
use super::vector::{Vector3, add, cross, three, times};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

impl SpatialFreeFlyer {
    /// Frame of the first tip, axes of its body, its velocity, m/s, and its angular velocity, rad/s; all in inertial axes. The robot has
    /// a tip.
    #[inline(never)]
    pub fn first_tip<T: Scalar>(&self, x: &[T], p: &[T]) -> (SpatialFrame<T>, Vector3<T>, Vector3<T>) {
        let at = At { t: T::zero(), x, u: &[], p, modes: &[] };
        let tip = self.structure.tips[0];
        let mut now = RobotInstant::new();
        now.place(self, &at);
        let frames = now.frames(self);
        let (frame, velocity) = (&frames[tip], now.carrier_velocity(tip));
        let offset = now.displaced(tip, three(p, self.parameter.tip_offset));
        let point = add(velocity.linear, cross(velocity.angular, offset)); // (SFF-7)
        let hand = SpatialFrame {
            rotation: now.carried(tip, frame).rotation,
            origin: add(frame.origin, times(&frame.rotation, offset)),
        };
        (hand, times(&frame.rotation, point), times(&frame.rotation, velocity.angular))
    }

    /// Its axes to inertial ones, as the output `tipQuaternion`.
    pub fn first_tip_quaternion<T: Scalar>(&self, x: &[T], p: &[T]) -> Quaternion<T> {
        let at = At { t: T::zero(), x, u: &[], p, modes: &[] };
        let tip = self.structure.tips[0];
        let mut now = RobotInstant::new();
        now.place(self, &at);
        product(self.attitudes(&at, &now)[tip], now.end_turn(tip))
    }
}
