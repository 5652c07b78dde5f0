//! Integration of what the recording does not prescribe.

use trueup_models::arm::ArmScalar;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

use super::Links;
use crate::engine::subject::EngineModel;

/// Space for one step.
pub(super) struct AdvanceWorkspace<T> {
    k: [Vec<T>; 4],
    x: Vec<T>,
    c: Vec<[T; 3]>,
    given: Vec<(usize, T)>,
}

impl<T: Scalar> AdvanceWorkspace<T> {
    pub(super) fn new(n: usize) -> Self {
        let v = || vec![T::zero(); n];
        Self { k: [v(), v(), v(), v()], x: v(), c: Vec::new(), given: Vec::new() }
    }
}

/// One step of what is not prescribed.
pub(super) struct StepContext<'a, T> {
    pub(super) model: &'a EngineModel,
    pub(super) links: &'a Links,
    pub(super) p: &'a [T],
    pub(super) u: &'a [T],
    pub(super) modes: &'a [i32],
    pub(super) step: f64,
}

impl<T: ArmScalar> StepContext<'_, T> {
    /// Classical Runge-Kutta for what moves freely; exact in the own rate of what follows.
    pub(super) fn advance(
        &self,
        t: f64,
        x: &mut [T],
        w: &mut AdvanceWorkspace<T>,
        share: impl Fn(f64, &mut Vec<[T; 3]>),
    ) {
        let h = self.step;
        w.c.resize(self.links.leads.len(), [T::zero(); 3]);
        let rates =
            |part: f64, x: &mut [T], (c, given): (&mut Vec<[T; 3]>, &mut Vec<(usize, T)>), dx: &mut [T]| {
                share(part, c);
                self.links.lead(c, x);
                let t = T::constant(t + part * h);
                self.links.accelerations(c, given);
                self.model.rates_prescribed(At { t, x, u: self.u, p: self.p, modes: self.modes }, given, dx);
            };
        w.x.copy_from_slice(x);
        if self.links.free.is_empty() {
            rates(0.5, &mut w.x, (&mut w.c, &mut w.given), &mut w.k[0]);
        } else {
            for (stage, part) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
                if stage > 0 {
                    for &s in &self.links.free {
                        w.x[s] = x[s] + w.k[stage - 1][s] * (part * h);
                    }
                }
                rates(part, &mut w.x, (&mut w.c, &mut w.given), &mut w.k[stage]);
            }
        }
        if !self.links.followers.is_empty() {
            let stage = usize::from(!self.links.free.is_empty());
            w.x.copy_from_slice(x);
            for &s in &self.links.free {
                w.x[s] = x[s] + w.k[0][s] * (0.5 * h);
            }
            let mut moved = vec![T::zero(); self.links.followers.len()];
            for (m, &s) in moved.iter_mut().zip(&self.links.followers) {
                let d = 1e-3 * h * w.k[stage][s].value().abs() + 1e-300;
                *m = T::constant(d);
                w.x[s] += *m;
            }
            let (first, last) = w.k.split_at_mut(3);
            rates(0.5, &mut w.x, (&mut w.c, &mut w.given), &mut last[0]);
            for (m, &s) in moved.iter().zip(&self.links.followers) {
                let f = first[stage][s];
                if f.value() == 0.0 {
                    continue;
                }
                let z = (last[0][s] - f) / *m * h;
                let phi = if z.value().abs() < 1e-5 { z * 0.5 + 1.0 } else { (z.exp() - 1.0) / z };
                x[s] += f * phi * h;
            }
        }
        if self.links.free.is_empty() {
            return;
        }
        for &s in &self.links.free {
            let (k, old) = (&w.k, x[s]);
            let slope = if self.links.followers.is_empty() {
                (k[0][s] + (k[1][s] + k[2][s]) * 2.0 + k[3][s]) / 6.0
            } else {
                (k[1][s] + k[2][s]) * 0.5
            };
            x[s] = old + slope * h;
            // What turns against dry friction stops; the next instant shows whether it breaks away.
            if self.links.stops.contains(&s) && old.value() * x[s].value() < 0.0 {
                x[s] = T::zero();
            }
        }
    }
}
