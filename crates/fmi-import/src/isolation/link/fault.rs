//! How the process of an FMU ends.

use std::os::unix::process::ExitStatusExt;
use std::process::{Child, ExitStatus};

use rustix::process::{Pid, Signal, kill_process, kill_process_group};

use crate::children::children;

/// Why there is no host any more.
#[derive(Clone, Debug)]
pub(crate) struct HostFault {
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
        6 => "crashed: SIGABRT (abort, a failed assertion, an uncaught exception, or its stack overflowed)",
        7 => "crashed: SIGBUS (bad memory access)",
        8 => "crashed: SIGFPE (arithmetic, such as an integer divided by zero)",
        9 => "was killed: SIGKILL (from outside, or for lack of memory)",
        11 => "crashed: SIGSEGV (bad memory access, or its stack overflowed)",
        15 => "was killed: SIGTERM",
        24 => "was stopped: SIGXCPU (limit of processor time)",
        _ => return format!("was ended by signal {signal}"),
    };
    name.to_owned()
}

/// Ends a host with all processes that its FMU has made, in whatever session: as long as it lives they are below it.
pub(super) fn end(host: &mut Child) {
    if let Some(id) = i32::try_from(host.id()).ok().and_then(Pid::from_raw) {
        let mut all = vec![id];
        let mut at = 0;
        while let (Ok(None), Some(process)) = (host.try_wait(), all.get(at)) {
            all.extend(children(*process));
            at += 1;
        }
        all.iter().skip(1).for_each(|below| _ = kill_process(*below, Signal::KILL));
        let _ = kill_process_group(id, Signal::KILL);
    }
    let _ = host.kill();
    let _ = host.wait();
}
