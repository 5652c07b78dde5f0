//! Methods without an error estimate, for a fixed step (real time); cubic Hermite between the ends, of [`Ros2`] a parabola.

use super::rodas4::factor;
use super::{Hermite, Ode, StepFault, StepMethod, Tolerance, checked, checked_rates, not_finite};
use crate::linear::lu_solve;

/// What the three methods share.
#[derive(Clone, Debug)]
struct Common {
    f0: Vec<f64>,
    f1: Vec<f64>,
    end: Vec<f64>,
    hermite: Hermite,
    /// `f0` belongs to the start of the next step; `f1` to the end of the last one.
    fresh: bool,
    end_fresh: bool,
}

impl Common {
    fn new(n: usize) -> Self {
        let row = || vec![0.0; n];
        Self { f0: row(), f1: row(), end: row(), hermite: Hermite::new(n), fresh: false, end_fresh: false }
    }
    fn begin(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64]) -> Result<(), StepFault> {
        self.end_fresh = false;
        if !self.fresh {
            checked_rates(ode, t, x, &mut self.f0)?;
            self.fresh = true;
        }
        Ok(())
    }
    fn finish(&self) -> Result<f64, StepFault> {
        not_finite(&self.end).map_or(Ok(0.0), |i| Err(StepFault::State(i)))
    }
    fn rates_at_end(&mut self, ode: &mut dyn Ode, t: f64, h: f64) {
        ode.rates(t + h, &self.end, &mut self.f1);
        self.end_fresh = true;
    }
}

/// Where each method keeps its [`Common`] part; the rest of the trait follows from it.
macro_rules! fixed {
    ($($method:ident),*) => {$(
        impl $method {
            /// Work space for `n` states.
            pub fn new(n: usize) -> Self {
                Self::with(Common::new(n), n)
            }
        }
        impl StepMethod for $method {
            fn error_order(&self) -> i32 {
                0
            }
            fn restart(&mut self) {
                self.common.fresh = false;
            }
            fn attempt(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], h: f64, _: Tolerance) -> Result<f64, StepFault> {
                self.step(ode, t, x, h)?;
                self.common.finish()
            }
            fn end(&self) -> &[f64] {
                &self.common.end
            }
            fn prepare_dense(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], h: f64) {
                self.end_rates(ode, t, x, h);
                let c = &mut self.common;
                c.hermite.set(h, x, &c.f0, &c.end, &c.f1);
            }
            fn dense(&self, theta: f64, x: &mut [f64]) {
                self.common.hermite.at(theta, x);
            }
            fn dense_is_parabola(&self) -> bool {
                Self::PARABOLA
            }
            fn accept(&mut self) {
                let c = &mut self.common;
                c.fresh = c.end_fresh;
                core::mem::swap(&mut c.f0, &mut c.f1);
            }
        }
    )*};
}
fixed!(Euler, Rk4, Ros2);

/// Explicit Euler, order 1.
#[derive(Clone, Debug)]
pub struct Euler {
    common: Common,
}

impl Euler {
    const PARABOLA: bool = false;
    fn with(common: Common, _n: usize) -> Self {
        Self { common }
    }
    fn end_rates(&mut self, ode: &mut dyn Ode, t: f64, _x: &[f64], h: f64) {
        self.common.rates_at_end(ode, t, h);
    }
    fn step(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], h: f64) -> Result<(), StepFault> {
        let c = &mut self.common;
        c.begin(ode, t, x)?;
        for i in 0..x.len() {
            c.end[i] = x[i] + h * c.f0[i];
        }
        Ok(())
    }
}

/// The classical Runge-Kutta method, order 4.
#[derive(Clone, Debug)]
pub struct Rk4 {
    common: Common,
    k: [Vec<f64>; 3],
    stage: Vec<f64>,
}

