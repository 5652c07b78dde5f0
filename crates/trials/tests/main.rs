//! Integration tests, one module a file.

mod trial;
