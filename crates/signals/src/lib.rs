//! Time series with units: recordings of real systems, the cases that they make up, what is wrong with them, and the
//! signal processing that identification and diagnosis share.
//!
//! - [`Recording`] and its [`Channel`]s, a [`Case`] of several, [`Loaded`] from its folder with [`Case::load`];
//! - [`Finding`]: what is wrong with one of them, where, and the remedy;
//! - [`keys`]: what a case and a sidecar may say;
//! - [`SignalVariable`]: what the caller declares of a model, so that this crate depends on none;
//!
//! ```
//! use trueup_signals::{Recording, SignalVariable, VariableRole};
//!
//! let known = [SignalVariable::new("motorCurrent", "A", VariableRole::Input), SignalVariable::new("motorAngle", "rad", VariableRole::Output)];
//! let text = "time,motorCurrent,motorAngle\n0,0.5,1.0\n0.1,,1.5\n0.2,0.7,\n";
//! let (run, findings) = Recording::parse_csv("run.csv", text.as_bytes(), &known)?;
//! assert!(findings.iter().all(|f| !f.is_error()));
//! let current = run.channel("motorCurrent").unwrap();
//! assert_eq!(current.time, [0.0, 0.2]); // what is missing is left out
//! assert!((current.at(0.1) - 0.6).abs() < 1e-15); // on the line between samples
//! # Ok::<(), trueup_signals::SignalsError>(())
//! ```

mod case;
pub mod check;
mod columns;
pub mod draft;
mod error;
mod figures;
mod finding;
pub mod keys;
mod names;
pub mod noise;
mod outlier;
pub mod process;
mod quantum;
mod read;
mod recording;
pub mod schema;
pub mod spline;
mod unit;
mod value;
mod variable;
mod write;

pub use case::{Case, FitWeight, KnownEffect, Loaded, ParameterValue};
pub use columns::{ColumnMapping, ColumnRule};
pub use error::SignalsError;
pub use figures::ChannelFigures;
pub use finding::{Finding, FindingKind, Severity};
pub use names::{RECORDING_ENDS, base_name, did_you_mean, element_name, names_recording, unreadable};
pub use read::{InputColumn, InputTable, recording_file};
pub use recording::{
    Channel, ChannelSettings, DeclaredFigures, Interpolation, PriorGuess, Recording, SensorData,
};
pub use unit::SignalUnit;
pub use variable::{SignalVariable, Takes, VariableRole};
pub use write::WrittenTable;
