//! What the recordings of a case can determine, before any fit: the Cramer-Rao bound at the nominal values.
//!
//! Standard errors are those of (J^T J)^-1, J the exact sensitivities of the free runs at the nominal values over the noise of the
//! readings, first states unknown. They hold if the model is right; a parameter that no reading shows has none.

use std::time::Instant;

use trueup_signals::Loaded;

use super::error::IdentifyError;
use super::unknowns;
use crate::covariance::Information;
use crate::lsq::LeastSquares;
use crate::model::SimulatedPlant;
use crate::output_error::OutputError;
use crate::predict::PredictError;
use crate::recorded::{led, nuisance, runs};
use crate::run::IdentificationRun;
use crate::unknown::{FitTarget, FitUnknown};

/// An error of so many times the value is no information on it.
const NOTHING: f64 = 100.0;

/// A parameter, and how well the recordings would give it.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeseenParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: &'static str,
    /// Its nominal value.
    pub value: f64,
    /// Expected standard error, in the unit; `None`: these recordings do not give it.
    pub standard_error: Option<f64>,
}

/// All of them.
#[derive(Clone, Debug, PartialEq)]
pub struct ForeseenParameters {
    /// What `identify` would estimate.
    pub parameters: Vec<ForeseenParameter>,
    /// The recordings that were simulated.
    pub recordings: Vec<String>,
    /// Recordings for fitting that would have taken too long.
    pub left_out: Vec<String>,
}

/// Simulates the recordings for fitting at the nominal values, as many of them as `seconds` allow, the shortest first.
///
/// # Errors
/// [`IdentifyError`]: nothing to fit, or a nominal model that cannot be simulated.
pub fn foreseen(loaded: &Loaded, seconds: f64) -> Result<ForeseenParameters, IdentifyError> {
    let begun = Instant::now();
    let plain = SimulatedPlant::of_case(&loaded.case, &[])?;
    let led = led(&plain, &[loaded.train(), loaded.holdout()].concat());
    let model = plain.with_led(&led)?;
    let nominal = model.set(&model.defaults(), &loaded.case.parameters)?;
    let (mut train, _) = runs(&model, loaded)?;
    let fitted = unknowns::of(&model, &loaded.case, &nominal, &train, &[])?;
    let shared: Vec<FitUnknown> = fitted.into_iter().filter(|f| f.asked_for).map(|f| f.unknown).collect();
    train.sort_by_key(IdentificationRun::len);
    let mut used = 0;
    let mut information = None;
    for n in 1..=train.len() {
        let before = Instant::now();
        let fewer = information.is_some();
        match sensitivities(&model, &nominal, &train[..n], &shared) {
            Ok(found) => information = Some(found),
            // One that cannot be run is left out, if another one can.
            Err(_) if fewer => break,
            Err(e) => return Err(e.into()),
        }
        used = n;
        // The next time all of them are run, and one more.
        let next = train.get(n).map_or(0, IdentificationRun::len);
        let readings: usize = train[..n].iter().map(IdentificationRun::len).sum();
        let forecast = before.elapsed().as_secs_f64() * (1.0 + next as f64 / readings.max(1) as f64);
        if begun.elapsed().as_secs_f64() + forecast > seconds {
            break;
        }
    }
    let names = |runs: &[IdentificationRun]| runs.iter().map(|r| r.name.clone()).collect();
    let one = |(k, u): (usize, &FitUnknown)| {
        let (name, value) = (u.name.clone(), u.start);
        let unit = match u.target {
            FitTarget::Parameter(i) => model.parameters()[i].unit,
            _ => "",
        };
        let found = information.as_ref().filter(|i: &&Information| i.determines(k));
        let slope = u.scale.value(u.scale.coordinate(u.start)).1;
        let error = found.map(|i| i.covariance[(k, k)].sqrt() * slope.abs());
        // A derivative that is nearly 0 (friction at the edge of sticking) is no information.
        let standard_error =
            error.filter(|e: &f64| e.is_finite() && (value == 0.0 || *e < NOTHING * value.abs()));
        ForeseenParameter { name, unit, value, standard_error }
    };
    Ok(ForeseenParameters {
        parameters: shared.iter().enumerate().map(one).collect(),
        recordings: names(&train[..used]),
        left_out: names(&train[used..]),
    })
}

/// By the readings alone: what is known beforehand is no part of it.
fn sensitivities(
    model: &SimulatedPlant,
    nominal: &[f64],
    runs: &[IdentificationRun],
    shared: &[FitUnknown],
) -> Result<Information, PredictError> {
    let mut all = shared.to_vec();
    all.extend(nuisance(model, nominal, runs));
    let problem = OutputError::new(model, nominal, runs, all);
    let jacobian = problem.evaluate(&problem.start(), true)?.jacobian.unwrap_or_default();
    let readings = problem.readings().min(jacobian.nrows());
    Ok(Information::new(&jacobian.rows(0, readings).into_owned()))
}
