//! FMUs in processes of their own: this program once more for each.

use std::process::ExitCode;
#[cfg(target_os = "linux")]
use std::sync::Arc;
#[cfg(target_os = "linux")]
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
#[cfg(target_os = "linux")]
use std::time::Instant;

use trueup_cosim::plan::PlannedComponent;
use trueup_cosim::system::ComponentInterface as SystemInterface;
#[cfg(target_os = "linux")]
use trueup_fmi_import::keeper::{self, KeeperEnd, KeeperSide};
use trueup_fmi_import::{Isolation, NoIsolation, UsedInterface, isolation};

use crate::error::CliError;
use crate::voice;

/// Signals that come closer to the first one are the same wish: a terminal sends Ctrl-C to all processes of the program, and
/// the one that waits hands it on.
pub(crate) const ONCE: Duration = Duration::from_millis(300);

/// Of the hidden command that serves.
const COMMAND: &str = "__fmu-host";

/// `deadline`: how long a single call may take, s.
pub(crate) fn isolation(deadline: Option<f64>) -> Result<Isolation, NoIsolation> {
    Isolation::new([COMMAND], deadline.map(Duration::from_secs_f64))
}

/// Gives each of these FMUs a process of its own if that is requested. Else those that are not ours have this process for
/// themselves, and another one waits for it: an FMU that ends its process ends no program that would say nothing of it.
///
/// # Errors
/// Not on this platform; in the process that waits: all is done and reported.
pub(crate) fn components(
    of: &[PlannedComponent],
    isolate: bool,
    deadline: Option<f64>,
) -> Result<(), CliError> {
    if isolate || deadline.is_some() {
        let isolation = isolation(deadline).map_err(|e| CliError::Failed(format!("--isolate: {e}")))?;
        of.iter().for_each(|component| component.fmu.isolate(&isolation));
        #[cfg(target_os = "linux")]
        let _ = keeper::adopt(); // else what an FMU that crashed has started lives on
        return Ok(());
    }
    let strange = of.iter().filter(|component| {
        !component.fmu.is_ours(match component.interface {
            SystemInterface::CoSimulation => UsedInterface::CoSimulation,
            SystemInterface::ModelExchange => UsedInterface::ModelExchange,
        })
    });
    let mut files: Vec<String> = strange.map(|c| c.fmu.file().display().to_string()).collect();
    files.dedup();
    if files.is_empty() { Ok(()) } else { keep(&files.join(", ")) }
}

/// The rest of the program in a process that another one waits for; `files` are the FMUs that will run there.
///
/// # Errors
/// In the one that waits: what the other one reported, or that it ended without a message.
#[cfg(target_os = "linux")]
pub(crate) fn keep(files: &str) -> Result<(), CliError> {
    use nix::sys::signal::{Signal, kill};
    if keeper::is_worker() {
        return Ok(());
    }
    let Ok(KeeperSide::Keeper(keeper)) = keeper::divide() else {
        return Ok(()); // the worker; or there is no other process to be had, and the work is done all the same
    };
    let worker = nix::unistd::Pid::from_raw(keeper.worker());
    let interrupted = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&interrupted);
    let mut first = None;
    let _ = ctrlc::set_handler(move || {
        asked.store(true, Ordering::Relaxed);
        _ = kill(worker, Signal::SIGTERM);
        // The second one ends it, also where an FMU has it ignore signals, or has stopped it.
        if first.get_or_insert_with(Instant::now).elapsed() >= ONCE {
            std::thread::sleep(ONCE);
            _ = kill(worker, Signal::SIGKILL);
        }
    });
    match keeper.wait() {
        KeeperEnd::Said(status) => Err(CliError::Elsewhere(status)),
        KeeperEnd::Silent(_) if interrupted.load(Ordering::Relaxed) => {
            Err(CliError::Failed("interrupted; nothing of this run is kept".into()))
        }
        KeeperEnd::Silent(how) => Err(CliError::Failed(format!(
            "{files}: the process in which the FMU ran {how} before the run had ended, and nothing of this run is kept; with \
             --isolate it has a process of its own: then its last call is named, and what was computed before is kept"
        ))),
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn keep(_: &str) -> Result<(), CliError> {
    Ok(())
}

/// This process is about to end with this exit status: to the one that waits for it, if there is one. What FMUs have started
/// ends before.
pub(crate) fn say(status: u8) {
    #[cfg(target_os = "linux")]
    {
        keeper::end_children();
        keeper::say(status);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = status;
}

/// Is the process of an FMU.
pub(crate) fn serve() -> ExitCode {
    isolation::serve().unwrap_or_else(|why| {
        voice::line(&format!(
            "trueup: {COMMAND} is started by this program itself, with an FMU to serve: {why}"
        ));
        ExitCode::from(2)
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Args, CliCommand};

    #[test]
    fn the_command_is_what_the_command_line_knows() {
        assert!(matches!(Args::parse_from(["trueup", COMMAND]).command, CliCommand::FmuHost));
    }
}
