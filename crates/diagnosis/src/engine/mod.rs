//! From recordings to a verdict.

pub mod hypothesis;
pub mod observer;
pub mod problem;
pub mod recordings;
pub mod subject;
