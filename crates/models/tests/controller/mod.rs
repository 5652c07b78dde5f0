//! The controllers against the reference plant, and sampled against continuous.

mod adaptive;
mod chain;
mod golden;
mod limit;
mod sampled;
