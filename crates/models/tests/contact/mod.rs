//! Contact, the gripper, bodies and the capture.

mod arm;
mod capture;
mod carriages;
mod end_ball;
mod events;
mod motor;
mod properties;
pub(crate) mod run;
mod scaling;
mod space;
mod space_effects;
