//! Parameters from recordings, with uncertainty.
