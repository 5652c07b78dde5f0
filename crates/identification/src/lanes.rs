//! Numbers with derivatives, as simulations carry them: as many derivatives as a plant computes at once. More unknowns take more
//! simulations, fewer leave derivatives at zero.

pub use trueup_plant::{LANES, Lanes};
