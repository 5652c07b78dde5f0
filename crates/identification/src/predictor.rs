//! What fits and judges recordings sees of a model.

use std::fmt::Debug;

use trueup_numerics::hybrid::ModelSizes;

use crate::carried::CarriedNoise;
use crate::predict::{InputMap, PredictError, PredictionPlan};
use crate::run::IdentificationRun;
use trueup_plant::Lanes;

/// What can be simulated along a recording: a model of ours, or an FMU. What fits and judges takes it as a trait object,
/// so that it is compiled once, not for each model.
pub trait Predictor: Debug + Sync {
    /// How many inputs, parameters and outputs it has; what else is left 0 may be unknown.
    fn counts(&self) -> ModelSizes;
    /// Readings of a recording with parameters `p`, channel after channel.
    ///
    /// # Errors
    /// See [`PredictError`].
    fn readings(
        &self,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        at_rest: bool,
    ) -> Result<Vec<f64>, PredictError>;
    /// Readings of a recording with parameters `p`, channel after channel, with derivatives.
    ///
    /// # Errors
    /// See [`PredictError`].
    fn readings_along(
        &self,
        plan: &PredictionPlan,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        at_rest: bool,
    ) -> Result<Vec<Lanes>, PredictError>;
    /// Whether it can say what noise of measured inputs does to its readings.
    fn carries_noise(&self) -> bool {
        false
    }
    /// What noise of the measured inputs does to the readings of a recording with parameters `p`; `None` where no input
    /// is declared to be noisy, or where it cannot say.
    ///
    /// # Errors
    /// See [`PredictError`].
    fn carried(
        &self,
        _recording: &IdentificationRun,
        _plan: &PredictionPlan,
        _p: &[f64],
        _map: &InputMap<f64>,
    ) -> Result<Option<CarriedNoise>, PredictError> {
        Ok(None)
    }
}
