//! What calls of an instance take and give: times, and results of steps and of events.

/// Times that initialization needs, in s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ExperimentSetup {
    /// Relative tolerance of an integrator inside the FMU.
    pub tolerance: Option<f64>,
    /// Start.
    pub start: f64,
    /// End, if the run will never go beyond.
    pub stop: Option<f64>,
}

/// Result of a co-simulation step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoSimulationStep {
    /// How far the FMU came, in s.
    pub time: f64,
    /// It stopped before the end of the step: early return (3.0), or the step was discarded.
    pub early: bool,
    /// The step was refused; `time` is the last successful one.
    pub discarded: bool,
    /// FMI 3.0: event mode must be entered.
    pub event: bool,
    /// The FMU requests the end of the run.
    pub terminate: bool,
}

impl CoSimulationStep {
    /// A step of `step` s from `time` that went its whole way, with nothing to report.
    pub fn whole(time: f64, step: f64) -> Self {
        Self { time: time + step, early: false, discarded: false, event: false, terminate: false }
    }
}

/// Result of an event iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventInfo {
    /// Another iteration is needed.
    pub again: bool,
    /// The FMU requests the end of the run.
    pub terminate: bool,
    /// Nominal values of the states have changed.
    pub nominals_changed: bool,
    /// States have jumped.
    pub states_changed: bool,
    /// Time of the next time event in s.
    pub next_event: Option<f64>,
}

/// Result of a completed integrator step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompletedStep {
    /// Event mode must be entered.
    pub event: bool,
    /// The FMU requests the end of the run.
    pub terminate: bool,
}
