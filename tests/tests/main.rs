//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod cases_document;
mod closed_loops;
mod dependencies;
mod effects_document;
mod hostile;
mod innovations;
mod insertion_points;
mod key_tables;
mod layers;
mod model_description;
mod ports_document;
