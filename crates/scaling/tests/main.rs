//! Integration tests, one module a file.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod cases;
mod law;
mod recordings;
mod systems;
mod tables;
