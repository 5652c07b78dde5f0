//! The functions of both versions, each in one line from which both sides are made: what the master calls in place of the
//! FMU's function, and what the host then calls.
//!
//! How a call goes: `post`: with the next one, nothing is read; `wait`: at once; `ask`: at once, or it was answered with the last
//! step; `step`: at once, and what was read after the last step is answered too.

#![allow(unsafe_code, non_snake_case, non_camel_case_types)] // the boundary of the process

use std::ffi::{c_int, c_void};

use super::frame::{Arguments, FrameReader, FrameWriter, PlainValue};
use super::link::ProcessLink;

/// The type of an argument.
macro_rules! type_of {
    (value $type:ty) => { $type };
    (array $type:ty, $n:expr) => { *const $type };
    (written $type:ty, $n:expr) => { *mut $type };
    (read $type:ty, $n:expr) => { *mut $type };
    (texts $n:expr) => { *const *const std::ffi::c_char };
    (binaries $sizes:expr, $n:expr) => { *const *const u8 };
    (given_texts $n:expr) => { *mut *const std::ffi::c_char };
    (given_binaries $sizes:expr, $n:expr) => { *mut *const u8 };
}

/// The master writes an argument.
macro_rules! put {
    ($w:ident $name:ident value $type:ty) => {
        $w.value($name)
    };
    ($w:ident $name:ident array $type:ty, $n:expr) => {
        $w.array($name, $n)
    };
    ($w:ident $name:ident written $type:ty, $n:expr) => {
        $w.written($name, $n)
    };
    ($w:ident $name:ident read $type:ty, $n:expr) => {
        $w.written($name, $n)
    };
    ($w:ident $name:ident texts $n:expr) => {
        $w.texts($name, $n)
    };
    ($w:ident $name:ident binaries $sizes:expr, $n:expr) => {
        $w.binaries($name, $sizes, $n)
    };
    ($w:ident $name:ident given_texts $n:expr) => {
        $w.word($n as u64)
    };
    ($w:ident $name:ident given_binaries $sizes:expr, $n:expr) => {
        $w.word($n as u64)
    };
}

/// The master reads what the FMU has written.
macro_rules! take {
    ($r:ident $name:ident value $type:ty) => {
        $r.word()
    };
    ($r:ident $name:ident array $type:ty, $n:expr) => {
        $r.skip::<$type>($n)
    };
    ($r:ident $name:ident written $type:ty, $n:expr) => {
        $r.written($name, $n)
    };
    ($r:ident $name:ident read $type:ty, $n:expr) => {
        $r.written($name, $n)
    };
    ($r:ident $name:ident texts $n:expr) => {};
    ($r:ident $name:ident binaries $sizes:expr, $n:expr) => {};
    ($r:ident $name:ident given_texts $n:expr) => {
        $r.word()
    };
    ($r:ident $name:ident given_binaries $sizes:expr, $n:expr) => {
        $r.word()
    };
}

/// The master reads what follows the entry.
macro_rules! take_behind {
    ($link:ident $at:ident $name:ident given_texts $n:expr) => {
        (*$link).texts_at($at, $name, $n)
    };
    ($link:ident $at:ident $name:ident given_binaries $sizes:expr, $n:expr) => {
        (*$link).binaries_at($at, $name, $sizes, $n)
    };
    ($($other:tt)*) => {};
}

/// The host reads an argument.
macro_rules! get {
    ($a:ident value $type:ty) => {
        $a.value::<$type>()
    };
    ($a:ident array $type:ty, $n:expr) => {
        $a.array::<$type>().cast_const()
    };
    ($a:ident written $type:ty, $n:expr) => {
        $a.array::<$type>()
    };
    // All of it has to be written.
    ($a:ident read $type:ty, $n:expr) => {
        $a.read(<$type>::NAN)
    };
    ($a:ident texts $n:expr) => {
        $a.texts()
    };
    ($a:ident binaries $sizes:expr, $n:expr) => {
        $a.binaries()
    };
    ($a:ident given_texts $n:expr) => {
        $a.places()
    };
    ($a:ident given_binaries $sizes:expr, $n:expr) => {
        $a.places()
    };
}

/// The host hands it over.
macro_rules! pass {
    ($name:ident texts $($rest:tt)*) => {
        $name.as_ptr()
    };
    ($name:ident binaries $($rest:tt)*) => {
        $name.as_ptr()
    };
    ($name:ident given_texts $($rest:tt)*) => {
        $name.as_mut_ptr()
    };
    ($name:ident given_binaries $($rest:tt)*) => {
        $name.as_mut_ptr()
    };
    ($name:ident $($rest:tt)*) => {
        $name
    };
}

