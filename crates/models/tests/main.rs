//! Integration tests, one module a file.

mod arm_common;
mod arm_derivatives;
mod arm_effects;
mod arm_golden;
mod arm_properties;
mod arm_replay;
mod arm_stick;
mod controller;
mod effects;
mod joint_golden;
