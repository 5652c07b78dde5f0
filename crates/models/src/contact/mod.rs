//! Contact in the plane (S2 sections 3.1, 3.2 and 4), and in space ([`spatial`]): the law between two balls, a gripper of balls against a docking port, bodies
//! that float, and a whole capture.
//!
//! The equations have ids CON-1 .. in `docs/equations/contact.md`. [`law`]: pure functions of one pair; [`frame`]: a point of a
//! body with its axes; [`closing`]: how jaws close; [`touch`]: all pairs at an instant; [`gripper`]: what holds at every instant
//! and at events, of both models that have a gripper.

mod ball;
mod bodies;
mod carriage;
mod chaser;
mod chaser_arm;
mod closing;
pub mod frame;
mod gripper;
mod gripper_contact;
pub mod impact;
pub mod law;
pub mod layout;
pub mod outcome;
mod parameters;
pub mod presets;
mod scene;
pub mod spatial;
mod touch;
mod view;

pub use bodies::FreeBody;
pub use chaser::{Chaser, RigidChaser};
pub use gripper_contact::GripperContact;
pub use layout::{Closing, GripperStructure, Mount, PortShape};
pub use outcome::CaptureOutcome;
pub use scene::CaptureScene;

/// Most balls of a gripper.
pub const MAX_BALLS: usize = 8;
/// Most docking points of a body.
pub const MAX_PORTS: usize = 8;
