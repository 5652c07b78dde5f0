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

use std::ops::Range;

use trueup_fmi_import::Error as FmuError;
use trueup_numerics::driver::{Memory, Solver, Stepper};

use self::calls::Columns;
use crate::error::Error;
use crate::node::Node;

/// What acts on the FMUs of a group, and what they do to each other.
pub trait Surroundings {
    /// Sets the inputs at `time` (s), those that come from other FMUs of the group in the order of dependency. In
    /// `event` mode discrete inputs are set too, else continuous ones only. Returns whether an input has got
    /// another value; asked in event mode only.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn exchange(&mut self, nodes: &mut [Node], time: f64, event: bool) -> Result<bool, Error>;
}

/// Nothing is connected.
impl Surroundings for () {
    fn exchange(&mut self, _: &mut [Node], _: f64, _: bool) -> Result<bool, Error> {
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
    /// An event waits at the end of the interval: [`Group::settle`].
    pub pending: bool,
    /// An FMU ended the run at [`Group::time`].
    pub terminated: bool,
}

/// What a [`Group::advance`] tells its observer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// An event is due; all values are those before it.
    Before,
    /// It has been handled.
    After,
}

/// Called at every event inside an interval, with the time in s; outputs may be read.
pub type Observer<'a> = &'a mut dyn FnMut(&mut [Node], f64, Moment) -> Result<(), Error>;

/// An FMU of the group.
#[derive(Clone, Debug)]
struct Member {
    /// Its place among all nodes.
    slave: usize,
    states: Range<usize>,
    indicators: Range<usize>,
    /// It wants to hear of completed steps.
    completed: bool,
    /// Where its directional derivatives can be used.
    columns: Option<Columns>,
    next_event: Option<f64>,
}

/// FMUs that are integrated together.
pub struct Group {
    members: Vec<Member>,
    time: f64,
    x: Vec<f64>,
    stepper: Stepper,
    indicators: usize,
    memory: Memory,
    integrator: Integrator,
    /// The explicit method was given up.
    stiff: bool,
    /// Steps in a row that looked stiff, and that did not.
    suspicion: (u32, u32),
    tolerance: f64,
    /// Inputs or states have jumped: nothing is known from the last step.
    fresh: bool,
    /// FMUs are connected to each other: directional derivatives of one are not all.
    linked: bool,
    /// Directional derivatives were compared with differences and are not to be trusted.
    distrusted: bool,
    statistics: Statistics,
    notes: Vec<String>,
}

impl Group {
    /// The FMUs at these places among `nodes`, each in event mode or continuous-time mode after initialization at
    /// `time` (s). `linked`: outputs of one are inputs of another. Runs the first event iteration.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    pub fn start(
        nodes: &mut [Node],
        members: &[usize],
        time: f64,
        linked: bool,
        integrator: Integrator,
        tolerance: f64,
        around: &mut dyn Surroundings,
    ) -> Result<(Self, Reached), Error> {
        let mut group = Self {
            members: Vec::new(),
            time,
            x: Vec::new(),
            stepper: Stepper::new(Solver::Explicit, Vec::new(), 0),
            indicators: 0,
            memory: Memory::default(),
            integrator,
            stiff: false,
            suspicion: (0, 0),
            tolerance,
            fresh: true,
            linked,
            distrusted: false,
            statistics: Statistics::default(),
            notes: Vec::new(),
        };
        let (mut states, mut indicators) = (0, 0);
        for &slave in members {
            let instance = &mut nodes[slave];
            let (n, m) = instance.counts().map_err(|source| Error::Call { time, source })?;
            let can = instance.abilities();
            group.members.push(Member {
                slave,
                states: states..states + n,
                indicators: indicators..indicators + m,
                completed: can.needs_completed_integrator_step,
                columns: instance.columns().filter(|_| can.provides_directional_derivatives),
                next_event: None,
            });
            (states, indicators) = (states + n, indicators + m);
        }
        group.x = vec![0.0; states];
        group.indicators = indicators;
        group.stepper = group.method(vec![1.0; states]);
        let terminated = group.iterate(nodes, around)?;
        Ok((group, Reached { pending: false, terminated }))
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

    fn method(&self, nominal: Vec<f64>) -> Stepper {
        let solver = match self.integrator {
            Integrator::Automatic if self.stiff => Solver::Stiff,
            Integrator::Automatic | Integrator::Explicit => Solver::Explicit,
            Integrator::Stiff => Solver::Stiff,
            Integrator::Euler(_) => Solver::FixedEuler,
        };
        Stepper::new(solver, nominal, self.indicators)
    }

    /// A failed call at the time of the group.
    fn call(&self) -> impl Fn(FmuError) -> Error + use<> {
        let time = self.time;
        move |source| Error::Call { time, source }
    }
}
