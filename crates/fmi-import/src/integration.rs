//! FMUs of Model Exchange, integrated together as one hybrid system: one loop for all who run them.
//!
//! A [`IntegratedGroup`] has the states of all its FMUs side by side. Rates are evaluated by setting time and states of every
//! FMU, passing outputs on to inputs ([`Fmus::exchange`]) and requesting the derivatives of every FMU. Between events a
//! one-step method of `trueup-numerics` integrates, the one that integrates our own models; state events are located on its
//! dense output, time events are hit exactly, and at an event all FMUs iterate until none of them, and no value that
//! they exchange, changes any more.
//!
//! A group of one FMU can be differentiated along the way: [`IntegratedGroup::differentiate`].

mod advance;
mod failure;
mod field;
mod iterate;
mod lanes;
mod names;
mod sensitivity;

use std::ops::Range;

use trueup_fmi_description::description::Description;
use trueup_numerics::driver::{DriverMemory, DriverReached as Steps, ErrorControlledStepper, Solver};

pub use self::failure::Failure;
pub use self::lanes::{Sensitivities, SensitivityLane};
use crate::pace::Pace;
use crate::{AnyInstance, DescribedCounts, ImportError, StateColumns};
use lanes::CarriedSensitivity;

/// The FMUs that are integrated together, and what acts on them.
pub trait Fmus {
    /// Why inputs could not be set.
    type Error;
    /// How many there are.
    fn count(&self) -> usize;
    /// One of them, instantiated for Model Exchange.
    fn instance(&mut self, member: usize) -> &mut AnyInstance;
    /// Its description, arrays sized as they are in this system.
    fn description(&self, member: usize) -> &Description;
    /// Sets the inputs at `time` (s), those that come from other FMUs of the group in the order of dependency. In
    /// `event` mode discrete inputs are set too, else continuous ones only.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn exchange(&mut self, time: f64, event: bool) -> Result<(), Self::Error>;
    /// Reads back the inputs whose change is an event: has one another value than last time?
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn inputs_changed(&mut self) -> Result<bool, ImportError> {
        Ok(false)
    }
}

/// How to integrate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Integrator {
    /// Explicit, until the system turns out to be stiff.
    #[default]
    Automatic,
    /// Dormand and Prince 5(4).
    Explicit,
    /// RODAS4, L-stable.
    Stiff,
    /// Euler's method with steps of this length in s: for comparison only.
    Euler(f64),
}

impl Integrator {
    /// `stiff`: the system was found to be.
    fn solver(self, stiff: bool) -> Solver {
        match self {
            Self::Automatic if stiff => Solver::Stiff,
            Self::Automatic | Self::Explicit => Solver::Explicit,
            Self::Stiff => Solver::Stiff,
            Self::Euler(_) => Solver::FixedEuler,
        }
    }
}

/// Default of the relative tolerance of the local error; the absolute one is this times the nominal value of the state.
pub const TOLERANCE: f64 = 1e-8;

/// How to run a [`IntegratedGroup`].
#[derive(Clone, Debug)]
pub struct IntegrationSettings {
    /// Method.
    pub integrator: Integrator,
    /// Relative tolerance.
    pub tolerance: f64,
    /// Outputs of one FMU are inputs of another.
    pub linked: bool,
    /// Inputs are set from outside at the end of every [`IntegratedGroup::advance`]: it ends in event mode, where all may be set.
    pub opens: bool,
    /// Length of the whole run in s, of which steps and events are a part; 0: not known, and they may be as short as they like.
    pub span: f64,
    /// Steps of one [`IntegratedGroup::advance`] after which it gives up.
    pub most_steps: usize,
    /// Events of one [`IntegratedGroup::advance`] after which it gives up.
    pub most_events: usize,
}

impl Default for IntegrationSettings {
    fn default() -> Self {
        Self {
            integrator: Integrator::Automatic,
            tolerance: TOLERANCE,
            linked: false,
            opens: false,
            span: 0.0,
            most_steps: usize::MAX,
            most_events: usize::MAX,
        }
    }
}

/// What a group has done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Integrator steps accepted.
    pub accepted: usize,
    /// Integrator steps rejected.
    pub rejected: usize,
    /// Events handled.
    pub events: usize,
}

/// What [`IntegratedGroup::advance`] came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IntegrationReached {
    /// An event waits at [`IntegratedGroup::time`]: [`IntegratedGroup::settle`].
    pub event: bool,
    /// An FMU ended the run at [`IntegratedGroup::time`].
    pub terminated: bool,
}

/// What [`IntegratedGroup::settle`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventSettled {
    /// There was an event iteration: outputs may have changed.
    pub changed: bool,
    /// Events handled.
    pub events: u64,
    /// An FMU ended the run.
    pub terminated: bool,
}

/// What an event came from.
#[derive(Clone, Copy, Debug)]
enum IntegrationEvent {
    Indicator(usize),
    Time,
    /// This member requested it when a step was completed.
    Step(usize),
}

/// An FMU of the group.
#[derive(Clone, Debug)]
struct Member {
    states: Range<usize>,
    indicators: Range<usize>,
    /// Completed steps are to be reported.
    completed: bool,
    /// Where its directional derivatives can be used.
    columns: Option<StateColumns>,
    next_event: Option<f64>,
}

