//! Text files that the command line, or one of its files, names.

use std::path::Path;

use trueup_signals::unreadable;

use crate::error::CliError;

/// The text of a file; where it cannot be read, `mend` states what to name.
pub(crate) fn text(path: &Path, mend: &str) -> Result<String, CliError> {
    std::fs::read_to_string(path).map_err(|e| unread(path, &e, mend))
}

pub(crate) fn unread(path: &Path, e: &std::io::Error, mend: &str) -> CliError {
    CliError::at(path, format!("{}; {mend}", unreadable(e)))
}
