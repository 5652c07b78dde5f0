//! How the process of an FMU ends.

use std::os::unix::process::ExitStatusExt;
use std::process::ExitStatus;

/// Why there is no host any more.
#[derive(Clone, Debug)]
pub(crate) struct Fault {
    /// The function that it was in.
    pub(crate) function: &'static str,
    /// What happened, as a sentence without its subject.
    pub(crate) how: String,
}

/// How a process ended, as a sentence without its subject.
pub(crate) fn ended(status: ExitStatus) -> String {
    if let Some(code) = status.code() {
        return format!("called exit({code})");
    }
    let signal = status.signal().unwrap_or(0);
    let name = match signal {
        4 => "crashed: SIGILL (illegal instruction)",
        5 => "crashed: SIGTRAP (trap)",
        6 => {
            "crashed: SIGABRT (abort, a failed assertion, an exception that nobody caught, or its stack overflowed)"
        }
        7 => "crashed: SIGBUS (bad memory access)",
        8 => "crashed: SIGFPE (arithmetic, such as an integer divided by zero)",
        9 => "was killed: SIGKILL (by somebody, or for lack of memory)",
        11 => "crashed: SIGSEGV (bad memory access, or its stack overflowed)",
        15 => "was killed: SIGTERM",
        24 => "was stopped: SIGXCPU (limit of processor time)",
        _ => return format!("was ended by signal {signal}"),
    };
    name.to_owned()
}
