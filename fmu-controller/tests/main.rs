//! Integration tests, one module a file.

mod defaults;
mod tables;
