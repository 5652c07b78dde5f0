//! The 75 functions of FMI 3.0, generic over the model; [`export_fmu!`](crate::export_fmu) makes the C
//! functions of them. Pointers are the importer's: NULL is refused, what else they point to is its responsibility.
#![allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]

use super::fmi3_status::call;
use super::{enter, free, slice, slice_mut, text, usable, write};
use crate::fault::{CallStatus, error};
use crate::instance::{InstanceSettings, ModelInstance};
use crate::log::{LogSink, MessageLog};
use crate::model::Exported;
use crate::state_machine::{CallGroup, InstanceVersion, InterfaceType};
use core::ffi::{CStr, c_int, c_void};
use trueup_fmi::abi::fmi3::*;
use trueup_fmi::table::LinearFactor;

pub use super::fmi3_states::*;
pub use super::fmi3_values::*;

pub unsafe fn fmi3GetVersion<E: Exported>() -> fmi3String {
    c"3.0".as_ptr()
}

/// The importer's pointer, carried along to be handed back only.
#[derive(Clone, Copy)]
struct Fmi3Environment(*mut c_void);
// SAFETY: never dereferenced here.
unsafe impl Send for Fmi3Environment {}

fn sink(log_message: fmi3LogMessageCallback, environment: fmi3InstanceEnvironment) -> Option<LogSink> {
    let log_message = log_message?;
    let environment = Fmi3Environment(environment);
    Some(Box::new(move |status: CallStatus, category: &CStr, message: &CStr| {
        let environment = &environment;
        // SAFETY: the importer's function, with null-terminated strings.
        unsafe {
            log_message(environment.0, fmi3Status(status as c_int), category.as_ptr(), message.as_ptr())
        }
    }))
}

unsafe fn make<E: Exported>(
    name: fmi3String,
    token: fmi3String,
    settings: InstanceSettings,
) -> Result<ModelInstance<E::Model>, String> {
    // SAFETY: the importer's strings, see the module.
    let (name, token) = unsafe { (text(name), text(token)) };
    if name.is_none_or(|n| n.is_empty()) {
        return Err("instanceName is NULL or empty: give the instance a name".to_owned());
    }
    super::make::<E>(token.as_deref(), "instantiationToken", settings)
}

