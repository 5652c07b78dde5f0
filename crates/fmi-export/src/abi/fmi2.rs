//! The 44 functions of FMI 2.0, generic over the model; [`export_fmu!`](crate::export_fmu) makes the C
//! functions of them. Pointers are the importer's: NULL is refused, what else they point to is its responsibility.
#![allow(non_snake_case, non_upper_case_globals, missing_docs, clippy::missing_safety_doc)]

use super::{free, slice, slice_mut, status, text, write};
use crate::fault::{CallOutcome, CallStatus, discard, error};
use crate::instance::{InstanceSettings, ModelInstance};
use crate::log::{LogSink, MessageLog};
use crate::model::{Exported, FmuModel};
use crate::state_machine::{CallGroup, InstanceVersion, InterfaceType};
use crate::values::ValueType;
use core::ffi::{CStr, c_int, c_void};
use std::ffi::CString;
use trueup_fmi::abi::fmi2::*;

pub unsafe fn fmi2GetTypesPlatform<E: Exported>() -> fmi2String {
    c"default".as_ptr()
}
pub unsafe fn fmi2GetVersion<E: Exported>() -> fmi2String {
    c"2.0".as_ptr()
}

unsafe fn call<M: FmuModel>(
    c: fmi2Component,
    function: &str,
    f: impl FnOnce(&mut ModelInstance<M>) -> CallOutcome,
) -> fmi2Status {
    // SAFETY: the importer's pointer, see the module.
    fmi2Status(unsafe { status(c, function, f) })
}

/// The importer's pointer, carried along to be handed back only.
struct Fmi2Environment(*mut c_void);
// SAFETY: never dereferenced here.
unsafe impl Send for Fmi2Environment {}

/// The message as a format without arguments. Many importers take the format for the text, as their language
/// has no variadic functions: they shall see the message and not "%s".
fn as_format(message: &CStr) -> CString {
    let escape = |b: &u8| [*b, *b].into_iter().take(1 + usize::from(matches!(b, b'%' | b'#')));
    // Nothing is lost: there are no inner zeros.
    CString::new(message.to_bytes().iter().flat_map(escape).collect::<Vec<_>>()).unwrap_or_default()
}

unsafe fn sink(functions: &fmi2CallbackFunctions, name: CString) -> Option<LogSink> {
    let logger = functions.logger?;
    let environment = Fmi2Environment(functions.componentEnvironment);
    Some(Box::new(move |status: CallStatus, category: &CStr, message: &CStr| {
        let environment = &environment;
        let format = as_format(message);
        // SAFETY: the importer's function, with null-terminated strings; the format consumes no argument.
        unsafe {
            logger(
                environment.0,
                name.as_ptr(),
                fmi2Status(status as c_int),
                category.as_ptr(),
                format.as_ptr(),
            );
        }
    }))
}

