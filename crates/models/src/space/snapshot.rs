//! A robot at one instant: what the algorithms over bodies read.

use super::bent::DeformationView;
use super::joint_drive::JointDrive;
use super::spatial::{Rigid, SpatialMotion};
use super::tree::{PlacedBody, Tree, TreeBody};
use super::vector::{Vector3, add};
use trueup_numerics::Scalar;

/// A robot with its values, placed and moving. Slices may be longer than there are bodies.
#[derive(Clone, Copy, Debug)]
pub struct RobotSnapshot<'a, T> {
    /// Which body hangs on which.
    pub tree: &'a Tree,
    /// The base without its appendages.
    pub base: &'a Rigid<T>,
    /// The bodies without their appendages; element 0 is not used.
    pub bodies: &'a [TreeBody<T>],
    /// Where they are; element 0 is the base.
    pub placed: &'a [PlacedBody<T>],
    /// Per joint its drive.
    pub drives: &'a [JointDrive<T>],
    /// The appendages, bent.
    pub flexing: DeformationView<'a, T>,
}

impl<'a, T: Scalar> RobotSnapshot<'a, T> {
    /// Of a robot without appendages.
    pub fn rigid(
        tree: &'a Tree,
        base: &'a Rigid<T>,
        bodies: &'a [TreeBody<T>],
        placed: &'a [PlacedBody<T>],
        drives: &'a [JointDrive<T>],
    ) -> Self {
        Self { tree, base, bodies, placed, drives, flexing: DeformationView::none() }
    }
    /// Rate of what carries the joints on this body: of its link's end, where that bends, its own axes.
    #[inline]
    pub(super) fn carrier_rate(&self, body: usize) -> Vector3<T> {
        let own = self.placed[body].velocity.angular;
        self.flexing.end(body).map_or(own, |e| add(own, e.end.velocity.angular))
    }
    /// Acceleration of what carries the joints on this body, whose own is `acceleration`.
    #[inline]
    pub(super) fn carrier_acceleration(
        &self,
        body: usize,
        acceleration: SpatialMotion<T>,
        modal: &[T],
    ) -> SpatialMotion<T> {
        let end = self.flexing.end(body);
        end.map_or(acceleration, |e| e.acceleration(acceleration, self.placed[body].velocity, modal))
    }
}
