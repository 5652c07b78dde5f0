//! Co-Simulation of FMI 2.0.

use std::time::{Duration, Instant};

use trueup_fmi::abi::fmi2::*;

use super::Fmi2Instance;
use crate::core::{call, lent};
use crate::error::{FmiStatus, ImportError};
use crate::results::CoSimulationStep;
use crate::{exit, interrupt};

impl Fmi2Instance {
    /// Steps from `time` by `step` s. `no_rollback`: no state before `time` will be restored.
    ///
    /// A step that the FMU discards is no error: see [`CoSimulationStep::discarded`]. A step that the FMU computes in the
    /// background is waited for.
    ///
    /// # Errors
    /// Whatever `fmi2DoStep` returns.
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

    /// As [`Fmi2Instance::do_step`]; `None`: the whole step was made and nothing is to be reported.
    ///
    /// # Errors
    /// As [`Fmi2Instance::do_step`].
    #[inline]
    pub fn step(
        &mut self,
        time: f64,
        step: f64,
        no_rollback: bool,
    ) -> Result<Option<Box<CoSimulationStep>>, Box<ImportError>> {
        match self.core.functions.fmi2DoStep {
            Some(function) if self.core.ready("fmi2DoStep").is_ok() => {
                exit::calls_at(self.core.live.id, time);
                // SAFETY: the signature is the standard's, the component is this instance's and not freed.
                let status = unsafe { function(self.core.component, time, step, no_rollback.into()) };
                if matches!(status.0, 0 | 1) { Ok(None) } else { self.not_whole(status, time) }
            }
            _ => Err(Box::new(match self.core.ready("fmi2DoStep") {
                Err(lost) => lost,
                Ok(()) => self.core.missing("fmi2DoStep"),
            })),
        }
    }

    /// What a status other than OK and Warning means for a step.
    #[cold]
    pub(crate) fn not_whole(
        &mut self,
        status: fmi2Status,
        time: f64,
    ) -> Result<Option<Box<CoSimulationStep>>, Box<ImportError>> {
        let mut result = self.core.check("fmi2DoStep", status.0);
        let (begun, deadline) =
            (Instant::now(), self.core.functions.remote.as_ref().and_then(|r| r.deadline()));
        while result.as_ref().is_err_and(|error| error.status() == Some(FmiStatus::Pending)) {
            std::thread::sleep(Duration::from_micros(100));
            let overdue = deadline.filter(|deadline| begun.elapsed() >= *deadline);
            let how = overdue
                .map(|deadline| format!("answered Pending for {} s and was stopped", deadline.as_secs_f64()));
            let how = how.or_else(|| {
                interrupt::requested().then(|| "answered Pending, and the run is interrupted".to_owned())
            });
            if let Some(how) = how {
                return Err(Box::new(self.core.give_up("fmi2DoStep", how)));
            }
            let mut status = fmi2Pending;
            call!(self.core, fmi2GetStatus, fmi2DoStepStatus, &raw mut status)?;
            result = self.core.check("fmi2DoStep", status.0);
        }
        match result {
            Ok(()) => Ok(None),
            Err(error) if error.status() == Some(FmiStatus::Discard) => {
                Ok(Some(Box::new(CoSimulationStep {
                    // An FMU that cannot say is where it was.
                    time: self.real_status(fmi2LastSuccessfulTime).unwrap_or(time),
                    early: true,
                    discarded: true,
                    event: false,
                    terminate: self.boolean_status(fmi2Terminated).unwrap_or(false),
                })))
            }
            Err(error) => Err(Box::new(error)),
        }
    }

    /// `fmi2GetRealStatus`.
    ///
    /// # Errors
    /// Whatever it returns.
    pub fn real_status(&mut self, kind: fmi2StatusKind) -> Result<f64, ImportError> {
        let mut value = f64::NAN;
        call!(self.core, fmi2GetRealStatus, kind, &raw mut value)?;
        Ok(value)
    }

    /// `fmi2GetBooleanStatus`.
    ///
    /// # Errors
    /// Whatever it returns.
    pub fn boolean_status(&mut self, kind: fmi2StatusKind) -> Result<bool, ImportError> {
        let mut value = fmi2False;
        call!(self.core, fmi2GetBooleanStatus, kind, &raw mut value)?;
        Ok(value != fmi2False)
    }

    /// Derivatives of inputs with respect to time, each of its order (from 1), for the next step.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2SetRealInputDerivatives` returns.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), ImportError> {
        self.core.length("fmi2SetRealInputDerivatives", "orders", references.len(), orders.len())?;
        self.core.length("fmi2SetRealInputDerivatives", "values", references.len(), values.len())?;
        let n = references.len();
        lent(references, |r| {
            lent(orders, |o| lent(values, |v| call!(self.core, fmi2SetRealInputDerivatives, r, n, o, v)))
        })
    }

    /// Derivatives of outputs with respect to time, each of its order (from 1).
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetRealOutputDerivatives` returns.
    pub fn get_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), ImportError> {
        self.core.length("fmi2GetRealOutputDerivatives", "orders", references.len(), orders.len())?;
        self.core.length("fmi2GetRealOutputDerivatives", "values", references.len(), values.len())?;
        let n = references.len();
        call!(
            self.core,
            fmi2GetRealOutputDerivatives,
            references.as_ptr(),
            n,
            orders.as_ptr(),
            values.as_mut_ptr()
        )
    }
}
