//! From a problem to estimates with their uncertainty.
//!
//! *Starts*: each is minimised with a loss that forgives what is far off, the best one is then fitted to the end.
//! *Counts*: readings of coarse sensors are taken as intervals wherever that makes the recordings more likely.
//! *Standard errors*: (J^T J)^-1 if readings err independently. Quantisation errors do not (a slow sensor repeats itself, a
//! sampled one beats), nor do those of a wrong model: [`crate::scatter`].
//! *Intervals*: profile likelihood: where the least cost with the unknown held fixed has risen by half of the chi-square
//! quantile, times the ratio of the two variances.

use crate::parallel;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use trueup_signals::process::rms;

use crate::covariance::{Information, correlation};
use crate::fit::{FitOptions, refine, search};
use crate::lsq::{LeastSquares, Loss, ResidualEvaluation, Solution, SolverOptions, Stop, solve};
use crate::output_error::OutputError;
use crate::predict::PredictError;
use crate::run::OutputChannel;
use crate::scatter::{as_normal, scatter};
use trueup_numerics::order::descending;

/// Half the 95 % quantile of chi-square with one degree of freedom, as a standard deviation.
pub(crate) const Z95: f64 = 1.959_963_984_540_054;
/// An unknown whose standard error (of its logarithm, or in units of its magnitude) is larger counts as not given.
const HOPELESS: f64 = 1.0;

/// How to estimate.
#[derive(Clone, Debug)]
pub struct EstimateSettings {
    /// Coordinates to start from; at least one.
    pub starts: Vec<Vec<f64>>,
    /// What residuals cost in the end.
    pub loss: Loss,
    /// Profile-likelihood intervals of these unknowns (by index); of others from the standard errors.
    pub profile: Vec<usize>,
    /// Iterations per start while the best is searched.
    pub first_iterations: usize,
}

/// An estimate of one unknown.
#[derive(Clone, Debug)]
pub struct ParameterEstimate {
    /// Name of the unknown.
    pub name: String,
    /// Recording that it belongs to, by index.
    pub run: Option<usize>,
    /// Value.
    pub value: f64,
    /// Its standard error; `None`: the data do not give it.
    pub standard_error: Option<f64>,
    /// The Cramer-Rao bound at the estimate (priors included) if readings had independent normal errors. Counts whose edges
    /// are read can know more.
    pub cramer_rao: Option<f64>,
    /// 95 % interval; an open end is `None`.
    pub ci95: [Option<f64>; 2],
    /// Why there is no standard error, or why it is doubtful.
    pub reason: Option<String>,
}

/// How a channel of a recording was fitted.
#[derive(Clone, Debug)]
pub struct ChannelFit {
    /// Recording, by index.
    pub run: usize,
    /// FMU variable.
    pub channel: String,
    /// Root mean square of the residuals over their standard deviation: 1 at the noise floor.
    pub above_floor: f64,
    /// Correlation of neighbouring residuals.
    pub lag1: f64,
    /// Probability that white residuals would be as correlated as these (Ljung and Box 1978, 20 lags).
    pub whiteness: f64,
}

/// The whole result of a fit.
#[derive(Clone, Debug)]
pub struct FitEstimate {
    /// One per unknown.
    pub unknowns: Vec<ParameterEstimate>,
    /// Their correlation.
    pub correlation: DMatrix<f64>,
    /// How many directions the data determine.
    pub rank: usize,
    /// Condition number of the scaled Jacobian.
    pub condition: f64,
    /// Coordinates of the solution.
    pub theta: Vec<f64>,
    /// Half the weighted sum of squares (robust cost).
    pub cost: f64,
    /// The start that ended there.
    pub start: usize,
    /// Cost after the first stage of each start; infinite where the model could not be simulated.
    pub start_costs: Vec<f64>,
    /// Iterations of the last stage.
    pub iterations: usize,
    /// How it ended.
    pub stop: Stop,
    /// Channel by channel.
    pub channels: Vec<ChannelFit>,
}

/// Estimates the unknowns of a problem.
///
/// # Errors
/// If the model can be simulated from none of the starts.
pub fn estimate(problem: &OutputError, settings: &EstimateSettings) -> Result<FitEstimate, PredictError> {
    let options = FitOptions {
        starts: settings.starts.clone(),
        loss: settings.loss,
        first_iterations: settings.first_iterations,
        ..FitOptions::default()
    };
    let (found, origins) = search(problem, &options)?;
    let mut e = match refine(problem, &found, settings.loss) {
        Some((slack, finer)) => {
            let mut problem = problem.clone();
            problem.read_intervals(Some(slack));
            assess(&problem, &finer, settings)
        }
        None => assess(problem, &found, settings),
    };
    (e.start, e.start_costs) = (origins.start, origins.costs);
    Ok(e)
}

