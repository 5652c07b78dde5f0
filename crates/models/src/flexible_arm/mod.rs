//! An arm on a base that is held, on the ground: joints of two masses with stick-slip, links that bend, gravity (S3).
//!
//! The bodies are those of [`crate::space`]; what is here is what drives their motors and brakes them. The equations have ids
//! LNK-1 .. in `docs/equations/flexible-arm.md`.

mod compiled;
mod friction;
pub mod layout;
mod model;
pub mod presets;
mod structure;

pub use model::FlexibleArm;
pub use structure::FlexibleArmStructure;

/// Most joints.
pub const MAX_JOINTS: usize = 8;
