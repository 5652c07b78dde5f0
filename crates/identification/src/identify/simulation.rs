//! Output error over a whole case: starts, outliers, noise of inputs, uncertainty; and the simplex on the same cost.

use nalgebra::DMatrix;
use trueup_signals::Loaded;

use super::error::IdentifyError;
use super::found::{FoundParameter, found};
use super::identified::{Identified, IdentifySettings};
use super::method::IdentifyMethod;
use super::searched::SearchableModel;
use super::starts::SearchStart;
use super::{design, forecast, kept, leverage, minima, starts, unknowns};
use crate::estimate::{EstimateSettings, assess};
use crate::fit::{
    ChannelComparison, FitOptions, OutputErrorFit, compare, fit, fit_carried, of_solution, refine,
};
use crate::lsq::{LeastSquares, Loss, Stop, solve};
use crate::nelder_mead::nelder_mead;
use crate::output_error::OutputError;
use crate::predict::PredictError;
use crate::recorded::nuisance;
use crate::run::IdentificationRun;
use crate::unknown::{FitTarget, FitUnknown};

/// Readings that differ from their neighbours by more than any noise: the residual less the median of the seven
/// about it, against 8 times the larger of noise and usual size of that.
fn outliers(c: &ChannelComparison) -> Vec<usize> {
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

/// Channels whose noise is not declared weigh by what the fit leaves.
fn undeclared(loaded: &Loaded, runs: &[IdentificationRun]) -> Vec<String> {
    let mut names: Vec<String> =
        runs.iter().flat_map(|r| r.channels.iter().map(|c| c.name.clone())).collect();
    names.sort();
    names.dedup();
    names.retain(|n| trueup_signals::noise::floor(loaded, n).is_none());
    names
}

/// Fits by simulation; `also` gives further starts, from the first one.
pub(super) fn by_simulation(
    model: &dyn SearchableModel,
    loaded: &Loaded,
    nominal: &[f64],
    mut train: Vec<IdentificationRun>,
    fitted: Vec<unknowns::CommonUnknown>,
    also: &dyn Fn(&SearchStart) -> Vec<SearchStart>,
    settings: &IdentifySettings,
) -> Result<Identified, IdentifyError> {
    let mut notes = Vec::new();
    let loss = Loss::Huber(4.0);
    let free = undeclared(loaded, &train);
    let shared: Vec<FitUnknown> = fitted.iter().map(|f| f.unknown.clone()).collect();
    // Before anything is fitted: what is requested may not be there.
    let varied =
        settings.design.map(|d| design::Varied::of(model, d, &shared).map(|v| (d, v))).transpose()?;
    let with_nuisance = |train: &[IdentificationRun]| {
        let mut all = shared.clone();
        all.extend(nuisance(model, nominal, train));
        all
    };
    forecast::tell(&OutputError::new(model, nominal, &train, with_nuisance(&train)), settings.progress);
    (settings.progress)("starts from regressions and from the case");
    let mut starts = model.starts(nominal, &train, &fitted);
    let further = starts.first().map_or_else(Vec::new, also);
    starts.extend(further);
    let coordinates = |problem: &OutputError| -> Vec<Vec<f64>> {
        starts.iter().map(|s| s.coordinates(problem.unknowns())).collect()
    };
    if !free.is_empty() {
        (settings.progress)("weighing channels whose noise is not declared");
        for _ in 0..2 {
            let problem = OutputError::new(model, nominal, &train, with_nuisance(&train));
            let options =
                FitOptions { starts: coordinates(&problem), loss, iterations: 25, ..FitOptions::default() };
            let rough = fit(&problem, &options)?;
            let worst = |name: &str| {
                let of = rough.comparisons.iter().filter(|c| c.channel == name);
                let (mut error, mut counted) = (0.0, 0.0);
                for c in of {
                    for ((t, p), m) in c.t.iter().zip(&c.predicted).zip(&c.measured) {
                        let weight = train[c.run].weight(*t);
                        error += weight * (p - m).powi(2);
                        counted += weight;
                    }
                }
                if counted > 0.0 { (error / counted).sqrt() } else { f64::NAN }
            };
            let left: Vec<f64> = free.iter().map(|name| worst(name)).collect();
            for c in train.iter_mut().flat_map(|r| &mut r.channels) {
                if let Some(k) = free.iter().position(|name| *name == c.name) {
                    c.sigma = left[k].max(1e-12 * c.sigma);
                }
            }
        }
        notes.push(format!(
            "noise of {} is not declared: weighed by what the fit leaves, so that it is not known whether the fit reaches the noise floor; declare noise or resolution under [channels]",
            free.join(", ")
        ));
    }
    (settings.progress)("output error");
    let (rough, spikes, wrong) = {
        let problem = OutputError::new(model, nominal, &train, with_nuisance(&train));
        let options = FitOptions { starts: coordinates(&problem), loss, ..FitOptions::default() };
        let mut rough = fit(&problem, &options)?;
        let again = model.again(problem.unknowns(), &rough);
        if again.len() > 1 && hopeless(&problem, &rough).is_none() {
            let options = FitOptions { starts: again, loss, ..FitOptions::default() };
            let lifted = fit(&problem, &options)?;
            if lifted.cost < rough.cost {
                rough = OutputErrorFit { origins: rough.origins, ..lifted };
            }
        }
        // Where the model is as wrong as that, the outliers are not the readings.
        let wrong = hopeless(&problem, &rough);
        let spikes: Vec<Vec<usize>> = rough
            .comparisons
            .iter()
            .map(|c| if wrong.is_some() { Vec::new() } else { outliers(c) })
            .collect();
        (rough, spikes, wrong)
    };
    for (c, spikes) in rough.comparisons.iter().zip(&spikes).filter(|(_, s)| !s.is_empty()) {
        let run = &mut train[c.run];
        notes.push(format!(
            "{}: outliers of {} left out: {}, the first at {} s",
            run.name,
            c.channel,
            spikes.len(),
            c.t[spikes[0]]
        ));
        if let Some(channel) = run.channels.iter_mut().find(|o| o.name == c.channel) {
            channel.leave_out(spikes);
        }
    }
    let mut problem = OutputError::new(model, nominal, &train, with_nuisance(&train));
    let (fit, iterations) = if settings.method == IdentifyMethod::NelderMead {
        (settings.progress)("downhill simplex");
        let begins = coordinates(&problem);
        let (theta, evaluations, shrunk) = simplex(&problem, &begins, shared.len(), loss, settings)?;
        if !shrunk {
            notes.push(format!(
                "the simplex has not shrunk after {evaluations} simulations: its estimate is not the best one; output-error takes a few dozen"
            ));
        }
        // Rank and curvature where the simplex ended, without moving from there.
        let options = FitOptions { starts: vec![theta], loss, iterations: 1, ..FitOptions::default() };
        (fit(&problem, &options)?, evaluations)
    } else if let Some(times) = wrong {
        notes.push(format!(
            "no values of these parameters reproduce the recordings: the residuals are {times:.0} times the noise. The search was cut short there; see `trueup diagnose` for what the model lacks"
        ));
        let iterations = rough.iterations;
        (rough, iterations)
    } else {
        (settings.progress)("weighing by the noise of the inputs");
        let options = FitOptions { starts: vec![rough.theta.clone()], loss, ..FitOptions::default() };
        let fit = fit_carried(&mut problem, &options)?;
        let iterations = fit.iterations + rough.iterations;
        (OutputErrorFit { origins: rough.origins, ..fit }, iterations)
    };
    let refined = if wrong.is_some() || settings.method == IdentifyMethod::NelderMead {
        None
    } else {
        refine(&problem, &fit.solution, loss)
    };
    let fit = match refined {
        Some((slack, finer)) => {
            problem.read_intervals(Some(slack));
            notes.push(format!(
                "readings of coarse sensors are treated as counts, with an error of {slack} counts before counting"
            ));
            of_solution(&problem, finer, loss, fit.origins)?
        }
        None => fit,
    };
    let searched = wrong.is_none() && settings.method != IdentifyMethod::NelderMead;
    let fit = if searched { minima::lowest(&problem, fit, shared.len(), loss, &mut notes)? } else { fit };
    let (fit, kept) = kept::of(&problem, fit, nominal, &shared, loss)?;
    (settings.progress)("uncertainty");
    let profile = if settings.profile && model.profiles() { (0..shared.len()).collect() } else { Vec::new() };
    let how = EstimateSettings { starts: Vec::new(), loss, profile, first_iterations: 0 };
    let mut e = assess(&problem, &fit.solution, &how);
    kept.iter().for_each(|k| k.said(&mut e.unknowns[k.unknown]));
    let noisy = problem.runs().iter().flat_map(|r| &r.drives).any(|d| d.sigma > 0.0);
    let uncarried = noisy && settings.method == IdentifyMethod::NelderMead && wrong.is_none();
    if uncarried {
        notes.push(
            "nelder-mead does not carry the noise of the inputs along: what it does to the motion is in no error, and lifts residuals above the noise floor; use output-error"
                .into(),
        );
    }
    for c in &e.channels {
        let name = &train[c.run].name;
        if wrong.is_none() && !uncarried && c.above_floor > 1.5 && !free.contains(&c.channel) {
            notes.push(format!(
                "{name}: {} is fitted {:.1} times above its noise floor: the model lacks something, see `trueup diagnose`; standard errors are widened for that, but do not include the bias of a wrong model",
                c.channel, c.above_floor
            ));
        }
    }
    if !fit.stop.converged() && settings.method != IdentifyMethod::NelderMead && wrong.is_none() {
        notes.push("the search ran out of iterations: the estimate may not be the best one".into());
    }
    let mut all: Vec<FoundParameter> =
        e.unknowns.iter().zip(problem.unknowns()).map(|(e, u)| found(model, nominal, e, u)).collect();
    for (f, fitted) in all.iter_mut().zip(&fitted) {
        f.doubt = fitted.doubt;
    }
    let own = all.split_off(shared.len());
    let designed = varied.map(|(d, v)| {
        (settings.progress)("what runs from other starts would identify");
        v.designed(model, d, &problem, &fit.theta, &all)
    });
    let designed = designed.transpose()?;
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
        model: model.title(),
        fmu: None,
        outputs: model.outputs().to_vec(),
        method: settings.method,
        parameters: parameters.into_iter().map(|(f, _)| f).collect(),
        uncertain: uncertain.into_iter().map(|(f, _)| f).collect(),
        nuisance,
        fit: Vec::new(),
        held_out: false,
        before: Vec::new(),
        without: Vec::new(),
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
            Stop::Cost => "the cost no longer falls",
            Stop::Step => "the parameters no longer move",
            Stop::Gradient => "the gradient is 0",
            Stop::Iterations if settings.method == IdentifyMethod::NelderMead => "the simplex stopped",
            Stop::Iterations => "out of iterations",
        },
        iterations,
        notes,
        values: problem.shared(&fit.theta),
        pack: None,
        sensors: (problem.unknowns().iter().zip(problem.values(&fit.theta)))
            .filter(|(u, _)| u.run.is_none() && !matches!(u.target, FitTarget::Parameter(_)))
            .map(|(u, value)| (u.target, value))
            .collect(),
        design: designed,
    })
}

