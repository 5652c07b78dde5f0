//! Instances of FMI 2.0.

#![allow(unsafe_code)] // the C boundary

use std::ffi::c_void;
use std::sync::Arc;
use std::time::{Duration, Instant};

use trueup_fmi::abi::fmi2::*;

use crate::core::{
    Completed, Core, EventInfo, Experiment, Options, Prepared, StateId, States, Step, c_string, c_strings,
    call, call_prepared, lent, state_functions,
};
use crate::error::{Error, Status};
use crate::exit;
use crate::interrupt;
use crate::library::{Fmu, Interface};
use crate::log::{Message, text, trueup_fmi2_logger};
use crate::open;
use crate::table::table2::Functions;

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// An instance. It may move between threads, one thread at a time.
pub struct Instance {
    pub(crate) core: Core<Functions>,
    states: States,
    /// Booleans as the FMU has them.
    raw: Vec<fmi2Boolean>,
    /// FMUs keep the pointer, so it must outlive the instance (declared after `core`, dropped after it).
    callbacks: Option<Box<fmi2CallbackFunctions>>,
}

// SAFETY: FMI asks that one thread at a time calls an instance, not that it is always the same.
unsafe impl Send for Instance {}

impl Instance {
    /// Instantiates.
    ///
    /// # Errors
    /// [`Error::Interface`], [`Error::File`] if the library cannot be loaded, [`Error::Instantiate`].
    pub fn new(fmu: &Arc<Fmu>, interface: Interface, options: Options) -> Result<Self, Error> {
        let (visible, logging_on) = (options.visible.into(), options.logging_on.into());
        let mut core = Core::new(fmu, Functions::none(), options);
        core.functions = open::two(fmu, interface, &core.live)?;
        let callbacks = Box::new(fmi2CallbackFunctions {
            logger: Some(trueup_fmi2_logger),
            allocateMemory: Some(calloc),
            freeMemory: Some(free),
            stepFinished: None,
            componentEnvironment: core.live.environment(),
        });
        let name = c_string("instance name", &core.live.name)?;
        let guid = c_string("guid", &fmu.description().token)?;
        let resources = c_string("resource location", &fmu.resource_uri())?;
        let kind = match interface {
            Interface::ModelExchange => fmi2ModelExchange,
            Interface::CoSimulation => fmi2CoSimulation,
        };
        let callbacks_pointer: *const fmi2CallbackFunctions = &*callbacks;
        core.mark();
        core.component = match &core.functions.remote {
            Some(remote) => remote.instantiate_two(kind.0, [&name, &guid, &resources], [visible, logging_on]),
            None => {
                let function = core.functions.fmi2Instantiate;
                let function = function.ok_or_else(|| core.missing("fmi2Instantiate"))?;
                // SAFETY: the standard's signature; the texts live through the call, the callbacks as long as the instance.
                unsafe {
                    function(
                        name.as_ptr(),
                        kind,
                        guid.as_ptr(),
                        resources.as_ptr(),
                        callbacks_pointer,
                        visible,
                        logging_on,
                    )
                }
            }
        };
        if core.component.is_null() {
            return Err(core.no_instance("fmi2Instantiate"));
        }
        Ok(Self { core, states: States::default(), raw: Vec::new(), callbacks: Some(callbacks) })
    }

    /// The FMU.
    pub fn fmu(&self) -> &Arc<Fmu> {
        &self.core.fmu
    }

    /// Name of the instance.
    pub fn name(&self) -> &str {
        &self.core.live.name
    }

    /// The last messages of this instance, oldest first.
    pub fn log(&self) -> Vec<Message> {
        self.core.live.messages()
    }

