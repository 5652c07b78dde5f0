//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod compiled;
mod coupled;
mod coupling;
mod events;
mod faults;
mod model_exchange;
mod reference_fmus;
mod results;
mod steps;
mod system;
