//! What free-running simulations showed.

use serde::Serialize;

/// Times the floor up to which a simulation is as good as perfect.
pub const NEAR: f64 = 2.0;

/// Gap of free-running simulations on recordings that were not fitted.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct FreeRun {
    /// Of the nominal model.
    pub before: f64,
    /// With its own parameters fitted.
    pub tuned: f64,
    /// With the causes.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
    /// What it leaves once in two hundred cases: noise of the inputs adds up along a run, and few runs are not many.
    pub chance: f64,
}

impl FreeRun {
    /// With the causes it does worse than without them, by more than chance.
    pub(crate) fn does_worse(&self) -> bool {
        self.after > self.tuned.max(self.chance)
    }
}
