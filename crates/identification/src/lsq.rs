//! Bounded nonlinear least squares: Levenberg (1944), Marquardt (1963), damping after Nielsen (1999), active set for
//! the bounds, robust losses by iteratively reweighted least squares.
//!
//! min_x 1/2 sum rho(r_i(x)^2), lower <= x <= upper. The unknowns should be scaled such that a change of 1 is a
//! large one (logarithms, or multiples of a typical value).
//! Deviation from MINPACK: normal equations with the diagonal of the Hessian as scale; the covariance is not
//! taken from them (see [`crate::covariance`]). Cross-tested against SciPy's `least_squares`.

use nalgebra::{DMatrix, DVector};

/// Residuals and, where asked for, their derivatives.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// r, one per observation, each divided by its standard deviation.
    pub residuals: DVector<f64>,
    /// dr/dx, one row per observation.
    pub jacobian: Option<DMatrix<f64>>,
}

/// What is minimised.
pub trait Problem {
    /// Why residuals cannot be had at some point; the solver then tries a shorter step.
    type Error;
    /// Residuals at `x`, with their Jacobian if asked for.
    ///
    /// # Errors
    /// What the problem says; at the start it ends the solution.
    fn evaluate(&self, x: &[f64], jacobian: bool) -> Result<Evaluation, Self::Error>;
    /// Lower and upper bounds.
    fn bounds(&self) -> (Vec<f64>, Vec<f64>);
}

/// What a residual costs: 1/2 rho(r^2).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// rho(s) = s.
    #[default]
    Squares,
    /// Huber: squares up to `|r| = k`, linear beyond.
    Huber(f64),
    /// rho(s) = 2 k^2 (sqrt(1 + s/k^2) - 1).
    SoftL1(f64),
}

impl Loss {
    /// rho(r^2).
    pub fn cost(self, r: f64) -> f64 {
        match self {
            Self::Squares => r * r,
            Self::Huber(k) if r.abs() <= k => r * r,
            Self::Huber(k) => k * (2.0 * r.abs() - k),
            Self::SoftL1(k) => 2.0 * k * k * ((1.0 + (r / k).powi(2)).sqrt() - 1.0),
        }
    }
    /// rho'(r^2), the weight of the residual.
    pub fn weight(self, r: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber(k) if r.abs() <= k => 1.0,
            Self::Huber(k) => k / r.abs(),
            Self::SoftL1(k) => 1.0 / (1.0 + (r / k).powi(2)).sqrt(),
        }
    }
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Iterations that ask for a Jacobian.
    pub max_iterations: usize,
    /// Stop when the cost falls by less than this share.
    pub cost_tolerance: f64,
    /// Stop when no unknown moves by more than this.
    pub step_tolerance: f64,
    /// Stop when no component of the scaled gradient (cosine between residual and column) is larger.
    pub gradient_tolerance: f64,
    /// What a residual costs.
    pub loss: Loss,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            max_iterations: 60,
            cost_tolerance: 1e-9,
            step_tolerance: 1e-9,
            gradient_tolerance: 1e-10,
            loss: Loss::Squares,
        }
    }
}

/// Why the solver stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The cost no longer falls.
    Cost,
    /// The unknowns no longer move.
    Step,
    /// The gradient is 0 (within the bounds).
    Gradient,
    /// The iterations are used up.
    Iterations,
}

/// Where the solver ended.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The unknowns.
    pub x: Vec<f64>,
    /// 1/2 sum rho(r^2).
    pub cost: f64,
    /// Residuals and Jacobian there, without robust weights.
    pub residuals: DVector<f64>,
    /// Jacobian there.
    pub jacobian: DMatrix<f64>,
    /// At a bound: -1 lower, +1 upper, else 0.
    pub at_bound: Vec<i8>,
    /// Jacobians asked for.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
}

impl Stop {
    /// Whether a minimum was reached.
    pub fn converged(self) -> bool {
        self != Self::Iterations
    }
}

/// Gradient and Gauss-Newton Hessian of the cost.
struct Quadratic {
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
}

impl Quadratic {
    fn new(r: &DVector<f64>, jacobian: &DMatrix<f64>, loss: Loss) -> Self {
        if loss == Loss::Squares {
            return Self { gradient: jacobian.tr_mul(r), hessian: jacobian.tr_mul(jacobian) };
        }
        let mut weighted = jacobian.clone();
        for mut column in weighted.column_iter_mut() {
            column.iter_mut().zip(r.iter()).for_each(|(j, r)| *j *= loss.weight(*r));
        }
        Self { gradient: weighted.tr_mul(r), hessian: weighted.tr_mul(jacobian) }
    }
}

fn cost(r: &DVector<f64>, loss: Loss) -> f64 {
    0.5 * r.iter().map(|r| loss.cost(*r)).sum::<f64>()
}

