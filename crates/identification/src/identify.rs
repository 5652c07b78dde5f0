//! A case from its recordings to its parameters: what `trueup identify` does.

mod breakaway;
mod design;
mod effects;
mod error;
mod forecast;
mod foreseen;
mod found;
mod identified;
mod innovations;
mod json;
mod kept;
mod leverage;
mod method;
mod minima;
mod searched;
mod simulation;
mod starts;
mod unknowns;

use nalgebra::DMatrix;
use trueup_signals::process::Misfit;
use trueup_signals::{FitWeight, Loaded};

use crate::estimate::ParameterEstimate;
use crate::fit::{ChannelComparison, free_run};
use crate::fmu::FmuSubject;
use crate::model::SimulatedPlant;
use crate::packed::PackedModel;
use crate::recorded::{led, runs, runs_of};
use crate::regress::Regressed;
use crate::run::IdentificationRun;
use crate::subject::IdentificationSubject;

use simulation::by_simulation;

pub use design::{Designed, ExperimentDesign};
pub use error::IdentifyError;
pub use foreseen::{ForeseenParameter, ForeseenParameters, foreseen};
pub use found::FoundParameter;
pub use identified::{FitFigure, Identified, IdentifySettings};
pub use json::json;
pub use leverage::Leverage;
pub use method::{IdentifyMethod, METHODS};
pub use starts::SearchStart;

/// Identifies a case.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify(loaded: &Loaded, settings: &IdentifySettings) -> Result<Identified, IdentifyError> {
    let searched = matches!(settings.method, IdentifyMethod::OutputError | IdentifyMethod::NelderMead);
    if !searched && !loaded.case.with.is_empty() {
        return Err(IdentifyError::Effects { method: settings.method });
    }
    if !searched && settings.design.is_some() {
        return Err(IdentifyError::DesignMethod { method: settings.method });
    }
    if !searched && !loaded.case.weights.is_empty() {
        return Err(IdentifyError::Weights { method: settings.method });
    }
    let with: Vec<&str> = loaded.case.with.iter().map(String::as_str).collect();
    let plain = SimulatedPlant::of_case(&loaded.case, &with)?;
    let led = led(&plain, &[loaded.train(), loaded.holdout()].concat());
    let model = plain.with_led(&led)?;
    let mut nominal = model.set(&model.defaults(), &loaded.case.parameters)?;
    let (train, holdout) = runs(&model, loaded)?;
    let effects = effects::of(&model, &loaded.case, &mut nominal, &train)?;
    let stands_on = effects::Effects::stands_on(&model, &loaded.case);
    let mut fitted = unknowns::of(&model, &loaded.case, &nominal, &train, &stands_on)?;
    fitted.retain(|f| !effects.fitted.iter().any(|e| e.unknown.name == f.unknown.name));
    fitted.splice(0..0, effects.fitted.iter().cloned());
    (settings.progress)(&format!(
        "{} recordings, {} readings, {} parameters",
        train.len(),
        train.iter().map(IdentificationRun::len).sum::<usize>(),
        fitted.len()
    ));
    let mut found = match settings.method {
        IdentifyMethod::OutputError | IdentifyMethod::NelderMead => {
            let also = |first: &SearchStart| effects.starts(first);
            by_simulation(&model, loaded, &nominal, train.clone(), fitted, &also, settings)?
        }
        IdentifyMethod::Innovations => {
            innovations::by_innovations(&model, &nominal, loaded, &train, &fitted, settings)?
        }
        IdentifyMethod::BreakAway => breakaway::found(&model, &nominal, &train)?,
        _ => by_regression(&model, &nominal, &train, &fitted, settings)?,
    };
    for j in led {
        found.notes.push(format!(
            "jointTorque[{}] is not recorded: the measured motion of the motor is prescribed",
            j + 1
        ));
    }
    let mut found = finish(&model, &nominal, &train, &holdout, found, settings)?;
    found.pack = Some(PackedModel::of(&model, &found.values).of_case(&loaded.case));
    if !with.is_empty() {
        (settings.progress)("the same without the effects, to compare with");
        let mut plain = loaded.clone();
        plain.case.with.clear();
        found.without =
            identify(&plain, &IdentifySettings { profile: false, design: None, ..*settings })?.fit;
    }
    Ok(found)
}

/// Identifies a case through an FMU, so that what is fitted is what is shipped; by output error or the simplex.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_fmu(
    loaded: &Loaded,
    mut model: FmuSubject,
    settings: &IdentifySettings,
) -> Result<Identified, IdentifyError> {
    if !matches!(settings.method, IdentifyMethod::OutputError | IdentifyMethod::NelderMead) {
        return Err(IdentifyError::FmuMethod { method: settings.method });
    }
    model.choose(&loaded.case.parameters)?;
    let nominal = model.set(&model.defaults(), &loaded.case.parameters)?;
    let (train, holdout) = runs_of(&model, loaded)?;
    let fitted = unknowns::of(&model, &loaded.case, &nominal, &train, &[])?;
    (settings.progress)(&format!(
        "{} recordings, {} readings, {} parameters, through {}",
        train.len(),
        train.iter().map(IdentificationRun::len).sum::<usize>(),
        fitted.len(),
        model.fmu().file().display()
    ));
    let mut found =
        by_simulation(&model, loaded, &nominal, train.clone(), fitted, &|_| Vec::new(), settings)?;
    found.fmu = Some(model.fmu().file().display().to_string());
    if train.iter().any(|r| r.drives.iter().any(|d| d.sigma > 0.0)) {
        found.notes.push(
            "noise of the inputs is not carried along the motion through an FMU: standard errors leave it out".into(),
        );
    }
    finish(&model, &nominal, &train, &holdout, found, settings)
}

