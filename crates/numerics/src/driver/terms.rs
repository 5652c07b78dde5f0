//! The request to a simulation, its memory, and its result.

use crate::figure::ShortNumber;
use crate::hybrid::{At, ModelSizes};

/// Which one-step method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Solver {
    /// Adaptive, explicit: [`Dopri5`](crate::integrate::Dopri5).
    #[default]
    Explicit,
    /// Adaptive, L-stable: [`Rodas4`](crate::integrate::Rodas4).
    Stiff,
    /// Fixed step `max_step`, explicit Euler.
    FixedEuler,
    /// Fixed step `max_step`, explicit: [`Rk4`](crate::integrate::Rk4).
    FixedExplicit,
    /// Fixed step `max_step`, L-stable: [`Ros2`](crate::integrate::Ros2).
    FixedStiff,
}

/// How to integrate.
#[derive(Clone, Copy, Debug)]
pub struct DriverOptions {
    /// One-step method.
    pub solver: Solver,
    /// Relative tolerance of the local error; the absolute one is this times the state's nominal value.
    pub tolerance: f64,
    /// Longest step in s; the step itself for fixed-step methods.
    pub max_step: f64,
    /// Return at an event *before* handling it (FMI 3 event mode); [`Driver::handle_event`](super::Driver::handle_event) then does.
    pub stop_at_event: bool,
    /// Steps per call (accepted and rejected) after which the call gives up.
    pub max_steps: usize,
    /// Passes of one event iteration after which it is assumed to be without end.
    pub max_passes: usize,
    /// Events in a row, each within 1e-9 of the time before it, after which they are assumed to be without end.
    pub max_chatter: u32,
}

impl Default for DriverOptions {
    fn default() -> Self {
        Self {
            solver: Solver::Explicit,
            tolerance: 1e-6,
            max_step: f64::INFINITY,
            stop_at_event: false,
            max_steps: 1_000_000,
            max_passes: 100,
            max_chatter: 20,
        }
    }
}

/// What the integrator remembers from call to call. Plain data: store and restore it with the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriverMemory {
    /// Size of the next step in s; 0: to be chosen.
    pub step: f64,
    /// Error ratio of the last accepted step.
    pub error: f64,
    /// Time of the last event in s.
    pub event_time: f64,
    /// Time of the last event that changed something, in s.
    pub change_time: f64,
    /// Events since time last went on.
    pub chatter: u32,
}

impl Default for DriverMemory {
    fn default() -> Self {
        Self {
            step: 0.0,
            error: 1e-4,
            event_time: f64::NEG_INFINITY,
            change_time: f64::NEG_INFINITY,
            chatter: 0,
        }
    }
}

impl DriverMemory {
    /// As numbers, for storing.
    pub fn to_array(self) -> [f64; 5] {
        [self.step, self.error, self.event_time, self.change_time, f64::from(self.chatter)]
    }
    /// From [`DriverMemory::to_array`].
    pub fn from_array([step, error, event_time, change_time, chatter]: [f64; 5]) -> Self {
        Self { step, error, event_time, change_time, chatter: chatter as u32 }
    }
}

/// All that a simulation carries on, lent by the caller; SI units, lengths as in [`ModelSizes`].
#[derive(Debug)]
pub struct DriverState<'a> {
    /// Time in s.
    pub t: &'a mut f64,
    /// Continuous states.
    pub x: &'a mut [f64],
    /// Inputs at time `t`.
    pub u: &'a mut [f64],
    /// Parameters.
    pub p: &'a [f64],
    /// Modes.
    pub modes: &'a mut [i32],
    /// What the integrator remembers.
    pub memory: &'a mut DriverMemory,
}

impl DriverState<'_> {
    pub(super) fn at(&self) -> At<'_, f64> {
        At { t: *self.t, x: self.x, u: self.u, p: self.p, modes: self.modes }
    }
}

