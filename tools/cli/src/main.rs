//! The program `trueup`.
// Their macros panic where the reader is gone: `output::say` and `voice::line` print.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod args;
mod assets;
mod case;
mod catalog;
mod command;
mod error;
mod help;
mod input;
mod isolate;
mod modelica;
mod moving;
mod output;
mod plot;
mod progress;
mod stages;
mod templates;
mod voice;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches};
use trueup_numerics::ShortNumber;

fn main() -> ExitCode {
    let matches = help::dressed(args::Args::command()).get_matches();
    let command = args::Args::from_arg_matches(&matches).unwrap_or_else(|e| e.exit()).command;
    if matches!(command, args::CliCommand::FmuHost) {
        return isolate::serve();
    }
    voice::keep();
    progress::keep_hangup_ignored();
    let _watch = trueup_fmi_import::exit::watch(|time, what| {
        let at = time.map_or_else(String::new, |t| format!("at t = {} s: ", ShortNumber(t)));
        voice::error(&format!("{at}{what}"));
        isolate::say(1);
    });
    let status = command::run(command).err().map_or(0, |e| {
        if let Some(message) = e.message() {
            voice::error(message);
        }
        e.status()
    });
    isolate::say(status);
    ExitCode::from(status)
}
