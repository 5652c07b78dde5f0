//! Reads a system, whatever it is written in.

use std::path::Path;

use crate::error::CosimError;
use crate::system::CosimSystem;

impl CosimSystem {
    /// Reads a system: TOML (`.toml`), SSP (`.ssp`, `.ssd`, or a folder that one was unpacked into), or a single FMU (a file or an unpacked folder), which is the component without
    /// a name.
    ///
    /// # Errors
    /// [`CosimError::System`] with every mistake and its line.
    pub fn read(file: &Path) -> Result<Self, CosimError> {
        match file.extension().and_then(|e| e.to_str()).map(str::to_lowercase).as_deref() {
            Some("toml") => crate::toml::read(file),
            Some("ssp" | "ssd") => crate::ssp::read(file),
            _ if file.join("SystemStructure.ssd").is_file() => crate::ssp::read(file),
            _ => Ok(Self::of_fmu(file)),
        }
    }
}
