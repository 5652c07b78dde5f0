//! A case from its recordings to its parameters: what `trueup identify` does.

mod breakaway;
mod design;
mod effects;
mod forecast;
mod json;
mod kept;
mod leverage;
mod minima;
mod simulation;
mod starts;
mod unknowns;

use std::fmt;
use std::str::FromStr;

use nalgebra::DMatrix;
use trueup_signals::Loaded;
use trueup_signals::process::Misfit;

use crate::estimate::{ChannelFit, Estimated};
use crate::fit::{Comparison, free_run};
use crate::fmu::FmuModel;
use crate::model::{Model, ModelError, Quantity};
use crate::predict::PredictError;
use crate::quasi_static::StaticError;
use crate::recorded::{RecordedError, led, runs, runs_of};
use crate::regress::{RegressError, Regressed};
use crate::run::Run;
use crate::subject::Subject;
use crate::unknown::{Target, Unknown};

use simulation::by_simulation;

pub use design::{Design, Designed};
pub use json::json;
pub use leverage::Leverage;
pub use starts::Start;

/// How to estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// S3 eq. (8) as printed; a warning.
    LsLiteral,
    /// Least squares: aligned, sign column, moving samples.
    Ls,
    /// The same through one zero-phase filter.
    Filtered,
    /// The same with a simulated model as instruments.
    Iv,
    /// Free-running simulation against all readings.
    #[default]
    OutputError,
    /// The same cost by the downhill simplex, without derivatives.
    NelderMead,
    /// Static friction alone, from slow ramps of the current.
    BreakAway,
}

/// Names as on the command line.
pub const METHODS: [(&str, Method); 7] = [
    ("ls-literal", Method::LsLiteral),
    ("ls", Method::Ls),
    ("filtered", Method::Filtered),
    ("iv", Method::Iv),
    ("output-error", Method::OutputError),
    ("nelder-mead", Method::NelderMead),
    ("break-away", Method::BreakAway),
];

impl FromStr for Method {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let names: Vec<&str> = METHODS.iter().map(|m| m.0).collect();
        let found = METHODS.iter().find(|m| m.0 == s).map(|m| m.1);
        found.ok_or_else(|| format!("there is no method `{s}`; choose from {}", names.join(", ")))
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(METHODS.iter().find(|m| m.1 == *self).map_or("", |m| m.0))
    }
}

/// A case that cannot be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// Its model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// One of its recordings.
    #[error(transparent)]
    Recorded(#[from] RecordedError),
    /// The simulation.
    #[error("{0}; check the parameters of the case, or narrow what is fitted")]
    Predict(#[from] PredictError),
    /// The regression.
    #[error(transparent)]
    Regress(#[from] RegressError),
    /// What is to be fitted.
    #[error("{0}")]
    Unknowns(String),
    /// Regressions are not for FMUs.
    #[error(
        "method {method} works on the equations of a joint of ours, not through an FMU; use output-error or nelder-mead, or leave out --fmu"
    )]
    FmuMethod {
        /// Which.
        method: Method,
    },
    /// A ramp that says nothing.
    #[error("{run}: {what}")]
    Static {
        /// Recording.
        run: String,
        /// Why.
        what: StaticError,
    },
    /// What is to be varied is not there.
    #[error("--design {name}: the model has no such parameter")]
    NoDesign {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// A value that is to be looked at cannot be simulated.
    #[error("--design {name}: at {value} the model cannot be simulated: {source}; narrow the range")]
    Refused {
        /// What is varied.
        name: String,
        /// Its value.
        value: f64,
        /// Why.
        source: PredictError,
    },
    /// Regressions simulate nothing.
    #[error(
        "method {method} has no sensitivities to design by; use output-error or nelder-mead, or leave out --design"
    )]
    DesignMethod {
        /// Which.
        method: Method,
    },
    /// Effects beside parameters.
    #[error("method {method} does not fit effects; use output-error or nelder-mead, or leave out --with")]
    Effects {
        /// Which.
        method: Method,
    },
    /// The method does not do that.
    #[error(
        "method {method} is for a flexible TwoMassJoint with recorded motorCurrent, motorAngle and loadAngle; use output-error"
    )]
    Method {
        /// Which.
        method: Method,
    },
}

