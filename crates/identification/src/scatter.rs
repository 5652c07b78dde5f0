//! How far estimates scatter when readings do not err independently.
//!
//! *Normal errors*: (J^T J)^-1 M (J^T J)^-1. Of a quantised channel M is worked out from the counts of the fitted motion,
//! over shifts of the counts against it; of any other it sums products of the scores J_i r_i up to a lag (Newey and West
//! 1987).
//! *Counts as intervals*: the edges that a motion happens to touch settle an estimate, not a sum over all readings, so a
//! sandwich of one linearisation is a poor measure. There the fit is done again and again (a parametric bootstrap, Efron and
//! Tibshirani 1993): the fitted motion, linear in the unknowns about the solution, is counted again with other phases. The
//! likelihood of intervals is log-concave, so that each of these fits has one minimum.

use std::collections::BTreeMap;

use crate::parallel;
use nalgebra::{DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};

use crate::covariance::Information;
use crate::interval;
use crate::lsq::{LeastSquares, Loss, ResidualEvaluation, Solution, SolverOptions, solve};
use crate::output_error::OutputError;
use crate::unknown::FitTarget;

/// Residuals so many times the noise come from a wrong model.
const WRONG: f64 = 2.0;
/// Phases of the counts for which quantisation errors are worked out.
const PHASES: usize = 32;
/// Fits to counts made again.
const DRAWS: u64 = 64;
/// A draw moves the solution by less than this, in standard deviations of the likelihood.
const REACH: f64 = 8.0;
/// Readings so many times the slack inside their edges do not matter to a draw.
const INNER: f64 = 5.0;

/// Covariance of the estimates.
pub(crate) fn scatter(
    problem: &OutputError,
    found: &Solution,
    information: &Information,
    normal: &Normal,
    loss: Loss,
) -> DMatrix<f64> {
    // In coordinates in which the unknowns would have unit variance if readings erred independently.
    let rows = &found.jacobian * &information.root;
    let channels: Vec<(usize, usize)> = (problem.runs().iter().enumerate())
        .flat_map(|(run, r)| (0..r.channels.len()).map(move |c| (run, c)))
        .collect();
    let (counted, others): (Vec<_>, Vec<_>) =
        channels.into_iter().partition(|&(run, c)| problem.slack(run, c).is_some());
    let parts: Vec<DMatrix<f64>> =
        parallel::map(&others, |&(run, c)| scores(problem, found, &rows, loss, run, c));
    let mut m = parts.into_iter().fold(DMatrix::zeros(rows.ncols(), rows.ncols()), |sum, m| sum + m);
    // What a prior contributes has the declared deviation.
    let priors = rows.rows(problem.readings(), rows.nrows() - problem.readings());
    m += priors.tr_mul(&priors);
    if !counted.is_empty() {
        m = bootstrap(problem, found, information, normal, &rows, loss, &counted, &others, &m);
    }
    &information.root * m * information.root.transpose()
}

/// Residuals and derivatives of a solution over the deviations of the readings.
pub(crate) struct Normal {
    pub residuals: DVector<f64>,
    pub jacobian: DMatrix<f64>,
}

/// A solution as if readings had normal errors, whatever the fit took them for.
pub(crate) fn as_normal(problem: &OutputError, found: &Solution) -> Normal {
    let mut normal = problem.clone();
    normal.read_intervals(None);
    let again = problem.reads_intervals().then(|| normal.evaluate(&found.x, true).ok()).flatten();
    match again.map(|e| (e.residuals, e.jacobian)) {
        Some((residuals, Some(jacobian))) => Normal { residuals, jacobian },
        _ => Normal { residuals: found.residuals.clone(), jacobian: found.jacobian.clone() },
    }
}

/// Where the residuals of a channel are: first and how many.
fn place(problem: &OutputError, run: usize, c: usize) -> (usize, usize) {
    let w = &problem.plans()[run].channels()[c..];
    (problem.residuals_of(run).start + w[0], w[1] - w[0])
}

