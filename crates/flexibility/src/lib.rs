//! What bends of an arm: where it comes to rest under its weight with its motors held, how it vibrates there, which joint or
//! link that is due to (S3 5).
//!
//! * [`equilibrium`]: rest, mass and stiffness about it.
//! * [`elements`]: joints and links one by one: their share of the deflection, what they do to the first mode.
//! * [`closed_loop`]: with motors free and a sampled controller on every joint: poles, damping.
//! * [`droop`]: above which wave frequency velocity waves run away under the weight.
//! * [`ground`]: arms of designs, with what they carry.
//! * [`map`]: all of that at a pose, and over the angles of two joints.

pub mod closed_loop;
pub mod droop;
pub mod elements;
pub mod equilibrium;
pub mod ground;
pub mod map;
