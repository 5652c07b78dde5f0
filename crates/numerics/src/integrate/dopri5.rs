//! Dormand and Prince 5(4): Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.5 and II.6.

use super::{Ode, StepFault, StepMethod, Tolerance, checked_rates, not_finite};

const C: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// The last row are the weights of the solution of order 5 too (first same as last).
const A: [[f64; 6]; 7] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Order 5 minus order 4.
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];
/// The term of the continuous extension of order 4 beyond cubic Hermite.
const D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// Adaptive, explicit, order 5(4), with a continuous extension of order 4.
#[derive(Clone, Debug)]
pub struct Dopri5 {
    k: [Vec<f64>; 7],
    stage: Vec<f64>,
    dense: [Vec<f64>; 5],
    /// `k[0]` belongs to the start of the next step.
    fresh: bool,
}

impl Dopri5 {
    /// Work space for `n` states.
    pub fn new(n: usize) -> Self {
        let row = || vec![0.0; n];
        Self {
            k: core::array::from_fn(|_| row()),
            stage: row(),
            dense: core::array::from_fn(|_| row()),
            fresh: false,
        }
    }
}

impl StepMethod for Dopri5 {
    fn error_order(&self) -> i32 {
        5
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
        if !self.fresh {
            checked_rates(ode, t, x, &mut self.k[0])?;
            self.fresh = true;
        }
        for s in 1..7 {
            let (done, rest) = self.k.split_at_mut(s);
            self.stage.copy_from_slice(x);
            for (a, k) in A[s].iter().zip(done.iter()) {
                if *a != 0.0 {
                    let ha = h * a;
                    self.stage.iter_mut().zip(k).for_each(|(y, k)| *y += ha * k);
                }
            }
            checked_rates(ode, t + C[s] * h, &self.stage, &mut rest[0])?;
        }
        if let Some(i) = not_finite(&self.stage) {
            return Err(StepFault::State(i));
        }
        let k = &self.k;
        Ok(tol.ratio(|i| h * (0..7).map(|s| E[s] * k[s][i]).sum::<f64>(), x, &self.stage))
    }
    fn end(&self) -> &[f64] {
        &self.stage
    }
    fn prepare_dense(&mut self, _ode: &mut dyn Ode, _t: f64, x: &[f64], h: f64) {
        let (k, r) = (&self.k, &mut self.dense);
        for i in 0..x.len() {
            let d = self.stage[i] - x[i];
            let a = h * k[0][i] - d;
            r[0][i] = x[i];
            r[1][i] = d;
            r[2][i] = a;
            r[3][i] = d - h * k[6][i] - a;
            r[4][i] = h * (0..7).map(|s| D[s] * k[s][i]).sum::<f64>();
        }
    }
    fn dense(&self, s: f64, x: &mut [f64]) {
        let (r, q) = (&self.dense, 1.0 - s);
        for i in 0..x.len() {
            x[i] = r[0][i] + s * (r[1][i] + q * (r[2][i] + s * (r[3][i] + q * r[4][i])));
        }
    }
    fn accept(&mut self) {
        self.k.swap(0, 6);
        self.fresh = true;
    }
}
