//! `trueup trial`

use std::path::PathBuf;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum Trial {
    /// Generate cases and their sealed keys; those that are there stay
    Generate(TrialGenerate),
    /// Diagnose the cases that have no result yet, then open their keys and write one table of all: table.csv
    Run(TrialRun),
    /// Open the keys and write the scorecard
    Score(TrialScore),
    /// Compare the same cases by two programs, paired: which cases differ, McNemar's exact test, processor time
    Compare(TrialCompare),
    /// Let cases into a corpus: all that are wrong, and right ones up to a number, spread over effects, drives and strengths
    Corpus(TrialCorpus),
}

#[derive(Debug, clap::Args)]
pub(crate) struct TrialGenerate {
    /// Folder for cases, keys and seals; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// joint, manipulator or held-arm
    #[arg(long, value_name = "PLANT", value_parser = ["joint", "manipulator", "held-arm"], required_unless_present = "corpus")]
    pub(crate) plant: Option<String>,
    /// What the cases are about
    #[arg(long, value_name = "SPLIT", value_parser = ["none", "parameters", "single", "pairs", "outside", "unidentifiable", "rig"], required_unless_present = "corpus")]
    pub(crate) split: Option<String>,
    /// How many, in all shards together
    #[arg(long, value_name = "N", default_value_t = 10)]
    pub(crate) count: usize,
    /// The same seed gives the same cases
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Instead: the cases of a corpus that `trial corpus` wrote
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["plant", "split", "count", "seed"])]
    pub(crate) corpus: Option<PathBuf>,
    /// Folder that keeps cases for the next time, by generator, plant, split, seed and number
    #[arg(long, value_name = "DIR", env = "TRUEUP_TRIAL_CACHE")]
    pub(crate) cache: Option<PathBuf>,
    /// Also write noise-free inputs, angles and rates of a held arm, a folder per case
    #[arg(long, value_name = "DIR", conflicts_with = "corpus")]
    pub(crate) truth: Option<PathBuf>,
    /// Only every n-th case, from the i-th on
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = super::shard)]
    pub(crate) shard: (usize, usize),
}

#[derive(Debug, clap::Args)]
pub(crate) struct TrialRun {
    /// Folder that `trial generate` made
    pub(crate) directory: PathBuf,
    /// Folder for results, inside that one for `trial compare` to find the keys [default: DIRECTORY/results]
    #[arg(long, value_name = "DIR")]
    pub(crate) results: Option<PathBuf>,
    /// Another build of this program that diagnoses in its place
    #[arg(long, value_name = "FILE")]
    pub(crate) program: Option<PathBuf>,
    /// Verdicts, claims and gaps alone: no pages, no FMUs, no next experiments
    #[arg(long)]
    pub(crate) verdict_only: bool,
    /// The recordings for fitting are healthy: also report when and where the held-out ones deviate from the model
    #[arg(long)]
    pub(crate) watch: bool,
    /// Processor time after which a case is stopped and counts as a miss, s
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, allow_negative_numbers = true, value_parser = super::seconds)]
    pub(crate) limit: f64,
    /// Only every n-th case, from the i-th on
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = super::shard)]
    pub(crate) shard: (usize, usize),
}

#[derive(Debug, clap::Args)]
pub(crate) struct TrialScore {
    /// Folder that `trial generate` made and `trial run` has run, or a folder of results in it
    pub(crate) directory: PathBuf,
    /// The scorecard, Markdown
    #[arg(short, long, value_name = "FILE.md")]
    pub(crate) output: PathBuf,
    /// What the diagnosis was built from, which the scorecard reports
    #[arg(long, value_name = "HASH")]
    pub(crate) commit: Option<String>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct TrialCompare {
    /// Folder that `trial run` has run, or a folder of results in it
    pub(crate) a: PathBuf,
    /// Another one with the same cases
    pub(crate) b: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(crate) struct TrialCorpus {
    /// The corpus; made if it is not there
    #[arg(value_name = "FILE.csv")]
    pub(crate) file: PathBuf,
    /// Folders that `trial run` has run
    #[arg(long, value_name = "DIR", required = true, num_args = 1..)]
    pub(crate) from: Vec<PathBuf>,
    /// Right cases of each plant up to which it is filled
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub(crate) right: usize,
    /// Of one plant alone
    #[arg(long, value_name = "PLANT", value_parser = ["joint", "manipulator", "held-arm"])]
    pub(crate) plant: Option<String>,
    /// What the diagnosis was built from
    #[arg(long, value_name = "HASH", default_value = "")]
    pub(crate) commit: String,
}
