//! What a case requests to be fitted, and what it declares uncertain.

use trueup_models::arm::PayloadParameter;
use trueup_signals::{Case, PriorGuess, base_name};

use super::error::IdentifyError;
use crate::run::IdentificationRun;
use crate::sensor_unknowns::{SensorFigure, SensorOf, SensorUnknown, sought};
use crate::subject::IdentificationSubject;
use crate::unknown::{FitTarget, FitUnknown, Scale};

/// An unknown of all recordings.
#[derive(Clone, Debug)]
pub(super) struct CommonUnknown {
    pub unknown: FitUnknown,
    /// The case requests it; else it is only uncertain.
    pub asked_for: bool,
    /// Relative, from the case.
    pub doubt: Option<f64>,
}

/// A number of the model, the same in all recordings: no first state, no choice.
fn is_fitted(model: &dyn IdentificationSubject, name: &str) -> bool {
    model
        .parameter(name)
        .map(|i| &model.parameters()[i])
        .is_none_or(|q| !q.is_initial() && q.items.is_empty())
}

/// Requested (by the case, and `besides`), then uncertain ones that are not.
pub(super) fn of(
    model: &dyn IdentificationSubject,
    case: &Case,
    nominal: &[f64],
    runs: &[IdentificationRun],
    besides: &[&str],
) -> Result<Vec<CommonUnknown>, IdentifyError> {
    let asked: Vec<String> = match &case.fit {
        None => model.fits(),
        Some(list) => list.iter().flat_map(|name| model.named(name)).map(|q| q.name.clone()).collect(),
    };
    let besides = besides.iter().filter(|b| model.parameter(b).is_some()).map(|b| (*b).to_owned());
    let carried =
        case.parameters.keys().filter(|n| PayloadParameter::named(n).is_some() && case.doubt(n).is_some());
    let asked: Vec<String> = asked.into_iter().chain(besides).chain(carried.cloned()).collect();
    let mut all = Vec::new();
    for name in &asked {
        if !is_fitted(model, name) {
            return Err(IdentifyError::Unknowns(format!(
                "`{name}` cannot be fitted: initial states are estimated in every recording anyway, a choice is no number; take it out of [fit] parameters"
            )));
        }
        if !all.iter().any(|f: &CommonUnknown| &f.unknown.name == name) {
            all.push(one(model, case, nominal, runs, name, true));
        }
    }
    all.extend(sensors(model, runs));
    let uncertain = case.parameters.keys().filter(|n| case.doubt(n).is_some_and(|d| d > 0.0));
    for name in uncertain.filter(|n| is_fitted(model, n)) {
        if model.parameter(name).is_some() && !asked.contains(name) {
            all.push(one(model, case, nominal, runs, name, false));
        }
    }
    if all.is_empty() && case.with.is_empty() {
        return Err(IdentifyError::Unknowns(
            "there is nothing to fit: no joint is flexible, and nothing is uncertain; write [fit] parameters = [\"linkMass[3]\"]".into(),
        ));
    }
    Ok(all)
}

/// Gains and delays of sensors, the same in all recordings; offsets are estimated in each recording.
fn sensors(model: &dyn IdentificationSubject, runs: &[IdentificationRun]) -> Vec<CommonUnknown> {
    let one = |s: &SensorUnknown| {
        let (channel, target) = match (s.of, s.figure) {
            (_, SensorFigure::Offset) => return None,
            (SensorOf::Output(i), SensorFigure::Gain) => (&model.outputs()[i], FitTarget::Gain(i)),
            (SensorOf::Output(i), SensorFigure::Delay) => (&model.outputs()[i], FitTarget::SensorDelay(i)),
            (SensorOf::Input(i), SensorFigure::Gain) => (&model.inputs()[i], FitTarget::InputGain(i)),
            (SensorOf::Input(i), SensorFigure::Delay) => (&model.inputs()[i], FitTarget::InputSensorDelay(i)),
        };
        let name = format!("{}.{}", channel.name, s.figure.name());
        let PriorGuess { value, doubt } = s.guess;
        let mut unknown = FitUnknown { start: value, ..FitUnknown::free(&name, target, None, s.size) };
        if let Some((lower, upper)) = s.bounds() {
            (unknown.lower, unknown.upper) = (lower, upper);
            unknown.prior = doubt.map(|_| (value / s.size, 1.0));
        } else if let Some(d) = doubt {
            unknown = unknown.believed(d);
        }
        Some(CommonUnknown { unknown, asked_for: true, doubt: doubt.filter(|_| !target.shifts()) })
    };
    sought(runs).iter().filter_map(one).collect()
}

