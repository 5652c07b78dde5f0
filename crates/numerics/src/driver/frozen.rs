//! A hybrid model between events as an ordinary differential equation; its Jacobian by forward duals.

use super::step::OdeSystem;
use super::terms::StepInputs;
use crate::Dual;
use crate::hybrid::{At, Hybrid, ModelSizes};
use crate::integrate::{Ode, StepFault};

/// Directions that one pass of duals carries.
const LANES: usize = 8;
type WideDual = Dual<LANES>;

/// The inputs as functions of time; `base` is the time of `u0`.
#[derive(Clone, Copy)]
pub(super) struct InputSignals<'a> {
    pub(super) inputs: StepInputs<'a>,
    pub(super) base: f64,
}

impl InputSignals<'_> {
    pub(super) fn at(&self, t: f64, u0: &[f64], u: &mut [f64]) {
        match self.inputs {
            StepInputs::Hold => u.copy_from_slice(u0),
            StepInputs::Function(f) => f(t, u),
            StepInputs::Ramp(slope) => {
                for (i, u) in u.iter_mut().enumerate() {
                    *u = u0[i] + slope.get(i).copied().unwrap_or(0.0) * (t - self.base);
                }
            }
        }
    }
    /// du/dt; of a function by a difference, `u` being the inputs at t.
    fn slope(&self, t: f64, u: &[f64], du: &mut [f64]) {
        match self.inputs {
            StepInputs::Hold => du.fill(0.0),
            StepInputs::Ramp(slope) => {
                for (i, du) in du.iter_mut().enumerate() {
                    *du = slope.get(i).copied().unwrap_or(0.0);
                }
            }
            StepInputs::Function(f) => {
                let later = t + 1e-7 * t.abs().max(1e-3);
                f(later, du);
                du.iter_mut().zip(u).for_each(|(du, u)| *du = (*du - u) / (later - t));
            }
        }
    }
}

/// Work space of [`FrozenModel`].
pub(super) struct FrozenWorkspace {
    pub(super) u: Vec<f64>,
    du: Vec<f64>,
    x_wide: Vec<WideDual>,
    u_wide: Vec<WideDual>,
    p_wide: Vec<WideDual>,
    dx_wide: Vec<WideDual>,
    /// Of the stiff part, in factors.
    stiff: Vec<f64>,
}

impl FrozenWorkspace {
    pub(super) fn new(n: ModelSizes) -> Self {
        let wide = |n: usize| vec![WideDual::default(); n];
        Self {
            u: vec![0.0; n.inputs],
            du: vec![0.0; n.inputs],
            x_wide: wide(n.states),
            u_wide: wide(n.inputs),
            p_wide: wide(n.parameters),
            dx_wide: wide(n.states),
            stiff: Vec::new(),
        }
    }

    /// For the model's stiff part, once.
    pub(super) fn make_room<M: Hybrid>(&mut self, model: &M) {
        self.stiff.resize(model.stiff_part().map_or(0, |part| part.room()), 0.0);
    }
}

/// The model with modes and parameters frozen.
pub(super) struct FrozenModel<'a, M> {
    pub(super) model: &'a M,
    pub(super) p: &'a [f64],
    pub(super) modes: &'a [i32],
    pub(super) signal: InputSignals<'a>,
    pub(super) u0: &'a [f64],
    pub(super) work: &'a mut FrozenWorkspace,
}

impl<M: Hybrid> Ode for FrozenModel<'_, M> {
    fn rates(&mut self, t: f64, x: &[f64], dx: &mut [f64]) {
        self.signal.at(t, self.u0, &mut self.work.u);
        self.model.rates(At { t, x, u: &self.work.u, p: self.p, modes: self.modes }, dx);
    }

    fn factor_stiff(&mut self, t: f64, x: &[f64], g: f64, dx: &mut [f64]) -> Option<Result<(), StepFault>> {
        let part = self.model.stiff_part()?;
        // A state that another driver initialised.
        self.work.make_room(self.model);
        let FrozenWorkspace { u, stiff, .. } = &mut *self.work;
        self.signal.at(t, self.u0, u);
        Some(
            part.factor(At { t, x, u, p: self.p, modes: self.modes }, g, stiff, dx)
                .map_err(StepFault::Matrix),
        )
    }

    fn solve_stiff(&self, y: &mut [f64]) {
        if let Some(part) = self.model.stiff_part() {
            part.solve(&self.work.stiff, y);
        }
    }

    fn jacobian(&mut self, t: f64, x: &[f64], dfdx: &mut [f64], dfdt: &mut [f64]) {
        let (n, w) = (x.len(), &mut *self.work);
        self.signal.at(t, self.u0, &mut w.u);
        self.signal.slope(t, &w.u, &mut w.du);
        for (wide, p) in w.p_wide.iter_mut().zip(self.p) {
            *wide = WideDual::new(*p, [0.0; LANES]);
        }
        // Directions 0..n are the states, direction n is time.
        for first in (0..=n).step_by(LANES) {
            for (j, wide) in w.x_wide.iter_mut().enumerate() {
                *wide = WideDual::variable(x[j], j.wrapping_sub(first));
            }
            let time = n - first;
            for (i, wide) in w.u_wide.iter_mut().enumerate() {
                *wide = WideDual::variable(w.u[i], time);
                wide.eps.iter_mut().for_each(|e| *e *= w.du[i]);
            }
            let at = At {
                t: WideDual::variable(t, time),
                x: &w.x_wide,
                u: &w.u_wide,
                p: &w.p_wide,
                modes: self.modes,
            };
            self.model.rates(at, &mut w.dx_wide);
            for (i, dx) in w.dx_wide.iter().enumerate() {
                for (lane, e) in dx.eps.iter().enumerate() {
                    match first + lane {
                        j if j < n => dfdx[i * n + j] = *e,
                        j if j == n => dfdt[i] = *e,
                        _ => {}
                    }
                }
            }
        }
    }
}