/// The host writes what the FMU gave.
macro_rules! give {
    ($a:ident $name:ident given_texts $n:expr) => {
        $a.give_texts(&$name)
    };
    ($a:ident $name:ident given_binaries $sizes:expr, $n:expr) => {
        $a.give_binaries(&$name, $sizes)
    };
    ($($other:tt)*) => {};
}

macro_rules! calls {
    ($version:ident, $abi:ident, $table:ident, $status:ident; $($mode:ident $function:ident($($name:ident: $kind:ident($($spec:tt)*)),*);)*) => {
        pub(crate) mod $version {
            use super::*;
            use crate::table::$table::LibraryFunctions;
            use trueup_fmi::abi::$abi::*;

            #[derive(Clone, Copy)]
            #[allow(clippy::enum_variant_names)]
            enum CallNumber {
                $($function,)*
            }

            /// Names of the functions, by number.
            pub(in super::super) const NAMES: &[&str] = &[$(stringify!($function)),*];

            $(unsafe extern "C" fn $function(c: *mut c_void, $($name: type_of!($kind $($spec)*)),*) -> $status {
                let link = c.cast::<ProcessLink>();
                // SAFETY: `c` is the link of this instance, see `RemoteInstance`; the other arguments are as the C function's.
                unsafe {
                    #[allow(unused_mut)]
                    let mut w: FrameWriter<'_> = (*link).entry(CallNumber::$function as u32);
                    $(put!(w $name $kind $($spec)*);)*
                    let (question, begin, end) = (w.question, w.begin, w.finish());
                    let status = ProcessLink::$mode(link, begin, question, end);
                    if let Some((at, _behind)) = status.at {
                        #[allow(unused_mut, unused_variables)]
                        let mut r: FrameReader<'_> = (*link).reader(at);
                        $(take!(r $name $kind $($spec)*);)*
                        $(take_behind!(link _behind $name $kind $($spec)*);)*
                    }
                    $status(status.status)
                }
            })*

            /// The functions that the library in the host has.
            pub(in super::super) fn table(there: &[bool]) -> LibraryFunctions {
                let mut functions = LibraryFunctions::none();
                $(if there.get(CallNumber::$function as usize) == Some(&true) {
                    functions.$function = Some($function);
                })*
                functions
            }

            /// Which of them a library has, by number.
            pub(in super::super) fn there(functions: &LibraryFunctions) -> Vec<bool> {
                vec![$(functions.$function.is_some()),*]
            }

            /// Calls one.
            ///
            /// # Safety
            /// The arguments are those of this function, the component is an instance of the library.
            pub(in super::super) unsafe fn call(functions: &LibraryFunctions, number: u32, component: *mut c_void, a: &mut Arguments) -> Option<c_int> {
                $(if number == CallNumber::$function as u32 {
                    let function = functions.$function?;
                    // SAFETY: the caller's word.
                    unsafe {
                        $(#[allow(unused_mut)] let mut $name = get!(a $kind $($spec)*);)*
                        let status = function(component, $(pass!($name $kind $($spec)*)),*);
                        $(give!(a $name $kind $($spec)*);)*
                        return Some(status.0);
                    }
                })*
                None
            }
        }
    };
}

impl PlainValue for trueup_fmi::abi::fmi2::fmi2StatusKind {
    fn word(self) -> u64 {
        self.0.word()
    }
    fn from_word(word: u64) -> Self {
        Self(c_int::from_word(word))
    }
}

impl PlainValue for trueup_fmi::abi::fmi3::fmi3Boolean {
    fn word(self) -> u64 {
        self.0.word()
    }
    fn from_word(word: u64) -> Self {
        Self(u8::from_word(word))
    }
}

calls! { two, fmi2, table2, fmi2Status;
    wait fmi2SetDebugLogging(on: value(fmi2Boolean), n: value(usize), categories: texts(n));
    wait fmi2SetupExperiment(with_tolerance: value(fmi2Boolean), tolerance: value(f64), start: value(f64), with_stop: value(fmi2Boolean), stop: value(f64));
    wait fmi2EnterInitializationMode();
    wait fmi2ExitInitializationMode();
    wait fmi2Terminate();
    wait fmi2Reset();
    ask fmi2GetReal(vr: array(u32, n), n: value(usize), v: read(f64, n));
    ask fmi2GetInteger(vr: array(u32, n), n: value(usize), v: written(fmi2Integer, n));
    ask fmi2GetBoolean(vr: array(u32, n), n: value(usize), v: written(fmi2Boolean, n));
    wait fmi2GetString(vr: array(u32, n), n: value(usize), v: given_texts(n));
    post fmi2SetReal(vr: array(u32, n), n: value(usize), v: array(f64, n));
    post fmi2SetInteger(vr: array(u32, n), n: value(usize), v: array(fmi2Integer, n));
    post fmi2SetBoolean(vr: array(u32, n), n: value(usize), v: array(fmi2Boolean, n));
    wait fmi2SetString(vr: array(u32, n), n: value(usize), v: texts(n));
    wait fmi2GetFMUstate(state: written(fmi2FMUstate, 1));
    wait fmi2SetFMUstate(state: value(*mut c_void));
    wait fmi2FreeFMUstate(state: written(fmi2FMUstate, 1));
    wait fmi2SerializedFMUstateSize(state: value(*mut c_void), size: written(usize, 1));
    wait fmi2SerializeFMUstate(state: value(*mut c_void), bytes: written(fmi2Byte, size), size: value(usize));
    wait fmi2DeSerializeFMUstate(bytes: array(fmi2Byte, size), size: value(usize), state: written(fmi2FMUstate, 1));
    wait fmi2GetDirectionalDerivative(of: array(u32, m), m: value(usize), by: array(u32, n), n: value(usize), dv: array(f64, n), du: written(f64, m));
    wait fmi2EnterEventMode();
    wait fmi2NewDiscreteStates(info: written(fmi2EventInfo, 1));
    wait fmi2EnterContinuousTimeMode();
    wait fmi2CompletedIntegratorStep(no_rollback: value(fmi2Boolean), event: written(fmi2Boolean, 1), terminate: written(fmi2Boolean, 1));
    post fmi2SetTime(time: value(f64));
    post fmi2SetContinuousStates(x: array(f64, n), n: value(usize));
    wait fmi2GetDerivatives(dx: read(f64, n), n: value(usize));
    wait fmi2GetEventIndicators(z: read(f64, n), n: value(usize));
    wait fmi2GetContinuousStates(x: read(f64, n), n: value(usize));
    wait fmi2GetNominalsOfContinuousStates(x: written(f64, n), n: value(usize));
    post fmi2SetRealInputDerivatives(vr: array(u32, n), n: value(usize), order: array(fmi2Integer, n), v: array(f64, n));
    wait fmi2GetRealOutputDerivatives(vr: array(u32, n), n: value(usize), order: array(fmi2Integer, n), v: written(f64, n));
    step fmi2DoStep(time: value(f64), size: value(f64), no_rollback: value(fmi2Boolean));
    wait fmi2GetStatus(kind: value(fmi2StatusKind), v: written(fmi2Status, 1));
    wait fmi2GetRealStatus(kind: value(fmi2StatusKind), v: written(f64, 1));
    wait fmi2GetIntegerStatus(kind: value(fmi2StatusKind), v: written(fmi2Integer, 1));
    wait fmi2GetBooleanStatus(kind: value(fmi2StatusKind), v: written(fmi2Boolean, 1));
}

calls! { three, fmi3, table3, fmi3Status;
    wait fmi3SetDebugLogging(on: value(fmi3Boolean), n: value(usize), categories: texts(n));
    wait fmi3EnterInitializationMode(with_tolerance: value(fmi3Boolean), tolerance: value(f64), start: value(f64), with_stop: value(fmi3Boolean), stop: value(f64));
    wait fmi3ExitInitializationMode();
    wait fmi3EnterEventMode();
    wait fmi3Terminate();
    wait fmi3Reset();
    ask fmi3GetFloat32(vr: array(u32, n), n: value(usize), v: read(f32, k), k: value(usize));
    ask fmi3GetFloat64(vr: array(u32, n), n: value(usize), v: read(f64, k), k: value(usize));
    ask fmi3GetInt8(vr: array(u32, n), n: value(usize), v: written(i8, k), k: value(usize));
    ask fmi3GetUInt8(vr: array(u32, n), n: value(usize), v: written(u8, k), k: value(usize));
    ask fmi3GetInt16(vr: array(u32, n), n: value(usize), v: written(i16, k), k: value(usize));
    ask fmi3GetUInt16(vr: array(u32, n), n: value(usize), v: written(u16, k), k: value(usize));
    ask fmi3GetInt32(vr: array(u32, n), n: value(usize), v: written(i32, k), k: value(usize));
    ask fmi3GetUInt32(vr: array(u32, n), n: value(usize), v: written(u32, k), k: value(usize));
    ask fmi3GetInt64(vr: array(u32, n), n: value(usize), v: written(i64, k), k: value(usize));
    ask fmi3GetUInt64(vr: array(u32, n), n: value(usize), v: written(u64, k), k: value(usize));
    ask fmi3GetBoolean(vr: array(u32, n), n: value(usize), v: written(fmi3Boolean, k), k: value(usize));
    wait fmi3GetString(vr: array(u32, n), n: value(usize), v: given_texts(k), k: value(usize));
    wait fmi3GetBinary(vr: array(u32, n), n: value(usize), sizes: written(usize, k), v: given_binaries(sizes, k), k: value(usize));
    wait fmi3GetClock(vr: array(u32, n), n: value(usize), v: written(fmi3Clock, n));
    post fmi3SetFloat32(vr: array(u32, n), n: value(usize), v: array(f32, k), k: value(usize));
    post fmi3SetFloat64(vr: array(u32, n), n: value(usize), v: array(f64, k), k: value(usize));
    post fmi3SetInt8(vr: array(u32, n), n: value(usize), v: array(i8, k), k: value(usize));
    post fmi3SetUInt8(vr: array(u32, n), n: value(usize), v: array(u8, k), k: value(usize));
    post fmi3SetInt16(vr: array(u32, n), n: value(usize), v: array(i16, k), k: value(usize));
    post fmi3SetUInt16(vr: array(u32, n), n: value(usize), v: array(u16, k), k: value(usize));
    post fmi3SetInt32(vr: array(u32, n), n: value(usize), v: array(i32, k), k: value(usize));
    post fmi3SetUInt32(vr: array(u32, n), n: value(usize), v: array(u32, k), k: value(usize));
    post fmi3SetInt64(vr: array(u32, n), n: value(usize), v: array(i64, k), k: value(usize));
    post fmi3SetUInt64(vr: array(u32, n), n: value(usize), v: array(u64, k), k: value(usize));
    post fmi3SetBoolean(vr: array(u32, n), n: value(usize), v: array(fmi3Boolean, k), k: value(usize));
    wait fmi3SetString(vr: array(u32, n), n: value(usize), v: texts(k), k: value(usize));
    wait fmi3SetBinary(vr: array(u32, n), n: value(usize), sizes: array(usize, k), v: binaries(sizes, k), k: value(usize));
    wait fmi3SetClock(vr: array(u32, n), n: value(usize), v: array(fmi3Clock, n));
    wait fmi3GetFMUState(state: written(fmi3FMUState, 1));
    wait fmi3SetFMUState(state: value(*mut c_void));
    wait fmi3FreeFMUState(state: written(fmi3FMUState, 1));
    wait fmi3SerializedFMUStateSize(state: value(*mut c_void), size: written(usize, 1));
    wait fmi3SerializeFMUState(state: value(*mut c_void), bytes: written(fmi3Byte, size), size: value(usize));
    wait fmi3DeserializeFMUState(bytes: array(fmi3Byte, size), size: value(usize), state: written(fmi3FMUState, 1));
    wait fmi3GetDirectionalDerivative(of: array(u32, m), m: value(usize), by: array(u32, n), n: value(usize), seed: array(f64, j), j: value(usize), v: written(f64, k), k: value(usize));
    wait fmi3GetAdjointDerivative(of: array(u32, m), m: value(usize), by: array(u32, n), n: value(usize), seed: array(f64, j), j: value(usize), v: written(f64, k), k: value(usize));
    wait fmi3EnterConfigurationMode();
    wait fmi3ExitConfigurationMode();
    wait fmi3GetIntervalDecimal(vr: array(u32, n), n: value(usize), v: written(f64, n), qualifiers: written(fmi3IntervalQualifier, n));
    wait fmi3EvaluateDiscreteStates();
    wait fmi3UpdateDiscreteStates(again: written(fmi3Boolean, 1), terminate: written(fmi3Boolean, 1), nominals: written(fmi3Boolean, 1), values: written(fmi3Boolean, 1), defined: written(fmi3Boolean, 1), next: written(f64, 1));
    wait fmi3EnterContinuousTimeMode();
    wait fmi3CompletedIntegratorStep(no_rollback: value(fmi3Boolean), event: written(fmi3Boolean, 1), terminate: written(fmi3Boolean, 1));
    post fmi3SetTime(time: value(f64));
    post fmi3SetContinuousStates(x: array(f64, n), n: value(usize));
    wait fmi3GetContinuousStateDerivatives(dx: read(f64, n), n: value(usize));
    wait fmi3GetEventIndicators(z: read(f64, n), n: value(usize));
    wait fmi3GetContinuousStates(x: read(f64, n), n: value(usize));
    wait fmi3GetNominalsOfContinuousStates(x: written(f64, n), n: value(usize));
    wait fmi3GetNumberOfEventIndicators(n: written(usize, 1));
    wait fmi3GetNumberOfContinuousStates(n: written(usize, 1));
    wait fmi3EnterStepMode();
    wait fmi3GetOutputDerivatives(vr: array(u32, n), n: value(usize), orders: array(i32, n), v: written(f64, k), k: value(usize));
    step fmi3DoStep(time: value(f64), size: value(f64), no_rollback: value(fmi3Boolean), event: written(fmi3Boolean, 1), terminate: written(fmi3Boolean, 1), early: written(fmi3Boolean, 1), last: written(f64, 1));
}
