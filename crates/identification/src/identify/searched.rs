//! What differs between a model of ours and an FMU when parameters are searched.

use super::starts::{self, SearchStart};
use super::unknowns;
use crate::fit::OutputErrorFit;
use crate::fmu::FmuSubject;
use crate::model::SimulatedPlant;
use crate::run::IdentificationRun;
use crate::subject::IdentificationSubject;
use crate::unknown::FitUnknown;

/// What differs between a model of ours and an FMU.
pub(super) trait SearchableModel: IdentificationSubject {
    /// Its name.
    fn title(&self) -> String;
    /// Intervals by profiles cost hundreds of fits.
    fn profiles(&self) -> bool;
    /// Where to begin.
    fn starts(
        &self,
        nominal: &[f64],
        runs: &[IdentificationRun],
        fitted: &[unknowns::CommonUnknown],
    ) -> Vec<SearchStart>;
    /// Further starts from a solution.
    fn again(&self, unknowns: &[FitUnknown], fit: &OutputErrorFit) -> Vec<Vec<f64>>;
}

impl SearchableModel for SimulatedPlant {
    fn title(&self) -> String {
        self.structure().model.clone()
    }
    fn profiles(&self) -> bool {
        true
    }
    fn starts(
        &self,
        nominal: &[f64],
        runs: &[IdentificationRun],
        fitted: &[unknowns::CommonUnknown],
    ) -> Vec<SearchStart> {
        starts::find(self, nominal, runs, fitted)
    }
    fn again(&self, unknowns: &[FitUnknown], fit: &OutputErrorFit) -> Vec<Vec<f64>> {
        starts::above_coulomb(self, unknowns, fit)
    }
}

impl SearchableModel for FmuSubject {
    fn title(&self) -> String {
        self.name().to_owned()
    }
    fn profiles(&self) -> bool {
        false
    }
    fn starts(
        &self,
        _: &[f64],
        _: &[IdentificationRun],
        fitted: &[unknowns::CommonUnknown],
    ) -> Vec<SearchStart> {
        starts::around(fitted)
    }
    fn again(&self, _: &[FitUnknown], _: &OutputErrorFit) -> Vec<Vec<f64>> {
        Vec::new()
    }
}
