//! Instances of FMI 2.0.

#![allow(unsafe_code)] // the C boundary

mod co_simulation;
mod model_exchange;

use std::ffi::c_void;
use std::sync::Arc;

use trueup_fmi::abi::fmi2::*;

use crate::core::{
    Core, InstanceOptions, PreparedReferences, StateId, States, UNWRITTEN, c_string, c_strings, call,
    call_prepared, lent, state_functions,
};
use crate::error::ImportError;
use crate::library::{UnpackedFmu, UsedInterface};
use crate::log::{Message, text, trueup_fmi2_logger};
use crate::open;
use crate::results::ExperimentSetup;
use crate::table::table2::LibraryFunctions;

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
}

/// An instance. It may move between threads, one thread at a time.
pub struct Fmi2Instance {
    pub(crate) core: Core<LibraryFunctions>,
    states: States,
    /// Booleans as the FMU has them.
    raw: Vec<fmi2Boolean>,
    /// FMUs keep the pointer, so it must outlive the instance (declared after `core`, dropped after it).
    callbacks: Option<Box<fmi2CallbackFunctions>>,
}

// SAFETY: FMI requires that one thread at a time calls an instance, not that it is always the same.
unsafe impl Send for Fmi2Instance {}

impl Fmi2Instance {
    /// Instantiates.
    ///
    /// # Errors
    /// [`ImportError::Interface`], [`ImportError::File`] if the library cannot be loaded, [`ImportError::Instantiate`].
    pub fn new(
        fmu: &Arc<UnpackedFmu>,
        interface: UsedInterface,
        options: InstanceOptions,
    ) -> Result<Self, ImportError> {
        let (visible, logging_on) = (options.visible.into(), options.logging_on.into());
        let mut core = Core::new(fmu, LibraryFunctions::none(), options);
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
            UsedInterface::ModelExchange => fmi2ModelExchange,
            UsedInterface::CoSimulation => fmi2CoSimulation,
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
    pub fn fmu(&self) -> &Arc<UnpackedFmu> {
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

    /// Which debug messages are requested; no category: all.
    ///
    /// # Errors
    /// Whatever `fmi2SetDebugLogging` returns.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), ImportError> {
        let texts = c_strings("log category", categories)?;
        let pointers: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
        call!(self.core, fmi2SetDebugLogging, on.into(), pointers.len(), pointers.as_ptr())
    }

    /// Hands over the experiment and enters initialization mode.
    ///
    /// # Errors
    /// Whatever `fmi2SetupExperiment`, `fmi2EnterInitializationMode` return.
    pub fn enter_initialization_mode(&mut self, experiment: ExperimentSetup) -> Result<(), ImportError> {
        let ExperimentSetup { tolerance, start, stop } = experiment;
        let (with_tolerance, with_stop) = (tolerance.is_some().into(), stop.is_some().into());
        let (tolerance, stop) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        call!(self.core, fmi2SetupExperiment, with_tolerance, tolerance, start, with_stop, stop)?;
        call!(self.core, fmi2EnterInitializationMode)
    }

    /// Leaves it.
    ///
    /// # Errors
    /// Whatever `fmi2ExitInitializationMode` returns.
    pub fn exit_initialization_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi2ExitInitializationMode)
    }

    /// Ends the run. Stored states are freed before.
    ///
    /// # Errors
    /// Whatever `fmi2Terminate` returns.
    pub fn terminate(&mut self) -> Result<(), ImportError> {
        self.free_states();
        call!(self.core, fmi2Terminate)
    }

    /// Back to where it was after instantiation.
    ///
    /// # Errors
    /// Whatever `fmi2Reset` returns.
    pub fn reset(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi2Reset)
    }

    /// Values of Reals.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetReal` returns.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), ImportError> {
        self.core.length("fmi2GetReal", "values", references.len(), values.len())?;
        values.fill(UNWRITTEN);
        lent(references, |r| call!(self.core, fmi2GetReal, r, references.len(), values.as_mut_ptr()))
    }

    /// Sets Reals.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2SetReal` returns.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), ImportError> {
        self.core.length("fmi2SetReal", "values", references.len(), values.len())?;
        lent(references, |r| lent(values, |v| call!(self.core, fmi2SetReal, r, references.len(), v)))
    }

    /// Values of Integers and Enumerations.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetInteger` returns.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), ImportError> {
        self.core.length("fmi2GetInteger", "values", references.len(), values.len())?;
        lent(references, |r| call!(self.core, fmi2GetInteger, r, references.len(), values.as_mut_ptr()))
    }

    /// Sets Integers and Enumerations.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2SetInteger` returns.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), ImportError> {
        self.core.length("fmi2SetInteger", "values", references.len(), values.len())?;
        lent(references, |r| lent(values, |v| call!(self.core, fmi2SetInteger, r, references.len(), v)))
    }

    /// Values of Booleans.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetBoolean` returns.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [bool]) -> Result<(), ImportError> {
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
    /// [`ImportError::Length`]; whatever `fmi2SetBoolean` returns.
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Result<(), ImportError> {
        self.core.length("fmi2SetBoolean", "values", references.len(), values.len())?;
        self.raw.clear();
        self.raw.extend(values.iter().map(|value| fmi2Boolean::from(*value)));
        lent(references, |r| call!(self.core, fmi2SetBoolean, r, references.len(), self.raw.as_ptr()))
    }

    /// Values of Strings.
    ///
    /// # Errors
    /// Whatever `fmi2GetString` returns.
    pub fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, ImportError> {
        let mut raw = vec![std::ptr::null(); references.len()];
        lent(references, |r| call!(self.core, fmi2GetString, r, references.len(), raw.as_mut_ptr()))?;
        // SAFETY: the FMU's texts are NULL or null-terminated, and valid until its next call.
        Ok(raw.into_iter().map(|pointer| unsafe { text(pointer) }).collect())
    }

    /// Sets Strings.
    ///
    /// # Errors
    /// [`ImportError::Length`], [`ImportError::Text`]; whatever `fmi2SetString` returns.
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Result<(), ImportError> {
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
    /// None; as in [FMI 3.0](crate::fmi3::Fmi3Instance::prepare), where sizes of arrays are queried.
    pub fn prepare(&mut self, references: &[u32]) -> Result<PreparedReferences, ImportError> {
        Ok(PreparedReferences { references: references.into(), count: references.len(), epoch: 0 })
    }

    /// Reals of a block.
    ///
    /// # Errors
    /// As [`Fmi2Instance::get_real`].
    #[inline]
    pub fn read(&mut self, block: &PreparedReferences, values: &mut [f64]) -> Result<(), Box<ImportError>> {
        let n = values.len();
        values.fill(UNWRITTEN);
        lent(&block.references, |r| {
            call_prepared!(self.core, fmi2GetReal, block, 0, n, r, n, values.as_mut_ptr())
        })
    }

    /// Sets Reals of a block.
    ///
    /// # Errors
    /// As [`Fmi2Instance::set_real`].
    #[inline]
    pub fn write(&mut self, block: &PreparedReferences, values: &[f64]) -> Result<(), Box<ImportError>> {
        let n = values.len();
        lent(&block.references, |r| {
            lent(values, |v| call_prepared!(self.core, fmi2SetReal, block, 0, n, r, n, v))
        })
    }

    /// Partial derivatives of the unknowns times a direction of the knowns.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi2GetDirectionalDerivative` returns.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        result: &mut [f64],
    ) -> Result<(), ImportError> {
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

impl Drop for Fmi2Instance {
    fn drop(&mut self) {
        self.free_states();
        if self.core.ready("fmi2FreeInstance").is_err() {
            std::mem::forget(self.callbacks.take()); // the FMU is never freed and may still use them
        }
    }
}
