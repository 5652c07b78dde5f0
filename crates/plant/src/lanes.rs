//! The number with derivatives that every plant computes with.

use trueup_numerics::Dual;

/// How many derivatives are computed at once. Every other width would compile every model, with all effects, once more.
pub const LANES: usize = 8;

/// A number with that many derivatives.
pub type Lanes = Dual<LANES>;
