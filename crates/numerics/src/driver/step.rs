//! One accepted step of a one-step method, with step control and event location: [`ErrorControlledStepper`].

use super::terms::{DriveError, DriverMemory, DriverOptions, DriverQuantity, DriverReached, Solver};
use crate::event::{Direction, Locator};
use crate::integrate::{Dopri5, Euler, Ode, Rk4, Rodas4, Ros2, StepFault, StepMethod, Tolerance};

/// dx/dt = f(t, x) with event indicators, smooth until the next event.
pub trait OdeSystem: Ode {
    /// Event indicators at (t, x) into `z`.
    fn indicators(&mut self, t: f64, x: &[f64], z: &mut [f64]);
}

/// Times closer than this are the same.
pub(super) fn tiny(t: f64) -> f64 {
    4.0 * f64::EPSILON * t.abs()
}

/// Step in s that is too small even at t = 0.
const SHORTEST: f64 = 1e-30;

/// Bounds of the ratio of one step to the one before, safety factor and integral gain of the step control
/// (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.4 and IV.2).
const SHRINK: f64 = 0.2;
const GROW: f64 = 10.0;
const SAFETY: f64 = 0.9;
const BETA: f64 = 0.04;

/// A one-step method with its step control and event location; work space only, see [`DriverMemory`].
pub struct ErrorControlledStepper {
    nominal: Vec<f64>,
    method: Box<dyn StepMethod>,
    locator: Locator,
    x1: Vec<f64>,
    f0: Vec<f64>,
    f1: Vec<f64>,
}

impl ErrorControlledStepper {
    /// Allocates everything. `nominal` are the typical magnitudes of the states.
    pub fn new(solver: Solver, nominal: Vec<f64>, indicators: usize) -> Self {
        let n = nominal.len();
        let method: Box<dyn StepMethod> = match solver {
            Solver::Explicit => Box::new(Dopri5::new(n)),
            Solver::Stiff => Box::new(Rodas4::new(n)),
            Solver::FixedEuler => Box::new(Euler::new(n)),
            Solver::FixedExplicit => Box::new(Rk4::new(n)),
            Solver::FixedStiff => Box::new(Ros2::new(n)),
        };
        let row = || vec![0.0; n];
        let locator = Locator::new(indicators, method.dense_is_parabola());
        Self { nominal, method, locator, x1: row(), f0: row(), f1: row() }
    }

    /// Typical magnitudes of the states.
    pub fn nominal_mut(&mut self) -> &mut [f64] {
        &mut self.nominal
    }

    /// Forgets what belongs to the states and inputs before an event; the indicators behind it are to be written.
    pub fn restart(&mut self) -> &mut [f64] {
        self.method.restart();
        self.locator.start()
    }