pub unsafe fn fmi2Instantiate<E: Exported>(
    instanceName: fmi2String,
    fmuType: fmi2Type,
    fmuGUID: fmi2String,
    _: fmi2String,
    functions: *const fmi2CallbackFunctions,
    _: fmi2Boolean,
    loggingOn: fmi2Boolean,
) -> fmi2Component {
    if functions.is_null() || !functions.is_aligned() {
        return core::ptr::null_mut();
    }
    // SAFETY: not NULL; strings and callbacks are the importer's responsibility.
    let (name, guid, sink) = unsafe {
        let name = text(instanceName);
        let c_name = CString::new(name.clone().unwrap_or_default()).unwrap_or_default();
        (name, text(fmuGUID), sink(&*functions, c_name))
    };
    let make = || -> Result<ModelInstance<E::Model>, String> {
        if name.as_deref().unwrap_or_default().is_empty() {
            return Err("instanceName is NULL or empty: give the instance a name".to_owned());
        }
        let interface = match fmuType {
            fmi2ModelExchange => InterfaceType::ModelExchange,
            fmi2CoSimulation => InterfaceType::CoSimulation,
            other => {
                return Err(format!(
                    "fmuType = {}: take fmi2ModelExchange (0) or fmi2CoSimulation (1)",
                    other.0
                ));
            }
        };
        let settings = InstanceSettings {
            version: InstanceVersion::Fmi2,
            interface,
            event_mode_used: false,
            early_return_allowed: false,
        };
        super::make::<E>(guid.as_deref(), "fmuGUID", settings)
    };
    super::instantiate("fmi2Instantiate", MessageLog::new(sink, loggingOn != fmi2False), make)
}
pub unsafe fn fmi2FreeInstance<E: Exported>(c: fmi2Component) {
    // SAFETY: the importer's pointer, see the module.
    unsafe { free::<E::Model>(c) }
}
pub unsafe fn fmi2SetDebugLogging<E: Exported>(
    c: fmi2Component,
    loggingOn: fmi2Boolean,
    nCategories: usize,
    categories: *const fmi2String,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2SetDebugLogging", |i| {
            let names = slice("categories", categories, nCategories)?;
            let names: Vec<_> = names.iter().map(|n| text(*n).unwrap_or_default()).collect();
            i.set_debug_logging(loggingOn != fmi2False, &names)
        })
    }
}
pub unsafe fn fmi2SetupExperiment<E: Exported>(
    c: fmi2Component,
    toleranceDefined: fmi2Boolean,
    tolerance: fmi2Real,
    startTime: fmi2Real,
    stopTimeDefined: fmi2Boolean,
    stopTime: fmi2Real,
) -> fmi2Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2SetupExperiment", |i| {
            i.permit(CallGroup::SetupExperiment)?;
            i.setup_experiment(
                (toleranceDefined != fmi2False).then_some(tolerance),
                startTime,
                (stopTimeDefined != fmi2False).then_some(stopTime),
            )
        })
    }
}

/// Functions of the instance alone.
macro_rules! plain {
    ($($name:ident => $method:ident;)*) => {$(
        pub unsafe fn $name<E: Exported>(c: fmi2Component) -> fmi2Status {
            // SAFETY: the importer's pointer, see the module.
            unsafe { call::<E::Model>(c, stringify!($name), |i| i.$method()) }
        }
    )*};
}
plain! {
    fmi2EnterInitializationMode => enter_initialization;
    fmi2ExitInitializationMode => exit_initialization;
    fmi2Terminate => terminate;
    fmi2Reset => reset;
    fmi2EnterEventMode => enter_event_mode;
    fmi2EnterContinuousTimeMode => enter_continuous_time;
}

/// Getters and setters of one data type.
macro_rules! values {
    ($($get:ident, $set:ident, $kind:ident, $type:ty;)*) => {$(
        pub unsafe fn $get<E: Exported>(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut $type) -> fmi2Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($get), |i| {
                let references = slice("vr", vr, nvr)?;
                let out = slice_mut("value", value, nvr)?;
                i.get(ValueType::$kind, references, nvr, |k, v| out[k] = v as $type)
            }) }
        }
        pub unsafe fn $set<E: Exported>(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const $type) -> fmi2Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($set), |i| {
                let references = slice("vr", vr, nvr)?;
                let values = slice("value", value, nvr)?;
                i.set(ValueType::$kind, references, nvr, |k| f64::from(values[k]))
            }) }
        }
    )*};
}
values! {
    fmi2GetReal, fmi2SetReal, Real, fmi2Real;
    fmi2GetInteger, fmi2SetInteger, AnyInteger, fmi2Integer;
    fmi2GetBoolean, fmi2SetBoolean, Boolean, fmi2Boolean;
}
pub unsafe fn fmi2GetString<E: Exported>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    _: *mut fmi2String,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetString", |i| {
            i.get(ValueType::Other, slice("vr", vr, nvr)?, nvr, |_, _| ())
        })
    }
}
pub unsafe fn fmi2SetString<E: Exported>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    _: *const fmi2String,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2SetString", |i| i.set(ValueType::Other, slice("vr", vr, nvr)?, nvr, |_| 0.0))
    }
}

