//! A fit as another program can use it: cost, whitened residuals with their times, Jacobian, covariance, and a
//! free-running prediction of recordings that were not fitted.

use crate::parallel;
use nalgebra::DMatrix;
use trueup_signals::process::{nrmse, rms};

use crate::covariance::Information;
use crate::interval::SLACKS;
use crate::lsq::{LeastSquares, Loss, Solution, SolverOptions, Stop, solve};
use crate::output_error::OutputError;
use crate::predict::PredictError;
use crate::recorded::nuisance;
use crate::run::IdentificationRun;
use crate::subject::IdentificationSubject;
use crate::unknown::FitTarget;

/// How to fit.
#[derive(Clone, Debug)]
pub struct FitOptions {
    /// Coordinates to start from; empty: the unknowns' own.
    pub starts: Vec<Vec<f64>>,
    /// What residuals cost in the end.
    pub loss: Loss,
    /// Iterations per start while the best is searched (with several starts).
    pub first_iterations: usize,
    /// Iterations of the last stage.
    pub iterations: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self { starts: Vec::new(), loss: Loss::Squares, first_iterations: 15, iterations: 60 }
    }
}

/// One channel of one recording against its simulation.
#[derive(Clone, Debug)]
pub struct ChannelComparison {
    /// Recording, by index.
    pub run: usize,
    /// FMU variable.
    pub channel: String,
    /// Times of the readings, s.
    pub t: Vec<f64>,
    /// Readings.
    pub measured: Vec<f64>,
    /// Simulated readings, offsets and delay included.
    pub predicted: Vec<f64>,
    /// (predicted - measured) / standard deviation of the reading; where inputs are noisy and that is carried
    /// ([`OutputError::carry_noise`]), whitened by their common covariance.
    pub whitened: Vec<f64>,
    /// Where `whitened` begins among the rows of the Jacobian.
    pub row: usize,
}

impl ChannelComparison {
    /// Root mean square of the residual over that of the readings about their mean; `None` for a channel without
    /// variation.
    pub fn nrmse(&self) -> Option<f64> {
        nrmse(&self.predicted, &self.measured)
    }
    /// Root mean square of the whitened residual: 1 at the noise floor.
    pub fn above_floor(&self) -> f64 {
        rms(&self.whitened)
    }
}

/// A fit.
#[derive(Clone, Debug)]
pub struct OutputErrorFit {
    /// Coordinates of the solution ([`crate::unknown::Scale`]), one per unknown.
    pub theta: Vec<f64>,
    /// Values of the unknowns.
    pub values: Vec<f64>,
    /// All parameters of the model with the shared unknowns in place; those of a single recording as before.
    pub parameters: Vec<f64>,
    /// Half the sum of the (robust) squares of the whitened residuals, priors included.
    pub cost: f64,
    /// Channel by channel, recording by recording.
    pub comparisons: Vec<ChannelComparison>,
    /// d(whitened residual) / d(theta): rows as the comparisons say, then those of the priors.
    pub jacobian: DMatrix<f64>,
    /// (J^T J)^+ in theta, its rank and condition.
    pub information: Information,
    /// Which starts were tried, and the result of each.
    pub origins: Origins,
    /// Iterations of the last stage.
    pub iterations: usize,
    /// How it ended.
    pub stop: Stop,
    /// Residuals and more, as the solver left them.
    pub solution: Solution,
}

/// Starts of a search and what the first stage, whose loss forgives what is far off, made of them. Of one start alone
/// there was no first stage.
#[derive(Clone, Debug, Default)]
pub struct Origins {
    /// The one that ended at the solution.
    pub start: usize,
    /// Cost of each; infinite where the model could not be simulated.
    pub costs: Vec<f64>,
    /// Coordinates where each ended; empty where the model could not be simulated.
    pub ends: Vec<Vec<f64>>,
}

