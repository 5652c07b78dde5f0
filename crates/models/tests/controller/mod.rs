//! The controllers against the reference plant, and sampled against continuous.

mod adaptive;
mod bench;
mod chain;
mod golden;
mod limit;
mod payload;
mod sampled;