pub unsafe fn fmi2GetFMUstate<E: Exported>(c: fmi2Component, state: *mut fmi2FMUstate) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe { call::<E::Model>(c, "fmi2GetFMUstate", |i| super::get_state(i, state)) }
}
pub unsafe fn fmi2SetFMUstate<E: Exported>(c: fmi2Component, state: fmi2FMUstate) -> fmi2Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe { call::<E::Model>(c, "fmi2SetFMUstate", |i| i.set_state(state as usize)) }
}
pub unsafe fn fmi2FreeFMUstate<E: Exported>(c: fmi2Component, state: *mut fmi2FMUstate) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe { call::<E::Model>(c, "fmi2FreeFMUstate", |i| super::free_state(i, state)) }
}
pub unsafe fn fmi2SerializedFMUstateSize<E: Exported>(
    c: fmi2Component,
    state: fmi2FMUstate,
    size: *mut usize,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2SerializedFMUstateSize", |i| {
            write("size", size, i.serialized_size(state as usize)?)
        })
    }
}
pub unsafe fn fmi2SerializeFMUstate<E: Exported>(
    c: fmi2Component,
    state: fmi2FMUstate,
    out: *mut fmi2Byte,
    size: usize,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2SerializeFMUstate", |i| {
            i.serialize(state as usize, slice_mut("serializedState", out.cast(), size)?)
        })
    }
}
pub unsafe fn fmi2DeSerializeFMUstate<E: Exported>(
    c: fmi2Component,
    bytes: *const fmi2Byte,
    size: usize,
    state: *mut fmi2FMUstate,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2DeSerializeFMUstate", |i| {
            super::usable("FMUstate", state, 1)?;
            let handle = i.deserialize(slice("serializedState", bytes.cast(), size)?)?;
            write("FMUstate", state, handle as fmi2FMUstate)
        })
    }
}
pub unsafe fn fmi2GetDirectionalDerivative<E: Exported>(
    c: fmi2Component,
    unknowns: *const fmi2ValueReference,
    nUnknown: usize,
    knowns: *const fmi2ValueReference,
    nKnown: usize,
    dvKnown: *const fmi2Real,
    dvUnknown: *mut fmi2Real,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetDirectionalDerivative", |i| {
            let (unknowns, knowns) =
                (slice("vUnknown_ref", unknowns, nUnknown)?, slice("vKnown_ref", knowns, nKnown)?);
            let seed = slice("dvKnown", dvKnown, nKnown)?;
            i.directional_derivative(unknowns, knowns, seed, slice_mut("dvUnknown", dvUnknown, nUnknown)?)
        })
    }
}

pub unsafe fn fmi2NewDiscreteStates<E: Exported>(c: fmi2Component, info: *mut fmi2EventInfo) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2NewDiscreteStates", |i| {
            super::usable("fmi2eventInfo", info, 1)?;
            let done = i.update_discrete_states()?;
            let result = fmi2EventInfo {
                newDiscreteStatesNeeded: c_int::from(done.needed),
                terminateSimulation: fmi2False,
                nominalsOfContinuousStatesChanged: fmi2False,
                valuesOfContinuousStatesChanged: c_int::from(done.states),
                nextEventTimeDefined: c_int::from(done.next.is_some()),
                nextEventTime: done.next.unwrap_or_default(),
            };
            write("fmi2eventInfo", info, result)
        })
    }
}
pub unsafe fn fmi2CompletedIntegratorStep<E: Exported>(
    c: fmi2Component,
    _: fmi2Boolean,
    event: *mut fmi2Boolean,
    terminate: *mut fmi2Boolean,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2CompletedIntegratorStep", |i| {
            let due = i.completed_integrator_step()?;
            write("enterEventMode", event, due.into())?;
            write("terminateSimulation", terminate, fmi2False)
        })
    }
}
pub unsafe fn fmi2SetTime<E: Exported>(c: fmi2Component, time: fmi2Real) -> fmi2Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe { call::<E::Model>(c, "fmi2SetTime", |i| i.set_time(time)) }
}
pub unsafe fn fmi2SetContinuousStates<E: Exported>(
    c: fmi2Component,
    x: *const fmi2Real,
    nx: usize,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe { call::<E::Model>(c, "fmi2SetContinuousStates", |i| i.set_states(slice("x", x, nx)?)) }
}

