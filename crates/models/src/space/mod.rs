//! A free base with arms in space: trees of rigid bodies, their accelerations, momenta and matrices (S1, S2).
//!
//! The equations have ids SFF-1 .. in `docs/equations/spatial.md`.

pub mod analysis;
pub mod articulated;
pub mod attitude;
pub mod composite;
pub mod design;
pub mod layout;
mod model;
pub mod presets;
mod show;
pub mod spatial;
pub mod transmitted;
pub mod tree;
mod values;
pub mod vector;

pub use model::{Led, SpatialFreeFlyer, Structure};

/// Most moving bodies of one tree: all arrays of the equations have this fixed capacity.
pub const MAX_BODIES: usize = 32;
/// Most coordinates: those of the base, and a joint and a rotor for each body.
pub const MAX_DOFS: usize = composite::BASE + 2 * MAX_BODIES;
/// Most end effectors.
pub const MAX_TIPS: usize = 8;
/// Most thrusters.
pub const MAX_THRUSTERS: usize = 32;
