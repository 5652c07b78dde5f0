//! The state of the arm.

/// Links, each behind a joint.
pub(crate) const LINKS: usize = 3;
/// x, y, attitude, joint angles, motor angles (of rigid joints: unused).
pub(crate) const COORDINATES: usize = 3 + 2 * LINKS;
/// Coordinates, their rates, an appendage.
pub(crate) type ArmState = [f64; 2 * COORDINATES + 2];
