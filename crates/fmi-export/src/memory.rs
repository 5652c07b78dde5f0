//! All that an FMU state holds, and one that is stored.

use crate::state_machine::InstanceState;
use trueup_numerics::driver;

/// All that an FMU state holds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct InstanceMemory {
    pub(crate) state: InstanceState,
    /// Time in s.
    pub(crate) t: f64,
    pub(crate) start_time: f64,
    pub(crate) stop_time: Option<f64>,
    pub(crate) tolerance: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) u: Vec<f64>,
    pub(crate) p: Vec<f64>,
    /// Parameter elements that were set.
    pub(crate) set: Vec<bool>,
    pub(crate) modes: Vec<i32>,
    /// Slopes of the inputs during the last step, or the next one if `slopes_new` (FMI 2.0 input derivatives).
    pub(crate) slopes: Vec<f64>,
    pub(crate) slopes_new: bool,
    /// Event iterations at this time (they must settle).
    pub(crate) passes: u32,
    /// States and modes have to be computed from the parameters.
    pub(crate) start_stale: bool,
    /// Parameters were changed and not yet checked against each other.
    pub(crate) unchecked: bool,
    /// What the integrator remembers (Co-Simulation).
    pub(crate) driver: driver::DriverMemory,
    /// End of the last successful step, in s.
    pub(crate) last_successful: f64,
}

/// A stored state; owned by the instance that made it.
pub(crate) struct StoredState {
    pub(crate) memory: InstanceMemory,
}
