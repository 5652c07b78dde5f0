//! JointController and ManipulatorController as FMUs: binding only.