    /// One accepted step, not beyond `stop`; ends at the first event in it, whose indicator is returned.
    ///
    /// # Errors
    /// A state, rate or indicator that is not finite however short the step; too many or too short steps.
    pub fn step<S: OdeSystem>(
        &mut self,
        system: &mut S,
        direction: &dyn Fn(usize) -> Direction,
        time: &mut f64,
        x: &mut [f64],
        memory: &mut DriverMemory,
        stop: f64,
        options: &DriverOptions,
        done: &mut DriverReached,
    ) -> Result<Option<usize>, DriveError> {
        let (t, left, floor) = (*time, stop - *time, tiny(*time).max(SHORTEST));
        let Self { nominal, method, locator, x1, f0, f1 } = self;
        let tol = Tolerance { relative: options.tolerance, nominal };
        let adaptive = method.error_order() > 0;
        let power = 1.0 / f64::from(method.error_order());
        if adaptive && memory.step <= 0.0 {
            memory.step = first_step(system, t, x, tol, power, f0, f1, x1).min(left);
        }
        let mut proposed =
            if adaptive { memory.step.max(floor).min(options.max_step) } else { options.max_step };
        let mut fault = None;
        let mut retried = false;
        loop {
            if done.accepted + done.rejected >= options.max_steps {
                return Err(DriveError::MaxSteps { t, steps: options.max_steps });
            }
            // Never a tiny last step: two halves instead.
            let h = if left <= proposed * (1.0 + 1e-9) {
                left
            } else if adaptive && left < 2.0 * proposed {
                0.5 * left
            } else {
                proposed
            };
            let t1 = if h == left { stop } else { t + h };
            let shrink = match method.attempt(system, t, x, h, tol) {
                Err(f) => {
                    fault = Some(match f {
                        StepFault::Rate(i) | StepFault::Matrix(i) => DriverQuantity::Rate(i),
                        StepFault::State(i) => DriverQuantity::State(i),
                    });
                    SHRINK
                }
                Ok(error) if error <= 1.0 => {
                    let mut crossing = None;
                    let mut bad = None;
                    if locator.count() > 0 {
                        method.prepare_dense(system, t, x, h);
                        let mut indicators = |time: f64, z: &mut [f64]| {
                            if time < t1 {
                                method.dense((time - t) / h, x1);
                            } else {
                                x1.copy_from_slice(method.end());
                            }
                            system.indicators(time, x1, z);
                        };
                        match locator.find(t, t1, direction, &mut indicators) {
                            Ok(found) => crossing = found,
                            Err(i) => bad = Some(DriverQuantity::Indicator(i)),
                        }
                    }
                    if bad.is_none() {
                        done.accepted += 1;
                        if adaptive {
                            let m = &mut *memory;
                            let slope = error.powf(power - 0.75 * BETA) / m.error.powf(BETA);
                            let ratio = (SAFETY / slope).clamp(SHRINK, GROW);
                            let new = h * if retried { ratio.min(1.0) } else { ratio };
                            // A step that was cut short is no reason against the size proposed before.
                            m.step = if h < proposed && !retried { new.max(proposed) } else { new };
                            m.error = error.max(1e-4);
                        }
                        match crossing {
                            Some(c) => {
                                if c.t < t1 {
                                    method.dense((c.t - t) / h, x);
                                } else {
                                    x.copy_from_slice(method.end());
                                }
                                *time = c.t;
                            }
                            None => {
                                x.copy_from_slice(method.end());
                                *time = t1;
                                method.accept();
                                locator.carry();
                            }
                        }
                        return Ok(crossing.map(|c| c.indicator));
                    }
                    fault = bad;
                    SHRINK
                }
                Ok(error) => (SAFETY / error.powf(power)).max(SHRINK),
            };
            done.rejected += 1;
            retried = true;
            proposed = h * shrink;
            if !adaptive || proposed <= floor {
                return Err(match fault {
                    Some(what) => DriveError::NotFinite { t, what },
                    None => DriveError::StepTooSmall { t, h: proposed },
                });
            }
        }
    }
}

/// Size of a first step (Hairer, Norsett, Wanner I, II.4).
fn first_step(
    ode: &mut dyn Ode,
    t: f64,
    x: &[f64],
    tol: Tolerance,
    power: f64,
    f0: &mut [f64],
    f1: &mut [f64],
    x1: &mut [f64],
) -> f64 {
    if x.is_empty() {
        return f64::INFINITY;
    }
    ode.rates(t, x, f0);
    let (d0, d1) = (tol.ratio(|i| x[i], x, x), tol.ratio(|i| f0[i], x, x));
    let h0 = if d0 < 1e-5 || d1 < 1e-5 { 1e-6 } else { 0.01 * d0 / d1 };
    for i in 0..x.len() {
        x1[i] = x[i] + h0 * f0[i];
    }
    ode.rates(t + h0, x1, f1);
    let d2 = tol.ratio(|i| f1[i] - f0[i], x, x) / h0;
    let h1 = if d1.max(d2) <= 1e-15 { (1e-3 * h0).max(1e-6) } else { (0.01 / d1.max(d2)).powf(power) };
    let h = h1.min(100.0 * h0);
    // Not a number: whatever is wrong with the rates is found out by the step itself.
    if h > 0.0 { h } else { 1e-6 }
}
