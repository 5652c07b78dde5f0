//! Contact in space: spheres of a hand against what is about a target's port, and a capture by a robot with a free base.
//!
//! The law, its modes and the jaws are those of the plane. [`solid`]: pure functions of one pair; [`scene`]: chaser, hand and target.

mod body;
pub mod layout;
mod outcome;
mod parameters;
mod scene;
pub mod solid;
mod touch;

pub use layout::{SolidShape, SpatialGripperStructure};
pub use scene::SpatialCaptureScene;
