//! Why something cannot be scaled.

use std::path::{Path, PathBuf};

use trueup_cosim::InputMistake;

/// Any failure of this crate.
#[derive(Debug, thiserror::Error)]
pub enum ScalingError {
    /// What is wrong in a file, all of it, with lines.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Mistakes(Vec<InputMistake>),
    /// A system that cannot be read or does not fit its FMUs.
    #[error(transparent)]
    System(#[from] trueup_cosim::CosimError),
    /// A file cannot be read or used.
    #[error("{}: {why}", .file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// What is wrong, and the remedy.
        why: String,
    },
}

impl ScalingError {
    pub(crate) fn at(file: &Path, why: impl ToString) -> Self {
        Self::File { file: file.into(), why: why.to_string() }
    }
}
