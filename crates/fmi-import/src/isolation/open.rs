//! An instance in another process, from its library to its first call.

#![allow(unsafe_code)] // the boundary of the process

use std::ffi::{CStr, c_int, c_void};
use std::path::Path;
use std::sync::Arc;

use trueup_fmi_description::FmiVersion;

use super::link::{ProcessLink, RemoteInstance};
use super::{Isolation, calls};
use crate::log::Live;
use crate::table::{table2, table3};

/// The functions of FMI 2.0 in a process of their own.
pub(crate) fn two(
    library: &Path,
    isolation: &Isolation,
    live: &Arc<Live>,
) -> Result<table2::LibraryFunctions, String> {
    let (link, there) = ProcessLink::start(library, FmiVersion::V2, calls::two::NAMES, isolation, live)?;
    let mut functions = calls::two::table(&there);
    functions.remote = Some(RemoteInstance::new(link));
    Ok(functions)
}

/// The functions of FMI 3.0.
pub(crate) fn three(
    library: &Path,
    isolation: &Isolation,
    live: &Arc<Live>,
) -> Result<table3::LibraryFunctions, String> {
    let (link, there) = ProcessLink::start(library, FmiVersion::V3, calls::three::NAMES, isolation, live)?;
    let mut functions = calls::three::table(&there);
    functions.remote = Some(RemoteInstance::new(link));
    Ok(functions)
}

/// Arguments of an instantiation in FMI 3.0.
pub(crate) struct Fmi3Opening<'a> {
    pub(crate) co_simulation: bool,
    pub(crate) name: &'a CStr,
    pub(crate) token: &'a CStr,
    pub(crate) resources: Option<&'a CStr>,
    /// Visible, logging on, event mode used, early return allowed, intermediate update.
    pub(crate) flags: [bool; 5],
    pub(crate) variables: &'a [u32],
}

impl RemoteInstance {
    /// Instantiates; NULL if it is refused.
    pub(crate) fn instantiate_two(&self, kind: c_int, texts: [&CStr; 3], flags: [c_int; 2]) -> *mut c_void {
        let [name, guid, resources] = texts.map(CStr::to_bytes_with_nul);
        // SAFETY: the link lives, and no call is under way.
        let made = unsafe {
            ProcessLink::instantiate(self.link(), |w| {
                w.bytes(name);
                w.value(kind);
                w.bytes(guid);
                w.bytes(resources);
                flags.iter().for_each(|flag| w.value(*flag));
            })
        };
        if made { self.component() } else { std::ptr::null_mut() }
    }

    /// As [`RemoteInstance::instantiate_two`].
    pub(crate) fn instantiate_three(&self, it: &Fmi3Opening<'_>) -> *mut c_void {
        // SAFETY: as above.
        let made = unsafe {
            ProcessLink::instantiate(self.link(), |w| {
                w.word(it.co_simulation.into());
                w.bytes(it.name.to_bytes_with_nul());
                w.bytes(it.token.to_bytes_with_nul());
                w.bytes(it.resources.map_or(&[], CStr::to_bytes_with_nul));
                it.flags.iter().for_each(|flag| w.word((*flag).into()));
                w.word(it.variables.len() as u64);
                w.array(it.variables.as_ptr(), it.variables.len());
            })
        };
        if made { self.component() } else { std::ptr::null_mut() }
    }
}
