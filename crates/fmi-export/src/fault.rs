//! Outcome of a call.

/// Status of a call, as both FMI versions number it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(i32)]
pub enum CallStatus {
    /// Done.
    Ok = 0,
    /// Done with a reservation.
    Warning = 1,
    /// Not possible with these values; a solver may try others.
    Discard = 2,
    /// Refused or failed; nothing was taken, the instance stays usable.
    Error = 3,
    /// The instance is lost.
    Fatal = 4,
}

/// A call that was not carried out: status and a message with variable, value and remedy.
#[derive(Clone, Debug, PartialEq)]
pub struct CallFault {
    /// Discard, Error or Fatal.
    pub status: CallStatus,
    /// For the importer's log.
    pub message: String,
}

/// Done, or why not.
pub type CallOutcome<T = ()> = Result<T, CallFault>;

/// A refusal with status Error.
pub fn error<T>(message: impl Into<String>) -> CallOutcome<T> {
    Err(CallFault { status: CallStatus::Error, message: message.into() })
}

/// A refusal with status Discard.
pub fn discard<T>(message: impl Into<String>) -> CallOutcome<T> {
    Err(CallFault { status: CallStatus::Discard, message: message.into() })
}
