//! Where the gap between a simulation and recordings is, which effect causes it, and how far it shrinks.
//!
//! - [`check`]: what a case shows before any fit;
//! - [`diagnose`]: from a case to a diagnosis; [`outcome`]: its result;
//! - [`engine`]: the last fit of what was named, by equation errors and free runs (which effect: crate `trueup_hypotheses`);
//! - [`experiment`]: what to record next where causes were not distinguished;
//! - [`floor`]: what noise alone leaves, and the gap as a figure;
//! - [`inputs`]: what a case was read from;
//! - [`locate`]: where the excess over that floor sits: channels, times, frequencies, orders, regimes, equation errors;
//! - [`picture`]: all that a case shows before any effect is named;
//! - [`shipped`]: whether a model that is shipped is the one that is reported;
//! - [`thinned`]: large recordings on a coarser grid;
//! - [`words`]: effects in words.

pub mod check;
pub mod diagnose;
pub mod engine;
pub mod experiment;
pub mod finite;
pub mod floor;
pub mod inputs;
pub mod locate;
pub mod outcome;
pub mod picture;
pub mod shipped;
pub mod thinned;
pub mod words;