    /// Which debug messages are wanted; no category: all.
    ///
    /// # Errors
    /// Whatever `fmi2SetDebugLogging` returns.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), Error> {
        let texts = c_strings("log category", categories)?;
        let pointers: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
        call!(self.core, fmi2SetDebugLogging, on.into(), pointers.len(), pointers.as_ptr())
    }

    /// Hands over the experiment and enters initialization mode.
    ///
    /// # Errors
    /// Whatever `fmi2SetupExperiment`, `fmi2EnterInitializationMode` return.
    pub fn enter_initialization_mode(&mut self, experiment: Experiment) -> Result<(), Error> {
        let Experiment { tolerance, start, stop } = experiment;
        let (with_tolerance, with_stop) = (tolerance.is_some().into(), stop.is_some().into());
        let (tolerance, stop) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        call!(self.core, fmi2SetupExperiment, with_tolerance, tolerance, start, with_stop, stop)?;
        call!(self.core, fmi2EnterInitializationMode)
    }

    /// Leaves it.
    ///
    /// # Errors
    /// Whatever `fmi2ExitInitializationMode` returns.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Error> {
        call!(self.core, fmi2ExitInitializationMode)
    }

    /// Ends the run. Stored states are freed before.
    ///
    /// # Errors
    /// Whatever `fmi2Terminate` returns.
    pub fn terminate(&mut self) -> Result<(), Error> {
        self.free_states();
        call!(self.core, fmi2Terminate)
    }

    /// Back to where it was after instantiation.
    ///
    /// # Errors
    /// Whatever `fmi2Reset` returns.
    pub fn reset(&mut self) -> Result<(), Error> {
        call!(self.core, fmi2Reset)
    }

    /// Values of Reals.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetReal` returns.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Error> {
        self.core.length("fmi2GetReal", "values", references.len(), values.len())?;
        lent(references, |r| call!(self.core, fmi2GetReal, r, references.len(), values.as_mut_ptr()))
    }

    /// Sets Reals.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2SetReal` returns.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), Error> {
        self.core.length("fmi2SetReal", "values", references.len(), values.len())?;
        lent(references, |r| lent(values, |v| call!(self.core, fmi2SetReal, r, references.len(), v)))
    }

    /// Values of Integers and Enumerations.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetInteger` returns.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), Error> {
        self.core.length("fmi2GetInteger", "values", references.len(), values.len())?;
        lent(references, |r| call!(self.core, fmi2GetInteger, r, references.len(), values.as_mut_ptr()))
    }

    /// Sets Integers and Enumerations.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2SetInteger` returns.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), Error> {
        self.core.length("fmi2SetInteger", "values", references.len(), values.len())?;
        lent(references, |r| lent(values, |v| call!(self.core, fmi2SetInteger, r, references.len(), v)))
    }

    /// Values of Booleans.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetBoolean` returns.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [bool]) -> Result<(), Error> {
        self.core.length("fmi2GetBoolean", "values", references.len(), values.len())?;
        self.raw.clear();
        self.raw.resize(values.len(), fmi2False);
        lent(references, |r| call!(self.core, fmi2GetBoolean, r, references.len(), self.raw.as_mut_ptr()))?;
        values.iter_mut().zip(&self.raw).for_each(|(value, raw)| *value = *raw != fmi2False);
        Ok(())
    }

    /// Sets Booleans.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2SetBoolean` returns.
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Result<(), Error> {
        self.core.length("fmi2SetBoolean", "values", references.len(), values.len())?;
        self.raw.clear();
        self.raw.extend(values.iter().map(|value| fmi2Boolean::from(*value)));
        lent(references, |r| call!(self.core, fmi2SetBoolean, r, references.len(), self.raw.as_ptr()))
    }

    /// Values of Strings.
    ///
    /// # Errors
    /// Whatever `fmi2GetString` returns.
    pub fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, Error> {
        let mut raw = vec![std::ptr::null(); references.len()];
        lent(references, |r| call!(self.core, fmi2GetString, r, references.len(), raw.as_mut_ptr()))?;
        // SAFETY: the FMU's texts are NULL or null-terminated, and valid until its next call.
        Ok(raw.into_iter().map(|pointer| unsafe { text(pointer) }).collect())
    }

    /// Sets Strings.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::Text`]; whatever `fmi2SetString` returns.
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Result<(), Error> {
        self.core.length("fmi2SetString", "values", references.len(), values.len())?;
        let texts = c_strings("value", values)?;
        let raw: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
        lent(references, |r| call!(self.core, fmi2SetString, r, references.len(), raw.as_ptr()))
    }

    state_functions!(
        fmi2GetFMUstate,
        fmi2SetFMUstate,
        fmi2FreeFMUstate,
        fmi2SerializedFMUstateSize,
        fmi2SerializeFMUstate,
        fmi2DeSerializeFMUstate
    );

    // Sizes are fixed in FMI 2.0.
    fn forget_sizes(&mut self) {}
    fn epoch(&self) -> u32 {
        0
    }

    /// A block to be read or written again and again.
    ///
    /// # Errors
    /// None; as in [FMI 3.0](crate::fmi3::Instance::prepare), where sizes of arrays are asked for.
    pub fn prepare(&mut self, references: &[u32]) -> Result<Prepared, Error> {
        Ok(Prepared { references: references.into(), count: references.len(), epoch: 0 })
    }

    /// Reals of a block.
    ///
    /// # Errors
    /// As [`Instance::get_real`].
    #[inline]
    pub fn read(&mut self, block: &Prepared, values: &mut [f64]) -> Result<(), Box<Error>> {
        let n = values.len();
        lent(&block.references, |r| {
            call_prepared!(self.core, fmi2GetReal, block, 0, n, r, n, values.as_mut_ptr())
        })
    }

    /// Sets Reals of a block.
    ///
    /// # Errors
    /// As [`Instance::set_real`].
    #[inline]
    pub fn write(&mut self, block: &Prepared, values: &[f64]) -> Result<(), Box<Error>> {
        let n = values.len();
        lent(&block.references, |r| {
            lent(values, |v| call_prepared!(self.core, fmi2SetReal, block, 0, n, r, n, v))
        })
    }

    /// Partial derivatives of the unknowns times a direction of the knowns.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetDirectionalDerivative` returns.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        result: &mut [f64],
    ) -> Result<(), Error> {
        self.core.length("fmi2GetDirectionalDerivative", "direction", knowns.len(), direction.len())?;
        self.core.length("fmi2GetDirectionalDerivative", "result", unknowns.len(), result.len())?;
        let (m, n, result) = (unknowns.len(), knowns.len(), result.as_mut_ptr());
        lent(unknowns, |u| {
            lent(knowns, |k| {
                lent(direction, |d| call!(self.core, fmi2GetDirectionalDerivative, u, m, k, n, d, result))
            })
        })
    }
}