/// Recordings that were not fitted, and how it was before.
fn finish(
    model: &dyn IdentificationSubject,
    nominal: &[f64],
    train: &[IdentificationRun],
    holdout: &[IdentificationRun],
    mut found: Identified,
    settings: &IdentifySettings,
) -> Result<Identified, IdentifyError> {
    (settings.progress)("comparing with recordings that were not fitted");
    let mut weights: Vec<&FitWeight> = Vec::new();
    train.iter().flat_map(|r| &r.weights).for_each(|w| {
        if !weights.contains(&w) {
            weights.push(w);
        }
    });
    found.notes.extend(weights.iter().map(|w| format!("{w}; figures of the fit are not weighted")));
    found.held_out = !holdout.is_empty();
    let runs = if found.held_out { holdout } else { train };
    let mut read = runs.to_vec();
    for run in &mut read {
        found.sensors.iter().for_each(|(target, value)| run.calibrate(*target, *value));
    }
    found.compared = free_run(model, &found.values, &read)?;
    found.fit = figures(model, &found.compared);
    // The nominal model may not even simulate.
    found.before = free_run(model, nominal, runs).map(|c| figures(model, &c)).unwrap_or_default();
    let names = |runs: &[IdentificationRun]| runs.iter().map(|r| r.name.clone()).collect();
    found.names = [names(train), names(runs)];
    Ok(found)
}

/// Pooled by sample over recordings.
fn figures(model: &dyn IdentificationSubject, compared: &[ChannelComparison]) -> Vec<FitFigure> {
    let mut names: Vec<&str> = Vec::new();
    for c in compared {
        if !names.contains(&c.channel.as_str()) {
            names.push(&c.channel);
        }
    }
    let figure = |name: &str| {
        let mut misfit = Misfit::default();
        compared.iter().filter(|c| c.channel == name).for_each(|c| misfit.add(&c.predicted, &c.measured));
        let unit = model.output(name).map_or("", |i| model.outputs()[i].unit);
        FitFigure { channel: name.into(), nrmse: misfit.nrmse(), rms: misfit.rms(), unit }
    };
    names.into_iter().map(figure).collect()
}

fn by_regression(
    model: &SimulatedPlant,
    nominal: &[f64],
    train: &[IdentificationRun],
    fitted: &[unknowns::CommonUnknown],
    settings: &IdentifySettings,
) -> Result<Identified, IdentifyError> {
    let wrong = || IdentifyError::Method { method: settings.method };
    if !model.joint().is_some_and(|j| j.flexible()) {
        return Err(wrong());
    }
    let r: Regressed = starts::regression(model, nominal, train, settings.method)?;
    let mut values = nominal.to_vec();
    let mut parameters = Vec::new();
    for f in fitted.iter().filter(|f| f.asked_for) {
        let name = &f.unknown.name;
        let index = model.parameter(name).ok_or_else(wrong)?;
        let mut estimate = ParameterEstimate {
            name: name.clone(),
            run: None,
            value: nominal[index],
            standard_error: None,
            cramer_rao: None,
            ci95: [None, None],
            reason: Some(format!("{} does not estimate it; use output-error", settings.method)),
        };
        if let Some(k) = starts::REGRESSED.iter().position(|n| n == name) {
            let (value, se) = (r.values[k], r.standard_errors[k]);
            let ends = [value - 1.96 * se, value + 1.96 * se].map(Some);
            estimate = ParameterEstimate {
                value,
                standard_error: Some(se),
                ci95: ends,
                reason: Some(
                    "as if residuals were independent and encoders exact: errors in the columns are not in it"
                        .into(),
                ),
                ..estimate
            };
            values[index] = value;
        }
        let unit = model.parameters()[index].unit;
        parameters.push(FoundParameter { estimate, unit, nominal: nominal[index], doubt: None });
    }
    let mut notes = vec![format!(
        "{} has no nuisance parameters and no bounds; compare with output-error before you rely on it",
        settings.method
    )];
    for (k, name) in starts::REGRESSED.iter().enumerate().filter(|(k, _)| r.values[*k] <= 0.0) {
        notes.push(format!(
            "{name} = {:.3e} is not physical: simulated with {:.3e}",
            r.values[k],
            1e-3 * nominal[model.parameter(name).unwrap_or(0)]
        ));
        if let Some(i) = model.parameter(name) {
            values[i] = 1e-3 * nominal[i].abs();
        }
    }
    let training = free_run(model, &values, train)?;
    let n = parameters.len();
    Ok(Identified {
        model: model.structure().model.clone(),
        fmu: None,
        outputs: model.outputs().to_vec(),
        method: settings.method,
        parameters,
        uncertain: Vec::new(),
        nuisance: train.iter().map(|r| (r.name.clone(), Vec::new())).collect(),
        fit: Vec::new(),
        held_out: false,
        before: Vec::new(),
        without: Vec::new(),
        channels: Vec::new(),
        training,
        compared: Vec::new(),
        names: Default::default(),
        correlation: DMatrix::identity(n, n),
        rank: (4, 4),
        condition: f64::NAN,
        leverage: Leverage::default(),
        starts: Vec::new(),
        stop: "closed form",
        iterations: r.samples,
        notes,
        values,
        pack: None,
        sensors: Vec::new(),
        design: None,
    })
}
