//! Why a sweep cannot be run or merged.

use std::path::{Path, PathBuf};

use trueup_cosim::InputMistake;

/// Any failure of this crate. A run that fails is none: it is a row with its reason.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// What is wrong in the sweep's file, all of it.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Mistakes(Vec<InputMistake>),
    /// The system without any factor cannot be run.
    #[error(transparent)]
    System(#[from] trueup_cosim::CosimError),
    /// A file cannot be read, written or used.
    #[error("{}: {why}", .file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// What is wrong, and the remedy.
        why: String,
    },
    /// There is no run of that number.
    #[error("there is no run {run}: the sweep has runs 1 to {runs}")]
    NoRun {
        /// What was requested.
        run: u64,
        /// How many there are.
        runs: u64,
    },
}

impl SweepError {
    pub(crate) fn at(file: &Path, why: impl ToString) -> Self {
        Self::File { file: file.into(), why: why.to_string() }
    }
}