/// Covariance of the scores of one channel.
fn scores(
    problem: &OutputError,
    found: &Solution,
    rows: &DMatrix<f64>,
    loss: Loss,
    run: usize,
    c: usize,
) -> DMatrix<f64> {
    let channel = &problem.runs()[run].channels[c];
    let (first, len) = place(problem, run, c);
    let (rows, residuals) = (rows.rows(first, len), &found.residuals.as_slice()[first..first + len]);
    let power = residuals.iter().map(|r| r * r).sum::<f64>() / len.max(1) as f64;
    let mut m = DMatrix::<f64>::zeros(rows.ncols(), rows.ncols());
    // Innovations are white if the model is right; what a wrong model leaves is no quantisation.
    if channel.counts() && problem.carried(run).is_none() && power < WRONG * WRONG {
        // What was there, by the fit.
        let step = channel.resolution;
        let shown: Vec<f64> = (0..len).map(|k| channel.y[k] + residuals[k] * channel.deviation(k)).collect();
        for i in 0..PHASES {
            let phase = (i as f64 + 0.5) / PHASES as f64;
            let errors = DVector::from_fn(len, |k, _| {
                let y = shown[k] / step + phase;
                (y - y.round()) * step / channel.deviation(k)
            });
            let moved = rows.tr_mul(&errors);
            m += &moved * moved.transpose() / PHASES as f64;
        }
        return m;
    }
    let mut score = rows.into_owned();
    for (mut row, r) in score.row_iter_mut().zip(residuals) {
        row *= r * loss.weight(*r);
    }
    m += score.tr_mul(&score);
    let least = (4.0 * (len as f64 / 100.0).powf(2.0 / 9.0)).ceil() as usize;
    let lags = if power < WRONG * WRONG { least } else { memory(residuals).max(least) };
    for lag in 1..=lags.min(len.saturating_sub(1)) {
        let weight = 1.0 - lag as f64 / (lags as f64 + 1.0);
        let cross = score.rows(lag, len - lag).tr_mul(&score.rows(0, len - lag)) * weight;
        m += &cross + cross.transpose();
    }
    m
}

/// Twice the lag at which residuals have forgotten what they were; at most a quarter of them, and 300.
fn memory(r: &[f64]) -> usize {
    let power: f64 = r.iter().map(|r| r * r).sum();
    let most = (r.len() / 8).min(150);
    let at = |lag: usize| r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum::<f64>();
    2 * (1..most).find(|lag| at(*lag) < 0.1 * power).unwrap_or(most)
}

/// The counts of a channel, once more: all lengths in counts.
struct CountsOfChannel {
    /// Output, and the recording if the sensor's zero is another one in each: within these the phase is the same.
    sensor: (usize, Option<usize>),
    /// Motion by the fit, and its derivatives by the coordinates.
    shown: DVector<f64>,
    along: DMatrix<f64>,
    /// Error before counting: as the recordings have it (none, if they are most likely with the least slack and none is
    /// declared), and as the fit takes it.
    noise: f64,
    slack: f64,
    /// By how much a draw may move each reading.
    reach: DVector<f64>,
    /// Factor on the residual of each reading.
    weight: DVector<f64>,
}

impl CountsOfChannel {
    /// What a draw leaves to be fitted: the readings that may come near an edge.
    fn again(&self, phase: f64, rng: &mut StdRng) -> Near {
        let mut off = Vec::new();
        let mut near = Vec::new();
        for (i, y) in self.shown.iter().enumerate() {
            let noise: f64 = if self.noise > 0.0 { StandardNormal.sample(rng) } else { 0.0 };
            let o = y + phase - (y + phase + self.noise * noise).round();
            if o.abs() + self.reach[i] + INNER * self.slack > 0.5 {
                off.push(o);
                near.push(i);
            }
        }
        let (along, weight) = (self.along.select_rows(&near), self.weight.select_rows(&near));
        Near { off: DVector::from_vec(off), along, weight, slack: self.slack }
    }
}

/// Readings of a channel near the edges of their counts, in counts.
struct Near {
    /// Motion less count at the solution, and its derivatives.
    off: DVector<f64>,
    along: DMatrix<f64>,
    weight: DVector<f64>,
    slack: f64,
}

/// A fit to counts made again; everything else is a quadratic about the solution.
struct RescaledFit<'a> {
    counts: Vec<Near>,
    /// Residuals of the quadratic, K z + w.
    k: &'a DMatrix<f64>,
    w: DVector<f64>,
}

impl LeastSquares for RescaledFit<'_> {
    type Error = std::convert::Infallible;
    fn evaluate(&self, z: &[f64], jacobian: bool) -> Result<ResidualEvaluation, Self::Error> {
        let z = DVector::from_column_slice(z);
        let readings: usize = self.counts.iter().map(|c| c.off.len()).sum();
        let mut residuals = DVector::zeros(readings + z.len());
        let mut rows = jacobian.then(|| DMatrix::zeros(residuals.len(), z.len()));
        let mut begin = 0;
        for Near { off, along, weight, slack } in &self.counts {
            let moved = off + along * &z;
            for (i, (off, weight)) in moved.iter().zip(weight).enumerate() {
                let (r, slope) = interval::residual(*off, 1.0, *slack);
                residuals[begin + i] = r * weight;
                if let Some(rows) = rows.as_mut().filter(|_| slope > 0.0) {
                    (0..z.len()).for_each(|j| rows[(begin + i, j)] = along[(i, j)] * slope * weight);
                }
            }
            begin += off.len();
        }
        residuals.rows_mut(begin, z.len()).copy_from(&(self.k * z + &self.w));
        if let Some(rows) = &mut rows {
            rows.rows_mut(begin, self.k.nrows()).copy_from(self.k);
        }
        Ok(ResidualEvaluation { residuals, jacobian: rows })
    }
    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        let n = self.k.ncols();
        (vec![f64::NEG_INFINITY; n], vec![f64::INFINITY; n])
    }
}

