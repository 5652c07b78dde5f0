//! What a parameter was found to be.

use crate::estimate::Estimated;
use crate::subject::Subject;
use crate::unknown::{Target, Unknown};

/// What a parameter was found to be.
#[derive(Clone, Debug)]
pub struct Found {
    /// Estimate with its uncertainty.
    pub estimate: Estimated,
    /// Unit.
    pub unit: &'static str,
    /// The nominal value of the case.
    pub nominal: f64,
    /// Relative standard deviation of the prior.
    pub doubt: Option<f64>,
}

pub(super) fn found(model: &dyn Subject, nominal: &[f64], e: &Estimated, u: &Unknown) -> Found {
    let (unit, nominal) = match u.target {
        Target::Parameter(i) => (model.parameters()[i].unit, nominal[i]),
        Target::Offset(i) => (model.outputs()[i].unit, u.start),
        Target::Gain(_) | Target::InputGain(_) => ("1", u.start),
        Target::InputBias(i) | Target::InputOffset(i) => (model.inputs()[i].unit, u.start),
        Target::Delay(_) | Target::InputDelay(_) => ("s", u.start),
    };
    Found { estimate: e.clone(), unit, nominal, doubt: None }
}
