//! The controllers against the reference plant, and sampled against continuous.

mod chain;
mod golden;
mod limit;
mod sampled;
