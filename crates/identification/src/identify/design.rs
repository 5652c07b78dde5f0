//! What an experiment from another start would identify: expected standard errors over the value of an initial state, or of
//! another parameter that is not fitted.
//!
//! The Cramer-Rao bound (J^T J)^-1, J the exact sensitivities of the case's own runs, begun so, at the estimates; sensors,
//! noise, sampling, inputs and priors are the case's. It holds if the model is right and readings err independently.

use super::error::IdentifyError;
use super::found::FoundParameter;
use super::searched::SearchableModel;
use crate::covariance::Information;
use crate::lsq::LeastSquares;
use crate::model::CoordinateIndices;
use crate::output_error::OutputError;
use crate::run::IdentificationRun;
use crate::subject::IdentificationSubject;
use crate::unknown::{FitTarget, FitUnknown};
use trueup_signals::base_name;

/// What is varied: a parameter that is not fitted, as initial states are, or `initialSpringOffset`: where the load begins
/// less where its motor does, rad on the side of the load; of an arm `initialSpringOffset[j]`.
#[derive(Clone, Debug, PartialEq)]
pub struct ExperimentDesign {
    /// Its name.
    pub name: String,
    /// Values to look at, in its SI unit, at least one.
    pub values: Vec<f64>,
}

/// What is to be expected of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Designed {
    /// What is varied.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// What is estimated, with units.
    pub unknowns: Vec<(String, &'static str)>,
    /// Each recording for fitting with the value that it has now.
    pub present: Vec<(String, f64)>,
    /// Expected standard errors now, in the order of `unknowns`; `None`: such runs do not give it.
    pub now: Vec<Option<f64>>,
    /// Value and expected standard errors of all recordings begun so.
    pub rows: Vec<(f64, Vec<Option<f64>>)>,
}

impl Designed {
    /// Row at which unknown `k` has its smallest error.
    pub fn best(&self, k: usize) -> Option<usize> {
        let errors = self.rows.iter().enumerate().filter_map(|(i, r)| Some((i, r.1[k]?)));
        errors.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }
    /// Row of the smallest product of the errors of all that some row gives; rows that do not give one of them are out.
    pub fn best_of_all(&self) -> Option<usize> {
        let given: Vec<usize> = (0..self.unknowns.len()).filter(|k| self.best(*k).is_some()).collect();
        let product =
            |r: &(f64, Vec<Option<f64>>)| given.iter().map(|k| r.1[*k].map(f64::ln)).sum::<Option<f64>>();
        let rows = self.rows.iter().enumerate().filter_map(|(i, r)| Some((i, product(r)?)));
        rows.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| !given.is_empty()).map(|(i, _)| i)
    }
    /// By how many times the error of unknown `k` is smaller in that row than now.
    pub fn gain(&self, k: usize, row: usize) -> Option<f64> {
        Some(self.now[k]? / self.rows[row].1[k]?)
    }
}

/// Indices of what is varied.
#[derive(Clone, Debug)]
pub(super) struct Varied {
    /// Parameter that is set.
    index: usize,
    /// What the value is counted from: another parameter, over this ratio.
    from: Option<(usize, Option<usize>)>,
}

impl Varied {
    /// Looks the name up.
    ///
    /// # Errors
    /// [`IdentifyError::NoDesign`], [`IdentifyError::Unknowns`].
    pub(super) fn of(
        model: &dyn SearchableModel,
        design: &ExperimentDesign,
        fitted: &[FitUnknown],
    ) -> Result<Self, IdentifyError> {
        let name = &design.name;
        let none = || IdentifyError::NoDesign { name: name.clone(), known: names(model, fitted) };
        let varied = match name.strip_prefix(OFFSET) {
            Some(element) => {
                let found = offsets(model).into_iter().find(|(own, _)| own == element);
                found.ok_or_else(none)?.1
            }
            None => Self { index: model.parameter(name).ok_or_else(none)?, from: None },
        };
        if fitted.iter().any(|u| u.target == FitTarget::Parameter(varied.index)) {
            return Err(IdentifyError::Unknowns(format!(
                "--design {name}: it is an unknown of the fit; vary how a run begins, as in initialSpringOffset=-0.05..0.05, or take it out of [fit] parameters"
            )));
        }
        let q = &model.parameters()[varied.index];
        match design.values.iter().find(|v| varied.from.is_none() && !(q.min..=q.max).contains(*v)) {
            Some(v) => Err(IdentifyError::Unknowns(format!(
                "--design {name}: {v} {} is outside its range, {} to {}; look within it",
                q.unit, q.min, q.max
            ))),
            None => Ok(varied),
        }
    }

