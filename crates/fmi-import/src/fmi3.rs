//! Instances of FMI 3.0.

#![allow(unsafe_code)] // the C boundary

mod events;
pub(crate) mod inner;
mod values;

use std::sync::{Arc, Weak};

use trueup_fmi::abi::fmi3::*;

use self::inner::InstanceInner;
use crate::core::{
    Core, InstanceOptions, PreparedReferences, StateId, States, c_string, c_strings, call, state_functions,
};
use crate::error::ImportError;
use crate::isolation::Fmi3Opening;
use crate::library::{UnpackedFmu, UsedInterface};
use crate::log::{Hook, Message, fmi3_intermediate_update, fmi3_log};
use crate::open;
use crate::results::ExperimentSetup;
use crate::table::table3::LibraryFunctions;

pub use self::values::{DerivativeOf, Fmi3Number};

/// Called inside a step of Co-Simulation.
pub type IntermediateUpdateListener = Box<dyn FnMut(&mut Intermediate) + Send>;

/// What Co-Simulation may use.
#[derive(Default)]
pub struct CoSimulationOptions {
    /// The importer handles events (enters event mode when a step requests it).
    pub event_mode_used: bool,
    /// The FMU may end a step early.
    pub early_return_allowed: bool,
    /// Variables that the intermediate update gets or sets.
    pub intermediate_variables: Vec<u32>,
    /// Called inside steps.
    pub intermediate_update: Option<IntermediateUpdateListener>,
}

/// An instance. It may move between threads, one thread at a time.
pub struct Fmi3Instance {
    pub(crate) core: Arc<InstanceInner>,
    states: States,
    /// Counts changes of the sizes of arrays.
    pub(crate) epoch: u32,
    /// Numbers of continuous states and event indicators, once read.
    counts: (Option<usize>, Option<usize>),
}

// SAFETY: FMI requires that one thread at a time calls an instance, not that it is always the same.
unsafe impl Send for Fmi3Instance {}

/// The inside of a step, as an intermediate update sees it: values may be got and set through it as the flags say.
pub struct Intermediate {
    core: Arc<InstanceInner>,
    /// Time in s.
    pub time: f64,
    /// Inputs may be set.
    pub set_requested: bool,
    /// Outputs may be read.
    pub get_allowed: bool,
    /// An internal step of the solver is complete.
    pub step_finished: bool,
    /// [`Intermediate::return_early`] has an effect.
    pub can_return_early: bool,
    early: Option<f64>,
}

impl Intermediate {
    /// Requests that the FMU ends its step at this time in s.
    pub fn return_early(&mut self, time: f64) {
        self.early = Some(time);
    }
}