pub unsafe fn fmi3InstantiateModelExchange<E: Exported>(
    name: fmi3String,
    token: fmi3String,
    _: fmi3String,
    _: fmi3Boolean,
    loggingOn: fmi3Boolean,
    environment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
) -> fmi3Instance {
    let settings = InstanceSettings {
        version: InstanceVersion::Fmi3,
        interface: InterfaceType::ModelExchange,
        event_mode_used: false,
        early_return_allowed: false,
    };
    let log = MessageLog::new(sink(logMessage, environment), loggingOn.into());
    // SAFETY: the importer's strings, see the module.
    super::instantiate("fmi3InstantiateModelExchange", log, || unsafe { make::<E>(name, token, settings) })
}
pub unsafe fn fmi3InstantiateCoSimulation<E: Exported>(
    name: fmi3String,
    token: fmi3String,
    _: fmi3String,
    _: fmi3Boolean,
    loggingOn: fmi3Boolean,
    eventModeUsed: fmi3Boolean,
    earlyReturnAllowed: fmi3Boolean,
    required: *const fmi3ValueReference,
    nRequired: usize,
    environment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
    intermediateUpdate: fmi3IntermediateUpdateCallback,
) -> fmi3Instance {
    let settings = InstanceSettings {
        version: InstanceVersion::Fmi3,
        interface: InterfaceType::CoSimulation,
        event_mode_used: eventModeUsed.into(),
        early_return_allowed: earlyReturnAllowed.into(),
    };
    let log = MessageLog::new(sink(logMessage, environment), loggingOn.into());
    super::instantiate("fmi3InstantiateCoSimulation", log, || {
        // SAFETY: the importer's strings, see the module.
        let mut instance = unsafe { make::<E>(name, token, settings) }?;
        // SAFETY: the importer's array, see the module.
        let required = unsafe { slice("requiredIntermediateVariables", required, nRequired) };
        instance.require_intermediate(required.map_err(|f| f.message)?)?;
        instance.intermediate_update = intermediateUpdate.map(|f| (f, environment as usize));
        Ok(instance)
    })
}
pub unsafe fn fmi3InstantiateScheduledExecution<E: Exported>(
    _: fmi3String,
    _: fmi3String,
    _: fmi3String,
    _: fmi3Boolean,
    loggingOn: fmi3Boolean,
    environment: fmi3InstanceEnvironment,
    logMessage: fmi3LogMessageCallback,
    _: fmi3ClockUpdateCallback,
    _: fmi3LockPreemptionCallback,
    _: fmi3UnlockPreemptionCallback,
) -> fmi3Instance {
    let log = MessageLog::new(sink(logMessage, environment), loggingOn.into());
    super::instantiate::<E::Model>("fmi3InstantiateScheduledExecution", log, || {
        Err("this FMU has no Scheduled Execution: use Model Exchange or Co-Simulation".to_owned())
    })
}
pub unsafe fn fmi3FreeInstance<E: Exported>(c: fmi3Instance) {
    // SAFETY: the importer's pointer, see the module.
    unsafe { free::<E::Model>(c) }
}
pub unsafe fn fmi3SetDebugLogging<E: Exported>(
    c: fmi3Instance,
    loggingOn: fmi3Boolean,
    nCategories: usize,
    categories: *const fmi3String,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3SetDebugLogging", |i| {
            let names = slice("categories", categories, nCategories)?;
            let names: Vec<_> = names.iter().map(|n| text(*n).unwrap_or_default()).collect();
            i.set_debug_logging(loggingOn.into(), &names)
        })
    }
}
pub unsafe fn fmi3EnterInitializationMode<E: Exported>(
    c: fmi3Instance,
    toleranceDefined: fmi3Boolean,
    tolerance: fmi3Float64,
    startTime: fmi3Float64,
    stopTimeDefined: fmi3Boolean,
    stopTime: fmi3Float64,
) -> fmi3Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3EnterInitializationMode", |i| {
            i.permit(CallGroup::EnterInitialization)?;
            i.setup_experiment(
                bool::from(toleranceDefined).then_some(tolerance),
                startTime,
                bool::from(stopTimeDefined).then_some(stopTime),
            )?;
            i.enter_initialization()
        })
    }
}

/// Functions of the instance alone.
macro_rules! plain {
    ($($name:ident => $method:ident;)*) => {$(
        pub unsafe fn $name<E: Exported>(c: fmi3Instance) -> fmi3Status {
            // SAFETY: the importer's pointer, see the module.
            unsafe { call::<E::Model>(c, stringify!($name), |i| i.$method()) }
        }
    )*};
}
plain! {
    fmi3ExitInitializationMode => exit_initialization;
    fmi3EnterEventMode => enter_event_mode;
    fmi3Terminate => terminate;
    fmi3Reset => reset;
    fmi3EnterConfigurationMode => enter_configuration;
    fmi3ExitConfigurationMode => exit_configuration;
    fmi3EnterContinuousTimeMode => enter_continuous_time;
    fmi3EnterStepMode => enter_step_mode;
    fmi3EvaluateDiscreteStates => evaluate_discrete_states;
}

