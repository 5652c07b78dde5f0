//! Why a case cannot be identified.

use super::method::IdentifyMethod;
use crate::model::ModelError;
use crate::predict::PredictError;
use crate::quasi_static::StaticError;
use crate::recorded::RecordedError;
use crate::regress::RegressError;

/// A case that cannot be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Its model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// One of its recordings.
    #[error(transparent)]
    Recorded(#[from] RecordedError),
    /// The simulation.
    #[error("{0}; check the parameters of the case, or narrow what is fitted")]
    Predict(#[from] PredictError),
    /// The regression.
    #[error(transparent)]
    Regress(#[from] RegressError),
    /// What is to be fitted.
    #[error("{0}")]
    Unknowns(String),
    /// Regressions are not for FMUs.
    #[error(
        "method {method} works on the equations of a model of ours, not through an FMU; use output-error or nelder-mead, or leave out --fmu"
    )]
    FmuMethod {
        /// Which.
        method: IdentifyMethod,
    },
    /// A ramp without information.
    #[error("{run}: {what}")]
    Static {
        /// Recording.
        run: String,
        /// Why.
        what: StaticError,
    },
    /// What is to be varied is not there.
    #[error("--design {name}: the model has no such parameter")]
    NoDesign {
        /// What was requested.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// A value that is to be looked at cannot be simulated.
    #[error("--design {name}: at {value} the model cannot be simulated: {source}; narrow the range")]
    Refused {
        /// What is varied.
        name: String,
        /// Its value.
        value: f64,
        /// Why.
        source: PredictError,
    },
    /// Regressions simulate nothing.
    #[error(
        "method {method} has no sensitivities to design by; use output-error or nelder-mead, or leave out --design"
    )]
    DesignMethod {
        /// Which.
        method: IdentifyMethod,
    },
    /// Effects together with parameters.
    #[error("method {method} does not fit effects; use output-error or nelder-mead, or leave out --with")]
    Effects {
        /// Which.
        method: IdentifyMethod,
    },
    /// Regressions know of no weights of times.
    #[error("method {method} has no `weight` of [fit]; use output-error or nelder-mead, or remove it")]
    Weights {
        /// Which.
        method: IdentifyMethod,
    },
    /// What innovations do not take.
    #[error("method innovations does not take this case ({why}); use --method output-error")]
    Innovations {
        /// What, and where.
        why: String,
    },
    /// The method does not do that.
    #[error(
        "method {method} is for one flexible joint, motor, spring and load, with recorded motorCurrent, motorAngle and loadAngle; use output-error"
    )]
    Method {
        /// Which.
        method: IdentifyMethod,
    },
}
