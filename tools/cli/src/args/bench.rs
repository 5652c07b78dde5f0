//! `trueup bench`

use std::path::PathBuf;

#[derive(Debug, clap::Subcommand)]
pub(crate) enum BenchCommand {
    /// Make cases with sealed keys, and the public folder without keys and without most readings of the hold-out recordings
    Make(BenchMake),
    /// Diagnose the public cases that have no result yet, and write the entry when all have one
    Run(BenchRun),
    /// Check an entry and write a receipt with its hash, before the keys are out
    Submit(BenchSubmit),
    /// Open the keys and write a page with the scores of entries, and their scores case by case next to it
    Score(BenchScore),
}

#[derive(Debug, clap::Args)]
pub(crate) struct BenchMake {
    /// Folder for `public` and `sealed`; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
    /// Kinds of machines
    #[arg(long, value_name = "TIER", value_delimiter = ',', default_value = "joint", value_parser = ["joint", "arm"])]
    pub(crate) tier: Vec<String>,
    /// Cases of each tier
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) count: u32,
    /// For development: the same seed gives the same cases, so anyone can open them [default: a secret one]
    #[arg(long, value_name = "S")]
    pub(crate) seed: Option<u64>,
    /// Folder that keeps cases for the next time, by generator, plant, split, seed and number
    #[arg(long, value_name = "DIR", env = "TRUEUP_TRIAL_CACHE")]
    pub(crate) cache: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(crate) struct BenchRun {
    /// The folder `public` of a benchmark
    pub(crate) public: PathBuf,
    /// The entry
    #[arg(short, long, value_name = "FILE.csv")]
    pub(crate) output: PathBuf,
    /// Folder for results [default: FILE.results]
    #[arg(long, value_name = "DIR")]
    pub(crate) results: Option<PathBuf>,
    /// Another build of this program that diagnoses in its place
    #[arg(long, value_name = "FILE")]
    pub(crate) program: Option<PathBuf>,
    /// Processor time after which a case is stopped and answered `unknown`, s
    #[arg(long, value_name = "SECONDS", default_value_t = 600.0, allow_negative_numbers = true, value_parser = super::seconds)]
    pub(crate) limit: f64,
    /// Only every n-th case, from the i-th on
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = super::shard)]
    pub(crate) shard: (usize, usize),
}

#[derive(Debug, clap::Args)]
pub(crate) struct BenchSubmit {
    /// The folder `public` of a benchmark
    pub(crate) public: PathBuf,
    /// The entry
    #[arg(value_name = "FILE.csv")]
    pub(crate) entry: PathBuf,
    /// The receipt
    #[arg(short, long, value_name = "FILE.toml")]
    pub(crate) output: PathBuf,
}

#[derive(Debug, clap::Args)]
pub(crate) struct BenchScore {
    /// Folder with `public` and `sealed`
    pub(crate) directory: PathBuf,
    /// Entries, a column of the page each
    #[arg(value_name = "FILE.csv", required = true)]
    pub(crate) entries: Vec<PathBuf>,
    /// The page, Markdown; scores case by case go into FILE.csv
    #[arg(short, long, value_name = "FILE.md")]
    pub(crate) output: PathBuf,
}
