//! `PlanarManipulator`: n links on a free-floating satellite, any of the joints flexible (S0 eq. 1-23).
//!
//! The equations have ids ARM-1 .. in `docs/equations/arm.md`. Angles turn counter-clockwise; a joint's angle
//! and its motor's are both relative to the body before the joint; torques act on the motors, joint side of
//! the gear. Gravity only where the base is fixed.
//! What it gets wrong: rigid links, one linear spring per joint, a motor torque that is there at once.
//! Effects add what lacks.

mod balance;
pub mod chain;
mod compiled;
mod hinge;
mod inverse;
pub mod kinematics;
pub mod layout;
mod model;
mod motion;
mod payload;
mod replay;
pub mod rotor;
pub mod solve;
mod stick;

pub use compiled::ArmScalar;
pub use inverse::{BY_ACCELERATION, InverseDynamics, JOINT_DRIVE, JOINT_DRIVE_CHOICE};
pub use layout::{ArmLayout, BASE, BASE_CHOICE, FIXED_BASE, input, output, parameter};
pub use model::PlanarManipulator;
pub use payload::{PAYLOAD, PayloadParameter};
pub use replay::Replay;

use crate::effect::EffectError;

/// Most links of one manipulator: all arrays of the equations have this fixed capacity.
pub const MAX_LINKS: usize = 8;
/// Most bodies: satellite and links.
pub const MAX_BODIES: usize = MAX_LINKS + 1;
/// Most degrees of freedom: x_0, y_0, q_0, q_1 .. q_n and a motor for each.
pub const MAX_DOFS: usize = 3 + 2 * MAX_LINKS;
/// Most modes: friction and effects of all joints.
const MAX_MODES: usize = 16 * MAX_LINKS;

/// A manipulator that cannot be built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ArmError {
    /// The requested number of links.
    Links(usize),
    /// The effects need so many modes.
    Modes(usize),
    /// An effect cannot be had.
    Effect(EffectError),
}

impl std::fmt::Display for ArmError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Links(n) => write!(
                f,
                "a PlanarManipulator with {n} links cannot be had; jointFlexible takes 1 to {MAX_LINKS} entries, one per link"
            ),
            Self::Modes(n) => write!(
                f,
                "the effects of this PlanarManipulator need {n} modes, at most {MAX_MODES} are there; use fewer effects"
            ),
            Self::Effect(e) => e.fmt(f),
        }
    }
}
impl std::error::Error for ArmError {}
impl From<EffectError> for ArmError {
    fn from(e: EffectError) -> Self {
        Self::Effect(e)
    }
}