/// FMUs that are integrated together.
pub struct IntegratedGroup {
    settings: IntegrationSettings,
    members: Vec<Member>,
    indicators: usize,
    time: f64,
    /// States, then the sensitivities of each lane.
    x: Vec<f64>,
    stepper: ErrorControlledStepper,
    memory: DriverMemory,
    mode: IntegrationMode,
    /// The explicit method was given up.
    stiff: bool,
    /// Steps in a row that looked stiff, and that did not.
    suspicion: (u32, u32),
    /// Directional derivatives were compared with differences and are not to be trusted.
    distrusted: bool,
    along: Option<CarriedSensitivity>,
    statistics: Statistics,
    /// Steps of this call of [`IntegratedGroup::advance`].
    steps: Steps,
    pace: Pace,
    notes: Vec<String>,
}

/// What a group remembers in addition to the states of its FMUs.
#[derive(Clone, Debug)]
pub struct IntegrationSnapshot {
    time: f64,
    x: Vec<f64>,
    memory: DriverMemory,
    mode: IntegrationMode,
    next_events: Vec<Option<f64>>,
    suspicion: (u32, u32),
}

/// Where a group is between its calls.
#[derive(Clone, Copy, Debug)]
struct IntegrationMode {
    /// The FMUs are in event mode.
    open: bool,
    /// The event that waits there.
    pending: Option<IntegrationEvent>,
    /// Discrete states were updated there.
    updated: bool,
    /// States have new values, and nominal values.
    states: bool,
    nominals: bool,
    /// Inputs, states or modes have jumped: nothing is known from the last step.
    fresh: bool,
}

impl IntegratedGroup {
    /// These FMUs, which have just left initialization mode at `time` (s). Runs the first event iteration; the FMUs stay in
    /// event mode.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    pub fn start<F: Fmus + ?Sized>(
        fmus: &mut F,
        time: f64,
        settings: IntegrationSettings,
    ) -> Result<(Self, EventSettled), Failure<F::Error>> {
        let mut members = Vec::new();
        let (mut states, mut indicators) = (0, 0);
        for at in 0..fmus.count() {
            let described = DescribedCounts::from(fmus.description(at));
            let (n, m) =
                fmus.instance(at).counts(described).map_err(|source| Failure::Call { time, source })?;
            let offered = fmus.description(at).model_exchange.as_ref();
            members.push(Member {
                states: states..states + n,
                indicators: indicators..indicators + m,
                completed: offered.is_some_and(|i| i.needs_completed_integrator_step),
                columns: StateColumns::of(fmus.description(at)),
                next_event: None,
            });
            (states, indicators) = (states + n, indicators + m);
        }
        let solver = settings.integrator.solver(false);
        let mut group = Self {
            settings,
            members,
            indicators,
            time,
            x: vec![0.0; states],
            stepper: ErrorControlledStepper::new(solver, vec![1.0; states], indicators),
            memory: DriverMemory::default(),
            mode: IntegrationMode {
                open: true,
                pending: None,
                updated: true,
                states: true,
                nominals: true,
                fresh: true,
            },
            stiff: false,
            suspicion: (0, 0),
            distrusted: false,
            along: None,
            statistics: Statistics::default(),
            steps: Steps::default(),
            pace: Pace::at(time),
            notes: Vec::new(),
        };
        let terminated = group.iterate(fmus)?;
        Ok((group, EventSettled { changed: true, events: 0, terminated }))
    }

    /// Some FMU may have an event whose time is not known beforehand.
    pub fn finds_events(&self) -> bool {
        self.indicators > 0 || self.members.iter().any(|m| m.completed)
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// States of all FMUs, known while they are in continuous-time mode.
    pub fn states(&self) -> &[f64] {
        &self.x[..self.state_count()]
    }

    fn state_count(&self) -> usize {
        self.members.last().map_or(0, |m| m.states.end)
    }

    /// What it has done so far.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// What it chose on the way, to be reported to the user.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What has to be restored together with the states of the FMUs, to go back.
    pub fn snapshot(&self) -> IntegrationSnapshot {
        IntegrationSnapshot {
            time: self.time,
            x: self.x.clone(),
            memory: self.memory,
            mode: self.mode,
            next_events: self.members.iter().map(|m| m.next_event).collect(),
            suspicion: self.suspicion,
        }
    }

    /// Goes back; the states of the FMUs have been restored.
    pub fn restore(&mut self, to: &IntegrationSnapshot) {
        (self.time, self.memory, self.suspicion) = (to.time, to.memory, to.suspicion);
        self.pace = Pace::at(to.time);
        self.mode = IntegrationMode { fresh: true, nominals: true, ..to.mode };
        self.x.copy_from_slice(&to.x);
        self.members.iter_mut().zip(&to.next_events).for_each(|(m, next)| m.next_event = *next);
    }

    /// A failed call at the time of the group.
    fn call<E>(&self) -> impl Fn(ImportError) -> Failure<E> + use<E> {
        let time = self.time;
        move |source| Failure::Call { time, source }
    }
}
