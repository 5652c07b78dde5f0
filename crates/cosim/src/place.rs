//! Where in a file something was written.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where something was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceSpan {
    /// The file (an archive's entry as `system.ssp/SystemStructure.ssd`).
    pub file: PathBuf,
    /// Line, from 1; 0: built in code.
    pub line: u32,
}

impl SourceSpan {
    /// The line of the byte `at` of a file's `text`; of its last line where that is beyond it.
    pub fn of(file: &Path, text: &str, at: usize) -> Self {
        let before = &text.as_bytes()[..at.min(text.len())];
        Self { file: file.into(), line: 1 + before.iter().filter(|b| **b == b'\n').count() as u32 }
    }
}

impl fmt::Display for SourceSpan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.file.display()),
            line => write!(f, "{}:{line}", self.file.display()),
        }
    }
}