pub unsafe fn fmi3GetNumberOfVariableDependencies<E: Exported>(
    c: fmi3Instance,
    vr: fmi3ValueReference,
    n: *mut usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3GetNumberOfVariableDependencies", |i| {
            write("nDependencies", n, i.dependencies(vr)?.len())
        })
    }
}
pub unsafe fn fmi3GetVariableDependencies<E: Exported>(
    c: fmi3Instance,
    dependent: fmi3ValueReference,
    elementIndicesOfDependent: *mut usize,
    independents: *mut fmi3ValueReference,
    elementIndicesOfIndependents: *mut usize,
    dependencyKinds: *mut fmi3DependencyKind,
    n: usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3GetVariableDependencies", |i| {
            let found = i.dependencies(dependent)?;
            if found.len() != n {
                return error(format!(
                    "nDependencies = {n}, but there are {}: give exactly that many places",
                    found.len()
                ));
            }
            let elements = slice_mut("elementIndicesOfDependent", elementIndicesOfDependent, n)?;
            let independents = slice_mut("independents", independents, n)?;
            let indices = slice_mut("elementIndicesOfIndependents", elementIndicesOfIndependents, n)?;
            let kinds = slice_mut("dependencyKinds", dependencyKinds, n)?;
            for (k, d) in found.iter().enumerate() {
                let factor;
                (elements[k], independents[k], indices[k], factor) = *d;
                kinds[k] = match factor {
                    Some(LinearFactor::Constant) => fmi3Constant,
                    Some(LinearFactor::Fixed) => fmi3Fixed,
                    Some(LinearFactor::Tunable) => fmi3Tunable,
                    None => fmi3Dependent,
                };
            }
            Ok(())
        })
    }
}

/// Directional and adjoint derivatives.
macro_rules! derivatives {
    ($($name:ident => $method:ident;)*) => {$(
        pub unsafe fn $name<E: Exported>(
            c: fmi3Instance,
            unknowns: *const fmi3ValueReference,
            nUnknowns: usize,
            knowns: *const fmi3ValueReference,
            nKnowns: usize,
            seed: *const fmi3Float64,
            nSeed: usize,
            sensitivity: *mut fmi3Float64,
            nSensitivity: usize,
        ) -> fmi3Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($name), |i| {
                let (unknowns, knowns) = (slice("unknowns", unknowns, nUnknowns)?, slice("knowns", knowns, nKnowns)?);
                i.$method(unknowns, knowns, slice("seed", seed, nSeed)?, slice_mut("sensitivity", sensitivity, nSensitivity)?)
            }) }
        }
    )*};
}
derivatives! {
    fmi3GetDirectionalDerivative => directional_derivative;
    fmi3GetAdjointDerivative => adjoint_derivative;
}

pub unsafe fn fmi3UpdateDiscreteStates<E: Exported>(
    c: fmi3Instance,
    needed: *mut fmi3Boolean,
    terminate: *mut fmi3Boolean,
    nominals: *mut fmi3Boolean,
    states: *mut fmi3Boolean,
    defined: *mut fmi3Boolean,
    next: *mut fmi3Float64,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3UpdateDiscreteStates", |i| {
            let flags = [
                ("discreteStatesNeedUpdate", needed),
                ("terminateSimulation", terminate),
                ("nominalsOfContinuousStatesChanged", nominals),
                ("valuesOfContinuousStatesChanged", states),
                ("nextEventTimeDefined", defined),
            ];
            for (name, p) in flags {
                usable(name, p, 1)?;
            }
            usable("nextEventTime", next, 1)?;
            let done = i.update_discrete_states()?;
            let values = [done.needed, false, false, done.states, done.next.is_some()];
            for ((name, p), value) in flags.into_iter().zip(values) {
                write(name, p, value.into())?;
            }
            write("nextEventTime", next, done.next.unwrap_or_default())
        })
    }
}
pub unsafe fn fmi3CompletedIntegratorStep<E: Exported>(
    c: fmi3Instance,
    _: fmi3Boolean,
    event: *mut fmi3Boolean,
    terminate: *mut fmi3Boolean,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3CompletedIntegratorStep", |i| {
            let due = i.completed_integrator_step()?;
            write("enterEventMode", event, due.into())?;
            write("terminateSimulation", terminate, fmi3False)
        })
    }
}
pub unsafe fn fmi3SetTime<E: Exported>(c: fmi3Instance, time: fmi3Float64) -> fmi3Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe { call::<E::Model>(c, "fmi3SetTime", |i| i.set_time(time)) }
}
pub unsafe fn fmi3SetContinuousStates<E: Exported>(
    c: fmi3Instance,
    x: *const fmi3Float64,
    n: usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3SetContinuousStates", |i| i.set_states(slice("continuousStates", x, n)?))
    }
}

