//! What belongs to the shell: completions and manual pages.

use std::path::PathBuf;

use clap_complete::Shell;

#[derive(Debug, clap::Args)]
pub(crate) struct Completions {
    /// The shell
    pub(crate) shell: Shell,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Man {
    /// Folder for the pages; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "man")]
    pub(crate) output: PathBuf,
}
