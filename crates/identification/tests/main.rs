//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod again;
mod bristles;
mod carried;
mod flexible_joint;
mod identify;
mod innovations;
mod intervals;
mod names;
mod output_error;
mod plants;
mod predict;
mod quasi_static;
mod sixth_plant;
mod testbed;
mod weights;
