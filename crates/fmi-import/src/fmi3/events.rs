//! Event mode, continuous-time mode (Model Exchange), steps (Co-Simulation).

use trueup_fmi::abi::fmi3::*;

use super::Fmi3Instance;
use crate::core::{UNWRITTEN, call, lent};
use crate::error::{FmiStatus, ImportError};
use crate::exit;
use crate::results::{CoSimulationStep, CompletedStep, EventInfo};

impl Fmi3Instance {
    /// Enters event mode.
    ///
    /// # Errors
    /// Whatever `fmi3EnterEventMode` returns.
    pub fn enter_event_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi3EnterEventMode)
    }

    /// One event iteration.
    ///
    /// # Errors
    /// Whatever `fmi3UpdateDiscreteStates` returns.
    pub fn update_discrete_states(&mut self) -> Result<EventInfo, ImportError> {
        let [mut again, mut terminate, mut nominals, mut states, mut defined] = [fmi3False; 5];
        let mut next = 0.0;
        call!(
            self.core,
            fmi3UpdateDiscreteStates,
            &raw mut again,
            &raw mut terminate,
            &raw mut nominals,
            &raw mut states,
            &raw mut defined,
            &raw mut next
        )?;
        Ok(EventInfo {
            again: again.into(),
            terminate: terminate.into(),
            nominals_changed: nominals.into(),
            states_changed: states.into(),
            next_event: bool::from(defined).then_some(next),
        })
    }

    /// Evaluates discrete states within an event iteration (clocked FMUs).
    ///
    /// # Errors
    /// Whatever `fmi3EvaluateDiscreteStates` returns.
    pub fn evaluate_discrete_states(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi3EvaluateDiscreteStates)
    }

    /// New intervals of clocks in s; `None`: unchanged or not yet known.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetIntervalDecimal` returns.
    pub fn get_intervals(
        &mut self,
        clocks: &[u32],
        intervals: &mut [Option<f64>],
    ) -> Result<(), ImportError> {
        self.core.length("fmi3GetIntervalDecimal", "intervals", clocks.len(), intervals.len())?;
        let mut values = vec![0.0; clocks.len()];
        let mut qualifiers = vec![fmi3IntervalNotYetKnown; clocks.len()];
        let (values_pointer, qualifiers_pointer) = (values.as_mut_ptr(), qualifiers.as_mut_ptr());
        call!(
            self.core,
            fmi3GetIntervalDecimal,
            clocks.as_ptr(),
            clocks.len(),
            values_pointer,
            qualifiers_pointer
        )?;
        for (i, interval) in intervals.iter_mut().enumerate() {
            *interval = (qualifiers[i] == fmi3IntervalChanged).then_some(values[i]);
        }
        Ok(())
    }
}

/// Most states or event indicators: an array of them takes 2 GiB.
const MOST: usize = 1 << 28;

/// Model Exchange.
impl Fmi3Instance {
    /// Number of continuous states.
    ///
    /// # Errors
    /// Whatever `fmi3GetNumberOfContinuousStates` returns.
    pub fn number_of_states(&mut self) -> Result<usize, ImportError> {
        if let Some(count) = self.counts.0 {
            return Ok(count);
        }
        let mut count = 0;
        call!(self.core, fmi3GetNumberOfContinuousStates, &raw mut count)?;
        self.holds("fmi3GetNumberOfContinuousStates", count)?;
        self.counts.0 = Some(count);
        Ok(count)
    }

    /// Number of event indicators.
    ///
    /// # Errors
    /// Whatever `fmi3GetNumberOfEventIndicators` returns.
    pub fn number_of_event_indicators(&mut self) -> Result<usize, ImportError> {
        if let Some(count) = self.counts.1 {
            return Ok(count);
        }
        let mut count = 0;
        call!(self.core, fmi3GetNumberOfEventIndicators, &raw mut count)?;
        self.holds("fmi3GetNumberOfEventIndicators", count)?;
        self.counts.1 = Some(count);
        Ok(count)
    }

    /// Arrays of so many numbers can be had.
    fn holds(&self, function: &'static str, count: usize) -> Result<(), ImportError> {
        if count <= MOST {
            return Ok(());
        }
        let reason =
            format!("{function} gives {count}, more than memory holds; this function of the FMU is wrong");
        Err(ImportError::File { file: self.fmu().file().to_owned(), reason })
    }

    /// A number that is not the one of the description.
    pub(crate) fn miscounted(
        &self,
        function: &'static str,
        count: usize,
        described: usize,
        element: &'static str,
    ) -> ImportError {
        let reason = format!(
            "{function} gives {count}, but modelDescription.xml has {described} (its elements {element}); this FMU is wrong, export it again"
        );
        ImportError::File { file: self.fmu().file().to_owned(), reason }
    }

    fn states_length(&mut self, function: &'static str, got: usize) -> Result<(), ImportError> {
        let expected = self.number_of_states()?;
        self.core.length(function, "states", expected, got)
    }

