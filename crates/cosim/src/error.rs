//! Why a run did not start or did not end well.

use std::path::PathBuf;

use trueup_numerics::ShortNumber;

use crate::mistake::InputMistake;

/// Any failure of this crate.
#[derive(Debug, thiserror::Error)]
pub enum CosimError {
    /// The FMU cannot be loaded or instantiated.
    #[error(transparent)]
    Fmu(#[from] trueup_fmi_import::ImportError),
    /// A call failed during the run.
    #[error("at t = {} s: {source}", ShortNumber(*.time))]
    Call {
        /// Time in s.
        time: f64,
        /// Function, instance, status and last messages.
        source: trueup_fmi_import::ImportError,
    },
    /// The FMU does not come further.
    #[error("at t = {} s: {reason}{}", ShortNumber(*.time), tail(.log))]
    Stuck {
        /// Time in s.
        time: f64,
        /// Which instance, what it did.
        reason: String,
        /// Its last messages.
        log: Vec<String>,
    },
    /// A value that is not finite.
    #[error("at t = {} s: {variable} of instance \"{instance}\" is {value}{}", ShortNumber(*.time), tail(.log))]
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
    /// An algebraic loop that has no solution, or none that was found.
    #[error("at t = {} s: the algebraic loop has no solution: {reason}{}", ShortNumber(*.time), residuals(.variables))]
    Loop {
        /// Time in s.
        time: f64,
        /// What went wrong.
        reason: String,
        /// Its inputs where the search ended.
        variables: Vec<ConnectionResidual>,
    },
    /// A step whose iteration does not settle, however short.
    #[error("at t = {} s: the inputs do not settle over the step: {reason}{}", ShortNumber(*.time), residuals(.variables))]
    Unsettled {
        /// Time in s.
        time: f64,
        /// What went wrong.
        reason: String,
        /// Those that still change.
        variables: Vec<ConnectionResidual>,
    },
    /// A request that does not fit the FMU; one line per mistake.
    #[error("{}", .0.join("\n  "))]
    Setting(Vec<String>),
    /// What is wrong in a description of a system; one line per mistake.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    System(Vec<InputMistake>),
    /// A file of inputs that cannot be used.
    #[error("{}{}: {reason}", .file.display(), .line.map(|line| format!(":{line}")).unwrap_or_default())]
    Inputs {
        /// The file.
        file: PathBuf,
        /// Its line, from 1, where one is known.
        line: Option<u64>,
        /// What is wrong, with the column.
        reason: String,
    },
    /// An FMU changed the working directory of the process, which gives names of files another meaning, or lowered its limits.
    #[error(
        "at t = {} s: the FMU of {who} {what}; that is undone, and the run ends: let the FMU have a process of its own (--isolate)",
        ShortNumber(*.time)
    )]
    Surroundings {
        /// Time in s.
        time: f64,
        /// Which instance, or instances one of which it was.
        who: String,
        /// What it changed, such as "changed the working directory to /".
        what: String,
    },
    /// The user ended the run, through a [sink](crate::ResultSink) that watches for it.
    #[error("at t = {} s: interrupted", ShortNumber(*.time))]
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

/// An input that does not agree with the output that it is connected to.
#[derive(Clone, Debug, PartialEq)]
pub struct ConnectionResidual {
    /// The input.
    pub variable: String,
    /// The output.
    pub source: String,
    /// Value of the input.
    pub value: f64,
    /// What the output would make of it, less that value.
    pub residual: f64,
}

fn residuals(variables: &[ConnectionResidual]) -> String {
    let line = |v: &ConnectionResidual| {
        format!(
            "\n  {} = {:?}, which {} would make {:?}",
            v.variable,
            v.value,
            v.source,
            v.value + v.residual
        )
    };
    variables.iter().map(line).collect()
}

fn tail(log: &[String]) -> String {
    if log.is_empty() { String::new() } else { format!("; its last messages:\n  {}", log.join("\n  ")) }
}

/// What a running system passes on is no larger than a pointer.
impl From<Box<CosimError>> for CosimError {
    fn from(error: Box<CosimError>) -> Self {
        *error
    }
}
