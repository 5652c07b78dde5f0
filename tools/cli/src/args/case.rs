//! What makes a case and looks at it.

use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Init {
    /// Logs (CSV, Parquet, MAT, MCAP), or folders of them (a LeRobot data set, a rosbag2 with MCAP); the case.toml goes next to them
    #[arg(required = true, value_name = "LOG")]
    pub(crate) logs: Vec<PathBuf>,
    /// The model that the logs are compared with; guessed from the number of drives when not given
    #[arg(long, value_name = "NAME")]
    pub(crate) model: Option<String>,
    /// The column that is the clock, where it is not recognised
    #[arg(long, value_name = "COLUMN")]
    pub(crate) time: Option<String>,
    /// Rows a second, instead of a clock
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = super::above_zero)]
    pub(crate) rate: Option<f64>,
    /// Print the case instead of writing it
    #[arg(long)]
    pub(crate) print: bool,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Check {
    /// A folder of recordings with a case.toml, or that file
    pub(crate) case: PathBuf,
    /// Print everything in machine-readable form
    #[arg(long)]
    pub(crate) json: bool,
    /// Write a page with the recordings as plots
    #[arg(long, value_name = "FILE.html")]
    pub(crate) plot: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Schema {
    /// The file that it describes
    pub(crate) of: SchemaOf,
}

/// Files that have a schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum SchemaOf {
    /// case.toml
    Case,
    /// What is next to a recording
    Sidecar,
    /// A system of FMUs
    System,
    /// A sweep
    Sweep,
    /// A robot
    Robot,
    /// ports.toml
    Ports,
}
