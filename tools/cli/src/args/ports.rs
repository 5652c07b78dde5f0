//! `trueup ports`

use std::path::PathBuf;

use trueup_cosim::system::ComponentInterface;

use super::deadline;

#[derive(Debug, clap::Args)]
pub(crate) struct PortsCommand {
    /// The FMU: FMI 2.0 or 3.0, of any tool. It is run, in a process of its own where there are any (Linux)
    pub(crate) fmu: PathBuf,
    /// Check this file instead of drafting one
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["output", "force", "print"])]
    pub(crate) ports: Option<PathBuf>,
    /// Interface of the experiments: me (Model Exchange) or cs (Co-Simulation); Model Exchange where it is offered and works
    #[arg(long, value_name = "me|cs")]
    pub(crate) interface: Option<ComponentInterface>,
    /// File for the draft; ports.toml next to the FMU when not given. With --json it is written only if it is given
    #[arg(short, long, value_name = "FILE.toml")]
    pub(crate) output: Option<PathBuf>,
    /// Overwrite the file if it is there
    #[arg(long)]
    pub(crate) force: bool,
    /// Print the draft instead of writing it
    #[arg(long, conflicts_with_all = ["output", "force", "json"])]
    pub(crate) print: bool,
    /// How long a single call of the FMU may take, s
    #[arg(long, value_name = "S", default_value = "10", value_parser = deadline)]
    pub(crate) deadline: f64,
    /// Print ports, checks and effects in machine-readable form
    #[arg(long)]
    pub(crate) json: bool,
}
