//! Numbers with derivatives, as simulations carry them.

use trueup_numerics::Dual;

/// How many derivatives a simulation carries. More unknowns take more simulations, fewer leave derivatives at zero: each
/// other width would compile every model, with all effects, once more.
pub const LANES: usize = 8;

/// A number with its derivatives to that many unknowns.
pub type Lanes = Dual<LANES>;
