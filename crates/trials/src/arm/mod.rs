//! Cases of a free-floating arm.

mod choice;
mod generate;
mod law;
mod plant;
mod rig;
mod run;
mod scene;
mod size;
mod solve;
mod state;
mod write;

pub(crate) use generate::generate;
