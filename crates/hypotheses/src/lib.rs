//! What a model may lack, and which of it recordings tell: by the likelihood of the innovations (crate `estimation`).
//!
//! [`baseline`] is the model as its owner believes it, fitted to a case; [`catalogue`] lists what may be missing and
//! [`parametrize`] puts it in numbers; [`screen`] weighs all of it at once from one Gram matrix, and [`refit`] linearises
//! what leads about itself.

pub mod baseline;
pub mod catalogue;
pub mod innovations;
pub mod levels;
pub mod parametrize;
pub mod pushes;
pub mod refit;
pub mod screen;
pub mod search;
pub mod sizes;
pub mod verdict;
