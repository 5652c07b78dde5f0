//! FMI 2.0: `fmi2TypesPlatform.h`, `fmi2FunctionTypes.h`.

use core::ffi::{c_char, c_int, c_uint, c_void};

use super::{integer_enum, pointer_types};

/// An instance, owned by the FMU.
pub type fmi2Component = *mut c_void;
/// The importer's own pointer, handed back in callbacks.
pub type fmi2ComponentEnvironment = *mut c_void;
/// A stored state of an instance, owned by the FMU.
pub type fmi2FMUstate = *mut c_void;
/// Handle of a variable.
pub type fmi2ValueReference = c_uint;
/// Real number.
pub type fmi2Real = f64;
/// Integer; also the values of enumerations.
pub type fmi2Integer = c_int;
/// Boolean: zero is false, [`fmi2True`] is true.
pub type fmi2Boolean = c_int;
/// Null-terminated UTF-8.
pub type fmi2String = *const c_char;
/// Byte of a serialized state.
pub type fmi2Byte = c_char;

/// True.
pub const fmi2True: fmi2Boolean = 1;
/// False.
pub const fmi2False: fmi2Boolean = 0;

integer_enum! {
    /// What every call returns.
    fmi2Status {
        /// All well.
        fmi2OK = 0,
        /// Not all well, the simulation may go on.
        fmi2Warning = 1,
        /// The call was refused (a smaller step may help); the instance is as before.
        fmi2Discard = 2,
        /// The instance cannot go on; reset, free or set a stored state.
        fmi2Error = 3,
        /// All instances of this FMU are lost.
        fmi2Fatal = 4,
        /// The step is still being computed.
        fmi2Pending = 5,
    }
}

integer_enum! {
    /// Which interface is instantiated.
    fmi2Type {
        /// Model Exchange.
        fmi2ModelExchange = 0,
        /// Co-Simulation.
        fmi2CoSimulation = 1,
    }
}

integer_enum! {
    /// What `fmi2GetXxxStatus` requests.
    fmi2StatusKind {
        /// Status of a pending step (`fmi2GetStatus`).
        fmi2DoStepStatus = 0,
        /// Text on a pending step (`fmi2GetStringStatus`).
        fmi2PendingStatus = 1,
        /// End of the last successful step in s (`fmi2GetRealStatus`).
        fmi2LastSuccessfulTime = 2,
        /// Whether the FMU requests the end of the run (`fmi2GetBooleanStatus`).
        fmi2Terminated = 3,
    }
}

/// Takes the FMU's messages: environment, instance name, status, category, printf format, its arguments.
pub type fmi2CallbackLogger = Option<
    unsafe extern "C" fn(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...),
>;
/// `calloc`.
pub type fmi2CallbackAllocateMemory = Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>;
/// `free`.
pub type fmi2CallbackFreeMemory = Option<unsafe extern "C" fn(*mut c_void)>;
/// Called at the end of a pending step.
pub type fmi2StepFinished = Option<unsafe extern "C" fn(fmi2ComponentEnvironment, fmi2Status)>;

/// What the importer offers to the FMU; must live until `fmi2FreeInstance` has returned.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct fmi2CallbackFunctions {
    /// Log messages.
    pub logger: fmi2CallbackLogger,
    /// `calloc`.
    pub allocateMemory: fmi2CallbackAllocateMemory,
    /// `free`.
    pub freeMemory: fmi2CallbackFreeMemory,
    /// End of a pending step; may be absent.
    pub stepFinished: fmi2StepFinished,
    /// First argument of `logger` and `stepFinished`.
    pub componentEnvironment: fmi2ComponentEnvironment,
}

/// Result of an event iteration.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct fmi2EventInfo {
    /// Another `fmi2NewDiscreteStates` is needed.
    pub newDiscreteStatesNeeded: fmi2Boolean,
    /// The FMU requests the end of the run.
    pub terminateSimulation: fmi2Boolean,
    /// Nominal values of the states have changed.
    pub nominalsOfContinuousStatesChanged: fmi2Boolean,
    /// States have jumped.
    pub valuesOfContinuousStatesChanged: fmi2Boolean,
    /// `nextEventTime` is valid.
    pub nextEventTimeDefined: fmi2Boolean,
    /// Time of the next time event in s.
    pub nextEventTime: fmi2Real,
}

/// Pointer types of all functions.
pub mod pointer {
    use super::*;
    crate::fmi2_functions!(pointer_types);
}

