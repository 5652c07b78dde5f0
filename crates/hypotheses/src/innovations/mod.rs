//! Which effect explains a joint's gap, by the evidence of the innovations (crate `estimation`, module `innovations`).
//!
//! [`laws`] are effects as columns [`along`] the smoothed trajectory; [`screen`] looks at all of
//! their shapes at once, [`search`] fits the leaders, and what else may be in frames of their own ([`late`], [`structure`]) and
//! [`pairs`]; [`verdict`] judges by a few numbers. Modules that begin with `chain` are the same steps of an arm, from [`chain_search`]
//! to [`chain_verdict`].

pub mod along;
pub mod candidate;
pub mod chain_along;
pub mod chain_effect;
pub mod chain_fits;
pub mod chain_form;
pub mod chain_frames;
pub mod chain_orders;
pub mod chain_pairs;
pub mod chain_pushes;
pub mod chain_screen;
pub mod chain_search;
pub mod chain_verdict;
pub mod drive;
pub mod findings;
pub mod foreign;
pub mod hypothesis;
pub mod joint_along;
pub mod late;
pub mod law;
pub mod laws;
pub mod levels;
pub mod mechanics;
pub mod operator;
pub mod pairs;
pub mod place;
pub mod pushes;
pub mod run_along;
pub mod screen;
pub mod search;
pub mod shape;
pub mod slope;
pub mod spectrum;
pub mod spline;
pub mod structure;
pub mod tangent;
pub mod verdict;
