//! Where FMUs cannot have processes of their own: what is never made.

use std::ffi::{CStr, c_int, c_void};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::{Isolation, NoIsolation};
use crate::log::Live;
use crate::table::{table2, table3};

/// As on Linux.
#[derive(Clone, Debug)]
pub(crate) struct HostFault {
    pub(crate) function: &'static str,
    pub(crate) how: String,
}

/// As on Linux; there is none.
pub(crate) enum RemoteInstance {}

/// As on Linux.
pub(crate) struct Fmi3Opening<'a> {
    pub(crate) co_simulation: bool,
    pub(crate) name: &'a CStr,
    pub(crate) token: &'a CStr,
    pub(crate) resources: Option<&'a CStr>,
    pub(crate) flags: [bool; 5],
    pub(crate) variables: &'a [u32],
}

pub(crate) fn two(_: &Path, _: &Isolation, _: &Arc<Live>) -> Result<table2::LibraryFunctions, String> {
    Err(NoIsolation.to_string())
}

pub(crate) fn three(_: &Path, _: &Isolation, _: &Arc<Live>) -> Result<table3::LibraryFunctions, String> {
    Err(NoIsolation.to_string())
}

impl RemoteInstance {
    pub(crate) fn instantiate_two(&self, _: c_int, _: [&CStr; 3], _: [c_int; 2]) -> *mut c_void {
        match *self {}
    }
    pub(crate) fn instantiate_three(&self, _: &Fmi3Opening<'_>) -> *mut c_void {
        match *self {}
    }
    pub(crate) fn free(&self) {
        match *self {}
    }
    pub(crate) fn abandon(&self) {
        match *self {}
    }
    pub(crate) fn deadline(&self) -> Option<Duration> {
        match *self {}
    }
    pub(crate) fn fault(&self) -> Option<HostFault> {
        match *self {}
    }
    pub(crate) fn blamed(&self) -> Option<&'static str> {
        match *self {}
    }
}
