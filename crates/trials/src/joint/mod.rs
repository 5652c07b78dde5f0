//! Cases of a joint.

mod bench;
mod choice;
mod drive;
mod generate;
mod law;
mod plant;
mod run;

pub(crate) use generate::generate;
