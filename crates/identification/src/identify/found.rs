//! What a parameter was found to be.

use crate::estimate::ParameterEstimate;
use crate::subject::IdentificationSubject;
use crate::unknown::{FitTarget, FitUnknown};

/// What a parameter was found to be.
#[derive(Clone, Debug)]
pub struct FoundParameter {
    /// Estimate with its uncertainty.
    pub estimate: ParameterEstimate,
    /// Unit.
    pub unit: &'static str,
    /// The nominal value of the case.
    pub nominal: f64,
    /// Relative standard deviation of the prior.
    pub doubt: Option<f64>,
}

pub(super) fn found(
    model: &dyn IdentificationSubject,
    nominal: &[f64],
    e: &ParameterEstimate,
    u: &FitUnknown,
) -> FoundParameter {
    let (unit, nominal) = match u.target {
        FitTarget::Parameter(i) => (model.parameters()[i].unit, nominal[i]),
        FitTarget::Offset(i) => (model.outputs()[i].unit, u.start),
        FitTarget::Gain(_) | FitTarget::InputGain(_) => ("1", u.start),
        FitTarget::InputBias(i) | FitTarget::InputOffset(i) => (model.inputs()[i].unit, u.start),
        FitTarget::SensorDelay(_) | FitTarget::InputSensorDelay(_) => ("s", u.start),
    };
    FoundParameter { estimate: e.clone(), unit, nominal, doubt: None }
}
