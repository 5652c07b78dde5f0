//! A case from its recordings to its parameters: what `trueup identify` does.

mod leverage;
mod starts;
mod unknowns;

use std::fmt;
use std::str::FromStr;

use nalgebra::DMatrix;
use trueup_signals::Loaded;
use trueup_signals::process::Misfit;

use crate::estimate::{ChannelFit, Estimated, Settings as EstimateSettings, assess};
use crate::fit::{Comparison, FitOptions, compare, fit_carried, free_run};
use crate::lsq::{Loss, Problem, solve};
use crate::model::{Model, ModelError};
use crate::nelder_mead::nelder_mead;
use crate::output_error::OutputError;
use crate::predict::PredictError;
use crate::recorded::{RecordedError, led, nuisance, runs};
use crate::regress::{RegressError, Regressed};
use crate::run::Run;
use crate::unknown::Unknown;

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
}

/// Names as on the command line.
pub const METHODS: [(&str, Method); 6] = [
    ("ls-literal", Method::LsLiteral),
    ("ls", Method::Ls),
    ("filtered", Method::Filtered),
    ("iv", Method::Iv),
    ("output-error", Method::OutputError),
    ("nelder-mead", Method::NelderMead),
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
    /// The model.
    pub model: Model,
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
}

/// What to do.
pub struct Settings<'a> {
    /// How.
    pub method: Method,
    /// Intervals by profile likelihood; else from standard errors.
    pub profile: bool,
    /// Told what is going on.
    pub progress: &'a (dyn Fn(&str) + Sync),
}

/// Identifies a case.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify(loaded: &Loaded, settings: &Settings) -> Result<Identified, IdentifyError> {
    let plain = Model::of_case(&loaded.case, &[])?;
    let led = led(&plain, &[loaded.train(), loaded.holdout()].concat());
    let model = plain.with_led(&led)?;
    let nominal = model.set(&model.defaults(), &loaded.case.parameters)?;
    let (train, holdout) = runs(&model, loaded)?;
    let fitted = unknowns::of(&model, &loaded.case, &nominal, &train)?;
    (settings.progress)(&format!(
        "{} recordings, {} readings, {} parameters",
        train.len(),
        train.iter().map(Run::len).sum::<usize>(),
        fitted.len()
    ));
    let mut found = match settings.method {
        Method::OutputError | Method::NelderMead => {
            by_simulation(&model, loaded, &nominal, train.clone(), fitted, settings)?
        }
        _ => by_regression(&model, &nominal, &train, &fitted, settings)?,
    };
    (settings.progress)("comparing with recordings that were not fitted");
    for j in led {
        found.notes.push(format!(
            "jointTorque[{}] is not recorded: the motor is led along its measured motion",
            j + 1
        ));
    }
    found.held_out = !holdout.is_empty();
    let runs = if found.held_out { &holdout } else { &train };
    found.compared = free_run(&model, &found.values, runs)?;
    found.fit = figures(&model, &found.compared);
    // What the owner believes may not even simulate.
    found.before = free_run(&model, &nominal, runs).map(|c| figures(&model, &c)).unwrap_or_default();
    let names = |runs: &[Run]| runs.iter().map(|r| r.name.clone()).collect();
    found.names = [names(&train), names(runs)];
    Ok(found)
}

