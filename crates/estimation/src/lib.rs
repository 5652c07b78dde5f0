//! Recordings and a plant with latent forces, compared by the evidence of the innovations of a filter about a smoothed trajectory.

pub mod case_structure;
pub mod innovations;
