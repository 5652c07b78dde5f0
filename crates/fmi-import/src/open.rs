//! The functions of an FMU, in this process or in one of its own.

use std::path::Path;
use std::sync::Arc;

use trueup_fmi_description::Version;

use crate::error::Error;
use crate::isolation::{self, Isolation};
use crate::library::{self, Fmu, Interface};
use crate::log::Live;
use crate::table::{table2, table3};

/// Of FMI 2.0.
pub(crate) fn two(fmu: &Fmu, interface: Interface, live: &Arc<Live>) -> Result<table2::Functions, Error> {
    let of = |path: &Path| library::load(path).map(table2::Functions::of);
    open(fmu, Version::V2, interface, of, |path, isolation| isolation::two(path, isolation, live))
}

/// Of FMI 3.0.
pub(crate) fn three(fmu: &Fmu, interface: Interface, live: &Arc<Live>) -> Result<table3::Functions, Error> {
    let of = |path: &Path| library::load(path).map(table3::Functions::of);
    open(fmu, Version::V3, interface, of, |path, isolation| isolation::three(path, isolation, live))
}

fn open<F>(
    fmu: &Fmu,
    version: Version,
    interface: Interface,
    within: impl FnOnce(&Path) -> Result<F, String>,
    isolated: impl FnOnce(&Path, &Isolation) -> Result<F, String>,
) -> Result<F, Error> {
    let path = fmu.library(version, interface)?;
    let opened = match fmu.isolation() {
        None => within(&path),
        Some(isolation) => isolated(&path, isolation),
    };
    opened.map_err(|e| Error::File {
        file: fmu.file().to_owned(),
        reason: format!("its library cannot be loaded: {e}"),
    })
}
