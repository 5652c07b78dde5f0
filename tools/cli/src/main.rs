//! The program `trueup`.
// Printing is what a program does; the libraries do not.
#![allow(clippy::print_stderr)]

mod args;
mod assets;
mod case;
mod catalog;
mod command;
mod error;
mod output;
mod plot;
mod progress;

use std::process::ExitCode;

use clap::Parser;

fn main() -> ExitCode {
    match command::run(args::Args::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            if let Some(message) = e.message() {
                eprintln!("trueup: {message}");
            }
            e.exit_code()
        }
    }
}
