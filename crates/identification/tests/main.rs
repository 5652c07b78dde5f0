//! Integration tests, one module a file.

mod carried;
mod flexible_joint;
mod identify;
mod intervals;
mod names;
mod output_error;
mod predict;
mod quasi_static;
mod testbed;
