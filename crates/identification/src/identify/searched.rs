//! What differs between a model of ours and an FMU when parameters are searched.

use super::starts::{self, Start};
use super::unknowns;
use crate::fit::Fit;
use crate::fmu::FmuModel;
use crate::model::Model;
use crate::run::Run;
use crate::subject::Subject;
use crate::unknown::Unknown;

/// What differs between a model of ours and an FMU.
pub(super) trait Searched: Subject {
    /// Its name.
    fn title(&self) -> String;
    /// Intervals by profiles cost hundreds of fits.
    fn profiles(&self) -> bool;
    /// Where to begin.
    fn starts(&self, nominal: &[f64], runs: &[Run], fitted: &[unknowns::Fitted]) -> Vec<Start>;
    /// Further starts from a solution.
    fn again(&self, unknowns: &[Unknown], fit: &Fit) -> Vec<Vec<f64>>;
}

impl Searched for Model {
    fn title(&self) -> String {
        self.structure().model.clone()
    }
    fn profiles(&self) -> bool {
        true
    }
    fn starts(&self, nominal: &[f64], runs: &[Run], fitted: &[unknowns::Fitted]) -> Vec<Start> {
        starts::find(self, nominal, runs, fitted)
    }
    fn again(&self, unknowns: &[Unknown], fit: &Fit) -> Vec<Vec<f64>> {
        starts::above_coulomb(self, unknowns, fit)
    }
}

impl Searched for FmuModel {
    fn title(&self) -> String {
        self.name().to_owned()
    }
    fn profiles(&self) -> bool {
        false
    }
    fn starts(&self, _: &[f64], _: &[Run], fitted: &[unknowns::Fitted]) -> Vec<Start> {
        starts::around(fitted)
    }
    fn again(&self, _: &[Unknown], _: &Fit) -> Vec<Vec<f64>> {
        Vec::new()
    }
}