impl Fmi3Instance {
    /// Instantiates for Model Exchange.
    ///
    /// # Errors
    /// [`ImportError::Interface`], [`ImportError::File`] if the library cannot be loaded, [`ImportError::Instantiate`].
    pub fn model_exchange(fmu: &Arc<UnpackedFmu>, options: InstanceOptions) -> Result<Self, ImportError> {
        let fill = |core: &Core<LibraryFunctions>, it: &Fmi3Opening<'_>| {
            let function = core.functions.fmi3InstantiateModelExchange;
            let function = function.ok_or_else(|| core.missing("fmi3InstantiateModelExchange"))?;
            let [visible, logging, ..] = it.flags.map(fmi3Boolean::from);
            let (name, token, resources) = pointers(it);
            // SAFETY: the standard's signature; the texts live through the call.
            Ok(unsafe {
                function(name, token, resources, visible, logging, core.live.environment(), Some(fmi3_log))
            })
        };
        Self::build(fmu, UsedInterface::ModelExchange, options, &CoSimulationOptions::default(), fill)
    }

    /// Instantiates for Co-Simulation.
    ///
    /// # Errors
    /// As [`Fmi3Instance::model_exchange`].
    pub fn co_simulation(
        fmu: &Arc<UnpackedFmu>,
        options: InstanceOptions,
        how: CoSimulationOptions,
    ) -> Result<Self, ImportError> {
        let callback: fmi3IntermediateUpdateCallback =
            how.intermediate_update.is_some().then_some(fmi3_intermediate_update);
        let fill = |core: &Core<LibraryFunctions>, it: &Fmi3Opening<'_>| {
            let function = core.functions.fmi3InstantiateCoSimulation;
            let function = function.ok_or_else(|| core.missing("fmi3InstantiateCoSimulation"))?;
            let [visible, logging, event_mode_used, early_return_allowed, _] =
                it.flags.map(fmi3Boolean::from);
            let (name, token, resources) = pointers(it);
            // SAFETY: the standard's signature; texts and references live through the call.
            Ok(unsafe {
                function(
                    name,
                    token,
                    resources,
                    visible,
                    logging,
                    event_mode_used,
                    early_return_allowed,
                    it.variables.as_ptr(),
                    it.variables.len(),
                    core.live.environment(),
                    Some(fmi3_log),
                    callback,
                )
            })
        };
        let instance = Self::build(fmu, UsedInterface::CoSimulation, options, &how, fill)?;
        if let Some(update) = how.intermediate_update {
            instance.core.live.set_hook(Some(hook(Arc::downgrade(&instance.core), update)));
        }
        Ok(instance)
    }

    /// `instantiate` does it in this process.
    fn build(
        fmu: &Arc<UnpackedFmu>,
        interface: UsedInterface,
        options: InstanceOptions,
        how: &CoSimulationOptions,
        instantiate: impl FnOnce(&Core<LibraryFunctions>, &Fmi3Opening<'_>) -> Result<fmi3Instance, ImportError>,
    ) -> Result<Self, ImportError> {
        let (visible, logging) = (options.visible, options.logging_on);
        let mut core = Core::new(fmu, LibraryFunctions::none(), options);
        core.functions = open::three(fmu, interface, &core.live)?;
        let name = c_string("instance name", &core.live.name)?;
        let token = c_string("instantiation token", &fmu.description().token)?;
        let resources = fmu.resource_path().map(|path| c_string("resource path", &path)).transpose()?;
        let co_simulation = interface == UsedInterface::CoSimulation;
        let update = how.intermediate_update.is_some();
        let it = Fmi3Opening {
            co_simulation,
            name: &name,
            token: &token,
            resources: resources.as_deref(),
            flags: [visible, logging, how.event_mode_used, how.early_return_allowed, update],
            variables: &how.intermediate_variables,
        };
        core.mark();
        core.component = match &core.functions.remote {
            Some(remote) => remote.instantiate_three(&it),
            None => instantiate(&core, &it)?,
        };
        if core.component.is_null() {
            let function =
                if co_simulation { "fmi3InstantiateCoSimulation" } else { "fmi3InstantiateModelExchange" };
            return Err(core.no_instance(function));
        }
        Ok(Self {
            core: Arc::new(InstanceInner::new(core)),
            states: States::default(),
            epoch: 0,
            counts: (None, None),
        })
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
    /// Whatever `fmi3SetDebugLogging` returns.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), ImportError> {
        let texts = c_strings("log category", categories)?;
        let pointers: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
        call!(self.core, fmi3SetDebugLogging, on.into(), pointers.len(), pointers.as_ptr())
    }

    /// Enters initialization mode.
    ///
    /// # Errors
    /// Whatever `fmi3EnterInitializationMode` returns.
    pub fn enter_initialization_mode(&mut self, experiment: ExperimentSetup) -> Result<(), ImportError> {
        let ExperimentSetup { tolerance, start, stop } = experiment;
        let (with_tolerance, with_stop) = (tolerance.is_some().into(), stop.is_some().into());
        let (tolerance, stop) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        call!(self.core, fmi3EnterInitializationMode, with_tolerance, tolerance, start, with_stop, stop)
    }

    /// Leaves it: to event mode in Model Exchange and where events are used, else to step mode.
    ///
    /// # Errors
    /// Whatever `fmi3ExitInitializationMode` returns.
    pub fn exit_initialization_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi3ExitInitializationMode)
    }

    /// Enters (re-)configuration mode, where structural parameters may be set.
    ///
    /// # Errors
    /// Whatever `fmi3EnterConfigurationMode` returns.
    pub fn enter_configuration_mode(&mut self) -> Result<(), ImportError> {
        call!(self.core, fmi3EnterConfigurationMode)
    }

    /// Leaves it; sizes may have changed.
    ///
    /// # Errors
    /// Whatever `fmi3ExitConfigurationMode` returns.
    pub fn exit_configuration_mode(&mut self) -> Result<(), ImportError> {
        self.forget_sizes();
        call!(self.core, fmi3ExitConfigurationMode)
    }

    /// Ends the run. Stored states are freed before.
    ///
    /// # Errors
    /// Whatever `fmi3Terminate` returns.
    pub fn terminate(&mut self) -> Result<(), ImportError> {
        self.free_states();
        call!(self.core, fmi3Terminate)
    }

    /// Back to where it was after instantiation.
    ///
    /// # Errors
    /// Whatever `fmi3Reset` returns.
    pub fn reset(&mut self) -> Result<(), ImportError> {
        self.forget_sizes();
        call!(self.core, fmi3Reset)
    }

    state_functions!(
        fmi3GetFMUState,
        fmi3SetFMUState,
        fmi3FreeFMUState,
        fmi3SerializedFMUStateSize,
        fmi3SerializeFMUState,
        fmi3DeserializeFMUState
    );

    fn forget_sizes(&mut self) {
        self.counts = (None, None);
        self.epoch += 1;
        self.core.forget_sizes();
    }

    fn epoch(&self) -> u32 {
        self.epoch
    }

    /// A block to be [read](Fmi3Instance::read) or [written](Fmi3Instance::write) again and again.
    ///
    /// # Errors
    /// Sizes of arrays cannot be had.
    pub fn prepare(&mut self, references: &[u32]) -> Result<PreparedReferences, ImportError> {
        Ok(PreparedReferences {
            references: references.into(),
            count: self.core.count(references)?,
            epoch: self.epoch,
        })
    }
}

/// Name, token and resources for C.
fn pointers(it: &Fmi3Opening<'_>) -> (fmi3String, fmi3String, fmi3String) {
    (it.name.as_ptr(), it.token.as_ptr(), it.resources.map_or(std::ptr::null(), |path| path.as_ptr()))
}

/// The closure behind the C callback. Weak: the instance owns the closure, not the other way round.
fn hook(core: Weak<InstanceInner>, mut update: IntermediateUpdateListener) -> Hook {
    Box::new(move |arguments| {
        let mut intermediate = Intermediate {
            core: core.upgrade()?,
            time: arguments.time,
            set_requested: arguments.set_requested,
            get_allowed: arguments.get_allowed,
            step_finished: arguments.step_finished,
            can_return_early: arguments.can_return_early,
            early: None,
        };
        update(&mut intermediate);
        intermediate.early.filter(|_| intermediate.can_return_early)
    })
}

impl Drop for Fmi3Instance {
    fn drop(&mut self) {
        self.core.live.set_hook(None);
        self.free_states();
    }
}