fn one(
    model: &dyn IdentificationSubject,
    case: &Case,
    nominal: &[f64],
    runs: &[IdentificationRun],
    name: &str,
    asked_for: bool,
) -> CommonUnknown {
    let index = model.parameter(name).unwrap_or(0);
    let (value, q) = (nominal[index], &model.parameters()[index]);
    let doubt = case.doubt(name).filter(|d| *d > 0.0);
    if model.absolute_doubt(index) {
        let size = if PayloadParameter::named(name).is_some() { doubt.unwrap_or(0.1) } else { 1.0 };
        let free = FitUnknown::free(name, FitTarget::Parameter(index), None, size);
        let prior = doubt.map(|d| (value / size, d / size));
        let unknown = FitUnknown { start: value, prior, lower: q.min, upper: q.max, ..free };
        return CommonUnknown { unknown, asked_for, doubt };
    }
    let mut unknown = FitUnknown::positive(name, index, value);
    if !(value > 0.0 && q.min >= 0.0) {
        let size = if value == 0.0 { typical(model, nominal, runs, name) } else { value.abs() };
        let start = if value == 0.0 && q.min >= 0.0 { 0.1 * size } else { value };
        let free = FitUnknown::free(name, FitTarget::Parameter(index), None, size);
        unknown = FitUnknown { start, lower: q.min, scale: Scale::Linear(size), ..free };
    }
    if unknown.scale == Scale::Log {
        // A case that is off by more is a case of another drive; far out simulations only cost time.
        (unknown.lower, unknown.upper) = (1e-2 * value, 1e2 * value);
    }
    unknown.upper = unknown.upper.min(q.max);
    unknown.lower = unknown.lower.max(if q.min > 0.0 { q.min } else { unknown.lower });
    if let Some(d) = doubt {
        unknown = unknown.believed(d);
    }
    CommonUnknown { unknown, asked_for, doubt }
}

/// How large a value is likely to be that is 0 in the case.
fn typical(
    model: &dyn IdentificationSubject,
    nominal: &[f64],
    runs: &[IdentificationRun],
    name: &str,
) -> f64 {
    let value = |n: &str| model.parameter(n).map_or(1.0, |i| nominal[i]);
    let largest = |i: usize| {
        let all = runs.iter().flat_map(|r| &r.drives).filter(|d| d.input == i).flat_map(|d| &d.u);
        all.fold(0.0, |m: f64, v| m.max(v.abs()))
    };
    // Of an arm the first input is a torque already.
    let torque = value("torqueConstant").abs() * largest(0);
    let speeds = runs.iter().flat_map(|r| &r.channels).filter(|c| model.outputs()[c.output].is_joint_angle());
    let fastest = speeds
        .flat_map(|c| c.t.windows(9).zip(c.y.windows(9)))
        .map(|(t, y)| ((y[8] - y[0]) / (t[8] - t[0])).abs())
        .fold(0.0, f64::max);
    let size = match base_name(name) {
        "coulombFriction" | "staticFriction" => 0.2 * torque,
        "viscousFriction" | "damping" | "jointDamping" => 0.2 * torque / fastest.max(1e-9),
        "motorInertia" | "loadInertia" | "linkInertia" | "baseInertia" => torque / fastest.max(1e-9),
        _ => 0.1,
    };
    if size > 0.0 && size.is_finite() { size } else { 0.1 }
}
