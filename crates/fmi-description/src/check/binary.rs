//! Symbols that a shared library exports, read from the file: nothing is loaded.

use std::collections::HashSet;

use object::Object;
use object::read::NameOrOrdinal;
use trueup_fmi::abi::{fmi2, fmi3};

use crate::FmiVersion;
use crate::description::Description;

/// Functions that the interface types of this FMU demand and the library lacks.
///
/// # Errors
/// A text where the file is no shared library that can be read.
pub(super) fn missing(d: &Description, bytes: &[u8]) -> Result<Vec<&'static str>, String> {
    let file = object::File::parse(bytes).map_err(|e| format!("it is no shared library: {e}"))?;
    let unreadable = |e| format!("its symbols cannot be read: {e}");
    let mut exported = HashSet::new();
    for export in file.exports().map_err(unreadable)? {
        if let NameOrOrdinal::Name(name) = export.map_err(unreadable)?.name() {
            let name = String::from_utf8_lossy(name).into_owned();
            // macOS puts an underscore before names in C.
            exported.insert(name.strip_prefix('_').map_or(name.clone(), str::to_owned));
        }
    }
    let needed = match d.version {
        FmiVersion::V2 => fmi2::pointer::NAMES,
        FmiVersion::V3 => fmi3::pointer::NAMES,
    };
    Ok(needed.iter().copied().filter(|n| demanded(d, n) && !exported.contains(*n)).collect())
}

/// FMI 3.0 demands all functions always; FMI 2.0 those of the interface types that are there.
fn demanded(d: &Description, name: &str) -> bool {
    const MODEL_EXCHANGE: &[&str] = &[
        "fmi2EnterEventMode",
        "fmi2NewDiscreteStates",
        "fmi2EnterContinuousTimeMode",
        "fmi2CompletedIntegratorStep",
        "fmi2SetTime",
        "fmi2SetContinuousStates",
        "fmi2GetDerivatives",
        "fmi2GetEventIndicators",
        "fmi2GetContinuousStates",
        "fmi2GetNominalsOfContinuousStates",
    ];
    const CO_SIMULATION: &[&str] = &[
        "fmi2SetRealInputDerivatives",
        "fmi2GetRealOutputDerivatives",
        "fmi2DoStep",
        "fmi2CancelStep",
        "fmi2GetStatus",
        "fmi2GetRealStatus",
        "fmi2GetIntegerStatus",
        "fmi2GetBooleanStatus",
        "fmi2GetStringStatus",
    ];
    !(MODEL_EXCHANGE.contains(&name) && d.model_exchange.is_none()
        || CO_SIMULATION.contains(&name) && d.co_simulation.is_none())
}
