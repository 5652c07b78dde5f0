//! RODAS4: Hairer, Wanner, Solving Ordinary Differential Equations II, IV.7 (stiffly accurate Rosenbrock method).

use super::{Ode, StepFault, StepMethod, Tolerance, checked_rates, not_finite};
use crate::linear::{lu_factor, lu_solve};

const STAGES: usize = 6;
const GAMMA: f64 = 0.25;
/// Stage times and the factors of h df/dt; both 1 and 0 for the last two stages.
const ALPHA: [f64; STAGES] = [0.0, 0.386, 0.21, 0.63, 1.0, 1.0];
const TIME: [f64; STAGES] = [0.25, -0.1043, 0.1035, -0.03620000000000023, 0.0, 0.0];
/// The last row equals row 4 plus stage 5: the last stage starts at the embedded solution.
const A: [[f64; 5]; STAGES] = [
    [0.0; 5],
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.9466785280815826, 0.2557011698983284, 0.0, 0.0, 0.0],
    [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0.0, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687_886_036_105_895, 0.0],
    [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687_886_036_105_895, 1.0],
];
const C: [[f64; 5]; STAGES] = [
    [0.0; 5],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430093356833875, -0.2063599157091915, 0.0, 0.0, 0.0],
    [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0.0, 0.0],
    [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.708_908_932_061_6, 0.0],
    [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
];
/// The two terms of the continuous extension of order 3.
const D: [[f64; 5]; 2] = [
    [10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662],
    [-0.6762803392301253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872],
];

/// Adaptive, L-stable, stiffly accurate, order 4(3), with a continuous extension of order 3.
#[derive(Clone, Debug)]
pub struct Rodas4 {
    k: [Vec<f64>; STAGES],
    f0: Vec<f64>,
    end: Vec<f64>,
    rhs: Vec<f64>,
    dfdx: Vec<f64>,
    dfdt: Vec<f64>,
    lu: Vec<f64>,
    pivots: Vec<usize>,
    dense: [Vec<f64>; 4],
    /// Rates and Jacobian belong to the start of the step to come.
    fresh: bool,
}

impl Rodas4 {
    /// Work space for `n` states.
    pub fn new(n: usize) -> Self {
        let row = || vec![0.0; n];
        Self {
            k: core::array::from_fn(|_| row()),
            f0: row(),
            end: row(),
            rhs: row(),
            dfdx: vec![0.0; n * n],
            dfdt: row(),
            lu: vec![0.0; n * n],
            pivots: vec![0; n],
            dense: core::array::from_fn(|_| row()),
            fresh: false,
        }
    }
}

/// LU factors of 1/(h gamma) - J.
pub(super) fn factor(
    dfdx: &[f64],
    g: f64,
    n: usize,
    lu: &mut [f64],
    pivots: &mut [usize],
) -> Result<(), StepFault> {
    for (l, j) in lu.iter_mut().zip(dfdx) {
        *l = -j;
    }
    for i in 0..n {
        lu[i * n + i] += g;
    }
    lu_factor(lu, n, pivots).map_err(|e| StepFault::Matrix(e.index))
}

impl StepMethod for Rodas4 {
    fn error_order(&self) -> i32 {
        4
    }
    fn restart(&mut self) {
        self.fresh = false;
    }
    fn attempt(
        &mut self,
        ode: &mut dyn Ode,
        t: f64,
        x: &[f64],
        h: f64,
        tol: Tolerance,
    ) -> Result<f64, StepFault> {
        let n = x.len();
        if !self.fresh {
            checked_rates(ode, t, x, &mut self.f0)?;
            ode.jacobian(t, x, &mut self.dfdx, &mut self.dfdt);
            if let Some(i) = not_finite(&self.dfdx) {
                return Err(StepFault::Rate(i / n));
            }
            if let Some(i) = not_finite(&self.dfdt) {
                return Err(StepFault::Rate(i));
            }
            self.fresh = true;
        }
        factor(&self.dfdx, 1.0 / (h * GAMMA), n, &mut self.lu, &mut self.pivots)?;
        for s in 0..STAGES {
            let (done, rest) = self.k.split_at_mut(s);
            let rhs = &mut self.rhs;
            if s == 0 {
                rhs.copy_from_slice(&self.f0);
            } else {
                self.end.copy_from_slice(x);
                for (a, k) in A[s].iter().zip(done.iter()) {
                    self.end.iter_mut().zip(k).for_each(|(y, k)| *y += a * k);
                }
                checked_rates(ode, t + ALPHA[s] * h, &self.end, rhs)?;
            }
            for i in 0..n {
                let c = C[s].iter().zip(done.iter()).map(|(c, k)| c * k[i]).sum::<f64>();
                rhs[i] += c / h + h * TIME[s] * self.dfdt[i];
            }
            lu_solve(&self.lu, n, &self.pivots, rhs);
            rest[0].copy_from_slice(rhs);
        }
        let error = &self.k[STAGES - 1];
        self.end.iter_mut().zip(error).for_each(|(y, k)| *y += k);
        if let Some(i) = not_finite(&self.end) {
            return Err(StepFault::State(i));
        }
        Ok(tol.ratio(|i| error[i], x, &self.end))
    }
    fn end(&self) -> &[f64] {
        &self.end
    }
    fn prepare_dense(&mut self, _ode: &mut dyn Ode, _t: f64, x: &[f64], _h: f64) {
        let term = |d: &[f64; 5], i: usize| d.iter().zip(&self.k).map(|(d, k)| d * k[i]).sum::<f64>();
        for i in 0..x.len() {
            self.dense[0][i] = x[i];
            self.dense[1][i] = self.end[i];
            self.dense[2][i] = term(&D[0], i);
            self.dense[3][i] = term(&D[1], i);
        }
    }
    fn dense(&self, s: f64, x: &mut [f64]) {
        let (r, q) = (&self.dense, 1.0 - s);
        for i in 0..x.len() {
            x[i] = r[0][i] * q + s * (r[1][i] + q * (r[2][i] + s * r[3][i]));
        }
    }
    fn accept(&mut self) {
        self.fresh = false;
    }
}
