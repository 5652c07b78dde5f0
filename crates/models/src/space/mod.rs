//! A free base with arms and flexible appendages in space: trees of bodies, their accelerations, momenta and matrices (S1, S2).
//!
//! The equations have ids SFF-1 .. in `docs/equations/spatial.md`.

pub mod analysis;
pub mod appendage;
pub mod articulated;
pub mod attitude;
mod bending_links;
pub mod bent;
mod body_check;
mod compiled;
pub mod composite;
pub mod control;
pub mod design;
mod dynamics;
mod effects;
pub mod end;
pub mod flexible;
mod flexure;
mod hand;
mod instant;
pub mod joint_drive;
pub mod layout;
mod link;
pub mod measures;
mod model;
mod outputs;
pub mod pose;
mod prescribed;
pub mod presets;
pub mod ritz;
pub mod second_order;
pub mod shapes;
pub mod snapshot;
pub mod spatial;
mod stick;
pub mod stiff;
mod structure;
pub mod table;
pub mod transmitted;
pub mod tree;
mod values;
pub mod vector;

use crate::effect::PUSHES;
pub(crate) use body_check::{inertia_fault, off_unit};
pub use compiled::RobotScalar;
pub use model::SpatialFreeFlyer;
pub use prescribed::PrescribedAccelerations;
pub(crate) use stick::StickSlip;
pub use structure::RobotStructure;

/// Most moving bodies of one tree: all arrays of the equations have this fixed capacity.
pub const MAX_BODIES: usize = 32;
/// Most states: those of base, joints, motors, modes, and of effects.
const MAX_STATES: usize = 13 + 2 * (2 * MAX_BODIES + MAX_MODES_OF_ALL) + MAX_STATES_OF_EFFECTS;
/// Most states of all effects of one robot together.
const MAX_STATES_OF_EFFECTS: usize = 512;
/// Most modes: of friction, play and forces at every joint, of forces at tip and base.
pub(crate) const MAX_MODES: usize = (2 + 2 * PUSHES) * MAX_BODIES + 4 * PUSHES;
/// Most coordinates: those of the base, a joint and a rotor for each body, the modes.
pub const MAX_DOFS: usize = composite::BASE + 2 * MAX_BODIES + MAX_MODES_OF_ALL;
/// Most end effectors.
pub const MAX_TIPS: usize = 8;
/// Most thrusters.
pub const MAX_THRUSTERS: usize = 32;
/// Most appendages of one robot.
pub const MAX_APPENDAGES: usize = 8;
/// Most modal coordinates of one link.
pub const MAX_MODES_OF_LINK: usize = 3 * ritz::MAX_LINK_SHAPES;
/// Most modal coordinates of all appendages together.
pub const MAX_MODES_OF_ALL: usize = 48;
