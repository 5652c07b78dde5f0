//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout)]

mod beams;
mod closed_loop;
mod delian;
mod droop;
mod map;
mod stiffening;
mod tables;
