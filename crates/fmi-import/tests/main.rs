//! Integration tests, one module a file.

mod misbehaving;
mod reference_fmus;