/// Model Exchange.
impl Instance {
    fn states_length(&self, function: &'static str, got: usize) -> Result<(), Error> {
        self.core.length(function, "states", self.core.fmu.description().structure.derivatives.len(), got)
    }

    /// Enters event mode.
    ///
    /// # Errors
    /// Whatever `fmi2EnterEventMode` returns.
    pub fn enter_event_mode(&mut self) -> Result<(), Error> {
        call!(self.core, fmi2EnterEventMode)
    }

    /// One event iteration.
    ///
    /// # Errors
    /// Whatever `fmi2NewDiscreteStates` returns.
    pub fn new_discrete_states(&mut self) -> Result<EventInfo, Error> {
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
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Error> {
        call!(self.core, fmi2EnterContinuousTimeMode)
    }

    /// Tells that an integrator step is accepted. `no_rollback`: no state before now will be restored.
    ///
    /// # Errors
    /// Whatever `fmi2CompletedIntegratorStep` returns.
    pub fn completed_integrator_step(&mut self, no_rollback: bool) -> Result<Completed, Error> {
        let (mut event, mut terminate) = (fmi2False, fmi2False);
        call!(
            self.core,
            fmi2CompletedIntegratorStep,
            no_rollback.into(),
            &raw mut event,
            &raw mut terminate
        )?;
        Ok(Completed { event: event != fmi2False, terminate: terminate != fmi2False })
    }

    /// Sets the time in s.
    ///
    /// # Errors
    /// Whatever `fmi2SetTime` returns.
    pub fn set_time(&mut self, time: f64) -> Result<(), Error> {
        call!(self.core, fmi2SetTime, time)
    }

    /// Sets the states.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2SetContinuousStates` returns.
    pub fn set_continuous_states(&mut self, states: &[f64]) -> Result<(), Error> {
        self.states_length("fmi2SetContinuousStates", states.len())?;
        lent(states, |x| call!(self.core, fmi2SetContinuousStates, x, states.len()))
    }

    /// The states.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetContinuousStates` returns.
    pub fn get_continuous_states(&mut self, states: &mut [f64]) -> Result<(), Error> {
        self.states_length("fmi2GetContinuousStates", states.len())?;
        call!(self.core, fmi2GetContinuousStates, states.as_mut_ptr(), states.len())
    }

    /// Their derivatives.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetDerivatives` returns.
    pub fn get_derivatives(&mut self, derivatives: &mut [f64]) -> Result<(), Error> {
        self.states_length("fmi2GetDerivatives", derivatives.len())?;
        call!(self.core, fmi2GetDerivatives, derivatives.as_mut_ptr(), derivatives.len())
    }

    /// Their nominal values.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetNominalsOfContinuousStates` returns.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> Result<(), Error> {
        self.states_length("fmi2GetNominalsOfContinuousStates", nominals.len())?;
        call!(self.core, fmi2GetNominalsOfContinuousStates, nominals.as_mut_ptr(), nominals.len())
    }

