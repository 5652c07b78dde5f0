//! The functions of an FMU, in this process or in one of its own.

use std::path::Path;
use std::sync::Arc;

use trueup_fmi_description::FmiVersion;

use crate::error::ImportError;
use crate::isolation::{self, Isolation};
use crate::library::{self, UnpackedFmu, UsedInterface};
use crate::log::Live;
use crate::table::{table2, table3};

/// Of FMI 2.0.
pub(crate) fn two(
    fmu: &UnpackedFmu,
    interface: UsedInterface,
    live: &Arc<Live>,
) -> Result<table2::LibraryFunctions, ImportError> {
    let of = |path: &Path| library::load(path).map(table2::LibraryFunctions::of);
    open(fmu, FmiVersion::V2, interface, of, |path, isolation| isolation::two(path, isolation, live))
}

/// Of FMI 3.0.
pub(crate) fn three(
    fmu: &UnpackedFmu,
    interface: UsedInterface,
    live: &Arc<Live>,
) -> Result<table3::LibraryFunctions, ImportError> {
    let of = |path: &Path| library::load(path).map(table3::LibraryFunctions::of);
    open(fmu, FmiVersion::V3, interface, of, |path, isolation| isolation::three(path, isolation, live))
}

fn open<F>(
    fmu: &UnpackedFmu,
    version: FmiVersion,
    interface: UsedInterface,
    within: impl FnOnce(&Path) -> Result<F, String>,
    isolated: impl FnOnce(&Path, &Isolation) -> Result<F, String>,
) -> Result<F, ImportError> {
    let path = fmu.library(version, interface)?;
    let opened = match fmu.isolation() {
        None => within(&path),
        Some(isolation) => isolated(&path, isolation),
    };
    opened.map_err(|e| ImportError::File {
        file: fmu.file().to_owned(),
        reason: format!("its library cannot be loaded: {e}"),
    })
}