/// Covariance of fits to counts made again; of what is not `counted`, `m` is the covariance of the scores.
fn bootstrap(
    problem: &OutputError,
    found: &Solution,
    information: &Information,
    normal: &Normal,
    rows: &DMatrix<f64>,
    loss: Loss,
    counted: &[(usize, usize)],
    others: &[(usize, usize)],
    m: &DMatrix<f64>,
) -> DMatrix<f64> {
    let n = rows.ncols();
    let counts: Vec<CountsOfChannel> = (counted.iter())
        .map(|&(run, c)| {
            let channel = &problem.runs()[run].channels[c];
            let (first, len) = place(problem, run, c);
            let step = channel.resolution;
            // Not those that are left out.
            let kept: Vec<usize> = (0..len).filter(|k| channel.worth(*k) > 1e-9).collect();
            let scale = |i: usize| channel.deviation(kept[i]) / step;
            let along = DMatrix::from_fn(kept.len(), normal.jacobian.ncols(), |i, j| {
                normal.jacobian[(first + kept[i], j)] * scale(i)
            });
            let along = along * &information.root;
            let slack = problem.slack(run, c).unwrap_or(step) / step;
            let declared = (channel.sigma / step).powi(2) - 1.0 / 12.0;
            let own_zero = problem
                .unknowns()
                .iter()
                .any(|u| u.run == Some(run) && u.target == FitTarget::Offset(channel.output));
            CountsOfChannel {
                sensor: (channel.output, own_zero.then_some(run)),
                shown: DVector::from_fn(kept.len(), |i, _| {
                    channel.y[kept[i]] / step + normal.residuals[first + kept[i]] * scale(i)
                }),
                reach: DVector::from_fn(kept.len(), |i, _| REACH * along.row(i).norm()),
                along,
                weight: DVector::from_fn(kept.len(), |i, _| channel.worth(kept[i]).sqrt()),
                noise: if slack > interval::SLACKS[interval::SLACKS.len() - 1] {
                    slack
                } else if declared > 1e-9 {
                    declared.sqrt()
                } else {
                    0.0
                },
                slack,
            }
        })
        .collect();
    let priors = rows.rows(problem.readings(), rows.nrows() - problem.readings());
    let mut h = priors.tr_mul(&priors);
    for &(run, c) in others {
        let (first, len) = place(problem, run, c);
        let mut rows = rows.rows(first, len).into_owned();
        for (mut row, r) in rows.row_iter_mut().zip(&found.residuals.as_slice()[first..]) {
            row *= loss.weight(*r).sqrt();
        }
        h += rows.tr_mul(&rows);
    }
    let k = powered(h.clone(), 0.5);
    // w of the covariance K^-1 M K^-1: such are the scores K w.
    let spread = powered(h, -0.5) * powered(m.clone(), 0.5);
    let draws: Vec<DVector<f64>> = parallel::map(0..DRAWS, |seed| {
        let mut rng = StdRng::seed_from_u64(seed);
        let mut phases = BTreeMap::new();
        let counts = (counts.iter())
            .map(|c| {
                let phase = *phases.entry(c.sensor).or_insert_with(|| rng.random_range(-0.5..0.5));
                c.again(phase, &mut rng)
            })
            .collect();
        let w = &spread * DVector::from_fn(n, |_, _| StandardNormal.sample(&mut rng));
        let again = RescaledFit { counts, k: &k, w };
        let options = SolverOptions {
            loss,
            max_iterations: 30,
            cost_tolerance: 1e-5,
            step_tolerance: 1e-3,
            radius: 10.0,
            ..SolverOptions::default()
        };
        match solve(&again, &vec![0.0; n], options) {
            Ok(s) => DVector::from_vec(s.x),
            Err(never) => match never {},
        }
    });
    // Such that the error over its standard error has unit variance (Student's t).
    draws.iter().map(|z| z * z.transpose()).sum::<DMatrix<f64>>() / (DRAWS - 2) as f64
}

/// A power of a symmetric matrix; where its eigenvalues vanish, 0.
fn powered(m: DMatrix<f64>, power: f64) -> DMatrix<f64> {
    let e = m.symmetric_eigen();
    let least = 1e-12 * e.eigenvalues.amax();
    let values = e.eigenvalues.map(|v| if v > least { v.powf(power) } else { 0.0 });
    &e.eigenvectors * DMatrix::from_diagonal(&values) * e.eigenvectors.transpose()
}
