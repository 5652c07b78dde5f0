//! modelDescription.xml of both FMI versions from a model's variable table.
//!
//! The output is deterministic: it is committed and compared. FMI 2.0 flattens the arrays, FMI 3.0 keeps
//! them; what both write alike is in `common`.

mod common;
mod error;
mod fmi2;
mod fmi3;
pub mod related;
mod structure;
pub mod terminals;
mod xml;

use std::collections::HashSet;

use sha2::{Digest, Sha256};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, ModelTable};
use trueup_fmi::units;

use crate::FmiVersion;
use common::start_demanded;
pub use error::WriteError;

/// modelDescription.xml with its token (FMI 2.0: GUID in braces; FMI 3.0: instantiation token).
///
/// The token is a fingerprint of the description, the configuration and this crate's version, in the form
/// of a UUID: two FMUs with the same token behave the same.
///
/// # Errors
/// [`WriteError`]: the table is not consistent.
pub fn with_token(
    table: &ModelTable,
    configuration: &Configuration,
    version: FmiVersion,
) -> Result<(String, String), WriteError> {
    let unsigned = model_description(table, version, "")?;
    let structure = Configuration { token: String::new(), ..configuration.clone() };
    let mut hash = Sha256::new();
    for part in [unsigned.as_str(), &structure.to_text(), env!("CARGO_PKG_VERSION")] {
        hash.update(part.as_bytes());
        hash.update([0]);
    }
    let hex: String = hash.finalize().iter().take(16).map(|b| format!("{b:02x}")).collect();
    let uuid = format!("{}-{}-{}-{}-{}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..]);
    let token = if version == FmiVersion::V2 { format!("{{{uuid}}}") } else { uuid };
    Ok((model_description(table, version, &token)?, token))
}

/// modelDescription.xml with this token.
///
/// # Errors
/// [`WriteError`]: the table is not consistent.
pub fn model_description(table: &ModelTable, version: FmiVersion, token: &str) -> Result<String, WriteError> {
    verify(table)?;
    match version {
        FmiVersion::V2 => fmi2::write(table, token),
        FmiVersion::V3 => fmi3::write(table, token),
    }
}

fn verify(table: &ModelTable) -> Result<(), WriteError> {
    let mut names = HashSet::new();
    for v in &table.variables {
        let variable = v.name.clone();
        if !names.insert(&v.name) {
            return Err(WriteError::Twice(variable));
        }
        if !v.unit.is_empty() && units::find(v.unit).is_none() {
            return Err(WriteError::Unit { variable, unit: v.unit.to_owned() });
        }
        if !v.start.is_empty() && v.start.len() != v.len() || v.start.is_empty() && start_demanded(v) {
            return Err(WriteError::Start { variable, given: v.start.len(), elements: v.len() });
        }
        let named = [(&v.derivative_of, "state of a rate"), (&v.follows, "parameter to follow")];
        for (other, role) in named {
            if let Some(other) = other
                && table.find(other).is_none()
            {
                return Err(WriteError::Name { variable, other: other.clone(), role });
            }
        }
        if let BoundaryType::Enumeration(index) = v.kind
            && index >= table.enumerations.len()
        {
            return Err(WriteError::Enumeration { variable, index, count: table.enumerations.len() });
        }
    }
    Ok(())
}
