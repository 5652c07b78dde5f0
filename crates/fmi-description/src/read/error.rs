//! Why a description cannot be read.

/// A description that cannot be read, with the place (counted from 1).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("modelDescription.xml, line {line}, column {column}: {message}")]
pub struct ReadError {
    /// Line.
    pub line: u32,
    /// Column.
    pub column: u32,
    /// What is wrong.
    pub message: String,
}
