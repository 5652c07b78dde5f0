//! Parameters from recordings, with uncertainty.

pub mod nelder_mead;
pub mod tangent;
