//! Cases of a robot arm with six joints on a base that does not move.

mod chain;
mod choice;
mod drive;
mod file;
mod generate;
#[cfg(test)]
mod lagrange;
mod law;
mod nominal;
mod plant;
mod reference;
mod refit;
mod replay;
mod robots;
mod run;
mod scene;
mod size;
mod solve;
mod space;
mod write;

pub(crate) use generate::generate;