impl<M: Hybrid> OdeSystem for FrozenModel<'_, M> {
    fn indicators(&mut self, t: f64, x: &[f64], z: &mut [f64]) {
        self.signal.at(t, self.u0, &mut self.work.u);
        self.model.indicators(At { t, x, u: &self.work.u, p: self.p, modes: self.modes }, z);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scalar;
    use crate::hybrid::EventUpdate;

    /// A nonlinear ring of any length, driven by two inputs and by time.
    struct Ring(usize);

    impl Hybrid for Ring {
        fn sizes(&self) -> ModelSizes {
            ModelSizes { states: self.0, inputs: 2, parameters: 1, ..ModelSizes::default() }
        }
        fn start<T: Scalar>(&self, _p: &[T], _x: &mut [T]) {}
        fn start_modes(&self, _at: At<f64>, _modes: &mut [i32]) {}
        fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
            for i in 0..self.0 {
                let next = at.x[(i + 1) % self.0];
                dx[i] = at.x[i].sin() * next * at.p[0] + at.u[i % 2] * at.x[i] + at.t * at.t;
            }
        }
        fn outputs<T: Scalar>(&self, _at: At<T>, _y: &mut [T]) {}
        fn indicators<T: Scalar>(&self, _at: At<T>, _z: &mut [T]) {}
        fn update(&self, _t: f64, _x: &mut [f64], _u: &[f64], _p: &[f64], _modes: &mut [i32]) -> EventUpdate {
            EventUpdate::default()
        }
    }

    #[test]
    fn jacobian_equals_central_differences() {
        let curve = |t: f64, u: &mut [f64]| (u[0], u[1]) = (t.sin(), t * t);
        for n in [1, 2, 7, 8, 9, 16, 19] {
            for inputs in [StepInputs::Hold, StepInputs::Ramp(&[0.3, -2.0]), StepInputs::Function(&curve)] {
                let (model, signal) = (Ring(n), InputSignals { inputs, base: 0.5 });
                let mut work = FrozenWorkspace::new(model.sizes());
                let mut ode = FrozenModel {
                    model: &model,
                    p: &[1.7],
                    modes: &[],
                    signal,
                    u0: &[0.4, 0.9],
                    work: &mut work,
                };
                let (t, x) = (0.8, (0..n).map(|i| (i as f64).cos()).collect::<Vec<_>>());
                let (mut dfdx, mut dfdt) = (vec![f64::NAN; n * n], vec![f64::NAN; n]);
                ode.jacobian(t, &x, &mut dfdx, &mut dfdt);
                let mut slope = |dt: f64, j: Option<usize>| {
                    let mut ends = [vec![0.0; n], vec![0.0; n]];
                    for (sign, f) in [1.0, -1.0].into_iter().zip(&mut ends) {
                        let mut x = x.clone();
                        if let Some(j) = j {
                            x[j] += sign * 1e-5;
                        }
                        ode.rates(t + sign * dt, &x, f);
                    }
                    ends[0].iter().zip(&ends[1]).map(|(a, b)| (a - b) / 2e-5).collect::<Vec<_>>()
                };
                let by_time = slope(1e-5, None);
                for i in 0..n {
                    assert!((dfdt[i] - by_time[i]).abs() < 1e-6, "{n} states, df{i}/dt");
                }
                for j in 0..n {
                    let column = slope(0.0, Some(j));
                    for i in 0..n {
                        assert!((dfdx[i * n + j] - column[i]).abs() < 1e-8, "{n} states, df{i}/dx{j}");
                    }
                }
            }
        }
    }
}
