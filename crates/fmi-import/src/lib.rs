//! Loads an FMU and calls it.
