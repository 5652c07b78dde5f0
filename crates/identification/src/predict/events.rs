//! Events of a simulation: when an indicator crosses 0, and the jump of states and sensitivities there.

use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{Lanes, PlantScalar};

use super::{Laws, PredictError, Simulation, plain};
use crate::law::FrozenPlant;

impl<T: PlantScalar> Simulation<'_, T> {
    /// The earliest of the crossings within (0, h]: the time at which it has just happened, and which it is.
    pub(super) fn locate(
        &mut self,
        crossed: &[usize],
        t: f64,
        x0: &[f64],
        u0: &[f64],
        h: f64,
    ) -> (f64, usize) {
        let f = FrozenPlant { model: self.model, p: &self.values, modes: &self.modes };
        let du = &self.slope[..];
        let Laws { known, constant, current, values, .. } = &mut self.laws;
        let (mut x, mut u) = (x0.to_vec(), u0.to_vec());
        let mut z = self.z[0].clone();
        let mut at = |tau: f64, i: usize| {
            x.copy_from_slice(x0);
            match constant {
                Some(own) => own.known[*current].1.step_once(&mut x, [u0, du], tau, values),
                None => known[*current].2.step_once(&f, t, &mut x, u0, du, tau),
            }
            u.iter_mut().zip(u0.iter().zip(du)).for_each(|(u, (u0, du))| *u = u0 + du * tau);
            let at = At { t: t + tau, x: &x, u: &u, p: f.p, modes: f.modes };
            f.model.indicators(at, &mut z);
            z[i]
        };
        let mut earliest = (h, crossed[0]);
        for &i in crossed {
            // Illinois: false position that halves the end that stays.
            let before = self.z[0][i] > 0.0;
            let (mut a, mut b, mut za, mut zb) = (0.0, earliest.0, self.z[0][i], at(earliest.0, i));
            if (zb > 0.0) == before {
                continue;
            }
            let mut stayed = 0;
            for _ in 0..100 {
                if b - a <= 4.0 * f64::EPSILON * (t.abs() + h) {
                    break;
                }
                let middle = b - zb * (b - a) / (zb - za);
                let tau = if middle > a && middle < b { middle } else { 0.5 * (a + b) };
                let tau = if !(-3..=3).contains(&stayed) { 0.5 * (a + b) } else { tau };
                let zt = at(tau, i);
                if (zt > 0.0) == before {
                    (a, za) = (tau, zt);
                    stayed = if stayed > 0 { stayed + 1 } else { 1 };
                    zb *= if stayed > 1 { 0.5 } else { 1.0 };
                } else {
                    (b, zb) = (tau, zt);
                    stayed = if stayed < 0 { stayed - 1 } else { -1 };
                    za *= if stayed < -1 { 0.5 } else { 1.0 };
                }
            }
            earliest = (b, i);
        }
        earliest
    }

    /// Event iteration with the jump of the sensitivities; did anything change?
    pub(super) fn jump(&mut self, t: f64, which: usize, u: &[T]) -> Result<bool, PredictError> {
        let n = self.model.sizes();
        let modes = self.modes.clone();
        let (mut z, mut old) = (vec![T::zero(); n.indicators], vec![T::zero(); n.states]);
        let at = At { t: T::constant(t), x: &self.x, u, p: self.p, modes: &modes };
        T::indicators(self.model, at, &mut z);
        T::rates(self.model, at, &[], &mut old);
        let along = self.indicator_rate(t, which, &plain(&self.x), &plain(u), &plain(&old), &self.slope);
        // Value 0, derivative that of the event's time.
        let shift = if along != 0.0 && along.is_finite() {
            (z[which] - T::constant(z[which].value())) * (-1.0 / along)
        } else {
            T::zero()
        };
        self.x.iter_mut().zip(&old).for_each(|(x, f)| *x += *f * shift);
        let changed = self.update(t, u)?;
        let mut new = vec![T::zero(); n.states];
        let at = At { t: T::constant(t), x: &self.x, u, p: self.p, modes: &self.modes };
        T::rates(self.model, at, &[], &mut new);
        self.x.iter_mut().zip(&new).for_each(|(x, f)| *x += *f * -shift);
        Ok(changed)
    }

    /// dz/dt of an indicator along the motion.
    fn indicator_rate(&self, t: f64, which: usize, x: &[f64], u: &[f64], dx: &[f64], du: &[f64]) -> f64 {
        let moving = |v: f64, d: f64| -> Lanes {
            let mut moving = Dual::constant(v);
            moving.eps[0] = d;
            moving
        };
        let along =
            |v: &[f64], d: &[f64]| -> Vec<Lanes> { v.iter().zip(d).map(|(v, d)| moving(*v, *d)).collect() };
        let p: Vec<Lanes> = self.values.iter().map(|v| Dual::constant(*v)).collect();
        let mut z = vec![Lanes::default(); self.z[0].len()];
        let (x, u) = (along(x, dx), along(u, du));
        let at = At { t: moving(t, 1.0), x: &x, u: &u, p: &p, modes: &self.modes };
        self.model.indicators_lanes(at, &mut z);
        z[which].eps[0]
    }
}
