//! What can go wrong with somebody's FMU.

use std::ffi::c_int;
use std::fmt;
use std::path::PathBuf;

use trueup_fmi_description::archive::ArchiveError;

/// What an FMI function returned; FMI 2.0 and 3.0 number it alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FmiStatus {
    /// All well.
    Ok,
    /// Not all well, the run may go on.
    Warning,
    /// Refused; the instance is as before.
    Discard,
    /// The instance cannot go on: reset it, restore a state or drop it.
    Error,
    /// All instances of this FMU are lost.
    Fatal,
    /// FMI 2.0: the step is still being computed.
    Pending,
    /// A number that the standard does not know.
    Unknown(c_int),
}

impl From<c_int> for FmiStatus {
    fn from(status: c_int) -> Self {
        match status {
            0 => Self::Ok,
            1 => Self::Warning,
            2 => Self::Discard,
            3 => Self::Error,
            4 => Self::Fatal,
            5 => Self::Pending,
            other => Self::Unknown(other),
        }
    }
}

impl fmt::Display for FmiStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ok => f.write_str("OK"),
            Self::Warning => f.write_str("Warning"),
            Self::Discard => f.write_str("Discard"),
            Self::Error => f.write_str("Error"),
            Self::Fatal => f.write_str("Fatal"),
            Self::Pending => f.write_str("Pending"),
            Self::Unknown(number) => write!(f, "unknown status {number}"),
        }
    }
}

/// A call that the FMU did not carry out.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{function} of instance \"{instance}\" returned {status}{}", tail(.log))]
pub struct FmiError {
    /// The C function.
    pub function: &'static str,
    /// What it returned.
    pub status: FmiStatus,
    /// Name of the instance.
    pub instance: String,
    /// The FMU's last messages.
    pub log: Vec<String>,
}

/// Any failure of this crate.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    /// The FMU did not carry out a call.
    #[error(transparent)]
    Call(#[from] FmiError),
    /// The FMU gave no instance.
    #[error("{function} of \"{instance}\" gave no instance{}", tail(.log))]
    Instantiate {
        /// The C function.
        function: &'static str,
        /// Name of the instance.
        instance: String,
        /// The FMU's last messages.
        log: Vec<String>,
    },
    /// The FMU's library lacks the function.
    #[error(
        "{function} is not supported by the FMU of instance \"{instance}\": its library does not export it"
    )]
    NotSupported {
        /// The C function.
        function: &'static str,
        /// Name of the instance.
        instance: String,
    },
    /// The FMU lacks an interface.
    #[error("{file} does not offer {interface}")]
    Interface {
        /// The FMU.
        file: PathBuf,
        /// What was requested.
        interface: String,
    },
    /// The process of an [isolated](crate::isolation) FMU is gone.
    #[error("{function} of instance \"{instance}\" ({file}): the FMU {how}{}", tail(.log))]
    Ended {
        /// The C function.
        function: &'static str,
        /// Name of the instance.
        instance: String,
        /// The FMU.
        file: PathBuf,
        /// What it did, as a sentence without its subject.
        how: String,
        /// The FMU's last messages.
        log: Vec<String>,
    },
    /// An earlier call returned Fatal, or was the last one of its process: nothing more may be called.
    #[error(
        "{function}: instance \"{instance}\" is lost since an earlier call returned Fatal or ended it; load the FMU again"
    )]
    Lost {
        /// The C function.
        function: &'static str,
        /// Name of the instance.
        instance: String,
    },
    /// A slice of the wrong length.
    #[error("{function} of instance \"{instance}\": {what} has {got} elements, {expected} are needed")]
    Length {
        /// The C function.
        function: &'static str,
        /// Name of the instance.
        instance: String,
        /// Which slice.
        what: &'static str,
        /// Elements needed.
        expected: usize,
        /// Elements given.
        got: usize,
    },
    /// A block that was prepared for other sizes of arrays.
    #[error("{function} of instance \"{instance}\": sizes of arrays have changed; prepare the block again")]
    Stale {
        /// The C function.
        function: &'static str,
        /// Name of the instance.
        instance: String,
    },
    /// A stored state that is not of this instance or already freed.
    #[error("instance \"{instance}\" has no such stored state: it was freed, or it is of another instance")]
    NoSuchState {
        /// Name of the instance.
        instance: String,
    },
    /// A text with a null character.
    #[error("{what} {text:?} contains a null character, which C cannot carry; remove it")]
    Text {
        /// Which text.
        what: &'static str,
        /// The text.
        text: String,
    },
    /// An event iteration without end.
    #[error(
        "event iteration of instance \"{instance}\" does not end: it requested another pass {passes} times{}",
        tail(.log)
    )]
    EventIteration {
        /// Name of the instance.
        instance: String,
        /// Passes made.
        passes: usize,
        /// The FMU's last messages.
        log: Vec<String>,
    },
    /// The importer's own callback panicked inside a step.
    #[error("the intermediate-update closure of instance \"{instance}\" panicked: {message}")]
    Panicked {
        /// Name of the instance.
        instance: String,
        /// The panic's message.
        message: String,
    },
    /// The file cannot be unpacked.
    #[error(transparent)]
    Archive(#[from] ArchiveError),
    /// The file is no FMU that can be used here.
    #[error("{file}: {reason}")]
    File {
        /// The FMU.
        file: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
}

impl ImportError {
    /// The status behind it, if an FMI function returned one.
    pub fn status(&self) -> Option<FmiStatus> {
        match self {
            Self::Call(error) => Some(error.status),
            _ => None,
        }
    }
}

pub(crate) fn tail(log: &[String]) -> String {
    if log.is_empty() { String::new() } else { format!("; its last messages:\n  {}", log.join("\n  ")) }
}
