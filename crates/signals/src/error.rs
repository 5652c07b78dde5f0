//! Why a file could not be read or written.

use std::path::PathBuf;

use crate::finding::Finding;

/// Any failure of this crate.
#[derive(Debug, thiserror::Error)]
pub enum SignalsError {
    /// What is wrong in files; at least one of them is an error. One line each.
    #[error("{}", .0.iter().filter(|f| f.is_error()).map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Wrong(Vec<Finding>),
    /// A file that cannot be written.
    #[error("{file}: {source}; nothing was left under that name")]
    Write {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

impl SignalsError {
    /// What was found, errors and the rest; empty if a file could not be written.
    pub fn findings(&self) -> &[Finding] {
        match self {
            Self::Wrong(findings) => findings,
            Self::Write { .. } => &[],
        }
    }
}

/// Either nothing is an error, or all is reported.
pub(crate) fn verdict<T>(value: T, findings: Vec<Finding>) -> Result<(T, Vec<Finding>), SignalsError> {
    if findings.iter().any(Finding::is_error) {
        Err(SignalsError::Wrong(findings))
    } else {
        Ok((value, findings))
    }
}
