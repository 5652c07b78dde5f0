//! The state of an arm, and what a case gives of it.

use super::chain::{JOINTS, SerialChain};
use super::space::Arrow;

/// Angles of joints, angles of motors (of rigid joints: unused).
pub(crate) const COORDINATES: usize = 2 * JOINTS;
/// Where rates begin, and states of effects.
pub(crate) const RATE: usize = COORDINATES;
pub(crate) const OWN: usize = 2 * COORDINATES;
/// Coordinates, their rates, states of effects.
pub(crate) type HeldArmState = [f64; 2 * COORDINATES + 4];

/// What a case gives of an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldArmValues {
    pub(crate) chain: SerialChain,
    /// From the last joint, axes of the last body, m.
    pub(crate) tip: Arrow,
    /// The joint has a spring.
    pub(crate) flexible: [bool; JOINTS],
    /// N.m/rad, N.m.s/rad.
    pub(crate) stiffness: [f64; JOINTS],
    pub(crate) damping: [f64; JOINTS],
    /// Dry friction while it slides and at which it breaks away, N.m; N.m.s/rad.
    pub(crate) coulomb: [f64; JOINTS],
    pub(crate) breakaway: [f64; JOINTS],
    pub(crate) viscous: [f64; JOINTS],
}

impl HeldArmValues {
    /// Coordinate of joint `j`'s motor.
    #[inline]
    pub(crate) fn motor(&self, j: usize) -> usize {
        if self.flexible[j] { JOINTS + j } else { j }
    }
}
