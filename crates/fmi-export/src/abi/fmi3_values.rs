//! The functions of FMI 3.0 that read and set values, one pair per data type; part of [`super::fmi3`].
#![allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]

use super::fmi3_status::call;
use super::{slice, slice_mut};
use crate::fault::error;
use crate::model::Exported;
use crate::values::ValueType;
use trueup_fmi::abi::fmi3::*;

/// Getters and setters of one data type. `$from` and `$to` convert from and to the `f64` kept inside.
macro_rules! values {
    ($($get:ident, $set:ident, $kind:ident, $type:ty, $from:expr, $to:expr;)*) => {$(
        pub unsafe fn $get<E: Exported>(c: fmi3Instance, vr: *const fmi3ValueReference, nvr: usize, values: *mut $type, n: usize) -> fmi3Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($get), |i| {
                let references = slice("valueReferences", vr, nvr)?;
                let out = slice_mut("values", values, n)?;
                let from: fn(f64) -> $type = $from;
                i.get(ValueType::$kind, references, n, |k, v| out[k] = from(v))
            }) }
        }
        pub unsafe fn $set<E: Exported>(c: fmi3Instance, vr: *const fmi3ValueReference, nvr: usize, values: *const $type, n: usize) -> fmi3Status {
            // SAFETY: the importer's pointers, see the module.
            unsafe { call::<E::Model>(c, stringify!($set), |i| {
                let references = slice("valueReferences", vr, nvr)?;
                let values = slice("values", values, n)?;
                let to: fn($type) -> f64 = $to;
                i.set(ValueType::$kind, references, n, |k| to(values[k]))
            }) }
        }
    )*};
}
values! {
    fmi3GetFloat64, fmi3SetFloat64, Real, fmi3Float64, |v| v, |v| v;
    fmi3GetInt32, fmi3SetInt32, Int32, fmi3Int32, |v| v as i32, f64::from;
    fmi3GetInt64, fmi3SetInt64, Enumeration, fmi3Int64, |v| v as i64, |v| v as f64;
    fmi3GetBoolean, fmi3SetBoolean, Boolean, fmi3Boolean, |v| (v != 0.0).into(), |v| f64::from(u8::from(bool::from(v)));
    fmi3GetFloat32, fmi3SetFloat32, Other, fmi3Float32, |v| v as f32, f64::from;
    fmi3GetInt8, fmi3SetInt8, Other, fmi3Int8, |v| v as i8, f64::from;
    fmi3GetUInt8, fmi3SetUInt8, Other, fmi3UInt8, |v| v as u8, f64::from;
    fmi3GetInt16, fmi3SetInt16, Other, fmi3Int16, |v| v as i16, f64::from;
    fmi3GetUInt16, fmi3SetUInt16, Other, fmi3UInt16, |v| v as u16, f64::from;
    fmi3GetUInt32, fmi3SetUInt32, Other, fmi3UInt32, |v| v as u32, f64::from;
    fmi3GetUInt64, fmi3SetUInt64, Other, fmi3UInt64, |v| v as u64, |v| v as f64;
    fmi3GetString, fmi3SetString, Other, fmi3String, |_| core::ptr::null(), |_| 0.0;
}
pub unsafe fn fmi3GetBinary<E: Exported>(
    c: fmi3Instance,
    vr: *const fmi3ValueReference,
    nvr: usize,
    _: *mut usize,
    _: *mut fmi3Binary,
    n: usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3GetBinary", |i| {
            i.get(ValueType::Other, slice("valueReferences", vr, nvr)?, n, |_, _| ())
        })
    }
}
pub unsafe fn fmi3SetBinary<E: Exported>(
    c: fmi3Instance,
    vr: *const fmi3ValueReference,
    nvr: usize,
    _: *const usize,
    _: *const fmi3Binary,
    n: usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3SetBinary", |i| {
            i.set(ValueType::Other, slice("valueReferences", vr, nvr)?, n, |_| 0.0)
        })
    }
}

/// Functions of clocks.
macro_rules! clocks {
    ($($name:ident($($type:ty),*);)*) => {$(
        pub unsafe fn $name<E: Exported>(c: fmi3Instance, $(_: $type),*) -> fmi3Status {
            // SAFETY: the importer's pointer, see the module.
            unsafe { call::<E::Model>(c, stringify!($name), |_| error("this FMU has no clocks: do not call it")) }
        }
    )*};
}
clocks! {
    fmi3GetClock(*const fmi3ValueReference, usize, *mut fmi3Clock);
    fmi3SetClock(*const fmi3ValueReference, usize, *const fmi3Clock);
    fmi3GetIntervalDecimal(*const fmi3ValueReference, usize, *mut fmi3Float64, *mut fmi3IntervalQualifier);
    fmi3GetIntervalFraction(*const fmi3ValueReference, usize, *mut fmi3UInt64, *mut fmi3UInt64, *mut fmi3IntervalQualifier);
    fmi3GetShiftDecimal(*const fmi3ValueReference, usize, *mut fmi3Float64);
    fmi3GetShiftFraction(*const fmi3ValueReference, usize, *mut fmi3UInt64, *mut fmi3UInt64);
    fmi3SetIntervalDecimal(*const fmi3ValueReference, usize, *const fmi3Float64);
    fmi3SetIntervalFraction(*const fmi3ValueReference, usize, *const fmi3UInt64, *const fmi3UInt64);
    fmi3SetShiftDecimal(*const fmi3ValueReference, usize, *const fmi3Float64);
    fmi3SetShiftFraction(*const fmi3ValueReference, usize, *const fmi3UInt64, *const fmi3UInt64);
    fmi3ActivateModelPartition(fmi3ValueReference, fmi3Float64);
}
