//! From recordings to a verdict.

pub mod decide;
pub mod hypothesis;
pub mod observer;
pub mod problem;
pub mod recordings;
pub mod replay;
pub mod search;
pub mod select;
pub mod subject;
