//! `trueup sweep`

use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct SweepCommand {
    #[command(subcommand)]
    pub(crate) after: Option<SweepFollowUp>,
    /// What is varied and what is kept (see docs/sweeps.md); logs go to the folder NAME.runs next to it
    #[arg(required = true, value_name = "SWEEP.toml")]
    pub(crate) file: Option<PathBuf>,
    /// Only every n-th run, from the i-th on; each share may be a process on another machine with the same folder
    #[arg(long, value_name = "I/N", value_parser = super::shard)]
    pub(crate) shard: Option<(usize, usize)>,
    /// Write a script for Slurm instead, NAME.slurm.sh next to the file: an array of N tasks, a share for each (as many as runs,
    /// but 1000 at most, where N is left out)
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, conflicts_with = "shard",
          value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) slurm: Option<Option<u32>>,
    /// Repeat one run with all that the system records, into --output, and leave the logs alone
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["shard", "slurm"])]
    pub(crate) run: Option<u64>,
    /// Results of --run [default: NAME-run-NUMBER.csv next to the file]
    #[arg(short, long, value_name = "FILE.csv|.parquet", requires = "run")]
    pub(crate) output: Option<PathBuf>,
    /// Give each FMU a process of its own: one that crashes, exits or hangs fails its run alone (Linux)
    #[arg(long)]
    pub(crate) isolate: bool,
    /// How long a single call of an FMU may take, s; else as long as it likes; gives each FMU a process of its own as --isolate
    #[arg(long, value_name = "S", value_parser = super::deadline)]
    pub(crate) deadline: Option<f64>,
}

#[derive(Debug, clap::Subcommand)]
pub(crate) enum SweepFollowUp {
    /// Write all runs as one table, in their order: the same bytes however they were shared out or interrupted
    Merge(Merge),
    /// Show what the runs came to as a page: tiles over the last two factors, the last one from left to right, coloured by the
    /// first output that is the last value of an enumeration; a tile that is clicked shows its time line
    Map(ReportMap),
}

#[derive(Debug, clap::Args)]
pub(crate) struct ReportMap {
    /// The file whose runs are done, a grid or a list
    #[arg(value_name = "SWEEP.toml")]
    pub(crate) file: PathBuf,
    /// What others say of the same runs: a column per factor, and columns of texts that are written into the tiles
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) beside: Option<PathBuf>,
    /// The page [default: NAME.html next to the file]
    #[arg(short, long, value_name = "FILE.html")]
    pub(crate) output: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct Merge {
    /// The file whose runs are done
    #[arg(value_name = "SWEEP.toml")]
    pub(crate) file: PathBuf,
    /// The table [default: NAME.parquet next to the file]
    #[arg(short, long, value_name = "FILE.parquet")]
    pub(crate) output: Option<PathBuf>,
}
