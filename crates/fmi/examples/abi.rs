//! Prints the ABI as Rust sees it, for a comparison with the official C headers:
//!
//! ```text
//! function NAME   TYPE           type of the function pointer, in C (GNU `__typeof__`)
//! constant NAME   VALUE
//! size     TYPE   BYTES
//! offset   STRUCT FIELD BYTES
//! ```
//!
//! The types are found from the Rust types themselves, not from their names.

#![allow(unsafe_code)] // calls of C functions
#![allow(clippy::print_stdout, non_snake_case)]

use std::ffi::c_void;
use std::mem::{offset_of, size_of};

use trueup_fmi::abi::{fmi2::*, fmi3::*};

/// The C type of a Rust type.
trait C {
    fn c() -> String;
}

macro_rules! c {
    ($($rust:ty => $c:literal),* $(,)?) => { $(impl C for $rust { fn c() -> String { $c.into() } })* };
}
// `c_char` and `i8` are one type in Rust: the reader of this list distinguishes `char` and `int8_t`.
c! {
    () => "void", c_void => "void", i8 => "int8", u8 => "uint8_t", i16 => "int16_t", u16 => "uint16_t",
    i32 => "int32_t", u32 => "uint32_t", i64 => "int64_t", u64 => "uint64_t", usize => "size_t", f32 => "float",
    f64 => "double", fmi3Boolean => "bool", fmi2Status => "fmi2Status", fmi2Type => "fmi2Type",
    fmi2StatusKind => "fmi2StatusKind", fmi2CallbackFunctions => "fmi2CallbackFunctions",
    fmi2EventInfo => "fmi2EventInfo", fmi3Status => "fmi3Status", fmi3DependencyKind => "fmi3DependencyKind",
    fmi3IntervalQualifier => "fmi3IntervalQualifier",
}

impl<T: C> C for *const T {
    fn c() -> String {
        format!("{} const*", T::c())
    }
}
impl<T: C> C for *mut T {
    fn c() -> String {
        format!("{}*", T::c())
    }
}

macro_rules! function_pointers {
    ($($arg:ident)*) => {
        impl<$($arg: C,)* R: C> C for unsafe extern "C" fn($($arg),*) -> R {
            fn c() -> String {
                let args: Vec<String> = vec![$($arg::c()),*];
                let args = if args.is_empty() { "void".into() } else { args.join(", ") };
                format!("__typeof__({} (*)({args}))", R::c())
            }
        }
        impl<$($arg: C,)* R: C> C for Option<unsafe extern "C" fn($($arg),*) -> R> {
            fn c() -> String {
                <unsafe extern "C" fn($($arg),*) -> R>::c()
            }
        }
    };
}
function_pointers!();
function_pointers!(A1);
function_pointers!(A1 A2);
function_pointers!(A1 A2 A3);
function_pointers!(A1 A2 A3 A4);
function_pointers!(A1 A2 A3 A4 A5);
function_pointers!(A1 A2 A3 A4 A5 A6);
function_pointers!(A1 A2 A3 A4 A5 A6 A7);
function_pointers!(A1 A2 A3 A4 A5 A6 A7 A8);
function_pointers!(A1 A2 A3 A4 A5 A6 A7 A8 A9);
function_pointers!(A1 A2 A3 A4 A5 A6 A7 A8 A9 A10);
function_pointers!(A1 A2 A3 A4 A5 A6 A7 A8 A9 A10 A11 A12);

impl<A: C, S: C, T: C> C for Option<unsafe extern "C" fn(A, T, S, T, T, ...)> {
    fn c() -> String {
        format!("__typeof__(void (*)({}, {t}, {}, {t}, {t}, ...))", A::c(), S::c(), t = T::c())
    }
}

macro_rules! print_functions {
    ($(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        $(println!("function {} {}", stringify!($name), <unsafe extern "C" fn($($type),*) $(-> $result)?>::c());)*
    };
}

macro_rules! print_types {
    ($($type:ident)*) => {
        $(println!("size {} {}", stringify!($type), size_of::<$type>());)*
        $(println!("type {} {}", stringify!($type), <$type as C>::c());)*
    };
}

macro_rules! print_offsets {
    ($type:ident { $($field:ident)* }) => {
        $(println!("offset {} {} {}", stringify!($type), stringify!($field), offset_of!($type, $field));)*
    };
}

macro_rules! print_constants {
    ($($type:ident)*) => {
        $(for (name, value) in $type::ALL { println!("constant {name} {}", value.0); })*
    };
}

fn main() {
    trueup_fmi::fmi2_functions!(print_functions);
    trueup_fmi::fmi3_functions!(print_functions);
    print_types! {
        fmi2Component fmi2ComponentEnvironment fmi2FMUstate fmi2ValueReference fmi2Real fmi2Integer fmi2Boolean
        fmi2String fmi2Byte fmi2Status fmi2Type fmi2StatusKind fmi2CallbackLogger fmi2CallbackAllocateMemory
        fmi2CallbackFreeMemory fmi2StepFinished fmi2CallbackFunctions fmi2EventInfo
        fmi3Instance fmi3InstanceEnvironment fmi3FMUState fmi3ValueReference fmi3Float32 fmi3Float64 fmi3Int8
        fmi3UInt8 fmi3Int16 fmi3UInt16 fmi3Int32 fmi3UInt32 fmi3Int64 fmi3UInt64 fmi3Boolean fmi3String fmi3Byte
        fmi3Binary fmi3Clock fmi3Status fmi3DependencyKind fmi3IntervalQualifier fmi3LogMessageCallback
        fmi3ClockUpdateCallback fmi3IntermediateUpdateCallback fmi3LockPreemptionCallback fmi3UnlockPreemptionCallback
    }
    print_offsets!(fmi2CallbackFunctions { logger allocateMemory freeMemory stepFinished componentEnvironment });
    print_offsets!(fmi2EventInfo {
        newDiscreteStatesNeeded terminateSimulation nominalsOfContinuousStatesChanged
        valuesOfContinuousStatesChanged nextEventTimeDefined nextEventTime
    });
    print_constants!(fmi2Status fmi2Type fmi2StatusKind fmi3Status fmi3DependencyKind fmi3IntervalQualifier);
    for (name, value) in [("fmi2True", fmi2True), ("fmi2False", fmi2False)] {
        println!("constant {name} {value}");
    }
    for (name, value) in [("fmi3True", fmi3True), ("fmi3False", fmi3False)] {
        println!("constant {name} {}", value.0);
    }
}
