//! Which effect a model lacks, by the evidence of the innovations (crate `estimation`).

pub mod innovations;
