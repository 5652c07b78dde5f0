//! Bounded nonlinear least squares: Levenberg's (1944) step within a trust region (More and Sorensen 1983), active set
//! for the bounds, robust losses by iteratively reweighted least squares.
//!
//! min_x 1/2 sum rho(r_i(x)^2), lower <= x <= upper. The unknowns should be scaled such that a change of 1 is a
//! large one (logarithms, or multiples of a typical value).
//! Deviation from MINPACK: the region is a ball in units that the problem chooses ([`LeastSquares::units`]), such that a direction of which the data
//! say little is left alone until the others fit; normal equations (the covariance does not come from them, see
//! [`crate::covariance`]). Cross-tested against SciPy's `least_squares`.

use nalgebra::{DMatrix, DVector};

/// Residuals and, where requested, their derivatives.
#[derive(Clone, Debug)]
pub struct ResidualEvaluation {
    /// r, one per observation, each divided by its standard deviation.
    pub residuals: DVector<f64>,
    /// dr/dx, one row per observation.
    pub jacobian: Option<DMatrix<f64>>,
}

/// What is minimised.
pub trait LeastSquares {
    /// Why residuals cannot be had at some point; the solver then tries a shorter step.
    type Error;
    /// Residuals at `x`, with their Jacobian if requested.
    ///
    /// # Errors
    /// The problem's error; at the start it ends the solution.
    fn evaluate(&self, x: &[f64], jacobian: bool) -> Result<ResidualEvaluation, Self::Error>;
    /// Lower and upper bounds.
    fn bounds(&self) -> (Vec<f64>, Vec<f64>);
    /// A large change of each unknown at `x`, above 0; the trust region is a ball in these units. 1 unless given otherwise.
    fn units(&self, x: &[f64]) -> DVector<f64> {
        DVector::from_element(x.len(), 1.0)
    }
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
pub struct SolverOptions {
    /// Iterations that request a Jacobian.
    pub max_iterations: usize,
    /// Stop when the cost falls by less than this share.
    pub cost_tolerance: f64,
    /// Stop when no unknown moves by more than this.
    pub step_tolerance: f64,
    /// Stop when no component of the scaled gradient (cosine between residual and column) is larger.
    pub gradient_tolerance: f64,
    /// What a residual costs.
    pub loss: Loss,
    /// First radius of the trust region.
    pub radius: f64,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            max_iterations: 60,
            cost_tolerance: 1e-9,
            step_tolerance: 1e-9,
            gradient_tolerance: 1e-10,
            loss: Loss::Squares,
            radius: 0.3,
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
    /// The iterations are used up, or a cost is not a number.
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
    /// Jacobians requested.
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
struct QuadraticModel {
    gradient: DVector<f64>,
    hessian: DMatrix<f64>,
}

impl QuadraticModel {
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
/// The problem's error at the start.
pub fn solve<P: LeastSquares>(
    problem: &P,
    start: &[f64],
    options: SolverOptions,
) -> Result<Solution, P::Error> {
    descend(problem, start, options, true)
}

/// The unknowns where [`solve`] ends, bit by bit, and the cost there. The derivatives there, which no step is made from any more, are
/// not computed: of a fit of few steps they are a third of the work.
///
/// # Errors
/// The problem's error at the start.
pub fn minimise<P: LeastSquares>(
    problem: &P,
    start: &[f64],
    options: SolverOptions,
) -> Result<(Vec<f64>, f64), P::Error> {
    descend(problem, start, options, false).map(|s| (s.x, s.cost))
}

/// `last`: residuals and derivatives are those of the end; else of a point before it.
fn descend<P: LeastSquares>(
    problem: &P,
    start: &[f64],
    options: SolverOptions,
    last: bool,
) -> Result<Solution, P::Error> {
    let (lower, upper) = problem.bounds();
    let inside = |i: usize, v: f64| v.clamp(lower[i], upper[i]);
    let n = start.len();
    let mut x: Vec<f64> = (0..n).map(|i| inside(i, start[i])).collect();
    let mut here = evaluate(problem, &x)?;
    let mut best = cost(&here.0, options.loss);
    let mut radius = options.radius;
    let (mut iterations, mut stop) = (1, Stop::Iterations);
    // Where the residuals are not numbers no step is better than another.
    'outer: while best.is_finite() {
        let q = QuadraticModel::new(&here.0, &here.1, options.loss);
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
        let units = problem.units(&x);
        let region = Region::new(&q, &free, &q.gradient, &units);
        loop {
            let mut next = x.clone();
            let mut moving = free.clone();
            let mut step = region.step(radius);
            loop {
                moving.iter().zip(step.iter()).for_each(|(&i, s)| next[i] = inside(i, x[i] + s));
                let stay: Vec<usize> = (moving.iter().zip(step.iter()))
                    .filter_map(|(&i, s)| (next[i] == x[i] + s).then_some(i))
                    .collect();
                if stay.len() == moving.len() || stay.is_empty() {
                    break;
                }
                // What ran into a bound stays there; the others make the best of it.
                let held = DVector::from_fn(n, |i, _| if stay.contains(&i) { 0.0 } else { next[i] - x[i] });
                let gradient = &q.gradient + &q.hessian * held;
                step = Region::new(&q, &stay, &gradient, &units).step(radius);
                moving = stay;
            }
            let moved = DVector::from_fn(n, |i, _| next[i] - x[i]);
            let predicted = -(q.gradient.dot(&moved) + 0.5 * moved.dot(&(&q.hessian * &moved)));
            let small = moved.amax() <= options.step_tolerance;
            let length = moved.component_div(&units).norm();
            let tried = problem.evaluate(&next, false).ok().map(|e| cost(&e.residuals, options.loss));
            let reached = tried.filter(|c| c.is_finite()).unwrap_or(f64::INFINITY);
            let gain = (best - reached) / predicted.max(f64::MIN_POSITIVE);
            if gain > 0.75 {
                radius = radius.max(3.0 * length);
            } else if gain < 0.25 {
                radius = 0.25 * radius.min(length);
            }
            if reached < best {
                let little = best - reached <= options.cost_tolerance * best && gain > 0.25;
                x = next;
                best = reached;
                iterations += 1;
                let ends = small || little || iterations >= options.max_iterations;
                if last || !ends {
                    here = evaluate(problem, &x)?;
                }
                if small || little {
                    stop = if small { Stop::Step } else { Stop::Cost };
                    break 'outer;
                }
                if ends {
                    break 'outer;
                }
                break;
            }
            if predicted.is_nan() {
                break 'outer;
            }
            // Nothing to be gained that rounding would let be seen.
            if small || predicted <= 1e-14 * best {
                stop = if small { Stop::Step } else { Stop::Cost };
                break 'outer;
            }
        }
    }
    let at_bound = (0..n).map(|i| i8::from(x[i] >= upper[i]) - i8::from(x[i] <= lower[i])).collect();
    Ok(Solution { x, cost: best, residuals: here.0, jacobian: here.1, at_bound, iterations, stop })
}

/// Residuals and their Jacobian at a point, of which every column is finite: factors of one that is not have no end.
///
/// # Errors
/// Where the problem cannot be evaluated.
pub fn evaluate<P: LeastSquares>(problem: &P, x: &[f64]) -> Result<(DVector<f64>, DMatrix<f64>), P::Error> {
    let e = problem.evaluate(x, true)?;
    let mut jacobian = e.jacobian.unwrap_or_else(|| DMatrix::zeros(e.residuals.len(), x.len()));
    // What has no finite derivative here stays where it is, as does one whose derivatives have no finite squares.
    for mut column in jacobian.column_iter_mut().filter(|c| !c.norm_squared().is_finite()) {
        column.fill(0.0);
    }
    Ok((e.residuals, jacobian))
}

/// The quadratic model over the free unknowns in their units, in its eigenvectors.
struct Region {
    units: DVector<f64>,
    values: DVector<f64>,
    vectors: DMatrix<f64>,
    /// Gradient along the eigenvectors.
    slope: DVector<f64>,
}

impl Region {
    fn new(q: &QuadraticModel, free: &[usize], gradient: &DVector<f64>, units: &DVector<f64>) -> Self {
        let units = DVector::from_fn(free.len(), |a, _| units[free[a]]);
        let h = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            units[a] * q.hessian[(free[a], free[b])] * units[b]
        });
        let g = DVector::from_fn(free.len(), |a, _| units[a] * gradient[free[a]]);
        let e = h.symmetric_eigen();
        let floor = 1e-15 * e.eigenvalues.amax();
        Self {
            values: e.eigenvalues.map(|v| v.max(floor)),
            slope: e.eigenvectors.tr_mul(&g),
            vectors: e.eigenvectors,
            units,
        }
    }
    /// The minimiser of the model within the radius: -(H + mu)^-1 g with the smallest such mu.
    fn step(&self, radius: f64) -> DVector<f64> {
        let along = |mu: f64| self.slope.zip_map(&self.values, |g, h| -g / (h + mu));
        let mut mu = 0.0;
        if along(0.0).norm() > radius {
            let (mut low, mut high) = (self.values.min() * 1e-3, self.slope.norm() / radius);
            for _ in 0..60 {
                mu = (low * high).sqrt();
                if along(mu).norm() > radius {
                    low = mu
                } else {
                    high = mu
                }
                if high / low < 1.05 {
                    break;
                }
            }
            mu = high;
        }
        (&self.vectors * along(mu)).component_mul(&self.units)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Residuals and their derivatives.
    struct Of<F>(F, Vec<f64>, Vec<f64>);
    impl<F: Fn(&[f64]) -> (Vec<f64>, Vec<Vec<f64>>)> LeastSquares for Of<F> {
        type Error = ();
        fn evaluate(&self, x: &[f64], _: bool) -> Result<ResidualEvaluation, ()> {
            let (r, rows) = self.0(x);
            let jacobian = DMatrix::from_fn(r.len(), x.len(), |i, j| rows[i][j]);
            Ok(ResidualEvaluation { residuals: DVector::from_vec(r), jacobian: Some(jacobian) })
        }
        fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
            (self.1.clone(), self.2.clone())
        }
    }

