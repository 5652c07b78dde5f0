//! Sweeps: many runs of one system, with the values of its factors varied by a plan.
//!
//! A [`SweepFile`] is what the user wrote; its [`SweepDesign`] is a numbered list of runs, a pure function of the file. A [`Runner`]
//! runs any share of them and appends a checked line per run to a [log](SweepLog); [`merge`] makes one table of all logs, the same
//! bytes however the runs were shared out or interrupted (docs/sweeps.md).

mod beside;
mod design;
mod done;
mod error;
mod file;
mod log;
mod measure;
mod mistakes;
mod print;
mod runner;
mod slurm;
mod table;
mod value;

pub use beside::RunNotes;
pub use design::{MOST_SOBOL, SweepDesign};
pub use done::{FinishedSweep, done};
pub use error::SweepError;
pub use file::{FactorValues, Output, Range, SweepFactor, SweepFile, SweepKind, Take, schema};
pub use log::{LogDamage, RunRecord, SweepLog, read as read_log};
pub use measure::Measures;
pub use print::fingerprint;
pub use runner::{RunStep, Runner, Shard, Tally};
pub use slurm::script;
pub use table::{Merged, merge};
pub use value::FactorValue;