/// What a parameter was found to be.
#[derive(Clone, Debug)]
pub struct Found {
    /// Estimate with its uncertainty.
    pub estimate: Estimated,
    /// Unit.
    pub unit: &'static str,
    /// What the owner of the case believes.
    pub nominal: f64,
    /// Relative doubt that was taken as a prior.
    pub doubt: Option<f64>,
}

/// How well a channel is reproduced, over all recordings that were compared.
#[derive(Clone, Debug)]
pub struct Figure {
    /// FMU variable.
    pub channel: String,
    /// RMS(simulated - measured) / RMS(measured - its mean); `None` for a channel without variation.
    pub nrmse: Option<f64>,
    /// RMS(simulated - measured), in the channel's unit.
    pub rms: f64,
    /// Unit.
    pub unit: &'static str,
}

/// All that there is to say.
#[derive(Clone, Debug)]
pub struct Identified {
    /// Name of the model.
    pub model: String,
    /// The FMU's file, if it was fitted through one.
    pub fmu: Option<String>,
    /// Outputs of the model.
    pub outputs: Vec<Quantity>,
    /// How.
    pub method: Method,
    /// What was asked for.
    pub parameters: Vec<Found>,
    /// What is uncertain and was estimated along with it.
    pub uncertain: Vec<Found>,
    /// Recording by recording, in the order of training.
    pub nuisance: Vec<(String, Vec<Found>)>,
    /// On held-out recordings, or on those of the training where there are none.
    pub fit: Vec<Figure>,
    /// Whether `fit` is on held-out recordings.
    pub held_out: bool,
    /// The same with the nominal parameters.
    pub before: Vec<Figure>,
    /// The same with the model's own parameters fitted, without the effects that are fitted beside them; empty: there are
    /// none.
    pub without: Vec<Figure>,
    /// Residuals of the training.
    pub channels: Vec<ChannelFit>,
    /// Training recordings against their simulation.
    pub training: Vec<Comparison>,
    /// What `fit` was made from.
    pub compared: Vec<Comparison>,
    /// Names of the recordings of `training` and of `compared`.
    pub names: [Vec<String>; 2],
    /// Correlation of parameters and uncertain ones, in their order.
    pub correlation: DMatrix<f64>,
    /// Directions that the data determine, of how many unknowns.
    pub rank: (usize, usize),
    /// Condition number of the scaled Jacobian.
    pub condition: f64,
    /// By how much of itself each estimate moves with what is held to be known.
    pub leverage: Leverage,
    /// Where the search began and what came of it; the first is where the solution came from.
    pub starts: Vec<Start>,
    /// Why the search ended.
    pub stop: &'static str,
    /// Iterations, simulations of the simplex, or samples of the regression.
    pub iterations: usize,
    /// What the reader has to know.
    pub notes: Vec<String>,
    /// All parameters of the model, with the estimates in place.
    pub values: Vec<f64>,
    /// What was found of sensors, the same in all recordings.
    pub sensors: Vec<(Target, f64)>,
    /// What runs begun otherwise would tell, if that was asked for.
    pub design: Option<Designed>,
}

/// What to do.
pub struct Settings<'a> {
    /// How.
    pub method: Method,
    /// Intervals by profile likelihood; else from standard errors.
    pub profile: bool,
    /// Also asks what runs begun otherwise would tell.
    pub design: Option<&'a Design>,
    /// Told what is going on.
    pub progress: &'a (dyn Fn(&str) + Sync),
}

