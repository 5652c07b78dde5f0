//! The program `trueup`.
// Printing is what a program does; the libraries do not.
#![allow(clippy::print_stderr)]

mod args;
mod assets;
mod case;
mod catalog;
mod command;
mod error;
mod isolate;
mod output;
mod plot;
mod progress;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    let command = args::Args::parse().command;
    if matches!(command, args::Command::FmuHost) {
        return isolate::serve();
    }
    progress::keep_hangup_ignored();
    let _watch = trueup_fmi_import::exit::watch(|message| eprintln!("trueup: {message}"));
    match command::run(command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            if let Some(message) = e.message() {
                eprintln!("trueup: {message}");
            }
            e.exit_code()
        }
    }
}
