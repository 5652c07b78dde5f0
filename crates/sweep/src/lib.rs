//! Sweeps: many runs of one system, with the values of its factors varied by a plan.
//!
//! A [`Sweep`] is what the user wrote; its [`Design`] is a numbered list of runs, a pure function of the file. A [`Runner`]
//! runs any share of them and appends a checked line per run to a [log](Log); [`merge`] makes one table of all logs, the same
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

pub use beside::Beside;
pub use design::{Design, MOST_SOBOL};
pub use done::{Done, done};
pub use error::Error;
pub use file::{Factor, Kind, Output, Range, Sweep, Take, Values};
pub use log::{Damage, Log, Record, read as read_log};
pub use measure::Measures;
pub use print::fingerprint;
pub use runner::{Runner, Shard, Step, Tally};
pub use slurm::script;
pub use table::{Merged, merge};
pub use value::Value;
