//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod arm_rig;
mod arm_search;
mod chain_search;
mod columns;
mod estimates;
mod far_out;
mod innovations;
mod made;
mod rig;
mod servo;
mod single;
mod values;
