//! What recordings are fitted with: a model of ours, or an FMU.

use std::collections::BTreeMap;

use trueup_numerics::hybrid::ModelSizes;
use trueup_signals::ParameterValue;

use crate::carried::{CarriedNoise, carried};
use crate::model::{CoordinateIndices, ModelError, NamedVariables, SimulatedPlant};
use crate::predict::{InputMap, PredictError, Prediction, PredictionPlan, predict};
use crate::predictor::Predictor;
use crate::run::IdentificationRun;
use trueup_plant::Lanes;

/// Variables by name, simulated along recordings.
pub trait IdentificationSubject: NamedVariables + Predictor {
    /// Its coordinates, each with where it begins and what shows it.
    fn begins(&self) -> Vec<CoordinateIndices>;
    /// States that are shown as they are: parameter that is their start value, output.
    fn shown_states(&self) -> &[(usize, usize)] {
        &[]
    }
    /// All parameters by name from another list, the rest from `base`.
    ///
    /// # Errors
    /// A value that is no number, or none that the parameter can have.
    fn with_values(
        &self,
        base: &[f64],
        given: &BTreeMap<String, ParameterValue>,
    ) -> Result<Vec<f64>, ModelError>;
    /// What is estimated unless the case chooses otherwise.
    fn fits(&self) -> Vec<String>;
}

impl IdentificationSubject for SimulatedPlant {
    fn begins(&self) -> Vec<CoordinateIndices> {
        self.coordinates()
    }
    fn with_values(
        &self,
        base: &[f64],
        given: &BTreeMap<String, ParameterValue>,
    ) -> Result<Vec<f64>, ModelError> {
        self.set(base, given)
    }
    fn fits(&self) -> Vec<String> {
        self.usual()
    }
}

impl SimulatedPlant {
    /// Readings of a run with parameters `p`, with events and modes ([`predict`]).
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn predict(
        &self,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        at_rest: bool,
    ) -> Result<Prediction<f64>, PredictError> {
        predict(self.plant(), plan, p, map, at_rest)
    }
}

impl Predictor for SimulatedPlant {
    fn counts(&self) -> ModelSizes {
        self.sizes()
    }
    fn readings(
        &self,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        at_rest: bool,
    ) -> Result<Vec<f64>, PredictError> {
        Ok(SimulatedPlant::predict(self, plan, p, map, at_rest)?.y)
    }
    fn readings_along(
        &self,
        plan: &PredictionPlan,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        at_rest: bool,
    ) -> Result<Vec<Lanes>, PredictError> {
        Ok(predict(self.plant(), plan, p, map, at_rest)?.y)
    }
    fn carries_noise(&self) -> bool {
        true
    }
    fn carried(
        &self,
        recording: &IdentificationRun,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
    ) -> Result<Option<CarriedNoise>, PredictError> {
        carried(self.plant(), recording, plan, p, map)
    }
}