    /// The whole prediction for the fit `theta`, whose first unknowns are those `shared` by all recordings.
    ///
    /// # Errors
    /// [`IdentifyError::Refused`] with the value at which the model cannot be simulated.
    pub(super) fn designed(
        &self,
        model: &dyn SearchableModel,
        design: &ExperimentDesign,
        problem: &OutputError,
        theta: &[f64],
        shared: &[FoundParameter],
    ) -> Result<Designed, IdentifyError> {
        let errors = |value: Option<f64>| {
            let refused = |source| IdentifyError::Refused {
                name: design.name.clone(),
                value: value.unwrap_or(f64::NAN),
                source,
            };
            self.errors(problem, theta, value, shared.len()).map_err(refused)
        };
        let row = |value: &f64| errors(Some(*value)).map(|all| (*value, all));
        let present = problem.runs().iter().enumerate().map(|(r, run)| {
            let p = problem.parameters(r, theta);
            (run.name.clone(), p[self.index] - self.zero(&p))
        });
        Ok(Designed {
            name: design.name.clone(),
            unit: model.parameters()[self.index].unit,
            unknowns: shared.iter().map(|f| (f.estimate.name.clone(), f.unit)).collect(),
            present: present.collect(),
            now: errors(None)?,
            rows: design.values.iter().map(row).collect::<Result<_, _>>()?,
        })
    }

    /// What the value is counted from.
    fn zero(&self, p: &[f64]) -> f64 {
        self.from.map_or(0.0, |(i, ratio)| p[i] / ratio.map_or(1.0, |r| p[r]))
    }

    /// Expected standard errors of all runs begun at `value`; `None`: as they began.
    fn errors(
        &self,
        problem: &OutputError,
        theta: &[f64],
        value: Option<f64>,
        shared: usize,
    ) -> Result<Vec<Option<f64>>, crate::predict::PredictError> {
        let mut theta = theta.to_vec();
        let mut runs: Vec<IdentificationRun> = problem.runs().to_vec();
        for (r, run) in runs.iter_mut().enumerate().filter(|_| value.is_some()) {
            let at = self.zero(&problem.parameters(r, &theta)) + value.unwrap_or_default();
            let own = |u: &FitUnknown| u.run == Some(r) && u.target == FitTarget::Parameter(self.index);
            match problem.unknowns().iter().position(own) {
                Some(k) => theta[k] = problem.unknowns()[k].scale.coordinate(at),
                None => {
                    run.known.retain(|k| k.0 != self.index);
                    run.known.push((self.index, at));
                }
            }
        }
        let mut begun = problem.with_runs(&runs);
        if (0..runs.len()).any(|r| problem.carried(r).is_some()) {
            begun.carry_noise(&theta)?;
        }
        let jacobian = begun.evaluate(&theta, true)?.jacobian.unwrap_or_default();
        let information = Information::new(&jacobian);
        let error = |k: usize| {
            let slope = problem.unknowns()[k].scale.value(theta[k]).1;
            information.determines(k).then(|| information.covariance[(k, k)].sqrt() * slope)
        };
        Ok((0..shared).map(error).collect())
    }
}

/// Where the load begins less where its motor does.
const OFFSET: &str = "initialSpringOffset";

/// Of joints with two coordinates: their part of the name, and where the load and its motor begin.
fn offsets(model: &dyn IdentificationSubject) -> Vec<(String, Varied)> {
    let begins = model.begins();
    let one = |c: &CoordinateIndices| {
        let (other, geared) = c.follows?;
        let other = begins[other];
        // Behind a gear the load follows its motor; else the motor follows its joint.
        let (load, motor) = if geared { (c, &other) } else { (&other, c) };
        let ratio = if geared { Some(model.parameter("gearRatio")?) } else { None };
        let name = &model.parameters()[load.angle].name;
        let element = name[base_name(name).len()..].to_owned();
        Some((element, Varied { index: load.angle, from: Some((motor.angle, ratio)) }))
    };
    begins.iter().filter_map(one).collect()
}

/// What may be varied.
fn names(model: &dyn IdentificationSubject, fitted: &[FitUnknown]) -> Vec<String> {
    let free = |q: &&crate::model::PlantQuantity| !fitted.iter().any(|u| u.name == q.name);
    let offsets = offsets(model).into_iter().map(|(element, _)| format!("{OFFSET}{element}"));
    model.parameters().iter().filter(free).map(|q| q.name.clone()).chain(offsets).collect()
}