    /// The event indicators.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2GetEventIndicators` returns.
    pub fn get_event_indicators(&mut self, indicators: &mut [f64]) -> Result<(), Error> {
        let expected = self.core.fmu.description().event_indicators();
        self.core.length("fmi2GetEventIndicators", "indicators", expected, indicators.len())?;
        call!(self.core, fmi2GetEventIndicators, indicators.as_mut_ptr(), indicators.len())
    }
}

/// Co-Simulation.
impl Instance {
    /// Steps from `time` by `step` s. `no_rollback`: no state before `time` will be restored.
    ///
    /// A step that the FMU discards is no error: see [`Step::discarded`]. A step that the FMU computes in the
    /// background is waited for.
    ///
    /// # Errors
    /// Whatever `fmi2DoStep` returns.
    pub fn do_step(&mut self, time: f64, step: f64, no_rollback: bool) -> Result<Step, Error> {
        match self.step(time, step, no_rollback) {
            Ok(None) => Ok(Step::whole(time, step)),
            Ok(Some(other)) => Ok(*other),
            Err(error) => Err(*error),
        }
    }

    /// As [`Instance::do_step`]; `None`: the whole step was made and nothing is to be told.
    ///
    /// # Errors
    /// As [`Instance::do_step`].
    #[inline]
    pub fn step(&mut self, time: f64, step: f64, no_rollback: bool) -> Result<Option<Box<Step>>, Box<Error>> {
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
    ) -> Result<Option<Box<Step>>, Box<Error>> {
        let mut result = self.core.check("fmi2DoStep", status.0);
        let (begun, deadline) =
            (Instant::now(), self.core.functions.remote.as_ref().and_then(|r| r.deadline()));
        while result.as_ref().is_err_and(|error| error.status() == Some(Status::Pending)) {
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
            Err(error) if error.status() == Some(Status::Discard) => Ok(Some(Box::new(Step {
                // An FMU that cannot say is where it was.
                time: self.real_status(fmi2LastSuccessfulTime).unwrap_or(time),
                early: true,
                discarded: true,
                event: false,
                terminate: self.boolean_status(fmi2Terminated).unwrap_or(false),
            }))),
            Err(error) => Err(Box::new(error)),
        }
    }

    /// `fmi2GetRealStatus`.
    ///
    /// # Errors
    /// Whatever it returns.
    pub fn real_status(&mut self, kind: fmi2StatusKind) -> Result<f64, Error> {
        let mut value = f64::NAN;
        call!(self.core, fmi2GetRealStatus, kind, &raw mut value)?;
        Ok(value)
    }

    /// `fmi2GetBooleanStatus`.
    ///
    /// # Errors
    /// Whatever it returns.
    pub fn boolean_status(&mut self, kind: fmi2StatusKind) -> Result<bool, Error> {
        let mut value = fmi2False;
        call!(self.core, fmi2GetBooleanStatus, kind, &raw mut value)?;
        Ok(value != fmi2False)
    }

    /// Derivatives of inputs with respect to time, each of its order (from 1), for the next step.
    ///
    /// # Errors
    /// [`Error::Length`]; whatever `fmi2SetRealInputDerivatives` returns.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), Error> {
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
    /// [`Error::Length`]; whatever `fmi2GetRealOutputDerivatives` returns.
    pub fn get_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), Error> {
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

impl Drop for Instance {
    fn drop(&mut self) {
        self.free_states();
        if self.core.ready("fmi2FreeInstance").is_err() {
            std::mem::forget(self.callbacks.take()); // the FMU is never freed and may still use them
        }
    }
}
