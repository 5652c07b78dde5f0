//! FMI 3.0: `fmi3PlatformTypes.h`, `fmi3FunctionTypes.h`.

use core::ffi::{c_char, c_void};

use super::{integer_enum, pointer_types};

/// An instance, owned by the FMU.
pub type fmi3Instance = *mut c_void;
/// The importer's own pointer, handed back in callbacks.
pub type fmi3InstanceEnvironment = *mut c_void;
/// A stored state of an instance, owned by the FMU.
pub type fmi3FMUState = *mut c_void;
/// Handle of a variable (a whole array has one).
pub type fmi3ValueReference = u32;
/// Single precision.
pub type fmi3Float32 = f32;
/// Double precision.
pub type fmi3Float64 = f64;
/// Signed, 8 bits.
pub type fmi3Int8 = i8;
/// Unsigned, 8 bits.
pub type fmi3UInt8 = u8;
/// Signed, 16 bits.
pub type fmi3Int16 = i16;
/// Unsigned, 16 bits.
pub type fmi3UInt16 = u16;
/// Signed, 32 bits.
pub type fmi3Int32 = i32;
/// Unsigned, 32 bits.
pub type fmi3UInt32 = u32;
/// Signed, 64 bits; also the values of enumerations.
pub type fmi3Int64 = i64;
/// Unsigned, 64 bits.
pub type fmi3UInt64 = u64;
/// Null-terminated UTF-8.
pub type fmi3String = *const c_char;
/// Byte of a serialized state or of a binary value.
pub type fmi3Byte = u8;
/// Binary value; its length is next to it.
pub type fmi3Binary = *const fmi3Byte;
/// Clock: active or not.
pub type fmi3Clock = fmi3Boolean;

/// `bool` of C as a byte: zero is false, anything else true, so that an odd byte does no harm.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct fmi3Boolean(pub u8);

/// True.
pub const fmi3True: fmi3Boolean = fmi3Boolean(1);
/// False.
pub const fmi3False: fmi3Boolean = fmi3Boolean(0);

impl From<bool> for fmi3Boolean {
    fn from(value: bool) -> Self {
        Self(u8::from(value))
    }
}

impl From<fmi3Boolean> for bool {
    fn from(value: fmi3Boolean) -> Self {
        value.0 != 0
    }
}

integer_enum! {
    /// What every call returns.
    fmi3Status {
        /// All well.
        fmi3OK = 0,
        /// Not all well, the simulation may go on.
        fmi3Warning = 1,
        /// The call was refused (a smaller step may help); the instance is as before.
        fmi3Discard = 2,
        /// The instance cannot go on; reset, free or set a stored state.
        fmi3Error = 3,
        /// All instances of this FMU are lost.
        fmi3Fatal = 4,
    }
}

integer_enum! {
    /// How a variable depends on another.
    fmi3DependencyKind {
        /// Not at all.
        fmi3Independent = 0,
        /// Linearly with a constant factor.
        fmi3Constant = 1,
        /// Linearly with a factor that is fixed after initialization.
        fmi3Fixed = 2,
        /// Linearly with a factor that changes with tunable parameters.
        fmi3Tunable = 3,
        /// Linearly with a factor that changes at events.
        fmi3Discrete = 4,
        /// In any way.
        fmi3Dependent = 5,
    }
}

integer_enum! {
    /// What is known of a clock's interval.
    fmi3IntervalQualifier {
        /// Not yet known.
        fmi3IntervalNotYetKnown = 0,
        /// As it was.
        fmi3IntervalUnchanged = 1,
        /// New value.
        fmi3IntervalChanged = 2,
    }
}

/// Takes the FMU's messages: environment, status, category, message.
pub type fmi3LogMessageCallback =
    Option<unsafe extern "C" fn(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String)>;
