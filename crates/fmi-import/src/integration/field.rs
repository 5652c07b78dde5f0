//! The group as an ordinary differential equation between events.

use trueup_numerics::driver::OdeSystem;
use trueup_numerics::integrate::Ode;

use super::lanes::CarriedSensitivity;
use super::{Failure, Fmus, Member};
use crate::FmiStatus;

/// The right-hand side. What an FMU refuses becomes NaN, at which the integrator tries a shorter step; what it fails
/// at ends the run: no FMU is called any more.
pub(super) struct IntegrationRates<'a, F: Fmus + ?Sized> {
    pub(super) fmus: &'a mut F,
    pub(super) members: &'a [Member],
    pub(super) along: Option<&'a CarriedSensitivity>,
    pub(super) nominal: &'a [f64],
    /// Interval that may be looked at, in s.
    pub(super) within: (f64, f64),
    /// Directional derivatives may be used; until they are found to be wrong.
    pub(super) directional: bool,
    /// The last value that was not finite.
    pub(super) value: Option<f64>,
    /// An Error or Fatal.
    pub(super) failure: Option<Failure<F::Error>>,
    /// The last Discard.
    pub(super) refused: Option<Failure<F::Error>>,
    /// The last two evaluations, where the integrator is explicit: see [`IntegrationRates::stiffness`].
    pub(super) trace: Option<[RateEvaluation; 2]>,
}

/// x and dx/dt at a time in s.
#[derive(Clone, Debug, Default)]
pub(super) struct RateEvaluation {
    t: f64,
    x: Vec<f64>,
    dx: Vec<f64>,
}

impl RateEvaluation {
    pub(super) fn new(n: usize) -> Self {
        Self { t: f64::NAN, x: vec![0.0; n], dx: vec![0.0; n] }
    }
}

/// Time, states and inputs of all FMUs.
pub(super) fn place<F: Fmus + ?Sized>(
    fmus: &mut F,
    members: &[Member],
    time: f64,
    x: &[f64],
) -> Result<(), Failure<F::Error>> {
    for (at, member) in members.iter().enumerate() {
        let instance = fmus.instance(at);
        let states = &x[member.states.clone()];
        let set = instance
            .set_time(time)
            .and_then(|()| if states.is_empty() { Ok(()) } else { instance.set_states(states) });
        set.map_err(|source| Failure::Call { time, source })?;
    }
    fmus.exchange(time, false).map_err(Failure::Exchange)
}

impl<F: Fmus + ?Sized> IntegrationRates<'_, F> {
    fn place(&mut self, time: f64, x: &[f64]) -> Result<(), Failure<F::Error>> {
        place(self.fmus, self.members, time, x)
    }

    fn evaluate(&mut self, time: f64, x: &[f64], dx: &mut [f64]) -> Result<(), Failure<F::Error>> {
        self.place(time, x)?;
        let call = |source| Failure::Call { time, source };
        for (at, member) in self.members.iter().enumerate().filter(|(_, m)| !m.states.is_empty()) {
            self.fmus.instance(at).derivatives(&mut dx[member.states.clone()]).map_err(call)?;
        }
        self.along.map_or(Ok(()), |along| along.rates(self.fmus.instance(0), time, x, dx)).map_err(call)
    }

    /// Keeps a failure; NaN reports it to the integrator.
    fn kept(&mut self, result: Result<(), Failure<F::Error>>, values: &mut [f64]) {
        let Err(error) = result else { return };
        values.fill(f64::NAN);
        let discard =
            matches!(&error, Failure::Call { source, .. } if source.status() == Some(FmiStatus::Discard));
        *(if discard { &mut self.refused } else { &mut self.failure }) = Some(error);
    }

    /// Estimate of h |lambda| from the last two stages of an explicit step of size `h`, which are at the same time
    /// (Hairer, Wanner, Solving Ordinary Differential Equations II, IV.2).
    pub(super) fn stiffness(&self, h: f64) -> Option<f64> {
        let [a, b] = self.trace.as_ref()?;
        if a.t != b.t {
            return None;
        }
        let distance = |a: &[f64], b: &[f64]| {
            let term = |((a, b), nominal): ((&f64, &f64), &f64)| ((a - b) / nominal).powi(2);
            a.iter().zip(b).zip(self.nominal).map(term).sum::<f64>().sqrt()
        };
        let dx = distance(&a.x, &b.x);
        (dx > 0.0).then(|| h * distance(&a.dx, &b.dx) / dx)
    }

    /// d f / d x_j by a difference.
    fn difference(&mut self, t: f64, x: &mut [f64], j: usize, f0: &[f64], column: &mut [f64]) {
        let (at, size) = (x[j], x[j].abs().max(self.nominal[j]));
        x[j] = at + f64::EPSILON.sqrt() * size;
        let step = x[j] - at;
        self.rates(t, x, column);
        x[j] = at;
        column.iter_mut().zip(f0).for_each(|(c, f)| *c = (*c - f) / step);
    }

    /// Column `j` by directional derivatives: those of the FMU whose state it is.
    fn directional(&mut self, t: f64, j: usize, column: &mut [f64]) {
        column.fill(0.0);
        let Some(at) = self.members.iter().position(|m| m.states.contains(&j)) else { return };
        let member = &self.members[at];
        let Some(columns) = &member.columns else { return };
        let done = self.fmus.instance(at).directional(
            &columns.derivatives,
            std::slice::from_ref(&columns.states[j - member.states.start]),
            &[1.0],
            &mut column[member.states.clone()],
        );
        self.kept(done.map_err(|source| Failure::Call { time: t, source }), column);
    }

    /// J v and a difference along v, for a v that touches every state: an FMU's derivatives may be wrong.
    fn agrees(&mut self, t: f64, x: &[f64], f0: &[f64], dfdx: &[f64]) -> bool {
        let n = x.len();
        let v: Vec<f64> =
            (0..n).map(|j| self.nominal[j].max(x[j].abs()) * (1.0 + 0.3 * (j as f64).sin())).collect();
        let eps = 1e-6;
        let moved: Vec<f64> = x.iter().zip(&v).map(|(x, v)| x + eps * v).collect();
        let mut f1 = vec![0.0; n];
        self.rates(t, &moved, &mut f1);
        let typical = f0.iter().zip(&f1).map(|(a, b)| a.abs().max(b.abs())).collect::<Vec<_>>();
        (0..n).all(|i| {
            let row = &dfdx[i * n..][..n];
            let size: f64 = row.iter().zip(&v).map(|(j, v)| (j * v).abs()).sum();
            let exact: f64 = row.iter().zip(&v).map(|(j, v)| j * v).sum();
            let difference = (f1[i] - f0[i]) / eps;
            // Curvature and rounding of the difference leave about this much.
            (exact - difference).abs() <= 0.01 * size.max(difference.abs()) + 1e-8 * typical[i] / eps
        })
    }
}

