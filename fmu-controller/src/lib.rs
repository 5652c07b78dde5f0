//! JointController and ManipulatorController as FMUs: binding only.

pub mod variables;
