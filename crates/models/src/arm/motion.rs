//! Where bodies and drives of an arm are, and how they move.

use super::chain::{Chain, LinkDirections};
use super::{MAX_BODIES, MAX_LINKS};
use crate::drive::DriveTrain;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

/// Position and motion of all bodies and drives.
pub(super) struct ArmMotion<'a, T> {
    /// Coordinates: x_0, y_0, q_0, q_1 .. q_n, q_m of the flexible joints.
    pub(super) q: &'a [T],
    /// Their rates.
    pub(super) v: &'a [T],
    pub(super) chain: Chain<T>,
    pub(super) turned: LinkDirections<T>,
    pub(super) drives: [DriveTrain<T>; MAX_LINKS],
}

impl<'a, T: Scalar> ArmMotion<'a, T> {
    /// Room for it.
    #[inline(always)]
    pub(super) fn unmoved(at: &At<'a, T>) -> Self {
        let (none, vectors) = ([T::zero(); MAX_BODIES], [[T::zero(); 2]; MAX_BODIES]);
        Self {
            q: at.x,
            v: at.x,
            chain: Chain { links: 0, mass: T::zero(), arm: vectors, gamma: vectors, inertia: none },
            turned: LinkDirections { links: 0, angle: none, rate: none, arm: vectors, gamma: vectors },
            drives: [DriveTrain::default(); MAX_LINKS],
        }
    }
}
