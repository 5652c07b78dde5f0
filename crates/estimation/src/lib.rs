//! Recordings and a model with latent forces, compared by the likelihood of the innovations.
//!
//! A model that is linear about a trajectory ([`system`]), with a latent force of limited bandwidth at each place where
//! something unmodelled may enter, is filtered once for each recording ([`filter`]). Whatever is unknown and enters
//! linearly is a *column* of innovations; a Gram matrix of columns is all that [`evidence`] needs for any set of them. The
//! [`smoother`] tells the latent forces themselves, with their deviations. [`joint`] makes such a system of the two-mass
//! joint, [`intake`] takes a case's recordings to its nodes, and [`fit`] estimates what is [`unknown`] of it, its trajectory and
//! the intensities of its latent torques together.

pub mod evidence;
pub mod filter;
pub mod fit;
pub mod innovations;
pub mod intake;
pub mod joint;
pub mod run;
pub mod smoother;
pub mod system;
pub mod unknown;
