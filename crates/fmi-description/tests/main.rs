//! Integration tests, one module a file.

mod archive;
mod check;
mod common;
mod read;
mod write;
