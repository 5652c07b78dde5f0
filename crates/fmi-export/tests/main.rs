//! Integration tests, one module a file.

#![allow(unsafe_code)] // calls of C functions

mod co_simulation;
mod common;
mod hostile;
mod model_exchange;
mod refusals;
mod states_and_derivatives;