/// The inputs during one call.
#[derive(Clone, Copy)]
pub enum StepInputs<'a> {
    /// Held at `DriverState::u`.
    Hold,
    /// `DriverState::u` plus these slopes (unit of the input per s) times the time since the start of the call
    /// or since the observer changed the inputs.
    Ramp(&'a [f64]),
    /// Any function of time; overwrites `DriverState::u`.
    Function(&'a dyn Fn(f64, &mut [f64])),
}

/// What is reported to the observer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverMoment {
    /// A step was accepted and `t` reached.
    Step,
    /// An event was handled.
    Event,
}

/// What the observer sees, during a call.
#[derive(Debug)]
pub struct DriverView<'a> {
    /// Why it is called.
    pub moment: DriverMoment,
    /// Time in s.
    pub t: f64,
    /// Continuous states.
    pub x: &'a [f64],
    /// Inputs; may be changed, then answer [`Flow::InputsChanged`].
    pub u: &'a mut [f64],
    /// Modes.
    pub modes: &'a [i32],
}

/// What the observer requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Go on.
    Continue,
    /// Go on with changed inputs: an event iteration is run and the integrator restarts.
    InputsChanged,
    /// Return now (early return).
    Return,
}

/// What an event came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventCause {
    /// Domain change of an indicator.
    Indicator(usize),
    /// [`Hybrid::next_event`](crate::hybrid::Hybrid::next_event).
    Time,
    /// Inputs, parameters or states that the caller has changed between two calls.
    Jump,
}

/// Result of [`Driver::advance_to`](super::Driver::advance_to).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DriverReached {
    /// Time reached in s (also in `DriverState::t`); before the end of the call after an event or an early return.
    pub t: f64,
    /// With `stop_at_event`: the event that waits to be handled at `t`.
    pub pending: Option<EventCause>,
    /// Events handled.
    pub events: usize,
    /// Steps accepted.
    pub accepted: usize,
    /// Steps rejected.
    pub rejected: usize,
}

/// What was not finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DriverQuantity {
    /// This state.
    State(usize),
    /// The rate of this state.
    Rate(usize),
    /// This input.
    Input(usize),
    /// This indicator.
    Indicator(usize),
}

/// Why a simulation could not go on. The state lent stays at the last time reached.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DriveError {
    /// The tolerance cannot be met.
    #[error("step of {} s at t = {} s is too small: loosen the tolerance or use the stiff solver", ShortNumber(*.h), ShortNumber(*.t))]
    StepTooSmall {
        /// Time in s.
        t: f64,
        /// Step in s.
        h: f64,
    },
    /// NaN or infinity.
    #[error("{what:?} is not finite at t = {} s", ShortNumber(*.t))]
    NotFinite {
        /// Time in s.
        t: f64,
        /// Which number.
        what: DriverQuantity,
    },
    /// Events without progress in time.
    #[error("endless events ({cause:?}) at t = {} s", ShortNumber(*.t))]
    Chattering {
        /// Time in s.
        t: f64,
        /// The last one.
        cause: EventCause,
    },
    /// An event iteration does not settle.
    #[error("event iteration at t = {} s does not settle", ShortNumber(*.t))]
    EventIteration {
        /// Time in s.
        t: f64,
    },
    /// Too many steps in one call.
    #[error("more than {steps} steps up to t = {} s in one call", ShortNumber(*.t))]
    MaxSteps {
        /// Time in s.
        t: f64,
        /// The limit.
        steps: usize,
    },
    /// A slice of the state lent has the wrong length.
    #[error("the driver expects {expected:?}")]
    Lengths {
        /// The lengths it was made for.
        expected: ModelSizes,
    },
    /// The end is before the start, or is not finite.
    #[error("cannot go from t = {t} s to {t_end} s")]
    Backwards {
        /// Time in s.
        t: f64,
        /// End of the call in s.
        t_end: f64,
    },
}
