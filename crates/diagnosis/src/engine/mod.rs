//! The last fit of what was named: equation errors along the recordings, then free runs.

pub mod balance;
mod believing;
mod compared;
pub mod coordinate;
pub mod decide;
pub mod floors;
pub mod free;
pub mod hypothesis;
mod kept;
#[cfg(test)]
pub(crate) mod made;
pub mod octaves;
mod offset;
mod order;
pub mod problem;
pub mod recordings;
pub mod replay;
pub mod result;
pub mod search;
pub mod subject;
pub mod unknown;
