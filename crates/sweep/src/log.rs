//! A log of runs: a line per run, only ever added to. Each line begins with the CRC-32 of the rest, so that what a killed
//! process, or a disk, left of a line is never read as a result.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::error::SweepError;

/// What a run gave.
#[derive(Clone, Debug, PartialEq)]
pub struct RunRecord {
    /// Its number, from 1.
    pub run: u64,
    /// A number for each output, `None` where there is none; or why the run failed.
    pub result: Result<Vec<Option<f64>>, String>,
}

/// A line that is not what was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogDamage {
    /// The log.
    pub file: PathBuf,
    /// From 1.
    pub line: u64,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum LogLine {
    Head { sweep: String },
    Done { run: u64, values: Vec<Option<f64>> },
    Failed { run: u64, reason: String },
}

/// A log that is written.
pub struct SweepLog {
    path: PathBuf,
    file: File,
    /// The file does not end with a whole line.
    torn: bool,
}

/// How often, and how long, a lock is awaited: what a killed process began may hold its files for a moment longer.
const ATTEMPTS: (u32, Duration) = (20, Duration::from_millis(50));

/// Takes the lock of a log; whether another process keeps it.
fn is_locked(file: &File) -> bool {
    (0..ATTEMPTS.0).all(|attempt| {
        if attempt > 0 {
            std::thread::sleep(ATTEMPTS.1);
        }
        matches!(file.try_lock(), Err(TryLockError::WouldBlock))
    })
}

impl SweepLog {
    /// Opens a log, makes it if there is none, and keeps others from writing it. `print` is the sweep's
    /// [fingerprint](crate::fingerprint).
    ///
    /// # Errors
    /// [`SweepError::File`]: another process writes it, it is of another sweep, it cannot be written.
    pub fn open(path: &Path, print: &str) -> Result<Self, SweepError> {
        let fail = |e: std::io::Error| SweepError::at(path, e);
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path).map_err(fail)?;
        // Where there are no locks no process is kept away.
        if is_locked(&file) {
            return Err(SweepError::at(
                path,
                "another process runs this share; wait for it, or end it first",
            ));
        }
        let known = read(path, print)?.known;
        let mut last = [b'\n'];
        match file.seek(SeekFrom::End(-1)) {
            Ok(_) => file.read_exact(&mut last).map_err(fail)?,
            Err(e) if e.kind() == ErrorKind::InvalidInput => {} // empty
            Err(e) => return Err(fail(e)),
        }
        let mut log = Self { path: path.into(), file, torn: last != [b'\n'] };
        if !known {
            log.line(&LogLine::Head { sweep: print.into() })?;
        }
        Ok(log)
    }

    /// Adds a run. It is there once this returns, whatever becomes of the process.
    ///
    /// # Errors
    /// [`SweepError::File`]
    pub fn add(&mut self, record: &RunRecord) -> Result<(), SweepError> {
        let run = record.run;
        self.line(&match &record.result {
            Ok(values) => LogLine::Done { run, values: values.clone() },
            Err(reason) => LogLine::Failed { run, reason: reason.clone() },
        })
    }

    /// Waits until all of it is on the disk: it survives a loss of power, too.
    ///
    /// # Errors
    /// [`SweepError::File`]
    pub fn sync(&self) -> Result<(), SweepError> {
        self.file.sync_data().map_err(|e| SweepError::at(&self.path, e))
    }

    fn line(&mut self, line: &LogLine) -> Result<(), SweepError> {
        let body = serde_json::to_string(line).map_err(|e| SweepError::at(&self.path, e))?;
        // What was torn stays, as a line of its own.
        let first = if self.torn { "\n" } else { "" };
        let text = format!("{first}{:08x} {body}\n", crc32fast::hash(body.as_bytes()));
        // One call: other writers of the file system see all of it or nothing.
        self.torn = true;
        self.file.write_all(text.as_bytes()).map_err(|e| SweepError::at(&self.path, e))?;
        self.torn = false;
        Ok(())
    }
}

impl Drop for SweepLog {
    /// Lets go of the lock, which a process that is being started next to this one would hold on to for a while.
    fn drop(&mut self) {
        // Closing the file is what is left to do.
        let _ = self.file.unlock();
    }
}

/// What a log holds.
#[derive(Debug, Default)]
pub struct LogContent {
    /// Whole records, in the order of the file.
    pub records: Vec<RunRecord>,
    /// Lines that are not what was written; their runs are run again.
    pub damage: Vec<LogDamage>,
    /// It names the sweep that it belongs to.
    pub known: bool,
}

/// Reads a log of the sweep with this [fingerprint](crate::fingerprint).
///
/// # Errors
/// [`SweepError::File`]: it belongs to another sweep, or cannot be read.
pub fn read(path: &Path, print: &str) -> Result<LogContent, SweepError> {
    let bytes = std::fs::read(path).map_err(|e| SweepError::at(path, e))?;
    let mut found = LogContent::default();
    let other = || {
        let name = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
        let why = "these runs are of another state of the sweep, of its system or its FMUs";
        SweepError::at(path, format!("{why}; move the folder {name} away to begin again, or undo the change"))
    };
    for (at, line) in bytes.split_inclusive(|b| *b == b'\n').enumerate() {
        match parse(line) {
            Some(LogLine::Head { sweep }) if sweep == print => found.known = true,
            Some(LogLine::Head { .. }) => return Err(other()),
            Some(LogLine::Done { run, values }) if found.known => {
                found.records.push(RunRecord { run, result: Ok(values) })
            }
            Some(LogLine::Failed { run, reason }) if found.known => {
                found.records.push(RunRecord { run, result: Err(reason) })
            }
            // A line that is not ended may be in the making by another process.
            None if !line.ends_with(b"\n") => {}
            _ => found.damage.push(LogDamage { file: path.into(), line: at as u64 + 1 }),
        }
    }
    Ok(found)
}

/// The content of a whole line; `None` if it is not what was written.
fn parse(line: &[u8]) -> Option<LogLine> {
    let text = std::str::from_utf8(line).ok()?;
    // A line that lacks nothing but its end is whole: another process may just be writing that.
    let text = text.strip_suffix('\n').unwrap_or(text);
    let (sum, body) = text.split_once(' ')?;
    // Compared as text: as a number, a digit of another case would go unnoticed.
    let right = sum == format!("{:08x}", crc32fast::hash(body.as_bytes()));
    right.then(|| serde_json::from_str(body).ok()).flatten()
}
