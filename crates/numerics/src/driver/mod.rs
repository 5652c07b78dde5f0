//! Simulation of a [`Hybrid`] model from one time to another: what Co-Simulation and native runs use.
//!
//! The caller owns the state and lends it ([`DriverState`]); a [`Driver`] holds options and work space only, so a
//! [`DriverState`] (with its [`DriverMemory`]) that is copied, stored and restored elsewhere continues bit by bit.

mod advance;
mod frozen;
mod run;
mod step;
mod terms;

pub use run::{SimulationRecord, simulate};
pub use step::{ErrorControlledStepper, OdeSystem};
pub use terms::{
    DriveError, DriverMemory, DriverMoment, DriverOptions, DriverQuantity, DriverReached, DriverState,
    DriverView, EventCause, Flow, Solver, StepInputs,
};

use crate::hybrid::{At, Hybrid, ModelSizes};
use crate::integrate::not_finite;
use frozen::FrozenWorkspace;

/// Options and work space for models of given sizes.
pub struct Driver {
    /// May be changed between calls, except `solver`.
    pub options: DriverOptions,
    sizes: ModelSizes,
    stepper: ErrorControlledStepper,
    work: FrozenWorkspace,
    /// What a model sees while it chooses its first modes: all 0.
    no_modes: Vec<i32>,
    u0: Vec<f64>,
    /// States and modes before an event iteration that is only tried.
    kept: (Vec<f64>, Vec<i32>),
}

impl core::fmt::Debug for Driver {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Driver")
            .field("options", &self.options)
            .field("sizes", &self.sizes)
            .finish_non_exhaustive()
    }
}

impl Driver {
    /// Allocates everything. `nominal` are the typical magnitudes of the states (missing ones: 1).
    pub fn new(sizes: ModelSizes, nominal: &[f64], options: DriverOptions) -> Self {
        let n = sizes.states;
        let mut nominal = nominal.to_vec();
        nominal.resize(n, 1.0);
        Self {
            options,
            sizes,
            stepper: ErrorControlledStepper::new(options.solver, nominal, sizes.indicators),
            work: FrozenWorkspace::new(sizes),
            no_modes: vec![0; sizes.modes],
            u0: vec![0.0; sizes.inputs],
            kept: (vec![0.0; n], vec![0; sizes.modes]),
        }
    }

    /// Initial states from the parameters at `DriverState::t`, modes that fit, event iteration until nothing changes.
    ///
    /// # Errors
    /// A state or input that is not finite; an event iteration without end.
    pub fn initialise<M: Hybrid>(&mut self, model: &M, s: &mut DriverState) -> Result<(), DriveError> {
        model.start(s.p, s.x);
        self.initialise_from(model, s)
    }

    /// As [`Driver::initialise`], from the states given.
    ///
    /// # Errors
    /// As [`Driver::initialise`].
    pub fn initialise_from<M: Hybrid>(&mut self, model: &M, s: &mut DriverState) -> Result<(), DriveError> {
        self.check(s)?;
        *s.memory = DriverMemory::default();
        self.work.make_room(model);
        let at = At { t: *s.t, x: s.x, u: s.u, p: s.p, modes: &self.no_modes };
        model.start_modes(at, s.modes);
        self.handle_event(model, s).map(|_| ())
    }

    /// Event iteration at `DriverState::t`; did anything change?
    ///
    /// # Errors
    /// A state or input that is not finite; an event iteration without end.
    pub fn handle_event<M: Hybrid>(&mut self, model: &M, s: &mut DriverState) -> Result<bool, DriveError> {
        self.check(s)?;
        for pass in 0..self.options.max_passes {
            if model.update(*s.t, s.x, s.u, s.p, s.modes).settled() {
                self.check(s)?;
                return Ok(pass > 0);
            }
        }
        Err(DriveError::EventIteration { t: *s.t })
    }

    fn check(&self, s: &DriverState) -> Result<(), DriveError> {
        let n = self.sizes;
        if [s.x.len(), s.u.len(), s.p.len(), s.modes.len()] != [n.states, n.inputs, n.parameters, n.modes] {
            return Err(DriveError::Lengths { expected: n });
        }
        let what = not_finite(s.u).map(DriverQuantity::Input).or(not_finite(s.x).map(DriverQuantity::State));
        what.map_or(Ok(()), |what| Err(DriveError::NotFinite { t: *s.t, what }))
    }
}
