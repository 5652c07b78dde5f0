//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![allow(clippy::print_stdout, clippy::print_stderr, clippy::type_complexity)]

mod arm;
mod balance;
mod data;
mod floor;
mod innovations;
mod input_scale;
mod isolability;
mod joint;
mod locate;
mod made;
mod map;
mod priors;
mod pushes;
mod reversals;
mod rigid;
