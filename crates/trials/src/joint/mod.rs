//! Cases of a joint.

mod abreast;
mod bench;
#[cfg(test)]
mod check;
mod choice;
mod drive;
mod generate;
mod law;
mod plant;
mod rig;
mod run;
mod scene;
mod sealed;
mod size;
mod values;
mod write;

pub(crate) use choice::{draw_pulses, spells};
pub(crate) use drive::short;
pub(crate) use generate::{generate, generate_rig};
pub(crate) use law::{Pulse, pulses};
pub(crate) use sealed::SealedJoint;