/// Residuals so many times the noise are not worth the last iterations.
const HOPELESS: f64 = 50.0;

/// By how much residuals usually exceed the noise, that of the inputs included, whatever a few outliers do; `None` if
/// not by so much, or if it is not known.
fn hopeless(problem: &OutputError, fit: &OutputErrorFit) -> Option<f64> {
    let usual = |residuals: &[f64]| {
        let mut all: Vec<f64> = residuals[..problem.readings()].iter().map(|r| r.abs()).collect();
        let middle = all.len() / 2;
        (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745)
    };
    let far = |times: &f64| *times > HOPELESS;
    let times = usual(fit.solution.residuals.as_slice()).filter(far)?;
    if problem.runs().iter().all(|r| r.drives.iter().all(|d| d.sigma <= 0.0)) {
        return Some(times);
    }
    let mut weighed = problem.clone();
    if !weighed.carry_noise(&fit.theta).ok()? {
        return None;
    }
    let found = weighed.evaluate(&fit.theta, false).ok()?;
    usual(found.residuals.as_slice()).filter(far)
}

/// Simulations per parameter that the simplex may take.
const SIMPLEX: usize = 200;

/// The downhill simplex over the shared unknowns; what belongs to single recordings follows by least squares, from where
/// it was last. Whether it has shrunk, and its simulations.
fn simplex(
    problem: &OutputError,
    starts: &[Vec<f64>],
    shared: usize,
    loss: Loss,
    settings: &IdentifySettings,
) -> Result<(Vec<f64>, usize, bool), PredictError> {
    let (lower, upper) = problem.bounds_of();
    let own = problem.unknowns()[shared..].to_vec();
    let inner = |z: &[f64]| {
        let nominal = problem.shared(z);
        OutputError::new(problem.model(), &nominal, problem.runs(), own.clone())
    };
    let options =
        crate::lsq::SolverOptions { max_iterations: 3, cost_tolerance: 1e-4, loss, ..Default::default() };
    solve(&inner(&starts[0][..shared]), &starts[0][shared..], options)?;
    let (mut best, mut at, mut done) = (f64::INFINITY, starts[0][shared..].to_vec(), 0usize);
    let mut price = |z: &[f64]| {
        done += 1;
        if done % 50 == 0 {
            (settings.progress)(&format!("{done} simulations, cost {best:.6e}"));
        }
        let Ok(s) = solve(&inner(z), &at, options) else { return f64::INFINITY };
        if s.cost < best {
            (best, at) = (s.cost, s.x);
        }
        s.cost
    };
    let most = SIMPLEX * shared;
    let prices: Vec<f64> = starts.iter().map(|s| price(&s[..shared])).collect();
    let first = (0..prices.len()).min_by(|a, b| prices[*a].total_cmp(&prices[*b])).unwrap_or(0);
    let z = &starts[first][..shared];
    let s = nelder_mead(&mut price, z, &vec![0.3; shared], &lower[..shared], &upper[..shared], 1e-4, most);
    let last = solve(&inner(&s.x), &at, crate::lsq::SolverOptions { loss, ..Default::default() })?;
    Ok(([s.x, last.x].concat(), s.evaluations, s.converged))
}
