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
pub mod stiff;
mod structure;
pub mod table;
pub mod transmitted;
pub mod tree;
mod values;
pub mod vector;

pub(crate) use body_check::{inertia_fault, off_unit};
pub use compiled::RobotScalar;
pub use model::SpatialFreeFlyer;
pub use prescribed::PrescribedAccelerations;
pub use structure::RobotStructure;

/// Most moving bodies of one tree: all arrays of the equations have this fixed capacity.
pub const MAX_BODIES: usize = 32;
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
