//! Integration tests, one module a file.

mod diagnosis;
mod page;