/// Called when a clock may have ticked (Scheduled Execution).
pub type fmi3ClockUpdateCallback = Option<unsafe extern "C" fn(fmi3InstanceEnvironment)>;
/// Called inside a step: environment, time in s, set requested, get allowed, internal step finished, early
/// return possible; written: early return requested, its time in s.
pub type fmi3IntermediateUpdateCallback = Option<
    unsafe extern "C" fn(
        fmi3InstanceEnvironment,
        fmi3Float64,
        fmi3Boolean,
        fmi3Boolean,
        fmi3Boolean,
        fmi3Boolean,
        *mut fmi3Boolean,
        *mut fmi3Float64,
    ),
>;
/// Begins a section that must not be preempted (Scheduled Execution).
pub type fmi3LockPreemptionCallback = Option<unsafe extern "C" fn()>;
/// Ends it.
pub type fmi3UnlockPreemptionCallback = Option<unsafe extern "C" fn()>;

/// Pointer types of all functions.
pub mod pointer {
    use super::*;
    crate::fmi3_functions!(pointer_types);
}

/// Hands the list of all 75 functions of FMI 3.0 to a macro, as `fn name(arg: type, ...) -> type;` each.
/// Where it is used the types of [`abi::fmi3`](crate::abi::fmi3) must be in scope.
#[macro_export]
macro_rules! fmi3_functions {
    ($($callback:ident)::+) => {
        $($callback)::+! {
            fn fmi3GetVersion() -> fmi3String;
            fn fmi3SetDebugLogging(instance: fmi3Instance, loggingOn: fmi3Boolean, nCategories: usize,
                categories: *const fmi3String) -> fmi3Status;
            fn fmi3InstantiateModelExchange(instanceName: fmi3String, instantiationToken: fmi3String,
                resourcePath: fmi3String, visible: fmi3Boolean, loggingOn: fmi3Boolean,
                instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback) ->
                fmi3Instance;
            fn fmi3InstantiateCoSimulation(instanceName: fmi3String, instantiationToken: fmi3String,
                resourcePath: fmi3String, visible: fmi3Boolean, loggingOn: fmi3Boolean, eventModeUsed:
                fmi3Boolean, earlyReturnAllowed: fmi3Boolean, requiredIntermediateVariables: *const
                fmi3ValueReference, nRequiredIntermediateVariables: usize, instanceEnvironment:
                fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback, intermediateUpdate:
                fmi3IntermediateUpdateCallback) -> fmi3Instance;
            fn fmi3InstantiateScheduledExecution(instanceName: fmi3String, instantiationToken: fmi3String,
                resourcePath: fmi3String, visible: fmi3Boolean, loggingOn: fmi3Boolean,
                instanceEnvironment: fmi3InstanceEnvironment, logMessage: fmi3LogMessageCallback,
                clockUpdate: fmi3ClockUpdateCallback, lockPreemption: fmi3LockPreemptionCallback,
                unlockPreemption: fmi3UnlockPreemptionCallback) -> fmi3Instance;
            fn fmi3FreeInstance(instance: fmi3Instance);
            fn fmi3EnterInitializationMode(instance: fmi3Instance, toleranceDefined: fmi3Boolean,
                tolerance: fmi3Float64, startTime: fmi3Float64, stopTimeDefined: fmi3Boolean, stopTime:
                fmi3Float64) -> fmi3Status;
            fn fmi3ExitInitializationMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3EnterEventMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3Terminate(instance: fmi3Instance) -> fmi3Status;
            fn fmi3Reset(instance: fmi3Instance) -> fmi3Status;
            fn fmi3GetFloat32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Float32, nValues: usize) -> fmi3Status;
            fn fmi3GetFloat64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Float64, nValues: usize) -> fmi3Status;
            fn fmi3GetInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Int8, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3UInt8, nValues: usize) -> fmi3Status;
            fn fmi3GetInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Int16, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3UInt16, nValues: usize) -> fmi3Status;
            fn fmi3GetInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Int32, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3UInt32, nValues: usize) -> fmi3Status;
            fn fmi3GetInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Int64, nValues: usize) -> fmi3Status;
            fn fmi3GetUInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3UInt64, nValues: usize) -> fmi3Status;
            fn fmi3GetBoolean(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Boolean, nValues: usize) -> fmi3Status;
            fn fmi3GetString(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3String, nValues: usize) -> fmi3Status;
            fn fmi3GetBinary(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, valueSizes: *mut usize, values: *mut fmi3Binary, nValues: usize)
                -> fmi3Status;
            fn fmi3GetClock(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *mut fmi3Clock) -> fmi3Status;
            fn fmi3SetFloat32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Float32, nValues: usize) -> fmi3Status;
            fn fmi3SetFloat64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Float64, nValues: usize) -> fmi3Status;
            fn fmi3SetInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Int8, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt8(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3UInt8, nValues: usize) -> fmi3Status;
            fn fmi3SetInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Int16, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt16(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3UInt16, nValues: usize) -> fmi3Status;
            fn fmi3SetInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Int32, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt32(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3UInt32, nValues: usize) -> fmi3Status;
            fn fmi3SetInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Int64, nValues: usize) -> fmi3Status;
            fn fmi3SetUInt64(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3UInt64, nValues: usize) -> fmi3Status;
            fn fmi3SetBoolean(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Boolean, nValues: usize) -> fmi3Status;
            fn fmi3SetString(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3String, nValues: usize) -> fmi3Status;
            fn fmi3SetBinary(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, valueSizes: *const usize, values: *const fmi3Binary, nValues:
                usize) -> fmi3Status;
            fn fmi3SetClock(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, values: *const fmi3Clock) -> fmi3Status;
            fn fmi3GetNumberOfVariableDependencies(instance: fmi3Instance, valueReference:
                fmi3ValueReference, nDependencies: *mut usize) -> fmi3Status;
            fn fmi3GetVariableDependencies(instance: fmi3Instance, dependent: fmi3ValueReference,
                elementIndicesOfDependent: *mut usize, independents: *mut fmi3ValueReference,
                elementIndicesOfIndependents: *mut usize, dependencyKinds: *mut fmi3DependencyKind,
                nDependencies: usize) -> fmi3Status;
            fn fmi3GetFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> fmi3Status;
            fn fmi3SetFMUState(instance: fmi3Instance, FMUState: fmi3FMUState) -> fmi3Status;
            fn fmi3FreeFMUState(instance: fmi3Instance, FMUState: *mut fmi3FMUState) -> fmi3Status;
            fn fmi3SerializedFMUStateSize(instance: fmi3Instance, FMUState: fmi3FMUState, size: *mut
                usize) -> fmi3Status;
            fn fmi3SerializeFMUState(instance: fmi3Instance, FMUState: fmi3FMUState, serializedState: *mut
                fmi3Byte, size: usize) -> fmi3Status;
            fn fmi3DeserializeFMUState(instance: fmi3Instance, serializedState: *const fmi3Byte, size:
                usize, FMUState: *mut fmi3FMUState) -> fmi3Status;
            fn fmi3GetDirectionalDerivative(instance: fmi3Instance, unknowns: *const fmi3ValueReference,
                nUnknowns: usize, knowns: *const fmi3ValueReference, nKnowns: usize, seed: *const
                fmi3Float64, nSeed: usize, sensitivity: *mut fmi3Float64, nSensitivity: usize) ->
                fmi3Status;
            fn fmi3GetAdjointDerivative(instance: fmi3Instance, unknowns: *const fmi3ValueReference,
                nUnknowns: usize, knowns: *const fmi3ValueReference, nKnowns: usize, seed: *const
                fmi3Float64, nSeed: usize, sensitivity: *mut fmi3Float64, nSensitivity: usize) ->
                fmi3Status;
            fn fmi3EnterConfigurationMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3ExitConfigurationMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3GetIntervalDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, intervals: *mut fmi3Float64, qualifiers: *mut
                fmi3IntervalQualifier) -> fmi3Status;
            fn fmi3GetIntervalFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, counters: *mut fmi3UInt64, resolutions: *mut fmi3UInt64,
                qualifiers: *mut fmi3IntervalQualifier) -> fmi3Status;
            fn fmi3GetShiftDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, shifts: *mut fmi3Float64) -> fmi3Status;
            fn fmi3GetShiftFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, counters: *mut fmi3UInt64, resolutions: *mut fmi3UInt64) ->
                fmi3Status;
            fn fmi3SetIntervalDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, intervals: *const fmi3Float64) -> fmi3Status;
            fn fmi3SetIntervalFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, counters: *const fmi3UInt64, resolutions: *const fmi3UInt64) ->
                fmi3Status;
            fn fmi3SetShiftDecimal(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, shifts: *const fmi3Float64) -> fmi3Status;
            fn fmi3SetShiftFraction(instance: fmi3Instance, valueReferences: *const fmi3ValueReference,
                nValueReferences: usize, counters: *const fmi3UInt64, resolutions: *const fmi3UInt64) ->
                fmi3Status;
            fn fmi3EvaluateDiscreteStates(instance: fmi3Instance) -> fmi3Status;
            fn fmi3UpdateDiscreteStates(instance: fmi3Instance, discreteStatesNeedUpdate: *mut
                fmi3Boolean, terminateSimulation: *mut fmi3Boolean, nominalsOfContinuousStatesChanged:
                *mut fmi3Boolean, valuesOfContinuousStatesChanged: *mut fmi3Boolean, nextEventTimeDefined:
                *mut fmi3Boolean, nextEventTime: *mut fmi3Float64) -> fmi3Status;
            fn fmi3EnterContinuousTimeMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3CompletedIntegratorStep(instance: fmi3Instance, noSetFMUStatePriorToCurrentPoint:
                fmi3Boolean, enterEventMode: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean) ->
                fmi3Status;
            fn fmi3SetTime(instance: fmi3Instance, time: fmi3Float64) -> fmi3Status;
            fn fmi3SetContinuousStates(instance: fmi3Instance, continuousStates: *const fmi3Float64,
                nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetContinuousStateDerivatives(instance: fmi3Instance, derivatives: *mut fmi3Float64,
                nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetEventIndicators(instance: fmi3Instance, eventIndicators: *mut fmi3Float64,
                nEventIndicators: usize) -> fmi3Status;
            fn fmi3GetContinuousStates(instance: fmi3Instance, continuousStates: *mut fmi3Float64,
                nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetNominalsOfContinuousStates(instance: fmi3Instance, nominals: *mut fmi3Float64,
                nContinuousStates: usize) -> fmi3Status;
            fn fmi3GetNumberOfEventIndicators(instance: fmi3Instance, nEventIndicators: *mut usize) ->
                fmi3Status;
            fn fmi3GetNumberOfContinuousStates(instance: fmi3Instance, nContinuousStates: *mut usize) ->
                fmi3Status;
            fn fmi3EnterStepMode(instance: fmi3Instance) -> fmi3Status;
            fn fmi3GetOutputDerivatives(instance: fmi3Instance, valueReferences: *const
                fmi3ValueReference, nValueReferences: usize, orders: *const fmi3Int32, values: *mut
                fmi3Float64, nValues: usize) -> fmi3Status;
            fn fmi3DoStep(instance: fmi3Instance, currentCommunicationPoint: fmi3Float64,
                communicationStepSize: fmi3Float64, noSetFMUStatePriorToCurrentPoint: fmi3Boolean,
                eventHandlingNeeded: *mut fmi3Boolean, terminateSimulation: *mut fmi3Boolean, earlyReturn:
                *mut fmi3Boolean, lastSuccessfulTime: *mut fmi3Float64) -> fmi3Status;
            fn fmi3ActivateModelPartition(instance: fmi3Instance, clockReference: fmi3ValueReference,
                activationTime: fmi3Float64) -> fmi3Status;
        }
    };
}