impl Rk4 {
    const PARABOLA: bool = false;
    fn with(common: Common, n: usize) -> Self {
        Self { common, k: core::array::from_fn(|_| vec![0.0; n]), stage: vec![0.0; n] }
    }
    fn end_rates(&mut self, ode: &mut dyn Ode, t: f64, _x: &[f64], h: f64) {
        self.common.rates_at_end(ode, t, h);
    }
    fn step(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], h: f64) -> Result<(), StepFault> {
        let c = &mut self.common;
        c.begin(ode, t, x)?;
        for (s, part) in [0.5, 0.5, 1.0].into_iter().enumerate() {
            let (done, rest) = self.k.split_at_mut(s);
            let k = done.last().unwrap_or(&c.f0);
            for i in 0..x.len() {
                self.stage[i] = x[i] + h * part * k[i];
            }
            checked_rates(ode, t + part * h, &self.stage, &mut rest[0])?;
        }
        let [k2, k3, k4] = &self.k;
        for i in 0..x.len() {
            c.end[i] = x[i] + h / 6.0 * (c.f0[i] + 2.0 * (k2[i] + k3[i]) + k4[i]);
        }
        Ok(())
    }
}

/// ROS2 with gamma = 1 - 1/sqrt(2): Verwer, Spee, Blom, Hundsdorfer (1999); order 2, L-stable.
///
/// Its order does not rest on the Jacobian: where the system has a stiff part of it, that is taken.
#[derive(Clone, Debug)]
pub struct Ros2 {
    common: Common,
    k: [Vec<f64>; 2],
    whole: Whole,
}

/// 1 - g df/dx in factors, and df/dt.
#[derive(Clone, Debug)]
struct Whole {
    dfdx: Vec<f64>,
    dfdt: Vec<f64>,
    lu: Vec<f64>,
    pivots: Vec<usize>,
}

impl Whole {
    fn factor(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], g: f64) -> Result<(), StepFault> {
        ode.jacobian(t, x, &mut self.dfdx, &mut self.dfdt);
        factor(&self.dfdx, 1.0 / g, x.len(), &mut self.lu, &mut self.pivots)
    }
    fn solve(&self, g: f64, y: &mut [f64]) {
        y.iter_mut().for_each(|y| *y /= g);
        lu_solve(&self.lu, y.len(), &self.pivots, y);
    }
}

impl Ros2 {
    const PARABOLA: bool = true;
    fn with(common: Common, n: usize) -> Self {
        let row = || vec![0.0; n];
        let square = || vec![0.0; n * n];
        let whole = Whole { dfdx: square(), dfdt: row(), lu: square(), pivots: vec![0; n] };
        Self { common, k: [row(), row()], whole }
    }
    /// Those of the parabola through both ends with the rates at the start: of the method's order, and nothing to evaluate.
    fn end_rates(&mut self, _ode: &mut dyn Ode, _t: f64, x: &[f64], h: f64) {
        let c = &mut self.common;
        for i in 0..x.len() {
            c.f1[i] = 2.0 * (c.end[i] - x[i]) / h - c.f0[i];
        }
    }
    /// (1 - gamma h J) k1 = f(t, x) + gamma h f_t;
    /// (1 - gamma h J) k2 = f(t + h, x + h k1) - 2 k1 - gamma h f_t; x1 = x + 3/2 h k1 + 1/2 h k2.
    fn step(&mut self, ode: &mut dyn Ode, t: f64, x: &[f64], h: f64) -> Result<(), StepFault> {
        let (c, n) = (&mut self.common, x.len());
        let g = (1.0 - core::f64::consts::FRAC_1_SQRT_2) * h;
        c.end_fresh = false;
        let known = if let Some(factored) = ode.factor_stiff(t, x, g, &mut c.f0) {
            factored?;
            checked(x, &c.f0)?;
            // The same order without f_t.
            self.whole.dfdt.fill(0.0);
            true
        } else {
            c.begin(ode, t, x)?;
            self.whole.factor(ode, t, x, g)?;
            false
        };
        let whole = &self.whole;
        let solve = |ode: &dyn Ode, y: &mut [f64]| if known { ode.solve_stiff(y) } else { whole.solve(g, y) };
        let [k1, k2] = &mut self.k;
        for i in 0..n {
            k1[i] = c.f0[i] + g * whole.dfdt[i];
        }
        solve(ode, k1);
        for i in 0..n {
            c.end[i] = x[i] + h * k1[i];
        }
        checked_rates(ode, t + h, &c.end, k2)?;
        for i in 0..n {
            k2[i] -= 2.0 * k1[i] + g * whole.dfdt[i];
        }
        solve(ode, k2);
        for i in 0..n {
            c.end[i] = x[i] + h * (1.5 * k1[i] + 0.5 * k2[i]);
        }
        Ok(())
    }
}
