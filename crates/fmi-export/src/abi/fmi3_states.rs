//! The functions of FMI 3.0 that store and restore FMU states; part of [`super::fmi3`].
#![allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]

use super::fmi3_status::call;
use super::{slice, slice_mut, usable, write};
use crate::model::Exported;
use trueup_fmi::abi::fmi3::*;

pub unsafe fn fmi3GetFMUState<E: Exported>(c: fmi3Instance, state: *mut fmi3FMUState) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe { call::<E::Model>(c, "fmi3GetFMUState", |i| super::get_state(i, state)) }
}
pub unsafe fn fmi3SetFMUState<E: Exported>(c: fmi3Instance, state: fmi3FMUState) -> fmi3Status {
    // SAFETY: the importer's pointer, see the module.
    unsafe { call::<E::Model>(c, "fmi3SetFMUState", |i| i.set_state(state as usize)) }
}
pub unsafe fn fmi3FreeFMUState<E: Exported>(c: fmi3Instance, state: *mut fmi3FMUState) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe { call::<E::Model>(c, "fmi3FreeFMUState", |i| super::free_state(i, state)) }
}
pub unsafe fn fmi3SerializedFMUStateSize<E: Exported>(
    c: fmi3Instance,
    state: fmi3FMUState,
    size: *mut usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3SerializedFMUStateSize", |i| {
            write("size", size, i.serialized_size(state as usize)?)
        })
    }
}
pub unsafe fn fmi3SerializeFMUState<E: Exported>(
    c: fmi3Instance,
    state: fmi3FMUState,
    out: *mut fmi3Byte,
    size: usize,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3SerializeFMUState", |i| {
            i.serialize(state as usize, slice_mut("serializedState", out, size)?)
        })
    }
}
pub unsafe fn fmi3DeserializeFMUState<E: Exported>(
    c: fmi3Instance,
    bytes: *const fmi3Byte,
    size: usize,
    state: *mut fmi3FMUState,
) -> fmi3Status {
    // SAFETY: the importer's pointers, see the module.
    unsafe {
        call::<E::Model>(c, "fmi3DeserializeFMUState", |i| {
            usable("FMUState", state, 1)?;
            let handle = i.deserialize(slice("serializedState", bytes, size)?)?;
            write("FMUState", state, handle as fmi3FMUState)
        })
    }
}
