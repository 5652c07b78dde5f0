//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod arm;
mod faults;
mod fmu;
mod isolated;
mod links;
mod named_files;
mod platforms;
mod robot;
mod scale;
mod shell;
mod simulate;
mod streams;
mod sweep;