/// The solution from the best of several starts.
///
/// # Errors
/// If the model can be simulated from none of them.
pub fn search(problem: &OutputError, options: &FitOptions) -> Result<(Solution, Origins), PredictError> {
    let first = SolverOptions {
        max_iterations: options.first_iterations,
        cost_tolerance: 1e-3,
        loss: Loss::SoftL1(3.0),
        ..SolverOptions::default()
    };
    let tried: Vec<Result<Solution, PredictError>> = if options.starts.len() < 2 {
        Vec::new()
    } else {
        parallel::map(&options.starts, |s| solve(problem, s, first))
    };
    let costs: Vec<f64> = tried.iter().map(|r| r.as_ref().map_or(f64::INFINITY, |s| s.cost)).collect();
    let best = (0..tried.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
    let ends = tried.iter().map(|r| r.as_ref().map_or_else(|_| Vec::new(), |s| s.x.clone())).collect();
    let begin = match tried.into_iter().nth(best) {
        Some(found) => found?.x,
        None => options.starts.first().cloned().unwrap_or_else(|| problem.start()),
    };
    let last =
        SolverOptions { loss: options.loss, max_iterations: options.iterations, ..SolverOptions::default() };
    Ok((solve(problem, &begin, last)?, Origins { start: best, costs, ends }))
}

/// How many times the noise the readings miss, at least 1: of a wrong model chance is that much larger.
pub(crate) fn misfit(problem: &OutputError, found: &Solution) -> f64 {
    rms(&found.residuals.as_slice()[..problem.readings()]).max(1.0)
}

/// Fits a problem.
///
/// # Errors
/// If the model can be simulated from none of the starts.
pub fn fit(problem: &OutputError, options: &FitOptions) -> Result<OutputErrorFit, PredictError> {
    let (solution, origins) = search(problem, options)?;
    of_solution(problem, solution, options.loss, origins)
}

/// All that there is to say of a solution.
pub(crate) fn of_solution(
    problem: &OutputError,
    solution: Solution,
    loss: Loss,
    origins: Origins,
) -> Result<OutputErrorFit, PredictError> {
    let theta = solution.x.clone();
    Ok(OutputErrorFit {
        values: problem.values(&theta),
        parameters: problem.shared(&theta),
        cost: solution.cost,
        comparisons: compare(problem, &theta)?,
        jacobian: solution.jacobian.clone(),
        information: Information::weighed(&solution.residuals, &solution.jacobian, loss),
        origins,
        iterations: solution.iterations,
        stop: solution.stop,
        theta,
        solution,
    })
}

/// Residuals up to so many times the noise let a reading be treated as a count.
const INTERVAL_MISFIT: f64 = 1.3;
/// Residuals that are this many times the noise come from a wrong model; noise of inputs is then of no account.
pub(crate) const MODEL_ERROR: f64 = 5.0;

/// Fits a problem whose measured inputs are noisy: a first fit as if they were not, then fits weighed by what their noise
/// does along the motion found ([`OutputError::carry_noise`]). Without noisy inputs, or where the model is so wrong that
/// noise explains little, the same as [`fit`].
///
/// # Errors
/// As [`fit`].
pub fn fit_carried(problem: &mut OutputError, options: &FitOptions) -> Result<OutputErrorFit, PredictError> {
    let first = fit(problem, options)?;
    if problem.runs().iter().all(|r| r.drives.iter().all(|d| d.sigma <= 0.0)) {
        return Ok(first);
    }
    if !problem.carry_noise(&first.theta)? {
        return Ok(first);
    }
    let halfway = FitOptions {
        starts: vec![first.theta.clone()],
        iterations: options.iterations / 2,
        ..options.clone()
    };
    let middle = fit(problem, &halfway)?;
    if rms(&middle.solution.residuals.as_slice()[..problem.readings()]) > MODEL_ERROR {
        problem.forget_noise();
        return Ok(first);
    }
    problem.carry_noise(&middle.theta)?;
    let last = fit(problem, &FitOptions { starts: vec![middle.theta], ..options.clone() })?;
    Ok(OutputErrorFit { origins: first.origins, ..last })
}

/// From a solution with normal errors on to one that takes the readings of counting sensors as intervals
/// ([`OutputError::read_intervals`]), the slack made smaller for as long as that makes the recordings more likely. `None`:
/// nothing counts, the model is not as right as that, or normal errors explain the readings better.
pub fn refine(problem: &OutputError, found: &Solution, loss: Loss) -> Option<(f64, Solution)> {
    let counting = problem.runs().iter().flat_map(|r| &r.channels).any(crate::run::OutputChannel::counts);
    let carried = (0..problem.runs().len()).any(|r| problem.carried(r).is_some());
    let misfit = rms(&found.residuals.as_slice()[..problem.readings()]);
    if !counting || carried || misfit > INTERVAL_MISFIT {
        return None;
    }
    let mut at = found.x.clone();
    let normal = found.cost + problem.constant();
    let mut best: Option<(f64, f64, Solution)> = None;
    let mut problem = problem.clone();
    for slack in SLACKS {
        problem.read_intervals(Some(slack));
        let options =
            SolverOptions { loss, max_iterations: 30, cost_tolerance: 1e-7, ..SolverOptions::default() };
        let Ok(s) = solve(&problem, &at, options) else { break };
        let surprise = s.cost + problem.constant();
        if best.as_ref().is_some_and(|b| b.1 <= surprise) {
            break;
        }
        at = s.x.clone();
        best = Some((slack, surprise, s));
    }
    best.filter(|b| b.1 < normal).map(|(slack, _, s)| (slack, s))
}

/// All channels of all recordings against their simulation at `theta`, without fitting.
///
/// # Errors
/// See [`PredictError`].
pub fn compare(problem: &OutputError, theta: &[f64]) -> Result<Vec<ChannelComparison>, PredictError> {
    let mut all: Vec<ChannelComparison> = Vec::new();
    for (r, run) in problem.runs().iter().enumerate() {
        let found = problem.predict(r, theta)?;
        let (mut together, first) = (Vec::new(), all.len());
        for (c, channel) in run.channels.iter().enumerate() {
            let range = problem.plans()[r].channels()[c]..problem.plans()[r].channels()[c + 1];
            let row = problem.residuals_of(r).start + range.start;
            let predicted = found[range].to_vec();
            let scaled = predicted.iter().zip(&channel.y).enumerate();
            together.extend(scaled.map(|(k, (p, y))| (p - y) / channel.deviation(k)));
            all.push(ChannelComparison {
                run: r,
                channel: channel.name.clone(),
                t: channel.t.clone(),
                measured: channel.y.clone(),
                predicted,
                whitened: Vec::new(),
                row,
            });
        }
        problem.whiten(r, &mut together);
        let begin = problem.residuals_of(r).start;
        for c in &mut all[first..] {
            c.whitened = together[c.row - begin..][..c.t.len()].to_vec();
        }
    }
    Ok(all)
}

/// Free-running simulation of recordings with the parameters `values`: only how each begins, and the offsets that are to
/// be estimated, are fitted, each recording for itself.
///
/// # Errors
/// See [`PredictError`].
pub fn free_run(
    model: &dyn IdentificationSubject,
    values: &[f64],
    runs: &[IdentificationRun],
) -> Result<Vec<ChannelComparison>, PredictError> {
    let one = |(r, run): (usize, &IdentificationRun)| {
        let alone = std::slice::from_ref(run);
        let problem = OutputError::new(model, values, alone, nuisance(model, values, alone));
        // Begun at rest or as the first readings say: a wrong one may stick where the other slides.
        let (start, mut rest) = (problem.start(), problem.start());
        let rates = problem.unknowns().iter().enumerate();
        rates
            .filter(|(_, u)| match u.target {
                FitTarget::Parameter(i) => model.is_velocity(model.parameters(), i),
                FitTarget::Offset(i) => model.is_velocity(model.outputs(), i),
                _ => false,
            })
            .for_each(|(k, _)| rest[k] = 0.0);
        // A simulation far off must not bend its beginning.
        let options = FitOptions {
            starts: vec![start, rest],
            loss: Loss::SoftL1(3.0),
            iterations: 30,
            ..FitOptions::default()
        };
        let (found, ..) = search(&problem, &options)?;
        let mut all = compare(&problem, &found.x)?;
        all.iter_mut().for_each(|c| c.run = r);
        Ok(all)
    };
    let all: Vec<Result<Vec<ChannelComparison>, PredictError>> = parallel::map(runs.iter().enumerate(), one);
    Ok(all.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
}

/// Cost of a problem at `theta`: half the sum of the (robust) squares, priors included.
///
/// # Errors
/// See [`PredictError`].
pub fn cost(problem: &OutputError, theta: &[f64], loss: Loss) -> Result<f64, PredictError> {
    let e = problem.evaluate(theta, false)?;
    Ok(0.5 * e.residuals.iter().map(|r| loss.cost(*r)).sum::<f64>())
}
