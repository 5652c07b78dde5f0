//! Where bodies and drives of an arm are, and how they move.

use super::MAX_LINKS;
use super::chain::{Chain, LinkDirections};
use crate::drive::DriveTrain;

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
