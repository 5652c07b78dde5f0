//! What is wrong in a robot's file, and where.

use std::path::Path;

/// A robot that cannot be had: file, line where one is known, error and remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct RobotReadError(pub String);

impl RobotReadError {
    pub(super) fn at(path: &Path, why: impl std::fmt::Display) -> Self {
        Self(format!("{}: {why}", path.display()))
    }
}

/// Error and remedy, and the byte of the file where it begins, where that is known.
pub(super) struct RobotFileError {
    pub(super) at: Option<usize>,
    pub(super) why: String,
}

impl RobotFileError {
    pub(super) fn at(byte: usize, why: String) -> Self {
        Self { at: Some(byte), why }
    }
}

impl From<String> for RobotFileError {
    fn from(why: String) -> Self {
        Self { at: None, why }
    }
}