    fn rosenbrock(x: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
        (vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]], vec![vec![-20.0 * x[0], 10.0], vec![-1.0, 0.0]])
    }

    #[test]
    fn rosenbrock_free_and_at_a_bound() {
        let far = vec![f64::NEG_INFINITY; 2];
        let free = Of(rosenbrock, far.clone(), vec![f64::INFINITY; 2]);
        let found = solve(&free, &[-1.2, 1.0], SolverOptions::default()).unwrap();
        assert!(found.x.iter().all(|x| (x - 1.0).abs() < 1e-8) && found.stop.converged(), "{found:?}");
        // SciPy's documentation of least_squares: x_1 >= 1.5 makes (1.22437075, 1.5), cost 0.0252 ...
        let bound = Of(rosenbrock, vec![f64::NEG_INFINITY, 1.5], vec![f64::INFINITY; 2]);
        let found = solve(&bound, &[2.0, 2.0], SolverOptions::default()).unwrap();
        assert!((found.x[0] - 1.22437075).abs() < 1e-6 && found.x[1] == 1.5, "{found:?}");
        assert!((found.cost - 0.025213093946805685).abs() < 1e-9 && found.at_bound == [0, -1]);
    }

    /// Where a fit ends does not depend on whether derivatives are computed there; of a fit that moves they are one evaluation more.
    #[test]
    fn a_minimum_without_the_last_derivatives_is_the_same() {
        let counts = std::cell::Cell::new(0);
        let counted = |x: &[f64]| {
            counts.set(counts.get() + 1);
            rosenbrock(x)
        };
        let free = Of(counted, vec![f64::NEG_INFINITY; 2], vec![f64::INFINITY; 2]);
        for (max_iterations, cost_tolerance) in [(2, 1e-9), (3, 1e-9), (60, 0.5), (60, 1e-9)] {
            let options = SolverOptions { max_iterations, cost_tolerance, ..SolverOptions::default() };
            let whole = solve(&free, &[-1.2, 1.0], options).unwrap();
            let all = counts.replace(0);
            assert_eq!(minimise(&free, &[-1.2, 1.0], options).unwrap(), (whole.x, whole.cost));
            let saved = all - counts.replace(0);
            assert!(saved == 1 || whole.stop == Stop::Gradient, "{max_iterations}: {saved}");
        }
    }

    /// a sin(k q) + b cos(k q) over an angle q: ln k, and amplitudes that end 40 units from where they begin.
    struct Ripple {
        turned: f64,
        in_units: bool,
    }

    impl LeastSquares for Ripple {
        type Error = ();
        fn evaluate(&self, x: &[f64], _: bool) -> Result<ResidualEvaluation, ()> {
            const COUNT: usize = 2000;
            let at = |i: usize| self.turned * i as f64 / COUNT as f64;
            let wave = |ln_k: f64, a: f64, b: f64, q: f64| {
                let (sin, cos) = (ln_k.exp() * q).sin_cos();
                (a * sin + b * cos, [(a * cos - b * sin) * ln_k.exp() * q, sin, cos])
            };
            let rows: Vec<_> = (0..COUNT).map(|i| wave(x[0], x[1], x[2], at(i))).collect();
            let measured = |i: usize| wave(60_f64.ln(), 30.0, 26.0, at(i)).0;
            Ok(ResidualEvaluation {
                residuals: DVector::from_fn(COUNT, |i, _| rows[i].0 - measured(i)),
                jacobian: Some(DMatrix::from_fn(COUNT, 3, |i, j| rows[i].1[j])),
            })
        }
        fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
            (vec![f64::NEG_INFINITY; 3], vec![f64::INFINITY; 3])
        }
        fn units(&self, x: &[f64]) -> DVector<f64> {
            let order = if self.in_units { 1.0 / (x[0].exp() * self.turned) } else { 1.0 };
            DVector::from_vec(vec![order, 1.0, 1.0])
        }
    }

    #[test]
    fn a_ball_in_units_lets_amplitudes_move_while_an_order_settles() {
        // Two and a half turns; the order is off by two radians at their end.
        let options = SolverOptions {
            max_iterations: 40,
            cost_tolerance: 1e-6,
            radius: 1.0,
            ..SolverOptions::default()
        };
        let left = |in_units| {
            let problem = Ripple { turned: 16.0, in_units };
            solve(&problem, &[59.88_f64.ln(), 4.0, -4.0], options).unwrap().cost
        };
        let (plain, in_units) = (left(false), left(true));
        assert!(in_units < 1e-6 * plain, "{plain} {in_units}");
    }

    #[test]
    fn an_unknown_without_a_derivative_stays() {
        for wild in [f64::NAN, f64::INFINITY, 1e200] {
            let line = |x: &[f64]| (vec![x[0] - 3.0, x[1]], vec![vec![1.0, wild], vec![0.0, 1.0]]);
            let problem = Of(line, vec![f64::NEG_INFINITY; 2], vec![f64::INFINITY; 2]);
            let found = solve(&problem, &[1.0, 0.5], SolverOptions::default()).unwrap();
            assert!((found.x[0] - 3.0).abs() < 1e-8 && found.x[1] == 0.5, "{found:?}");
            // Where not even the residuals are numbers it ends, and does not say that it has converged.
            let lost = |x: &[f64]| (vec![x[0] * wild, x[1]], vec![vec![1.0, 0.0], vec![0.0, 1.0]]);
            let problem = Of(lost, vec![f64::NEG_INFINITY; 2], vec![f64::INFINITY; 2]);
            let found = solve(&problem, &[1.0, 0.5], SolverOptions::default()).unwrap();
            assert!(!found.stop.converged(), "{found:?}");
        }
    }

    #[test]
    fn robust_losses_agree_with_scipy() {
        // y = a exp(b t), the last but one reading is far out.
        let data = [(0.0, 2.0), (0.5, 1.6), (1.0, 1.15), (1.5, 0.95), (2.0, 0.7), (2.5, 3.0), (3.0, 0.45)];
        let model = |x: &[f64]| {
            let rows = data.map(|(t, _)| vec![(x[1] * t).exp(), x[0] * t * (x[1] * t).exp()]);
            (data.map(|(t, y)| x[0] * (x[1] * t).exp() - y).to_vec(), rows.to_vec())
        };
        let problem = Of(model, vec![f64::NEG_INFINITY; 2], vec![f64::INFINITY; 2]);
        // scipy.optimize.least_squares(..., loss=..., f_scale=0.1, xtol=ftol=gtol=1e-15), SciPy 1.17.1.
        for (loss, expected) in [
            (Loss::Huber(0.1), [1.99427266, -0.49048713]),
            (Loss::SoftL1(0.1), [1.99467332, -0.48751434]),
            (Loss::Squares, [1.68846478, -0.12735063]),
        ] {
            let options = SolverOptions {
                loss,
                cost_tolerance: 1e-15,
                step_tolerance: 1e-12,
                ..SolverOptions::default()
            };
            let found = solve(&problem, &[1.0, 0.0], options).unwrap();
            for (x, e) in found.x.iter().zip(expected) {
                assert!((x - e).abs() < 1e-6, "{loss:?} {:?} {expected:?}", found.x);
            }
        }
    }
}
