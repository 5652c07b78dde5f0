//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod arm_common;
mod arm_derivatives;
mod arm_effects;
mod arm_golden;
mod arm_properties;
mod arm_replay;
mod arm_stick;
mod contact;
mod controller;
mod draws;
mod effects;
mod flexible_arm;
mod flexible_arm_steps;
mod joint_golden;
mod plant_arm;
mod plant_joint;
mod plant_roles;
mod plant_space;
mod space;
