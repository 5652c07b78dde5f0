//! Completions for shells and manual pages, from the definition of the command line.

use std::path::Path;

use clap::CommandFactory;

use crate::args::{Args, Completions, Man};
use crate::error::CliError;
use crate::{help, output};

pub(crate) fn completions(args: &Completions) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "trueup", &mut script);
    output::say(&String::from_utf8_lossy(&script))
}

pub(crate) fn man(args: &Man) -> Result<(), CliError> {
    output::folder(&args.output)?;
    let mut command = help::for_manual(Args::command().disable_help_subcommand(true));
    command.build();
    page(&command, &args.output)
}

/// The page of a command, and those of all below it: `trueup-fmu-pack.1`.
fn page(command: &clap::Command, folder: &Path) -> Result<(), CliError> {
    let name = command.get_display_name().unwrap_or(command.get_name());
    let path = folder.join(format!("{name}.1"));
    let mut text = Vec::new();
    clap_mangen::Man::new(command.clone()).render(&mut text).map_err(|e| CliError::at(&path, e))?;
    output::write(&path, &text)?;
    output::say(&format!("{}\n", path.display()))?;
    command.get_subcommands().filter(|c| !c.is_hide_set()).try_for_each(|c| page(c, folder))
}