/// Minimises from `start` (moved into the bounds).
///
/// # Errors
/// What the problem says at the start.
pub fn solve<P: Problem>(problem: &P, start: &[f64], options: Options) -> Result<Solution, P::Error> {
    let (lower, upper) = problem.bounds();
    let inside = |i: usize, v: f64| v.clamp(lower[i], upper[i]);
    let n = start.len();
    let mut x: Vec<f64> = (0..n).map(|i| inside(i, start[i])).collect();
    let mut here = evaluate(problem, &x)?;
    let mut best = cost(&here.0, options.loss);
    let (mut damping, mut growth) = (1e-3, 2.0);
    let mut largest = vec![0.0f64; n];
    let (mut iterations, mut stop) = (1, Stop::Iterations);
    'outer: loop {
        let q = Quadratic::new(&here.0, &here.1, options.loss);
        let norm = (2.0 * best).sqrt().max(f64::MIN_POSITIVE);
        let free: Vec<usize> = (0..n)
            .filter(|&i| {
                let out = q.gradient[i];
                q.hessian[(i, i)] > 0.0 && !(x[i] <= lower[i] && out > 0.0 || x[i] >= upper[i] && out < 0.0)
            })
            .collect();
        let flat =
            |&i: &usize| q.gradient[i].abs() <= options.gradient_tolerance * norm * q.hessian[(i, i)].sqrt();
        if free.iter().all(flat) {
            stop = Stop::Gradient;
            break;
        }
        free.iter().for_each(|&i| largest[i] = largest[i].max(q.hessian[(i, i)]));
        loop {
            let Some(step) = damped_step(&q, &free, damping, &largest) else {
                (damping, growth) = (damping * growth, growth * 2.0);
                if damping > 1e30 {
                    stop = Stop::Step;
                    break 'outer;
                }
                continue;
            };
            let mut next = x.clone();
            free.iter().zip(step.iter()).for_each(|(&i, s)| next[i] = inside(i, x[i] + s));
            let moved = DVector::from_fn(n, |i, _| next[i] - x[i]);
            let predicted = -(q.gradient.dot(&moved) + 0.5 * moved.dot(&(&q.hessian * &moved)));
            let small = moved.amax() <= options.step_tolerance;
            let tried = problem.evaluate(&next, false).ok().map(|e| cost(&e.residuals, options.loss));
            let reached = tried.filter(|c| c.is_finite()).unwrap_or(f64::INFINITY);
            if reached < best {
                let gain = (best - reached) / predicted.max(f64::MIN_POSITIVE);
                let little = best - reached <= options.cost_tolerance * best;
                damping = (damping * (1.0 - (2.0 * gain.min(1.0) - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-14);
                growth = 2.0;
                x = next;
                here = evaluate(problem, &x)?;
                best = reached;
                iterations += 1;
                if small || little && predicted <= 2.0 * options.cost_tolerance * best.max(f64::MIN_POSITIVE)
                {
                    stop = if small { Stop::Step } else { Stop::Cost };
                    break 'outer;
                }
                if iterations >= options.max_iterations {
                    break 'outer;
                }
                break;
            }
            // Nothing to be gained that rounding would let be seen.
            if small || predicted <= 1e-14 * best {
                stop = if small { Stop::Step } else { Stop::Cost };
                break 'outer;
            }
            (damping, growth) = (damping * growth, growth * 2.0);
        }
    }
    let at_bound = (0..n).map(|i| i8::from(x[i] >= upper[i]) - i8::from(x[i] <= lower[i])).collect();
    Ok(Solution { x, cost: best, residuals: here.0, jacobian: here.1, at_bound, iterations, stop })
}

fn evaluate<P: Problem>(problem: &P, x: &[f64]) -> Result<(DVector<f64>, DMatrix<f64>), P::Error> {
    let e = problem.evaluate(x, true)?;
    let jacobian = e.jacobian.unwrap_or_else(|| DMatrix::zeros(e.residuals.len(), x.len()));
    Ok((e.residuals, jacobian))
}

fn damped_step(q: &Quadratic, free: &[usize], damping: f64, largest: &[f64]) -> Option<DVector<f64>> {
    let scale: Vec<f64> = free.iter().map(|&i| largest[i].sqrt()).collect();
    let mut h = DMatrix::from_fn(free.len(), free.len(), |a, b| {
        q.hessian[(free[a], free[b])] / (scale[a] * scale[b])
    });
    (0..free.len()).for_each(|a| h[(a, a)] += damping);
    let g = DVector::from_fn(free.len(), |a, _| -q.gradient[free[a]] / scale[a]);
    let step = h.cholesky()?.solve(&g);
    let step = DVector::from_fn(free.len(), |a, _| step[a] / scale[a]);
    step.iter().all(|s| s.is_finite()).then_some(step)
}
