//! FMUs in processes of their own: this program once more for each.

use std::process::ExitCode;
use std::time::Duration;

use trueup_fmi_import::{Isolation, NoIsolation, isolation};

/// Of the hidden command that serves.
const COMMAND: &str = "__fmu-host";

/// `deadline`: how long a single call may take, s.
pub(crate) fn isolation(deadline: Option<f64>) -> Result<Isolation, NoIsolation> {
    Isolation::new([COMMAND], deadline.map(Duration::from_secs_f64))
}

/// Is the process of an FMU.
pub(crate) fn serve() -> ExitCode {
    isolation::serve().unwrap_or_else(|why| {
        eprintln!("trueup: {COMMAND} is started by this program itself, with an FMU to serve: {why}");
        ExitCode::from(2)
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Args, Command};

    #[test]
    fn the_command_is_what_the_command_line_knows() {
        assert!(matches!(Args::parse_from(["trueup", COMMAND]).command, Command::FmuHost));
    }
}
