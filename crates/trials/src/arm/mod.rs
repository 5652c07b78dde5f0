//! Cases of a free-floating arm.

mod choice;
mod generate;
mod law;
mod plant;
mod run;

pub(crate) use generate::generate;
