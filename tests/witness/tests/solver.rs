//! A solver for `fmi-rs`: Runge-Kutta of order 4 with a fixed step; a step over an event is cut by bisection.
//! Nothing here comes from the project: an independent integrator is part of the evidence.

use fmi_rs::sim::SimulationError;
use fmi_rs::sim::solver::{Dae, Ode, Solver, SolverFactory};

/// Largest step in s: the fastest mode of the FMUs has some 100 rad/s.
const STEP: f64 = 2e-4;
/// To this much an event is located, s.
const EVENT: f64 = 1e-12;

pub(crate) struct RungeKutta;

impl SolverFactory for RungeKutta {
    fn create<'a, O: Ode + 'a, D: Dae + 'a>(
        &self,
        start_time: f64,
        _relative_tolerance: f64,
        ode: O,
        _dae: Option<D>,
    ) -> Result<Box<dyn Solver + 'a>, SimulationError> {
        let mut solver =
            Running { t: start_time, x: vec![0.0; ode.nx()], positive: vec![false; ode.nz()], ode };
        solver.reset(start_time)?;
        Ok(Box::new(solver))
    }
}

struct Running<O> {
    t: f64,
    x: Vec<f64>,
    /// Domains of the event indicators.
    positive: Vec<bool>,
    ode: O,
}

impl<O: Ode> Running<O> {
    fn rates(&self, t: f64, x: &[f64]) -> Result<Vec<f64>, SimulationError> {
        let mut dx = vec![0.0; x.len()];
        self.ode.f(t, x, &mut dx)?;
        Ok(dx)
    }
    fn domains(&self, t: f64, x: &[f64]) -> Result<Vec<bool>, SimulationError> {
        let mut z = vec![0.0; self.positive.len()];
        self.ode.g(t, x, &mut z)?;
        Ok(z.iter().map(|z| *z > 0.0).collect())
    }
    /// The states a step `h` later.
    fn after(&self, h: f64) -> Result<Vec<f64>, SimulationError> {
        let moved = |k: &[f64], h: f64| self.x.iter().zip(k).map(|(x, k)| x + h * k).collect::<Vec<_>>();
        let k1 = self.rates(self.t, &self.x)?;
        let k2 = self.rates(self.t + h / 2.0, &moved(&k1, h / 2.0))?;
        let k3 = self.rates(self.t + h / 2.0, &moved(&k2, h / 2.0))?;
        let k4 = self.rates(self.t + h, &moved(&k3, h))?;
        let slope: Vec<_> = (0..k1.len()).map(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0).collect();
        Ok(moved(&slope, h))
    }
}

impl<O: Ode> Solver for Running<O> {
    fn reset(&mut self, time: f64) -> Result<(), SimulationError> {
        self.t = time;
        let mut nominals = vec![1.0; self.x.len()];
        self.ode.init(&mut self.x, &mut nominals)?;
        self.positive = self.domains(time, &self.x)?;
        Ok(())
    }

    fn step(&mut self, next_time: f64) -> Result<(f64, &[f64], bool), SimulationError> {
        let (begin, steps) = (self.t, ((next_time - self.t) / STEP).ceil().max(1.0));
        for k in 1..=steps as usize {
            let end =
                if k == steps as usize { next_time } else { begin + (next_time - begin) * k as f64 / steps };
            let (mut low, mut high) = (0.0, end - self.t);
            let mut x = self.after(high)?;
            let event = self.domains(end, &x)? != self.positive;
            while event && high - low > EVENT {
                let middle = 0.5 * (low + high);
                let trial = self.after(middle)?;
                if self.domains(self.t + middle, &trial)? == self.positive {
                    low = middle;
                } else {
                    (high, x) = (middle, trial);
                }
            }
            self.x = x;
            self.t = if event { self.t + high } else { end };
            self.positive = self.domains(self.t, &self.x)?;
            if event {
                return Ok((self.t, &self.x, true));
            }
        }
        Ok((next_time, &self.x, false))
    }
}
