//! FMUs of Model Exchange, integrated together as one hybrid system.
//!
//! A [`Group`] has the states of all its FMUs side by side. Rates are evaluated by setting time and states of every
//! FMU, handing outputs on to inputs in the order of dependency ([`Surroundings`]) and asking every FMU for its
//! derivatives. Between events a one-step method of `trueup-numerics` integrates; state events are located on its
//! dense output, time events are hit exactly, and at an event all FMUs iterate until none of them, and no value that
//! they exchange, changes any more.

mod advance;
mod calls;
mod field;
mod iterate;
mod linear;

use std::ops::Range;

use trueup_fmi_import::Error as FmuError;
use trueup_numerics::driver::{Memory, Solver, Stepper};

use self::calls::Columns;
pub use self::linear::{Linear, Point};
use crate::error::Error;
use crate::node::Node;
use crate::pace::Pace;
use crate::slave::Block;

/// What acts on the FMUs of a group, and what they do to each other.
pub trait Surroundings {
    /// Sets the inputs at `time` (s), those that come from other FMUs of the group in the order of dependency. In
    /// `event` mode discrete inputs are set too, else continuous ones only.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn exchange(&mut self, nodes: &mut [Node], time: f64, event: bool) -> Result<(), Error>;
}

/// Nothing is connected.
impl Surroundings for () {
    fn exchange(&mut self, _: &mut [Node], _: f64, _: bool) -> Result<(), Error> {
        Ok(())
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

/// Relative tolerance of the local error where nobody asks for another; the absolute one is this times the nominal
/// value of the state.
pub const TOLERANCE: f64 = 1e-8;

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

/// What [`Group::advance`] came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reached {
    /// An event waits at [`Group::time`]: [`Group::settle`].
    pub event: bool,
    /// An FMU ended the run at [`Group::time`].
    pub terminated: bool,
}

/// What [`Group::settle`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Settled {
    /// There was an event iteration: outputs may have changed.
    pub changed: bool,
    /// Events handled.
    pub events: u64,
    /// An FMU ended the run.
    pub terminated: bool,
}

/// An FMU of the group.
#[derive(Clone, Debug)]
struct Member {
    /// Its place among all nodes.
    node: usize,
    states: Range<usize>,
    indicators: Range<usize>,
    /// It wants to hear of completed steps.
    completed: bool,
    /// Where its directional derivatives can be used.
    columns: Option<Columns>,
    next_event: Option<f64>,
}

/// How to run a [`Group`].
#[derive(Clone, Debug)]
pub struct Settings {
    /// Method.
    pub integrator: Integrator,
    /// Relative tolerance.
    pub tolerance: f64,
    /// Outputs of one FMU are inputs of another.
    pub linked: bool,
    /// Inputs whose change is an event, if it happens in event mode: node and variables of one type.
    pub inputs: Vec<(usize, Block)>,
    /// Inputs are set from outside at the end of every [`Group::advance`]: it ends in event mode, where all may be set.
    pub opens: bool,
    /// Length of the whole run in s, of which steps and events are a part; 0: not known, and they may be as short as they like.
    pub span: f64,
}

impl Default for Settings {
    fn default() -> Self {
        let (integrator, inputs) = (Integrator::Automatic, Vec::new());
        Self { integrator, tolerance: TOLERANCE, linked: false, inputs, opens: false, span: 0.0 }
    }
}

/// FMUs that are integrated together.
pub struct Group {
    settings: Settings,
    members: Vec<Member>,
    indicators: usize,
    time: f64,
    x: Vec<f64>,
    stepper: Stepper,
    memory: Memory,
    mode: Mode,
    /// The explicit method was given up.
    stiff: bool,
    /// Steps in a row that looked stiff, and that did not.
    suspicion: (u32, u32),
    /// Directional derivatives were compared with differences and are not to be trusted.
    distrusted: bool,
    statistics: Statistics,
    pace: Pace,
    notes: Vec<String>,
}

/// What a group remembers beside the states of its FMUs.
#[derive(Clone, Debug)]
pub struct Snapshot {
    time: f64,
    x: Vec<f64>,
    memory: Memory,
    mode: Mode,
    next_events: Vec<Option<f64>>,
    inputs: Vec<(usize, Block)>,
    suspicion: (u32, u32),
}

/// Where a group stands between its calls.
#[derive(Clone, Copy, Debug)]
struct Mode {
    /// The FMUs are in event mode.
    open: bool,
    /// An event waits there.
    pending: bool,
    /// Discrete states were updated there.
    updated: bool,
    /// States have new values, and nominal values.
    states: bool,
    nominals: bool,
    /// Inputs, states or modes have jumped: nothing is known from the last step.
    fresh: bool,
}

impl Group {
    /// The FMUs at these places among `nodes`, which have just left initialization mode at `time` (s). Runs the first
    /// event iteration; the FMUs stay in event mode.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    pub fn start(
        nodes: &mut [Node],
        members: &[usize],
        time: f64,
        settings: Settings,
        around: &mut dyn Surroundings,
    ) -> Result<(Self, Settled), Error> {
        let mut list = Vec::new();
        let (mut states, mut indicators) = (0, 0);
        for &at in members {
            let node = &mut nodes[at];
            let (n, m) = node.slave.counts().map_err(|source| Error::Call { time, source })?;
            list.push(Member {
                node: at,
                states: states..states + n,
                indicators: indicators..indicators + m,
                completed: node.offered().is_some_and(|i| i.needs_completed_integrator_step),
                columns: node.columns(),
                next_event: None,
            });
            (states, indicators) = (states + n, indicators + m);
        }
        let solver = settings.integrator.solver(false);
        let mut group = Self {
            settings,
            members: list,
            indicators,
            time,
            x: vec![0.0; states],
            stepper: Stepper::new(solver, vec![1.0; states], indicators),
            memory: Memory::default(),
            mode: Mode {
                open: true,
                pending: false,
                updated: true,
                states: true,
                nominals: true,
                fresh: true,
            },
            stiff: false,
            suspicion: (0, 0),
            distrusted: false,
            statistics: Statistics::default(),
            pace: Pace::at(time),
            notes: Vec::new(),
        };
        let terminated = group.iterate(nodes, around)?;
        Ok((group, Settled { changed: true, events: 0, terminated }))
    }

    /// Some FMU may have an event whose time is not known beforehand.
    pub fn finds_events(&self) -> bool {
        self.indicators > 0 || self.members.iter().any(|m| m.completed)
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// What it has done so far.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// What it chose on the way, to be told to the user.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What has to be restored together with the states of the FMUs, to go back.
    pub fn snapshot(&self) -> Snapshot {
        Snapshot {
            time: self.time,
            x: self.x.clone(),
            memory: self.memory,
            mode: self.mode,
            next_events: self.members.iter().map(|m| m.next_event).collect(),
            inputs: self.settings.inputs.clone(),
            suspicion: self.suspicion,
        }
    }

    /// Goes back; the states of the FMUs have been restored.
    pub fn restore(&mut self, to: &Snapshot) {
        (self.time, self.memory, self.suspicion) = (to.time, to.memory, to.suspicion);
        self.pace = Pace::at(to.time);
        self.mode = Mode { fresh: true, nominals: true, ..to.mode };
        self.x.copy_from_slice(&to.x);
        self.settings.inputs.clone_from(&to.inputs);
        self.members.iter_mut().zip(&to.next_events).for_each(|(m, next)| m.next_event = *next);
    }

    /// A failed call at the time of the group.
    fn call(&self) -> impl Fn(FmuError) -> Error + use<> {
        let time = self.time;
        move |source| Error::Call { time, source }
    }
}
