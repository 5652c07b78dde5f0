//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]
#![allow(unsafe_code)] // calls of C functions

mod co_simulation;
mod common;
mod hostile;
mod model_exchange;
mod refusals;
mod states_and_derivatives;
