//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod hybrid_derivatives;
mod hybrid_events;
mod hybrid_fmu;
mod hybrid_run;
mod isolated;
mod misbehaving;
mod reference_fmus;
