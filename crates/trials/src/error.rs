//! What can go wrong.

use std::path::{Path, PathBuf};

/// Why a trial could not be made, run or scored.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A file that cannot be read or written.
    #[error("{}: {why}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// A key that is not the one that was sealed.
    #[error("{}: this key is not the one that was sealed with the case; generate the case again", path.display())]
    Broken {
        /// The key.
        path: PathBuf,
    },
    /// A plant that has no cases of a split.
    #[error("plant {plant} has no cases of split {split}; choose another split")]
    Absent {
        /// The plant.
        plant: &'static str,
        /// The split.
        split: &'static str,
    },
    /// A plant whose noise-free runs are not kept.
    #[error("plant {plant} gives no noise-free recordings; leave --truth out, or choose the plant held-arm")]
    Silent {
        /// The plant.
        plant: &'static str,
    },
    /// No draw gave a case in which the effect shows.
    #[error("case {index} of split {split}, seed {seed}: no draw shows its effect; try another seed")]
    Useless {
        /// The split.
        split: &'static str,
        /// The seed.
        seed: u64,
        /// The number of the case.
        index: usize,
    },
}

impl TrialError {
    pub(crate) fn at(path: &Path, why: impl std::fmt::Display) -> Self {
        Self::File { path: path.to_owned(), why: why.to_string() }
    }
}