/// Vectors of the integrator.
macro_rules! vectors {
    ($($name:ident => $method:ident;)*) => {$(
        pub unsafe fn $name<E: Exported>(c: fmi3Instance, values: *mut fmi3Float64, n: usize) -> fmi3Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($name), |i| i.$method(slice_mut("the array", values, n)?)) }
        }
    )*};
}
vectors! {
    fmi3GetContinuousStateDerivatives => get_rates;
    fmi3GetEventIndicators => get_indicators;
    fmi3GetContinuousStates => get_states;
    fmi3GetNominalsOfContinuousStates => get_nominals;
}
pub unsafe fn fmi3GetNumberOfEventIndicators<E: Exported>(c: fmi3Instance, n: *mut usize) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3GetNumberOfEventIndicators", |i| {
            i.permit(CallGroup::Any)?;
            write("nEventIndicators", n, i.layout().sizes.indicators)
        })
    }
}
pub unsafe fn fmi3GetNumberOfContinuousStates<E: Exported>(c: fmi3Instance, n: *mut usize) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3GetNumberOfContinuousStates", |i| {
            i.permit(CallGroup::Any)?;
            write("nContinuousStates", n, i.layout().sizes.states)
        })
    }
}
pub unsafe fn fmi3GetOutputDerivatives<E: Exported>(
    c: fmi3Instance,
    vr: *const fmi3ValueReference,
    nvr: usize,
    orders: *const fmi3Int32,
    values: *mut fmi3Float64,
    n: usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3GetOutputDerivatives", |i| {
            i.output_derivatives(
                slice("valueReferences", vr, nvr)?,
                slice("orders", orders, nvr)?,
                slice_mut("values", values, n)?,
            )
        })
    }
}

pub unsafe fn fmi3DoStep<E: Exported>(
    c: fmi3Instance,
    t: fmi3Float64,
    h: fmi3Float64,
    _: fmi3Boolean,
    eventHandlingNeeded: *mut fmi3Boolean,
    terminateSimulation: *mut fmi3Boolean,
    earlyReturn: *mut fmi3Boolean,
    lastSuccessfulTime: *mut fmi3Float64,
) -> fmi3Status {
    const NAME: &str = "fmi3DoStep";
    let flags = [
        ("eventHandlingNeeded", eventHandlingNeeded),
        ("terminateSimulation", terminateSimulation),
        ("earlyReturn", earlyReturn),
    ];
    // SAFETY: the importer's pointers, see the module.
    let callback = unsafe {
        enter::<E::Model, _>(c, NAME, |i| {
            for (name, p) in flags {
                usable(name, p.cast_const(), 1)?;
            }
            usable("lastSuccessfulTime", lastSuccessfulTime.cast_const(), 1)?;
            Ok(i.intermediate_update.map(|f| (f, i.early_return_allowed())))
        })
    };
    let callback = match callback {
        Ok(callback) => callback,
        Err(status) => return fmi3Status(status as c_int),
    };
    let update = callback.map(|((function, environment), early_allowed)| {
        move |t: f64| {
            let (mut requested, mut early) = (fmi3False, t);
            // SAFETY: the importer's function; the pointers are ours and live through the call.
            unsafe {
                let environment = environment as *mut c_void;
                let can_return = early_allowed.into();
                function(
                    environment,
                    t,
                    fmi3True,
                    fmi3True,
                    fmi3True,
                    can_return,
                    &raw mut requested,
                    &raw mut early,
                );
            }
            (early_allowed && bool::from(requested)).then_some(early)
        }
    });
    let update = update.as_ref().map(|f| f as &dyn Fn(f64) -> Option<f64>);
    // SAFETY: the importer's pointer, see the module.
    let done = match unsafe { super::do_step::<E::Model>(c, NAME, t, h, update) } {
        Ok(done) => done,
        Err(status) => return fmi3Status(status as c_int),
    };
    // SAFETY: checked above; the rest is the importer's responsibility.
    unsafe {
        call::<E::Model>(c, NAME, |_| {
            for ((name, p), value) in flags.into_iter().zip([done.event, false, done.early]) {
                write(name, p, value.into())?;
            }
            write("lastSuccessfulTime", lastSuccessfulTime, done.t)
        })
    }
}
