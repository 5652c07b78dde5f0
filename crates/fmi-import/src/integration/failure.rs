//! Why a [`IntegratedGroup`](super::IntegratedGroup) does not go on.

use std::fmt;

use trueup_numerics::ShortNumber;
use trueup_numerics::driver::DriveError;

use crate::ImportError;

/// Why a group of FMUs does not go on; `E`: why its inputs could not be set.
#[derive(Debug)]
pub enum Failure<E> {
    /// A call failed at this time in s.
    Call {
        /// s.
        time: f64,
        /// Function, instance, status and last messages.
        source: ImportError,
    },
    /// Inputs could not be set.
    Exchange(E),
    /// The user ended the run, at this time in s.
    Interrupted {
        /// s.
        time: f64,
    },
    /// A value that is not finite.
    NotFinite {
        /// s.
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
    /// No further step.
    Integrator {
        /// s.
        time: f64,
        /// Names of the instances.
        instances: Vec<String>,
        /// Why.
        source: DriveError,
    },
    /// The FMUs do not come further.
    Stuck {
        /// s.
        time: f64,
        /// Which instance, what it did.
        reason: String,
        /// Its last messages.
        log: Vec<String>,
    },
    /// The run goes on, its derivatives do not.
    NoDerivative {
        /// s.
        time: f64,
        /// Why.
        reason: &'static str,
    },
}

impl<E: fmt::Display> fmt::Display for Failure<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Call { time, source } => write!(f, "at t = {} s: {source}", ShortNumber(*time)),
            Self::Exchange(error) => error.fmt(f),
            Self::Interrupted { time } => write!(f, "at t = {} s: interrupted", ShortNumber(*time)),
            Self::NotFinite { time, instance, variable, value, log } => {
                write!(
                    f,
                    "at t = {} s: {variable} of instance \"{instance}\" is {value}",
                    ShortNumber(*time)
                )?;
                tail(log, f)
            }
            Self::Integrator { time, instances, source } => {
                write!(f, "at t = {} s: integration of {instances:?} fails: {source}", ShortNumber(*time))
            }
            Self::Stuck { time, reason, log } => {
                write!(f, "at t = {} s: {reason}", ShortNumber(*time))?;
                tail(log, f)
            }
            Self::NoDerivative { time, reason } => write!(f, "at t = {} s: {reason}", ShortNumber(*time)),
        }
    }
}

fn tail(log: &[String], f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if log.is_empty() { Ok(()) } else { write!(f, "; its last messages:\n  {}", log.join("\n  ")) }
}
