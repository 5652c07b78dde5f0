//! What recordings are fitted with: a model of ours, or an FMU.

use std::collections::BTreeMap;

use trueup_numerics::hybrid::Sizes;
use trueup_signals::Value;

use crate::carried::{Carried, carried};
use crate::model::{Coordinate, Model, ModelError, Named};
use crate::predict::{InputMap, Plan, PredictError, Prediction, predict};
use crate::predictor::Predictor;
use crate::run::Run;
use trueup_plant::Lanes;

/// Variables by name, simulated along recordings.
pub trait Subject: Named + Predictor {
    /// Its coordinates, each with where it begins and what shows it.
    fn begins(&self) -> Vec<Coordinate>;
    /// States that are shown as they are: parameter that is their start value, output.
    fn shown_states(&self) -> &[(usize, usize)] {
        &[]
    }
    /// All parameters by name from another list, the rest from `base`.
    ///
    /// # Errors
    /// A value that is no number, or none that the parameter can have.
    fn with_values(&self, base: &[f64], given: &BTreeMap<String, Value>) -> Result<Vec<f64>, ModelError>;
    /// What is estimated unless the case chooses otherwise.
    fn fits(&self) -> Vec<String>;
}

impl Subject for Model {
    fn begins(&self) -> Vec<Coordinate> {
        self.coordinates()
    }
    fn with_values(&self, base: &[f64], given: &BTreeMap<String, Value>) -> Result<Vec<f64>, ModelError> {
        self.set(base, given)
    }
    fn fits(&self) -> Vec<String> {
        self.usual()
    }
}

impl Model {
    /// Readings of a run with parameters `p`, with events and modes ([`predict`]).
    ///
    /// # Errors
    /// See [`PredictError`].
    pub fn predict(
        &self,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
        at_rest: bool,
    ) -> Result<Prediction<f64>, PredictError> {
        predict(self.plant(), plan, p, map, at_rest)
    }
}

impl Predictor for Model {
    fn counts(&self) -> Sizes {
        self.sizes()
    }
    fn readings(
        &self,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
        at_rest: bool,
    ) -> Result<Vec<f64>, PredictError> {
        Ok(Model::predict(self, plan, p, map, at_rest)?.y)
    }
    fn readings_along(
        &self,
        plan: &Plan,
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
        recording: &Run,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
    ) -> Result<Option<Carried>, PredictError> {
        carried(self.plant(), recording, plan, p, map)
    }
}