impl<F: Fmus + ?Sized> Ode for IntegrationRates<'_, F> {
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        if self.failure.is_some() {
            dx.fill(f64::NAN);
            return;
        }
        let done = self.evaluate(t, x, dx);
        self.value = dx.iter().copied().find(|x| !x.is_finite()).filter(|_| done.is_ok()).or(self.value);
        self.kept(done, dx);
        if let Some(trace) = &mut self.trace {
            trace.swap(0, 1);
            trace[1].t = t;
            trace[1].x.copy_from_slice(x);
            trace[1].dx.copy_from_slice(dx);
        }
    }

    fn jacobian(&mut self, t: f64, x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]) {
        let n = x.len();
        let (mut x, mut f0, mut column) = (x.to_vec(), vec![0.0; n], vec![0.0; n]);
        let members = self.members;
        let offered = |j| members.iter().any(|m| m.columns.is_some() && m.states.contains(&j));
        let (own, rest): (Vec<usize>, Vec<usize>) = (0..n).partition(|j| self.directional && offered(*j));
        let mut set = |j: usize, column: &[f64]| (0..n).for_each(|i| dfdx[i * n + j] = column[i]);
        self.rates(t, &x, &mut f0);
        for &j in &own {
            self.directional(t, j, &mut column);
            set(j, &column);
        }
        for j in rest {
            self.difference(t, &mut x, j, &f0, &mut column);
            set(j, &column);
        }
        if !own.is_empty() && !self.agrees(t, &x, &f0, dfdx) {
            self.directional = false;
            for j in own {
                self.difference(t, &mut x, j, &f0, &mut column);
                (0..n).for_each(|i| dfdx[i * n + j] = column[i]);
            }
        }
        // Never beyond the interval: inputs, or the FMU, may know nothing there.
        let span = 1e-7 * t.abs().max(1e-3).min(self.within.1 - self.within.0);
        let later = if t + span <= self.within.1 { t + span } else { t - span };
        self.rates(later, &x, dfdt);
        dfdt.iter_mut().zip(&f0).for_each(|(d, f)| *d = (*d - f) / (later - t));
    }
}

impl<F: Fmus + ?Sized> OdeSystem for IntegrationRates<'_, F> {
    fn indicators(&mut self, t: f64, x: &[f64], z: &mut [f64]) {
        if self.failure.is_some() {
            z.fill(f64::NAN);
            return;
        }
        let mut done = self.place(t, x);
        for (at, member) in self.members.iter().enumerate().filter(|(_, m)| !m.indicators.is_empty()) {
            done = done.and_then(|()| {
                let z = &mut z[member.indicators.clone()];
                self.fmus.instance(at).indicators(z).map_err(|source| Failure::Call { time: t, source })
            });
        }
        self.kept(done, z);
    }
}
