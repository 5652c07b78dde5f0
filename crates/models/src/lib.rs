//! Dynamics, effects and control laws. Pure functions over [`trueup_numerics::Scalar`]: no FMI, no I/O, no clock.
//!
//! * [`joint`]: the two-mass flexible joint with stick-slip friction (ESA's DELIAN arm).
//! * [`arm`]: the free-floating planar manipulator with flexible joints (CBK PAN's test-bed).
//! * [`space`]: trees of bodies on a free base in space: dynamics and what a pose shows.
//! * [`flexible_arm`]: an arm on the ground with flexible joints and links (DELIAN whole).
//! * [`contact`]: balls that touch, a gripper of balls, floating bodies, a capture.
//! * [`effect`]: what may act in a plant beyond its own equations, one small file each.
//! * [`friction`]: dry friction with a static level, by modes.
//! * [`controller`]: P/PI and wave-based joint control, continuous and sampled.

pub mod arm;
pub mod compiled;
pub mod contact;
pub mod controller;
pub mod drive;
pub mod effect;
pub mod flexible_arm;
pub mod friction;
pub mod gearbox;
pub mod joint;
pub mod layout;
pub mod plants;
pub mod presets;
mod sampling;
pub mod space;
