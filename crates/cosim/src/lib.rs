//! The master: runs an FMU of FMI 2.0 or 3.0 of any origin in Co-Simulation.
//!
//! ```no_run
//! use trueup_cosim::{SimulateOptions, Results, simulate};
//! use trueup_fmi_import::UnpackedFmu;
//!
//! let fmu = UnpackedFmu::open("BouncingBall.fmu")?;
//! let options = SimulateOptions { stop: Some(3.0), set: vec![("e".into(), "0.8".into())], ..SimulateOptions::default() };
//! let mut results = Results::create("results.csv".as_ref())?;
//! match simulate(&fmu, &options, &mut results) {
//!     Ok(_) => results.finish()?,
//!     Err(error) => eprintln!("{error}; kept: {:?}", results.keep_partial()?),
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A wrong run never looks like a good one: every status is checked, a value that is not finite ends the run, and
//! what was computed until then is kept under another name.

mod adaptive;
mod buffer;
mod calls;
mod check;
mod choose;
pub mod couple;
mod error;
mod events;
pub mod exchange;
mod graph;
mod grid;
mod inputs;
pub mod keys;
mod log;
mod master;
mod mistake;
pub mod model_exchange;
pub mod node;
mod open;
mod place;
pub mod plan;
mod record;
mod results;
mod simulate;
mod single;
mod ssp;
mod step_rule;
pub mod stepper;
mod store;
mod straight;
pub mod system;
mod toml;
mod value;

pub use adaptive::Adapted;
pub use buffer::{BlockAccess, ValueBuffer, VariableBlock};
pub use calls::{CallCounts, FmuCalls};
pub use check::{Files, check, check_with, names};
pub use error::{ConnectionResidual, CosimError};
pub use grid::CommunicationGrid;
pub use inputs::{InputFileTable, InputSignal};
pub use log::RunLog;
pub use master::Master;
pub use mistake::{InputMistake, suggestion};
pub use results::{ColumnKind, ResultColumn, ResultRow, ResultSink, Results, RowValues, SeriesMemory, slots};
pub use simulate::{SimulateOptions, Summary, simulate};
pub use single::{PartialDerivatives, SteppedFmu};
pub use ssp::write as write_ssp;
