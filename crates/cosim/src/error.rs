//! Why a run did not start or did not end well.

use std::path::PathBuf;

use crate::mistake::Mistake;

/// Any failure of this crate.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The FMU cannot be loaded or instantiated.
    #[error(transparent)]
    Fmu(#[from] trueup_fmi_import::Error),
    /// A call failed during the run.
    #[error("at t = {time:?} s: {source}")]
    Call {
        /// Time in s.
        time: f64,
        /// Function, instance, status and last messages.
        source: trueup_fmi_import::Error,
    },
    /// The FMU does not come further.
    #[error("at t = {time:?} s: {reason}{}", tail(.log))]
    Stuck {
        /// Time in s.
        time: f64,
        /// Which instance, what it did.
        reason: String,
        /// Its last messages.
        log: Vec<String>,
    },
    /// A value that is not finite.
    #[error("at t = {time:?} s: {variable} of instance \"{instance}\" is {value}{}", tail(.log))]
    NotFinite {
        /// Time in s.
        time: f64,
        /// Name of the instance.
        instance: String,
        /// Name of the variable, with its element.
        variable: String,
        /// The value.
        value: f64,
        /// The instance's last messages.
        log: Vec<String>,
    },
    /// What was asked for does not fit the FMU; one line per mistake.
    #[error("{}", .0.join("\n  "))]
    Setting(Vec<String>),
    /// What is wrong in a description of a system; one line per mistake.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    System(Vec<Mistake>),
    /// A file of inputs that cannot be used.
    #[error("{file}: {reason}")]
    Inputs {
        /// The file.
        file: PathBuf,
        /// What is wrong, with line or column.
        reason: String,
    },
    /// The user ended the run, through a [sink](crate::Sink) that watches for it.
    #[error("at t = {time:?} s: interrupted")]
    Interrupted {
        /// Time in s.
        time: f64,
    },
    /// Results that cannot be written.
    #[error("{file}: {source}")]
    Results {
        /// The file.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

fn tail(log: &[String]) -> String {
    if log.is_empty() { String::new() } else { format!("; its last messages:\n  {}", log.join("\n  ")) }
}
