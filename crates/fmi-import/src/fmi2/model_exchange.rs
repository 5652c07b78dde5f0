//! Model Exchange of FMI 2.0.

use trueup_fmi::abi::fmi2::*;

use super::Fmi2Instance;
use crate::core::{UNWRITTEN, call, lent};
use crate::error::ImportError;
use crate::results::{CompletedStep, EventInfo};

impl Fmi2Instance {
    fn states_length(&self, function: &'static str, got: usize) -> Result<(), ImportError> {
        self.core.length(function, "states", self.core.fmu.description().structure.derivatives.len(), got)
    }

    /// Enters event mode.
    ///
    /// # Errors
    /// Whatever `fmi2EnterEventMode` returns.
    pub fn enter_event_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi2EnterEventMode)
    }

    /// One event iteration.
    ///
    /// # Errors
    /// Whatever `fmi2NewDiscreteStates` returns.
    pub fn new_discrete_states(&mut self) -> Result<EventInfo, ImportError> {
        let mut info = fmi2EventInfo::default();
        call!(self.core, fmi2NewDiscreteStates, &raw mut info)?;
        Ok(EventInfo {
            again: info.newDiscreteStatesNeeded != fmi2False,
            terminate: info.terminateSimulation != fmi2False,
            nominals_changed: info.nominalsOfContinuousStatesChanged != fmi2False,
            states_changed: info.valuesOfContinuousStatesChanged != fmi2False,
            next_event: (info.nextEventTimeDefined != fmi2False).then_some(info.nextEventTime),
        })
    }

    /// Enters continuous-time mode.
    ///
    /// # Errors
    /// Whatever `fmi2EnterContinuousTimeMode` returns.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi2EnterContinuousTimeMode)
    }

    /// Reports that an integrator step is accepted. `no_rollback`: no state before now will be restored.
    ///
    /// # Errors
    /// Whatever `fmi2CompletedIntegratorStep` returns.
    pub fn completed_integrator_step(&mut self, no_rollback: bool) -> Result<CompletedStep, ImportError> {
        let (mut event, mut terminate) = (fmi2False, fmi2False);
        call!(
            self.core,
            fmi2CompletedIntegratorStep,
            no_rollback.into(),
            &raw mut event,
            &raw mut terminate
        )?;
        Ok(CompletedStep { event: event != fmi2False, terminate: terminate != fmi2False })
    }

    /// Sets the time in s.
    ///
    /// # Errors
    /// Whatever `fmi2SetTime` returns.
    pub fn set_time(&mut self, time: f64) -> Result<(), ImportError> {
        call!(self.core, fmi2SetTime, time)
    }

    /// Sets the states.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2SetContinuousStates` returns.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), ImportError> {
        self.states_length("fmi2SetContinuousStates", states.len())?;
        lent(states, |x| call!(self.core, fmi2SetContinuousStates, x, states.len()))
    }

    /// The states.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetContinuousStates` returns.
    pub fn get_continuous_states(&mut self, states: &mut [f64]) -> Result<(), ImportError> {
        self.states_length("fmi2GetContinuousStates", states.len())?;
        states.fill(UNWRITTEN);
        call!(self.core, fmi2GetContinuousStates, states.as_mut_ptr(), states.len())
    }

    /// Their derivatives.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetDerivatives` returns.
    pub fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), ImportError> {
        self.states_length("fmi2GetDerivatives", derivatives.len())?;
        derivatives.fill(UNWRITTEN);
        call!(self.core, fmi2GetDerivatives, derivatives.as_mut_ptr(), derivatives.len())
    }

    /// Their nominal values.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetNominalsOfContinuousStates` returns.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), ImportError> {
        self.states_length("fmi2GetNominalsOfContinuousStates", nominals.len())?;
        call!(self.core, fmi2GetNominalsOfContinuousStates, nominals.as_mut_ptr(), nominals.len())
    }

    /// The event indicators.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetEventIndicators` returns.
    pub fn get_event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), ImportError> {
        let expected = self.core.fmu.description().event_indicators();
        self.core.length("fmi2GetEventIndicators", "indicators", expected, indicators.len())?;
        indicators.fill(UNWRITTEN);
        call!(self.core, fmi2GetEventIndicators, indicators.as_mut_ptr(), indicators.len())
    }
}
