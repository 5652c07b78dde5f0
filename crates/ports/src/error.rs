//! Failures.

use trueup_fmi_import::ImportError;

/// Why the ports of an FMU cannot be determined.
#[derive(Debug, thiserror::Error)]
pub enum PortsError {
    /// A call of the FMU failed.
    #[error("{file}: {error}")]
    Call {
        /// The FMU.
        file: String,
        /// What failed.
        error: Box<ImportError>,
    },
    /// The FMU cannot be used.
    #[error("{0}")]
    Fmu(String),
}