/// Hands the list of all 44 functions of FMI 2.0 to a macro, as `fn name(arg: type, ...) -> type;` each.
/// Where it is used the types of [`abi::fmi2`](crate::abi::fmi2) must be in scope.
#[macro_export]
macro_rules! fmi2_functions {
    ($($callback:ident)::+) => {
        $($callback)::+! {
            fn fmi2GetTypesPlatform() -> fmi2String;
            fn fmi2GetVersion() -> fmi2String;
            fn fmi2SetDebugLogging(c: fmi2Component, loggingOn: fmi2Boolean, nCategories: usize,
                categories: *const fmi2String) -> fmi2Status;
            fn fmi2Instantiate(instanceName: fmi2String, fmuType: fmi2Type, fmuGUID: fmi2String,
                fmuResourceLocation: fmi2String, functions: *const fmi2CallbackFunctions, visible:
                fmi2Boolean, loggingOn: fmi2Boolean) -> fmi2Component;
            fn fmi2FreeInstance(c: fmi2Component);
            fn fmi2SetupExperiment(c: fmi2Component, toleranceDefined: fmi2Boolean, tolerance: fmi2Real,
                startTime: fmi2Real, stopTimeDefined: fmi2Boolean, stopTime: fmi2Real) -> fmi2Status;
            fn fmi2EnterInitializationMode(c: fmi2Component) -> fmi2Status;
            fn fmi2ExitInitializationMode(c: fmi2Component) -> fmi2Status;
            fn fmi2Terminate(c: fmi2Component) -> fmi2Status;
            fn fmi2Reset(c: fmi2Component) -> fmi2Status;
            fn fmi2GetReal(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut
                fmi2Real) -> fmi2Status;
            fn fmi2GetInteger(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut
                fmi2Integer) -> fmi2Status;
            fn fmi2GetBoolean(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut
                fmi2Boolean) -> fmi2Status;
            fn fmi2GetString(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *mut
                fmi2String) -> fmi2Status;
            fn fmi2SetReal(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const
                fmi2Real) -> fmi2Status;
            fn fmi2SetInteger(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const
                fmi2Integer) -> fmi2Status;
            fn fmi2SetBoolean(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const
                fmi2Boolean) -> fmi2Status;
            fn fmi2SetString(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize, value: *const
                fmi2String) -> fmi2Status;
            fn fmi2GetFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> fmi2Status;
            fn fmi2SetFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate) -> fmi2Status;
            fn fmi2FreeFMUstate(c: fmi2Component, FMUstate: *mut fmi2FMUstate) -> fmi2Status;
            fn fmi2SerializedFMUstateSize(c: fmi2Component, FMUstate: fmi2FMUstate, size: *mut usize) ->
                fmi2Status;
            fn fmi2SerializeFMUstate(c: fmi2Component, FMUstate: fmi2FMUstate, serializedState: *mut
                fmi2Byte, size: usize) -> fmi2Status;
            fn fmi2DeSerializeFMUstate(c: fmi2Component, serializedState: *const fmi2Byte, size: usize,
                FMUstate: *mut fmi2FMUstate) -> fmi2Status;
            fn fmi2GetDirectionalDerivative(c: fmi2Component, vUnknown_ref: *const fmi2ValueReference,
                nUnknown: usize, vKnown_ref: *const fmi2ValueReference, nKnown: usize, dvKnown: *const
                fmi2Real, dvUnknown: *mut fmi2Real) -> fmi2Status;
            fn fmi2EnterEventMode(c: fmi2Component) -> fmi2Status;
            fn fmi2NewDiscreteStates(c: fmi2Component, fmi2eventInfo: *mut fmi2EventInfo) -> fmi2Status;
            fn fmi2EnterContinuousTimeMode(c: fmi2Component) -> fmi2Status;
            fn fmi2CompletedIntegratorStep(c: fmi2Component, noSetFMUStatePriorToCurrentPoint:
                fmi2Boolean, enterEventMode: *mut fmi2Boolean, terminateSimulation: *mut fmi2Boolean) ->
                fmi2Status;
            fn fmi2SetTime(c: fmi2Component, time: fmi2Real) -> fmi2Status;
            fn fmi2SetContinuousStates(c: fmi2Component, x: *const fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2GetDerivatives(c: fmi2Component, derivatives: *mut fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2GetEventIndicators(c: fmi2Component, eventIndicators: *mut fmi2Real, ni: usize) ->
                fmi2Status;
            fn fmi2GetContinuousStates(c: fmi2Component, x: *mut fmi2Real, nx: usize) -> fmi2Status;
            fn fmi2GetNominalsOfContinuousStates(c: fmi2Component, x_nominal: *mut fmi2Real, nx: usize) ->
                fmi2Status;
            fn fmi2SetRealInputDerivatives(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize,
                order: *const fmi2Integer, value: *const fmi2Real) -> fmi2Status;
            fn fmi2GetRealOutputDerivatives(c: fmi2Component, vr: *const fmi2ValueReference, nvr: usize,
                order: *const fmi2Integer, value: *mut fmi2Real) -> fmi2Status;
            fn fmi2DoStep(c: fmi2Component, currentCommunicationPoint: fmi2Real, communicationStepSize:
                fmi2Real, noSetFMUStatePriorToCurrentPoint: fmi2Boolean) -> fmi2Status;
            fn fmi2CancelStep(c: fmi2Component) -> fmi2Status;
            fn fmi2GetStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Status) -> fmi2Status;
            fn fmi2GetRealStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Real) -> fmi2Status;
            fn fmi2GetIntegerStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Integer) ->
                fmi2Status;
            fn fmi2GetBooleanStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2Boolean) ->
                fmi2Status;
            fn fmi2GetStringStatus(c: fmi2Component, s: fmi2StatusKind, value: *mut fmi2String) -> fmi2Status;
        }
    };
}