/// The uncertainty of a solution that [`search`] found.
pub fn assess(problem: &OutputError, found: &Solution, settings: &EstimateSettings) -> FitEstimate {
    let unknowns = problem.unknowns();
    let n = unknowns.len();
    let information = Information::weighed(&found.residuals, &found.jacobian, settings.loss);
    // As if readings had normal errors, each its own.
    let normal = as_normal(problem, found);
    let independent = Information::weighed(&normal.residuals, &normal.jacobian, settings.loss);
    let robust = scatter(problem, found, &information, &normal, settings.loss);
    // Residuals of a few hundred samples underrate their own correlation; counts do not.
    let counts = |r: usize| {
        problem.carried(r).is_none() && problem.runs()[r].channels.iter().all(OutputChannel::counts)
    };
    let least = match (0..problem.runs().len()).all(counts) {
        true if problem.reads_intervals() => 0.0,
        true => 0.1,
        false => 1.0,
    };
    let inflation: Vec<f64> = (0..n)
        .map(|k| (robust[(k, k)] / information.covariance[(k, k)].max(f64::MIN_POSITIVE)).max(least))
        .collect();
    // Of a wrong model the likelihood is no measure.
    let readings = problem.readings();
    let wrong = rms(&found.residuals.as_slice()[..readings]) > 5.0;
    let estimates = parallel::map(0..n, |k| {
        let u = &unknowns[k];
        let (value, slope) = u.scale.value(found.x[k]);
        let se = (information.covariance[(k, k)].max(0.0) * inflation[k]).sqrt();
        let reason = why_not(problem, found, &information, k, se);
        let given = reason.is_none();
        let wald = |sign: f64| Some(u.scale.value(found.x[k] + sign * Z95 * se).0);
        let ci95 = if !given && found.at_bound[k] == 0 && !information.determines(k) {
            [None, None]
        } else if settings.profile.contains(&k) && !wrong {
            [-1.0, 1.0]
                .map(|sign| profile(problem, found, &information, k, sign, se, inflation[k], settings.loss))
        } else {
            [wald(-1.0), wald(1.0)]
        };
        ParameterEstimate {
            name: u.name.clone(),
            run: u.run,
            value,
            standard_error: given.then_some(se * slope),
            cramer_rao: given.then_some(independent.covariance[(k, k)].max(0.0).sqrt() * slope),
            ci95,
            reason,
        }
    });
    FitEstimate {
        unknowns: estimates,
        correlation: correlation(&information.covariance),
        rank: information.rank,
        condition: information.condition,
        theta: found.x.clone(),
        cost: found.cost,
        start: 0,
        start_costs: Vec::new(),
        iterations: found.iterations,
        stop: found.stop,
        channels: channels(problem, &normal.residuals),
    }
}

fn why_not(
    problem: &OutputError,
    found: &Solution,
    information: &Information,
    k: usize,
    se: f64,
) -> Option<String> {
    let unknowns = problem.unknowns();
    if found.at_bound[k] != 0 {
        let (bound, which) =
            if found.at_bound[k] < 0 { (unknowns[k].lower, "lower") } else { (unknowns[k].upper, "upper") };
        return Some(format!(
            "the fit ends at its {which} bound {bound:.4e}: the data require what the model cannot give, or contain nothing on it"
        ));
    }
    if found.jacobian.column(k).norm() == 0.0 {
        let why = match unknowns[k].name.as_str() {
            "staticFriction" => {
                ": nothing breaks away in them, or it is at or below the Coulomb level, where it has no effect"
            }
            _ => "",
        };
        return Some(format!("no reading depends on it in these recordings{why}"));
    }
    if !information.determines(k) {
        let mut partners: Vec<(f64, &str)> = Vec::new();
        for column in information.null.column_iter().filter(|c| c[k].abs() > 0.03) {
            let others = (0..unknowns.len()).filter(|&i| i != k && column[i].abs() > 0.1);
            partners.extend(others.map(|i| (column[i].abs(), unknowns[i].name.as_str())));
        }
        descending(&mut partners, |item| item.0);
        partners.dedup_by(|a, b| a.1 == b.1);
        let names: Vec<&str> = partners.iter().take(4).map(|p| p.1).collect();
        return Some(format!("these data give only a combination of it with {}", names.join(", ")));
    }
    if se > HOPELESS {
        let c = correlation(&information.covariance);
        let with = (0..unknowns.len())
            .filter(|&i| i != k)
            .max_by(|&a, &b| c[(k, a)].abs().total_cmp(&c[(k, b)].abs()));
        let with = with.map_or(String::new(), |i| {
            format!("; closest to {} (correlation {:.3})", unknowns[i].name, c[(k, i)])
        });
        return Some(format!("its standard error would be {:.0} % of its size{with}", 100.0 * se));
    }
    None
}

/// The problem with some unknowns held: index and coordinate.
pub(crate) struct ProfileProblem<'a, P> {
    pub(crate) problem: &'a P,
    pub(crate) at: &'a [(usize, f64)],
}

