//! Cases of a robot arm with six joints on a base that does not move.

mod chain;
mod channels;
mod choice;
mod drive;
mod file;
mod generate;
mod law;
mod named;
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
#[cfg(test)]
mod tests;
mod values;
mod write;

pub(crate) use generate::generate;
