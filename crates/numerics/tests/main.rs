//! Integration tests, one module a file.

mod allocation;
mod common;
mod driver;
mod dual;
mod event;
mod inputs;
mod integrate;
mod linear;
