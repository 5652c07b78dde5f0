//! Integration tests, one module a file.

mod fmu;
mod simulate;