/// Pooled by sample over recordings.
fn figures(model: &Model, compared: &[Comparison]) -> Vec<Figure> {
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

/// Readings that stand out from their neighbours by more than any noise: the residual less the median of the seven
/// about it, against 8 times the larger of noise and usual size of that.
fn outliers(c: &Comparison) -> Vec<usize> {
    let n = c.whitened.len();
    if n < 20 {
        return Vec::new();
    }
    let median = |mut v: Vec<f64>| {
        let middle = v.len() / 2;
        *v.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let alone: Vec<f64> = (0..n)
        .map(|k| {
            let begin = k.saturating_sub(3).min(n - 7);
            (c.whitened[k] - median(c.whitened[begin..begin + 7].to_vec())).abs()
        })
        .collect();
    let usual = median(alone.clone()) / 0.6745;
    let found: Vec<usize> = (0..n).filter(|k| alone[*k] > 8.0 * usual.max(1.0)).collect();
    // What happens all the time is no outlier.
    if found.len() * 20 > n { Vec::new() } else { found }
}

/// Channels whose noise nobody has declared weigh by what the fit leaves.
fn undeclared(loaded: &Loaded, runs: &[Run]) -> Vec<String> {
    let mut names: Vec<String> =
        runs.iter().flat_map(|r| r.channels.iter().map(|c| c.name.clone())).collect();
    names.sort();
    names.dedup();
    names.retain(|n| trueup_signals::noise::floor(loaded, n).is_none());
    names
}

fn by_simulation(
    model: &Model,
    loaded: &Loaded,
    nominal: &[f64],
    mut train: Vec<Run>,
    fitted: Vec<unknowns::Fitted>,
    settings: &Settings,
) -> Result<Identified, IdentifyError> {
    let mut notes = Vec::new();
    let loss = Loss::Huber(4.0);
    let free = undeclared(loaded, &train);
    let shared: Vec<Unknown> = fitted.iter().map(|f| f.unknown.clone()).collect();
    let with_nuisance = |train: &[Run]| {
        let mut all = shared.clone();
        all.extend(nuisance(model, nominal, train));
        all
    };
    (settings.progress)("starts from regressions and from the case");
    let starts = starts::find(model, nominal, &train, &fitted);
    let coordinates = |problem: &OutputError<Model>| -> Vec<Vec<f64>> {
        starts.iter().map(|s| s.coordinates(problem.unknowns())).collect()
    };
    if !free.is_empty() {
        (settings.progress)("weighing channels whose noise is not declared");
        for _ in 0..2 {
            let problem = OutputError::new(model, nominal, &train, with_nuisance(&train));
            let options =
                FitOptions { starts: coordinates(&problem), loss, iterations: 25, ..FitOptions::default() };
            let rough = crate::fit::fit(&problem, &options)?;
            let worst = |name: &str| {
                let of = rough.comparisons.iter().filter(|c| c.channel == name);
                let mut misfit = Misfit::default();
                of.for_each(|c| misfit.add(&c.predicted, &c.measured));
                misfit.rms()
            };
            for c in train.iter_mut().flat_map(|r| &mut r.channels).filter(|c| free.contains(&c.name)) {
                c.sigma = worst(&c.name).max(1e-12 * c.sigma);
            }
        }
        notes.push(format!(
            "noise of {} is not declared: weighed by what the fit leaves, so that it cannot be said whether the fit reaches the noise floor; declare noise or resolution under [channels]",
            free.join(", ")
        ));
    }
    (settings.progress)("output error");
    let (rough, spikes) = {
        let problem = OutputError::new(model, nominal, &train, with_nuisance(&train));
        let options = FitOptions { starts: coordinates(&problem), loss, ..FitOptions::default() };
        let mut rough = crate::fit::fit(&problem, &options)?;
        let again = starts::above_coulomb(model, problem.unknowns(), &rough);
        if again.len() > 1 {
            let options = FitOptions { starts: again, loss, ..FitOptions::default() };
            let lifted = crate::fit::fit(&problem, &options)?;
            if lifted.cost < rough.cost {
                rough = crate::fit::Fit { start: rough.start, start_costs: rough.start_costs, ..lifted };
            }
        }
        let spikes = rough.comparisons.iter().map(outliers).collect::<Vec<_>>();
        (rough, spikes)
    };
    for (c, spikes) in rough.comparisons.iter().zip(&spikes).filter(|(_, s)| !s.is_empty()) {
        let run = &mut train[c.run];
        notes.push(format!(
            "{}: {} readings of {} are left out as outliers, the first at {} s",
            run.name,
            spikes.len(),
            c.channel,
            c.t[spikes[0]]
        ));
        if let Some(channel) = run.channels.iter_mut().find(|o| o.name == c.channel) {
            channel.leave_out(spikes);
        }
    }
    let mut problem = OutputError::new(model, nominal, &train, with_nuisance(&train));
    let (fit, iterations) = if settings.method == Method::NelderMead {
        (settings.progress)("downhill simplex");
        let (theta, evaluations) = simplex(&problem, &coordinates(&problem)[0], shared.len(), loss)?;
        // Rank and curvature where the simplex ended, without moving from there.
        let options = FitOptions { starts: vec![theta], loss, iterations: 1, ..FitOptions::default() };
        (crate::fit::fit(&problem, &options)?, evaluations)
    } else {
        (settings.progress)("weighing by the noise of the inputs");
        let options = FitOptions { starts: vec![rough.theta.clone()], loss, ..FitOptions::default() };
        let fit = fit_carried(&mut problem, &options)?;
        let iterations = fit.iterations + rough.iterations;
        (crate::fit::Fit { start: rough.start, start_costs: rough.start_costs, ..fit }, iterations)
    };
    (settings.progress)("uncertainty");
    let profile = if settings.profile { (0..shared.len()).collect() } else { Vec::new() };
    let how = EstimateSettings { starts: Vec::new(), loss, profile, first_iterations: 0 };
    let e = assess(&problem, &fit.solution, &how);
    for c in &e.channels {
        let name = &train[c.run].name;
        if c.above_floor > 1.5 && !free.contains(&c.channel) {
            notes.push(format!(
                "{name}: {} is fitted {:.1} times above its noise floor: the model lacks something, see `trueup diagnose`; errors are widened for that, but do not hold what a wrong model does",
                c.channel, c.above_floor
            ));
        }
    }
    if !fit.stop.converged() {
        notes.push("the search ran out of iterations: the estimate may not be the best one".into());
    }
    let mut all: Vec<Found> =
        e.unknowns.iter().zip(problem.unknowns()).map(|(e, u)| found(model, nominal, e, u)).collect();
    for (f, fitted) in all.iter_mut().zip(&fitted) {
        f.doubt = fitted.doubt;
    }
    let own = all.split_off(shared.len());
    let (parameters, uncertain): (Vec<_>, Vec<_>) =
        all.into_iter().zip(&fitted).partition(|(_, f)| f.asked_for);
    let nuisance = (train.iter().enumerate())
        .map(|(r, run)| {
            let of = own.iter().filter(|f| f.estimate.run == Some(r)).cloned();
            (run.name.clone(), of.collect())
        })
        .collect();
    let order: Vec<usize> = (0..fitted.len())
        .filter(|&i| fitted[i].asked_for)
        .chain((0..fitted.len()).filter(|&i| !fitted[i].asked_for))
        .collect();
    let leverage = leverage::of(model, nominal, &problem, &fit, &order);
    Ok(Identified {
        model: model.clone(),
        method: settings.method,
        parameters: parameters.into_iter().map(|(f, _)| f).collect(),
        uncertain: uncertain.into_iter().map(|(f, _)| f).collect(),
        nuisance,
        fit: Vec::new(),
        held_out: false,
        before: Vec::new(),
        training: compare(&problem, &fit.theta)?,
        channels: e.channels,
        compared: Vec::new(),
        names: Default::default(),
        correlation: DMatrix::from_fn(order.len(), order.len(), |i, j| e.correlation[(order[i], order[j])]),
        rank: (e.rank, problem.unknowns().len()),
        condition: e.condition,
        leverage,
        starts: starts::outcome(starts, &fit),
        stop: match fit.stop {
            crate::lsq::Stop::Cost => "the cost no longer falls",
            crate::lsq::Stop::Step => "the parameters no longer move",
            crate::lsq::Stop::Gradient => "the gradient is 0",
            crate::lsq::Stop::Iterations if settings.method == Method::NelderMead => "the simplex has shrunk",
            crate::lsq::Stop::Iterations => "out of iterations",
        },
        iterations,
        notes,
        values: problem.shared(&fit.theta),
    })
}

fn found(model: &Model, nominal: &[f64], e: &Estimated, u: &Unknown) -> Found {
    use crate::unknown::Target;
    let (unit, nominal) = match u.target {
        Target::Parameter(i) => (model.parameters()[i].unit, nominal[i]),
        Target::Offset(i) => (model.outputs()[i].unit, 0.0),
        Target::InputGain(_) => ("1", 1.0),
        Target::InputBias(i) | Target::InputOffset(i) => (model.inputs()[i].unit, 0.0),
    };
    Found { estimate: e.clone(), unit, nominal, doubt: None }
}

/// The downhill simplex over the shared unknowns; what belongs to single recordings follows by least squares.
fn simplex(
    problem: &OutputError<Model>,
    start: &[f64],
    shared: usize,
    loss: Loss,
) -> Result<(Vec<f64>, usize), PredictError> {
    struct Inner<'a>(&'a OutputError<'a, Model>, Vec<f64>);
    impl Problem for Inner<'_> {
        type Error = PredictError;
        fn evaluate(&self, x: &[f64], jacobian: bool) -> Result<crate::lsq::Evaluation, PredictError> {
            let mut e = self.0.evaluate(x, jacobian)?;
            if let Some(j) = &mut e.jacobian {
                (0..self.1.len()).for_each(|k| j.column_mut(k).fill(0.0));
            }
            Ok(e)
        }
        fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
            let (mut lower, mut upper) = self.0.bounds();
            lower[..self.1.len()].copy_from_slice(&self.1);
            upper[..self.1.len()].copy_from_slice(&self.1);
            (lower, upper)
        }
    }
    let (lower, upper) = problem.bounds();
    problem.evaluate(start, false)?;
    let mut own = start[shared..].to_vec();
    let options = crate::lsq::Options { max_iterations: 4, loss, ..Default::default() };
    let mut best = f64::INFINITY;
    let mut price = |z: &[f64]| {
        let at = [z, &own].concat();
        let Ok(s) = solve(&Inner(problem, z.to_vec()), &at, options) else { return f64::INFINITY };
        if s.cost < best {
            best = s.cost;
            own = s.x[shared..].to_vec();
        }
        s.cost
    };
    let steps = vec![0.3; shared];
    let s = nelder_mead(&mut price, &start[..shared], &steps, &lower[..shared], &upper[..shared], 1e-5, 1500);
    let at = [&s.x[..], &own].concat();
    let last = solve(&Inner(problem, s.x.clone()), &at, crate::lsq::Options { loss, ..Default::default() })?;
    Ok((last.x, s.evaluations))
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
        model: model.clone(),
        method: settings.method,
        parameters,
        uncertain: Vec::new(),
        nuisance: train.iter().map(|r| (r.name.clone(), Vec::new())).collect(),
        fit: Vec::new(),
        held_out: false,
        before: Vec::new(),
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
    })
}
