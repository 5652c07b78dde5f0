//! What free-running simulations of the sets showed.

use serde::{Deserialize, Serialize};

use super::thresholds::Thresholds;
use crate::engine::search::FittedSet;
use crate::json::number;

/// Gap of free-running simulations on recordings that were not fitted.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct FreeRun {
    /// Of the nominal model.
    #[serde(deserialize_with = "number")]
    pub before: f64,
    /// With its own parameters fitted.
    #[serde(deserialize_with = "number")]
    pub tuned: f64,
    /// With the causes.
    #[serde(deserialize_with = "number")]
    pub after: f64,
    /// What noise alone leaves.
    #[serde(deserialize_with = "number")]
    pub floor: f64,
    /// What it leaves once in two hundred cases: noise of the inputs adds up along a run, and few runs are not many.
    #[serde(deserialize_with = "number")]
    pub chance: f64,
    /// The same where the sensors' noise is as declared: what is between the two is a gap only where a cause takes it.
    #[serde(deserialize_with = "number")]
    pub noticed: f64,
    /// Chance does not leave so much on the recordings for fitting, though it may on those held out.
    pub trained: bool,
    /// Gap of the refitted model over windows, in floors of these; `None`: not requested, or there are none.
    #[serde(default)]
    pub windowed: Option<f64>,
}

impl FreeRun {
    /// Without any effect: parameters that were refitted may do worse on what was held out than those that were given.
    pub(crate) fn bare(&self) -> f64 {
        self.tuned.min(self.before)
    }
    /// What the refitted model leaves is near what noise leaves: of whole recordings, or over windows, which gather nothing at
    /// stops and slips.
    pub(super) fn is_enough(&self, limits: &Thresholds) -> bool {
        let windows = self.windowed.is_some_and(|w| w <= limits.free_runs.near);
        self.tuned <= limits.gap.missed * self.chance || windows
    }
    /// With the causes it does worse than without them, by more than chance.
    pub(crate) fn does_worse(&self) -> bool {
        self.after > self.tuned.max(self.chance)
    }
}

/// What models miss of recordings for fitting that were left out in turn, in units of what the channels vary by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// The refitted model.
    #[serde(deserialize_with = "number")]
    pub tuned: f64,
    /// With the causes.
    #[serde(deserialize_with = "number")]
    pub with: f64,
    /// What the sensors' noise leaves.
    #[serde(deserialize_with = "number")]
    pub noise: f64,
}

impl LeftOut {
    /// With the causes it does worse than without them, and no simulation as good as perfect (`near`: times the noise).
    pub(crate) fn does_worse(&self, near: f64) -> bool {
        self.with > self.tuned.max(near * self.noise)
    }
}

/// How well a free-running simulation does: its gap above the floor, as a power. What is below a tenth of the floor's does not count.
pub(crate) fn left(gap: f64, floor: f64) -> f64 {
    (gap * gap - floor * floor).max(0.1 * floor * floor).max(f64::MIN_POSITIVE)
}

/// What free-running simulations of some of the sets showed.
pub trait FreeRunResults {
    /// Gap on recordings held out.
    fn after(&self, set: usize) -> Option<f64>;
    /// How far the predictions of two sets are apart, as a gap.
    fn apart(&self, a: usize, b: usize) -> Option<f64>;
    /// One sensor shows mostly what one input does: whichever of the two is late, it shows the same.
    fn one_sensor(&self) -> bool;
    /// Recording by recording what a set leaves above the floor, as a power; what cannot be distinguished from the floor is as large.
    fn each(&self, set: usize) -> Option<Vec<f64>>;
    /// Leave-one-out over the recordings for fitting.
    fn left_out(&self, set: Option<usize>, fitted: &FittedSet) -> Option<LeftOut>;
}
