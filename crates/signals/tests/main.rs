//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod broken;
mod columns;
mod common;
mod draft;
mod formats;
mod implausible;
mod mcap;
mod mutants;
mod noise;
mod parameters;
mod process;
mod properties;
mod reading;
mod relations;
mod weights;