/// Vectors of the integrator.
macro_rules! vectors {
    ($($name:ident => $method:ident;)*) => {$(
        pub unsafe fn $name<E: Exported>(c: fmi2Component, values: *mut fmi2Real, n: usize) -> fmi2Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($name), |i| i.$method(slice_mut("the array", values, n)?)) }
        }
    )*};
}
vectors! {
    fmi2GetDerivatives => get_rates;
    fmi2GetEventIndicators => get_indicators;
    fmi2GetContinuousStates => get_states;
    fmi2GetNominalsOfContinuousStates => get_nominals;
}

pub unsafe fn fmi2SetRealInputDerivatives<E: Exported>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *const fmi2Real,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2SetRealInputDerivatives", |i| {
            i.set_input_derivatives(
                slice("vr", vr, nvr)?,
                slice("order", order, nvr)?,
                slice("value", value, nvr)?,
            )
        })
    }
}
pub unsafe fn fmi2GetRealOutputDerivatives<E: Exported>(
    c: fmi2Component,
    vr: *const fmi2ValueReference,
    nvr: usize,
    order: *const fmi2Integer,
    value: *mut fmi2Real,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetRealOutputDerivatives", |i| {
            i.output_derivatives(
                slice("vr", vr, nvr)?,
                slice("order", order, nvr)?,
                slice_mut("value", value, nvr)?,
            )
        })
    }
}
pub unsafe fn fmi2DoStep<E: Exported>(
    c: fmi2Component,
    t: fmi2Real,
    h: fmi2Real,
    _: fmi2Boolean,
) -> fmi2Status {
    // SAFETY: the importer's pointer, see the module.
    let done = unsafe { super::do_step::<E::Model>(c, "fmi2DoStep", t, h, None) };
    fmi2Status(done.err().unwrap_or(CallStatus::Ok) as c_int)
}
pub unsafe fn fmi2CancelStep<E: Exported>(c: fmi2Component) -> fmi2Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2CancelStep", |_| {
            error("steps of this FMU are complete when fmi2DoStep returns: there is nothing to cancel")
        })
    }
}

const NOT_ASYNCHRONOUS: &str = "steps of this FMU never run asynchronously, so there is no such status: ";

pub unsafe fn fmi2GetStatus<E: Exported>(
    c: fmi2Component,
    kind: fmi2StatusKind,
    value: *mut fmi2Status,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetStatus", |i| {
            i.permit(CallGroup::StepStatus)?;
            super::usable("value", value, 1)?;
            discard(format!("{NOT_ASYNCHRONOUS}{kind}"))
        })
    }
}
pub unsafe fn fmi2GetRealStatus<E: Exported>(
    c: fmi2Component,
    kind: fmi2StatusKind,
    value: *mut fmi2Real,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetRealStatus", |i| {
            i.permit(CallGroup::StepStatus)?;
            if kind != fmi2LastSuccessfulTime {
                super::usable("value", value, 1)?;
                return discard(format!("{NOT_ASYNCHRONOUS}{kind}"));
            }
            write("value", value, i.last_successful_time())
        })
    }
}
pub unsafe fn fmi2GetIntegerStatus<E: Exported>(
    c: fmi2Component,
    kind: fmi2StatusKind,
    value: *mut fmi2Integer,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetIntegerStatus", |i| {
            i.permit(CallGroup::StepStatus)?;
            super::usable("value", value, 1)?;
            discard(format!("{NOT_ASYNCHRONOUS}{kind}"))
        })
    }
}
pub unsafe fn fmi2GetBooleanStatus<E: Exported>(
    c: fmi2Component,
    kind: fmi2StatusKind,
    value: *mut fmi2Boolean,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetBooleanStatus", |i| {
            i.permit(CallGroup::StepStatus)?;
            if kind != fmi2Terminated {
                super::usable("value", value, 1)?;
                return discard(format!("{NOT_ASYNCHRONOUS}{kind}"));
            }
            // The model never requests the end of the run.
            write("value", value, fmi2False)
        })
    }
}
pub unsafe fn fmi2GetStringStatus<E: Exported>(
    c: fmi2Component,
    kind: fmi2StatusKind,
    value: *mut fmi2String,
) -> fmi2Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi2GetStringStatus", |i| {
            i.permit(CallGroup::StepStatus)?;
            super::usable("value", value, 1)?;
            discard(format!("{NOT_ASYNCHRONOUS}{kind}"))
        })
    }
}
