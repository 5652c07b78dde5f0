//! Integration tests, one module a file.

mod broken;
mod common;
mod noise;
mod process;
mod properties;
mod reading;
