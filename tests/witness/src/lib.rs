//! `fmi-rs` as a reference for the packed FMUs: a package of its own, because what it depends on takes as long to compile as `identification`.