/// Identifies a case.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify(loaded: &Loaded, settings: &Settings) -> Result<Identified, IdentifyError> {
    let searched = matches!(settings.method, Method::OutputError | Method::NelderMead);
    if !searched && !loaded.case.with.is_empty() {
        return Err(IdentifyError::Effects { method: settings.method });
    }
    if !searched && settings.design.is_some() {
        return Err(IdentifyError::DesignMethod { method: settings.method });
    }
    let with: Vec<&str> = loaded.case.with.iter().map(String::as_str).collect();
    let plain = Model::of_case(&loaded.case, &with)?;
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
        train.iter().map(Run::len).sum::<usize>(),
        fitted.len()
    ));
    let mut found = match settings.method {
        Method::OutputError | Method::NelderMead => {
            let also = |first: &Start| effects.starts(first);
            by_simulation(&model, loaded, &nominal, train.clone(), fitted, &also, settings)?
        }
        Method::BreakAway => breakaway::found(&model, &nominal, &train)?,
        _ => by_regression(&model, &nominal, &train, &fitted, settings)?,
    };
    for j in led {
        found.notes.push(format!(
            "jointTorque[{}] is not recorded: the motor is led along its measured motion",
            j + 1
        ));
    }
    let mut found = finish(&model, &nominal, &train, &holdout, found, settings)?;
    if !with.is_empty() {
        (settings.progress)("the same without the effects, to compare with");
        let mut plain = loaded.clone();
        plain.case.with.clear();
        found.without = identify(&plain, &Settings { profile: false, design: None, ..*settings })?.fit;
    }
    Ok(found)
}

/// Identifies a case through an FMU, so that what is fitted is what is shipped; by output error or the simplex.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_fmu(
    loaded: &Loaded,
    mut model: FmuModel,
    settings: &Settings,
) -> Result<Identified, IdentifyError> {
    if !matches!(settings.method, Method::OutputError | Method::NelderMead) {
        return Err(IdentifyError::FmuMethod { method: settings.method });
    }
    model.choose(&loaded.case.parameters)?;
    let nominal = model.set(&model.defaults(), &loaded.case.parameters)?;
    let (train, holdout) = runs_of(&model, loaded)?;
    let fitted = unknowns::of(&model, &loaded.case, &nominal, &train, &[])?;
    (settings.progress)(&format!(
        "{} recordings, {} readings, {} parameters, through {}",
        train.len(),
        train.iter().map(Run::len).sum::<usize>(),
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
    model: &dyn Subject,
    nominal: &[f64],
    train: &[Run],
    holdout: &[Run],
    mut found: Identified,
    settings: &Settings,
) -> Result<Identified, IdentifyError> {
    (settings.progress)("comparing with recordings that were not fitted");
    found.held_out = !holdout.is_empty();
    let runs = if found.held_out { holdout } else { train };
    let mut read = runs.to_vec();
    for run in &mut read {
        found.sensors.iter().for_each(|(target, value)| run.calibrate(*target, *value));
    }
    found.compared = free_run(model, &found.values, &read)?;
    found.fit = figures(model, &found.compared);
    // What the owner believes may not even simulate.
    found.before = free_run(model, nominal, runs).map(|c| figures(model, &c)).unwrap_or_default();
    let names = |runs: &[Run]| runs.iter().map(|r| r.name.clone()).collect();
    found.names = [names(train), names(runs)];
    Ok(found)
}

/// Pooled by sample over recordings.
fn figures(model: &dyn Subject, compared: &[Comparison]) -> Vec<Figure> {
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
        Figure { channel: name.into(), nrmse: misfit.nrmse(), rms: misfit.rms(), unit }
    };
    names.into_iter().map(figure).collect()
}

fn found(model: &dyn Subject, nominal: &[f64], e: &Estimated, u: &Unknown) -> Found {
    let (unit, nominal) = match u.target {
        Target::Parameter(i) => (model.parameters()[i].unit, nominal[i]),
        Target::Offset(i) => (model.outputs()[i].unit, u.start),
        Target::Gain(_) | Target::InputGain(_) => ("1", u.start),
        Target::InputBias(i) | Target::InputOffset(i) => (model.inputs()[i].unit, u.start),
        Target::Delay(_) | Target::InputDelay(_) => ("s", u.start),
    };
    Found { estimate: e.clone(), unit, nominal, doubt: None }
}

fn by_regression(
    model: &Model,
    nominal: &[f64],
    train: &[Run],
    fitted: &[unknowns::Fitted],
    settings: &Settings,
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
        let mut estimate = Estimated {
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
            estimate = Estimated {
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
        parameters.push(Found { estimate, unit, nominal: nominal[index], doubt: None });
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
        sensors: Vec::new(),
        design: None,
    })
}
