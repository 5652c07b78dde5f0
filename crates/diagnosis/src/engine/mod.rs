//! From recordings to a verdict.

pub mod balance;
mod believing;
mod compared;
pub mod coordinate;
pub mod decide;
pub mod floors;
pub mod fold;
pub mod hypothesis;
mod kept;
#[cfg(test)]
pub(crate) mod made;
pub mod octaves;
mod offset;
mod order;
pub mod problem;
mod push;
pub mod recordings;
pub mod replay;
pub mod screen;
pub mod search;
pub mod select;
pub mod stretches;
pub mod subject;
pub mod unknown;