    /// Enters continuous-time mode.
    ///
    /// # Errors
    /// Whatever `fmi3EnterContinuousTimeMode` returns.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi3EnterContinuousTimeMode)
    }

    /// Reports that an integrator step is accepted. `no_rollback`: no state before now will be restored.
    ///
    /// # Errors
    /// Whatever `fmi3CompletedIntegratorStep` returns.
    pub fn completed_integrator_step(&mut self, no_rollback: bool) -> Result<CompletedStep, ImportError> {
        let (mut event, mut terminate) = (fmi3False, fmi3False);
        call!(
            self.core,
            fmi3CompletedIntegratorStep,
            no_rollback.into(),
            &raw mut event,
            &raw mut terminate
        )?;
        Ok(CompletedStep { event: event.into(), terminate: terminate.into() })
    }

    /// Sets the time in s.
    ///
    /// # Errors
    /// Whatever `fmi3SetTime` returns.
    pub fn set_time(&mut self, time: f64) -> Result<(), ImportError> {
        call!(self.core, fmi3SetTime, time)
    }

    /// Sets the states.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3SetContinuousStates` returns.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), ImportError> {
        self.states_length("fmi3SetContinuousStates", states.len())?;
        lent(states, |x| call!(self.core, fmi3SetContinuousStates, x, states.len()))
    }

    /// The states.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetContinuousStates` returns.
    pub fn get_continuous_states(&mut self, states: &mut [f64]) -> Result<(), ImportError> {
        self.states_length("fmi3GetContinuousStates", states.len())?;
        states.fill(UNWRITTEN);
        call!(self.core, fmi3GetContinuousStates, states.as_mut_ptr(), states.len())
    }

    /// Their derivatives.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetContinuousStateDerivatives` returns.
    pub fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), ImportError> {
        self.states_length("fmi3GetContinuousStateDerivatives", derivatives.len())?;
        derivatives.fill(UNWRITTEN);
        call!(self.core, fmi3GetContinuousStateDerivatives, derivatives.as_mut_ptr(), derivatives.len())
    }

    /// Their nominal values.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetNominalsOfContinuousStates` returns.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), ImportError> {
        self.states_length("fmi3GetNominalsOfContinuousStates", nominals.len())?;
        call!(self.core, fmi3GetNominalsOfContinuousStates, nominals.as_mut_ptr(), nominals.len())
    }

    /// The event indicators.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetEventIndicators` returns.
    pub fn get_event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), ImportError> {
        let expected = self.number_of_event_indicators()?;
        self.core.length("fmi3GetEventIndicators", "indicators", expected, indicators.len())?;
        indicators.fill(UNWRITTEN);
        call!(self.core, fmi3GetEventIndicators, indicators.as_mut_ptr(), indicators.len())
    }
}

/// Co-Simulation.
impl Fmi3Instance {
    /// From event mode back to step mode.
    ///
    /// # Errors
    /// Whatever `fmi3EnterStepMode` returns.
    pub fn enter_step_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi3EnterStepMode)
    }

    /// Steps from `time` by `step` s. `no_rollback`: no state before `time` will be restored.
    ///
    /// A step that the FMU discards is no error: see [`CoSimulationStep::discarded`].
    ///
    /// # Errors
    /// Whatever `fmi3DoStep` returns; [`ImportError::Panicked`] if the intermediate-update closure did.
    pub fn do_step(
        &mut self,
        time: f64,
        step: f64,
        no_rollback: bool,
    ) -> Result<CoSimulationStep, ImportError> {
        match self.step(time, step, no_rollback) {
            Ok(None) => Ok(CoSimulationStep::whole(time, step)),
            Ok(Some(other)) => Ok(*other),
            Err(error) => Err(*error),
        }
    }

    /// As [`Fmi3Instance::do_step`]; `None`: the whole step was made and nothing is to be reported.
    ///
    /// # Errors
    /// As [`Fmi3Instance::do_step`].
    #[inline]
    pub fn step(
        &mut self,
        time: f64,
        step: f64,
        no_rollback: bool,
    ) -> Result<Option<Box<CoSimulationStep>>, Box<ImportError>> {
        let [mut event, mut terminate, mut early] = [fmi3False; 3];
        let mut last = time;
        exit::calls_at(self.core.live.id, time);
        let result = call!(
            self.core,
            fmi3DoStep,
            time,
            step,
            no_rollback.into(),
            &raw mut event,
            &raw mut terminate,
            &raw mut early,
            &raw mut last
        );
        self.stepped(result, time, step, [event, terminate, early].map(bool::from), last)
    }

    /// What the result and the flags of a step mean: event, terminate, early; `last` successful time.
    #[inline]
    pub(crate) fn stepped(
        &self,
        result: Result<(), ImportError>,
        time: f64,
        step: f64,
        [event, terminate, early]: [bool; 3],
        last: f64,
    ) -> Result<Option<Box<CoSimulationStep>>, Box<ImportError>> {
        if let Some(message) = self.core.live.take_panic() {
            return Err(Box::new(ImportError::Panicked { instance: self.name().into(), message }));
        }
        let discarded = match result {
            Ok(()) if !(event || terminate || early) => return Ok(None),
            Ok(()) => false,
            Err(error) if error.status() == Some(FmiStatus::Discard) => true,
            Err(error) => return Err(Box::new(error)),
        };
        let early = discarded || early;
        // Some FMUs do not write the time of a full step.
        let time = if early { last } else { time + step };
        Ok(Some(Box::new(CoSimulationStep { time, early, discarded, event, terminate })))
    }
}
