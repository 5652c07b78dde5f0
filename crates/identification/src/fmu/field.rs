//! The FMU between events as an ordinary differential equation.

use trueup_fmi_import::{Error, ModelExchange, StateColumns, Status};
use trueup_numerics::driver::System;
use trueup_numerics::integrate::Ode;

use super::lane::Lane;

/// The right-hand side, inputs on their way from `begin` on. What the FMU refuses becomes NaN, at which the integrator
/// tries a shorter step; what it fails at ends the run.
pub(super) struct Field<'a> {
    pub(super) slave: &'a mut ModelExchange,
    pub(super) references: &'a [u32],
    pub(super) begin: f64,
    /// Inputs at `begin`, and their slopes.
    pub(super) u: &'a [f64],
    pub(super) du: &'a [f64],
    pub(super) columns: Option<&'a StateColumns>,
    pub(super) nominal: &'a [f64],
    /// States; behind them come the sensitivities, lane by lane.
    pub(super) n: usize,
    pub(super) lanes: &'a [Lane],
    /// An Error or Fatal.
    pub(super) failure: Option<Error>,
}

impl Field<'_> {
    /// Time, states and inputs.
    pub(super) fn place(&mut self, t: f64, x: &[f64]) -> Result<(), Error> {
        self.slave.set_time(t)?;
        if self.n > 0 {
            self.slave.set_states(&x[..self.n])?;
        }
        if self.references.is_empty() {
            return Ok(());
        }
        let u: Vec<f64> = self.u.iter().zip(self.du).map(|(u, du)| u + du * (t - self.begin)).collect();
        self.slave.set(self.references, &u)
    }

    /// Rates of the states, then of the sensitivities: (df/dx) s + df/du du + df/dp dp.
    pub(super) fn all_rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) -> Result<(), Error> {
        self.place(t, x)?;
        if self.n == 0 {
            return Ok(());
        }
        self.slave.derivatives(&mut dx[..self.n])?;
        if let Some(c) = self.columns {
            for (k, lane) in self.lanes.iter().enumerate() {
                let at = self.n * (k + 1)..self.n * (k + 2);
                let (by, seed) = lane.knowns(&c.states, &x[at.clone()], self.references, t - self.begin);
                self.slave.directional(&c.derivatives, &by, &seed, &mut dx[at])?;
            }
        }
        Ok(())
    }

    fn kept(&mut self, done: Result<(), Error>, values: &mut [f64]) {
        let Err(error) = done else { return };
        values.fill(f64::NAN);
        if error.status() != Some(Status::Discard) {
            self.failure = Some(error);
        }
    }
}

impl Ode for Field<'_> {
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        if self.failure.is_some() {
            dx.fill(f64::NAN);
            return;
        }
        let done = self.all_rates(t, x, dx);
        self.kept(done, dx);
    }

    fn jacobian(&mut self, t: f64, x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]) {
        let n = x.len();
        let (mut x, mut f, mut column) = (x.to_vec(), vec![0.0; n], vec![0.0; n]);
        self.rates(t, &x, &mut f);
        for j in 0..n {
            if let Some(c) = self.columns {
                let done = self.slave.directional(&c.derivatives, &[c.states[j]], &[1.0], &mut column);
                self.kept(done, &mut column);
            } else {
                let at = x[j];
                x[j] = at + f64::EPSILON.sqrt() * at.abs().max(self.nominal[j]);
                let step = x[j] - at;
                self.rates(t, &x, &mut column);
                x[j] = at;
                column.iter_mut().zip(&f).for_each(|(c, f)| *c = (*c - f) / step);
            }
            (0..n).for_each(|i| dfdx[i * n + j] = column[i]);
        }
        let span = 1e-7 * t.abs().max(1e-3);
        self.rates(t + span, &x, dfdt);
        dfdt.iter_mut().zip(&f).for_each(|(d, f)| *d = (*d - f) / span);
    }
}

impl System for Field<'_> {
    fn indicators(&mut self, t: f64, x: &[f64], z: &mut [f64]) {
        if self.failure.is_some() {
            z.fill(f64::NAN);
            return;
        }
        let done = self.place(t, x).and_then(|()| self.slave.indicators(z));
        self.kept(done, z);
    }
}
