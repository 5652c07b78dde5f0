//! An FMU in a process of its own: what it does to its process it does to that one alone.
//!
//! Instances of an FMU that is [isolated](crate::UnpackedFmu::isolate) are used as any others, and give the same bits. Each has a process,
//! which [`serve`]s it: this program again, started with arguments that lead there. Calls go through shared memory; a process that
//! crashes, ends or does not return in time is an [`Error::Ended`](crate::ImportError::Ended).
//!
//! It keeps a program alive, it keeps nothing secret: the FMU has the rights of the user who runs it.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

#[cfg(target_os = "linux")]
mod calls;
#[cfg(target_os = "linux")]
mod frame;
#[cfg(target_os = "linux")]
mod host;
#[cfg(target_os = "linux")]
mod link;
#[cfg(target_os = "linux")]
mod memory;
#[cfg(target_os = "linux")]
mod open;

#[cfg(not(target_os = "linux"))]
#[path = "isolation/elsewhere.rs"]
mod link;

#[cfg(target_os = "linux")]
pub(crate) use link::{HostFault, RemoteInstance, ended};
#[cfg(target_os = "linux")]
pub(crate) use open::{Fmi3Opening, three, two};

#[cfg(not(target_os = "linux"))]
pub(crate) use link::{HostFault, RemoteInstance, Three, three, two};

/// How FMUs get processes of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Isolation {
    pub(crate) program: PathBuf,
    pub(crate) arguments: Vec<OsString>,
    pub(crate) deadline: Option<Duration>,
}

/// Why FMUs cannot have processes of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "an FMU can have a process of its own on Linux only: run it within this one, or in a container with a time limit"
)]
pub struct NoIsolation;

impl Isolation {
    /// By this program, which [`serve`]s when it is started with these arguments. `deadline`: how long a single call may take;
    /// none: as long as it likes.
    ///
    /// # Errors
    /// Not on this platform.
    pub fn new(
        arguments: impl IntoIterator<Item = impl Into<OsString>>,
        deadline: Option<Duration>,
    ) -> Result<Self, NoIsolation> {
        if !cfg!(target_os = "linux") {
            return Err(NoIsolation);
        }
        // Also where the file has been replaced since.
        let program = PathBuf::from("/proc/self/exe");
        Ok(Self { program, arguments: arguments.into_iter().map(Into::into).collect(), deadline })
    }
}

/// What a program does that was started as the process of an FMU. It was given the memory to share as standard input.
///
/// # Errors
/// It was started by somebody else.
pub fn serve() -> Result<ExitCode, String> {
    #[cfg(target_os = "linux")]
    return host::serve();
    #[cfg(not(target_os = "linux"))]
    return Err(NoIsolation.to_string());
}
