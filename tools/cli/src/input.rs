//! Text files that the command line, or one of its files, names.

use std::io::ErrorKind;
use std::path::Path;

use crate::error::CliError;

/// The text of a file; where it cannot be read, `mend` states what to name.
pub(crate) fn text(path: &Path, mend: &str) -> Result<String, CliError> {
    std::fs::read_to_string(path).map_err(|e| unread(path, &e, mend))
}

pub(crate) fn unread(path: &Path, e: &std::io::Error, mend: &str) -> CliError {
    CliError::at(path, format!("{}; {mend}", why(e)))
}

/// Why a file cannot be read.
pub(crate) fn why(e: &std::io::Error) -> String {
    match e.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => "there is no such file".into(),
        ErrorKind::IsADirectory => "it is a folder, not a file".into(),
        ErrorKind::InvalidData => "it is no text in UTF-8".into(),
        _ => format!("it cannot be read: {e}"),
    }
}