impl<P: LeastSquares> LeastSquares for ProfileProblem<'_, P> {
    type Error = P::Error;
    fn evaluate(&self, x: &[f64], jacobian: bool) -> Result<ResidualEvaluation, P::Error> {
        let mut e = self.problem.evaluate(x, jacobian)?;
        if let Some(j) = &mut e.jacobian {
            self.at.iter().for_each(|(k, _)| j.column_mut(*k).fill(0.0));
        }
        Ok(e)
    }
    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let (mut lower, mut upper) = self.problem.bounds();
        self.at.iter().for_each(|(k, at)| (lower[*k], upper[*k]) = (*at, *at));
        (lower, upper)
    }
}

/// One end of the profile-likelihood interval; `None` if it is open.
fn profile(
    problem: &OutputError,
    found: &Solution,
    information: &Information,
    k: usize,
    sign: f64,
    se: f64,
    inflation: f64,
    loss: Loss,
) -> Option<f64> {
    let u = &problem.unknowns()[k];
    let (lower, upper) = problem.bounds();
    let target = Z95 * inflation.sqrt();
    let far = if sign < 0.0 { lower[k] } else { upper[k] };
    // Along the valley: how the others follow.
    let valley: Vec<f64> = (0..found.x.len())
        .map(|i| information.covariance[(i, k)] / information.covariance[(k, k)].max(f64::MIN_POSITIVE))
        .collect();
    let options =
        SolverOptions { max_iterations: 12, cost_tolerance: 1e-7, loss, ..SolverOptions::default() };
    // Signed root of the rise of the cost: nearly linear.
    let rise = |distance: f64| {
        let start: Vec<f64> = (0..found.x.len()).map(|i| found.x[i] + sign * distance * valley[i]).collect();
        let held = ProfileProblem { problem, at: &[(k, found.x[k] + sign * distance)] };
        let cost = solve(&held, &start, options).map_or(f64::INFINITY, |s| s.cost);
        (2.0 * (cost - found.cost).max(0.0)).sqrt()
    };
    let room = (far - found.x[k]).abs();
    let mut distance = (Z95 * se).clamp(1e-12, 3.0).min(room);
    let (mut inside, mut outside) = ((0.0, 0.0), None::<(f64, f64)>);
    for _ in 0..8 {
        let r = rise(distance);
        if (r / target - 1.0).abs() < 0.02 {
            return Some(u.scale.value(found.x[k] + sign * distance).0);
        }
        if r < target {
            if distance >= room || distance > 8.0 {
                return None;
            }
            inside = (distance, r);
        } else {
            outside = Some((distance, r));
        }
        distance = match outside {
            Some((d, r)) if r.is_finite() => {
                inside.0 + (d - inside.0) * ((target - inside.1) / (r - inside.1)).clamp(0.1, 0.9)
            }
            Some((d, _)) => 0.5 * (inside.0 + d),
            None => (inside.0 * (target / inside.1.max(1e-3 * target)).clamp(1.1, 3.0)).min(room),
        };
    }
    Some(u.scale.value(found.x[k] + sign * distance).0)
}

/// Correlation of neighbouring residuals, and the probability that white ones would be as correlated as these (Ljung and Box 1978, 20 lags).
pub(crate) fn whiteness(r: &[f64]) -> (f64, f64) {
    let n = r.len() as f64;
    let power = r.iter().map(|r| r * r).sum::<f64>();
    let lags = 20.min(r.len().saturating_sub(1));
    let at =
        |lag: usize| r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum::<f64>() / power.max(f64::MIN_POSITIVE);
    let q: f64 = (1..=lags).map(|l| at(l).powi(2) / (n - l as f64)).sum::<f64>() * n * (n + 2.0);
    let whiteness = ChiSquared::new(lags.max(1) as f64).map_or(f64::NAN, |d| d.sf(q));
    (if lags > 0 { at(1) } else { 0.0 }, whiteness)
}

fn channels(problem: &OutputError, residuals: &DVector<f64>) -> Vec<ChannelFit> {
    let mut all = Vec::new();
    for (run, plan) in problem.plans().iter().enumerate() {
        let begin = problem.residuals_of(run).start;
        for (c, w) in plan.channels().windows(2).enumerate() {
            let r = &residuals.as_slice()[begin + w[0]..begin + w[1]];
            if r.is_empty() {
                continue;
            }
            let power = r.iter().map(|r| r * r).sum::<f64>();
            let (lag1, whiteness) = whiteness(r);
            let channel = problem.runs()[run].channels[c].name.clone();
            let counted: f64 =
                problem.runs()[run].channels[c].t.iter().map(|t| problem.runs()[run].weight(*t)).sum();
            let above_floor = if counted > 0.0 { (power / counted).sqrt() } else { 0.0 };
            all.push(ChannelFit { run, channel, above_floor, lag1, whiteness });
        }
    }
    all
}

/// d ln(estimate) / d ln(known): by how much of itself each estimate moves when what is assumed known is wrong by all
/// of itself; `known` are the columns of derivatives by the knowns' logarithms. One column per known, for linear
/// unknowns in units of their magnitude.
pub fn leverage(jacobian: &DMatrix<f64>, known: &DMatrix<f64>) -> DMatrix<f64> {
    let information = Information::new(jacobian);
    -(&information.covariance * jacobian.tr_mul(known))
}
