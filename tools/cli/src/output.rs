//! Standard output and the folder for results.

use std::io::{ErrorKind, Write};
use std::path::Path;

use trueup_fmi_description::whole;

use crate::error::CliError;

/// Writes a text to standard output. A reader that has seen enough (`trueup fmu list | head`) is no error.
pub(crate) fn say(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(CliError::Failed(format!("standard output: {e}"))),
        _ => Ok(()),
    }
}

/// Makes the folder that `--output` names, if it is not there.
pub(crate) fn folder(path: &Path) -> Result<(), CliError> {
    folder_of("--output", path)
}

/// The same of another option.
pub(crate) fn folder_of(option: &str, path: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(path).map_err(|e| {
        let why = if path.exists() { "it is a file".to_owned() } else { e.to_string() };
        CliError::Failed(format!(
            "the folder {} cannot be made: {why}; name another one with {option}",
            path.display()
        ))
    })
}

/// What a small file takes on a disk: none left is found out before the work.
static PROBE: [u8; 1 << 16] = [0; 1 << 16];

/// Whether [`folder`] will be able to make it and files can be written there, without leaving an empty one behind for work
/// that may be interrupted.
pub(crate) fn can_be_made(path: &Path) -> Result<(), CliError> {
    let there = path.exists();
    folder(path)?;
    let probe = tempfile::Builder::new().prefix(".trueup-").tempfile_in(path);
    let probe = probe.and_then(|mut file| file.write_all(&PROBE).and_then(|()| file.flush()));
    if !there {
        // Only an empty one is removed; its parents may stay.
        let _ = std::fs::remove_dir(path);
    }
    probe.map_err(|e| {
        CliError::at(
            path,
            format!("nothing can be written there: {}; name another folder with --output", cause(&e)),
        )
    })
}

/// The system's message without the path, which is named already.
fn cause(e: &std::io::Error) -> String {
    e.raw_os_error().map_or_else(|| e.to_string(), |code| std::io::Error::from_raw_os_error(code).to_string())
}

/// Writes a file under another name first, so that it is there whole or not at all.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    whole::write(path, bytes).map_err(|e| unwritten(path, &e))
}

/// Whether [`write`] will be able to write it: found out before the work.
pub(crate) fn can_be_written(path: &Path) -> Result<(), CliError> {
    whole::part(path).map(drop).map_err(|e| unwritten(path, &e))
}

fn unwritten(path: &Path, e: &std::io::Error) -> CliError {
    CliError::at(path, format!("it cannot be written: {e}"))
}
