//! `trueup lab`

use std::path::PathBuf;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum LabCommand {
    /// Make a joint whose cause is sealed: first recordings, a case for `trueup diagnose`, and limits for experiments
    New(LabNew),
    /// Run a proposed experiment on it, and add its recording to the case
    Run(LabRun),
}

#[derive(Debug, clap::Args)]
pub(crate) struct LabNew {
    /// Folder for the rig; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "lab")]
    pub(crate) output: PathBuf,
    /// For development: the same seed gives the same rig [default: a secret one]
    #[arg(long, value_name = "S")]
    pub(crate) seed: Option<u64>,
    /// What the rig is about [default: drawn as in the benchmark]
    #[arg(long, value_name = "SPLIT", value_parser = ["none", "parameters", "single", "pairs", "outside", "unidentifiable"])]
    pub(crate) split: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct LabRun {
    /// `rig = "DIR"` and `input = "FILE.csv"`, both relative to this file; or the input itself: `time` in s, `motorCurrent` in A
    #[arg(value_name = "PROPOSAL.toml|.csv")]
    pub(crate) proposal: PathBuf,
    /// The rig [default: that of the proposal]
    #[arg(long, value_name = "DIR")]
    pub(crate) rig: Option<PathBuf>,
}
