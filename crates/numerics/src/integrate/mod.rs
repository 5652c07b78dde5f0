//! One-step methods. Each owns its work space; no method allocates after construction.
//!
//! | method | order | dense output | for |
//! |---|---|---|---|
//! | [`Dopri5`] | 5(4) | 4 | smooth, not stiff, any accuracy |
//! | [`Rodas4`] | 4(3), L-stable, stiffly accurate | 3 | stiff friction, stiff transmissions |
//! | [`Rk4`] | 4 | 3 | fixed step, not stiff |
//! | [`Ros2`] | 2, L-stable | 2 | fixed step, stiff, real time |

mod dopri5;
mod fixed;
mod rodas4;

pub use dopri5::Dopri5;
pub use fixed::{Euler, Rk4, Ros2};
pub use rodas4::Rodas4;

/// dx/dt = f(t, x).
pub trait Ode {
    /// f(t, x) into `dx`.
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]);
    /// df/dx (row-major, n x n) and df/dt (n).
    fn jacobian(&mut self, t: f64, x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]);
    /// Factors of 1 - g A, A being the stiff part of df/dx, for [`Ode::solve_stiff`], and f(t, x) into `dx`; `None`: no such
    /// part is known, and nothing was done.
    fn factor_stiff(
        &mut self,
        _t: f64,
        _x: &[f64],
        _g: f64,
        _dx: &mut [f64],
    ) -> Option<Result<(), StepFault>> {
        None
    }
    /// Solves (1 - g A) y' = y in place.
    fn solve_stiff(&self, _y: &mut [f64]) {}
}

/// Which local error is allowed: of state i, `relative * (max(|x_i|) + nominal_i)`.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance<'a> {
    /// Relative tolerance.
    pub relative: f64,
    /// Typical magnitude of each state.
    pub nominal: &'a [f64],
}

impl Tolerance<'_> {
    /// The allowed error of state `i` that has the sizes `a` and `b` at the ends of the step.
    pub fn weight(&self, i: usize, a: f64, b: f64) -> f64 {
        self.relative * (a.abs().max(b.abs()) + self.nominal[i])
    }
    /// Largest ratio of error to allowed error over all states; NaN if one of them is NaN.
    pub fn ratio(&self, error: impl Fn(usize) -> f64, x0: &[f64], x1: &[f64]) -> f64 {
        let mut worst = 0.0;
        for i in 0..x0.len() {
            let r = error(i).abs() / self.weight(i, x0[i], x1[i]);
            if r > worst || r.is_nan() {
                worst = r;
            }
        }
        worst
    }
}

/// Why a step could not be computed at all; a shorter one may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepFault {
    /// The rate of this state is not finite.
    Rate(usize),
    /// This state is not finite at the end of the step.
    State(usize),
    /// The matrix of an implicit stage is singular (row).
    Matrix(usize),
}

/// A one-step method.
pub trait StepMethod: Send {
    /// Order of the error estimate plus 1: the error of a step goes with this power of its size;
    /// 0 for a method without an estimate, which is then used with a fixed step.
    fn error_order(&self) -> i32;
    /// What was kept from the last step no longer holds (states, inputs or modes have changed).
    fn restart(&mut self);
    /// Tries a step from (t, x) of size `h`; returns error / allowed error (accept at <= 1).
    ///
    /// # Errors
    /// What was not finite.
    fn attempt(
        &mut self,
        ode: &mut dyn Ode,
        t: f64,
        x: &[f64],
        h: f64,
        tol: Tolerance,
    ) -> Result<f64, StepFault>;
    /// The states at the end of the last attempt.
    fn end(&self) -> &[f64];
    /// Makes [`StepMethod::dense`] ready for the last attempt.
    fn prepare_dense(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], h: f64);
    /// The states at `theta` in [0, 1] of the last attempt.
    fn dense(&self, theta: f64, x: &mut [f64]);
    /// Whether they are parabolas, which a point between the ends determines.
    fn dense_is_parabola(&self) -> bool {
        false
    }
    /// The last attempt is accepted: the next one starts at its end.
    fn accept(&mut self);
}

/// The first element that is not finite.
pub(crate) fn not_finite(values: &[f64]) -> Option<usize> {
    values.iter().position(|v| !v.is_finite())
}

/// f(t, x), checked.
fn checked_rates(ode: &mut dyn Ode, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), StepFault> {
    ode.rates(t, x, dx);
    checked(x, dx)
}

/// Rates that are finite.
fn checked(x: &[f64], dx: &[f64]) -> Result<(), StepFault> {
    // A sum is finite only if all its terms are: one test in the usual case.
    if dx.iter().sum::<f64>().is_finite() {
        return Ok(());
    }
    match (not_finite(x), not_finite(dx)) {
        (Some(i), _) => Err(StepFault::State(i)),
        (None, Some(i)) => Err(StepFault::Rate(i)),
        (None, None) => Ok(()),
    }
}

/// Cubic Hermite interpolation from the states and rates at both ends.
#[derive(Clone, Debug, Default)]
struct Hermite {
    x0: Vec<f64>,
    d: Vec<f64>,
    a: Vec<f64>,
    b: Vec<f64>,
}

impl Hermite {
    fn new(n: usize) -> Self {
        Self { x0: vec![0.0; n], d: vec![0.0; n], a: vec![0.0; n], b: vec![0.0; n] }
    }
    fn set(&mut self, h: f64, x0: &[f64], f0: &[f64], x1: &[f64], f1: &[f64]) {
        for i in 0..x0.len() {
            let d = x1[i] - x0[i];
            let a = h * f0[i] - d;
            (self.x0[i], self.d[i], self.a[i], self.b[i]) = (x0[i], d, a, d - h * f1[i] - a);
        }
    }
    fn at(&self, s: f64, x: &mut [f64]) {
        for i in 0..x.len() {
            x[i] = self.x0[i] + s * (self.d[i] + (1.0 - s) * (self.a[i] + s * self.b[i]));
        }
    }
}
