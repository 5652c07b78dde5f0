//! What the tests of the manipulators share: a high-order integrator with event location, and a generator.
#![allow(dead_code, clippy::panic, clippy::type_complexity)]

use trueup_models::arm::PlanarManipulator;
use trueup_numerics::hybrid::{At, Hybrid};

/// A run: model, parameters, its state.
pub(crate) struct Run<'a, M: Hybrid = PlanarManipulator> {
    pub(crate) model: &'a M,
    pub(crate) p: Vec<f64>,
    pub(crate) input: Box<dyn Fn(f64) -> Vec<f64> + 'a>,
    pub(crate) t: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) modes: Vec<i32>,
    /// Power that goes in or is lost, integrated next to the states (see [`Run::with_power`]).
    pub(crate) power: Box<dyn Fn(&At<f64>, &M) -> f64 + 'a>,
    pub(crate) work: f64,
    pub(crate) events: Vec<(f64, Vec<i32>)>,
}

impl<'a, M: Hybrid> Run<'a, M> {
    pub(crate) fn new(model: &'a M, p: &[f64], input: impl Fn(f64) -> Vec<f64> + 'a) -> Self {
        let s = model.sizes();
        let (mut x, mut modes) = (vec![0.0; s.states], vec![0; s.modes]);
        model.start(p, &mut x);
        model.start_modes(At { t: 0.0, x: &x, u: &input(0.0), p, modes: &[] }, &mut modes);
        let mut run = Self {
            model,
            p: p.to_vec(),
            input: Box::new(input),
            t: 0.0,
            x,
            modes,
            power: Box::new(|_, _| 0.0),
            work: 0.0,
            events: Vec::new(),
        };
        run.iterate();
        run
    }
    pub(crate) fn with_power(mut self, power: impl Fn(&At<f64>, &M) -> f64 + 'a) -> Self {
        self.power = Box::new(power);
        self
    }
    pub(crate) fn iterate(&mut self) {
        let u = (self.input)(self.t);
        for _ in 0..100 {
            if self.model.update(self.t, &mut self.x, &u, &self.p, &mut self.modes).settled() {
                return;
            }
        }
        panic!("event iteration does not settle at t = {}: {:?}", self.t, self.modes);
    }
    pub(crate) fn outputs(&self) -> Vec<f64> {
        let mut y = vec![0.0; self.model.sizes().outputs];
        let u = (self.input)(self.t);
        self.model.outputs(At { t: self.t, x: &self.x, u: &u, p: &self.p, modes: &self.modes }, &mut y);
        y
    }
    fn slope(&self, t: f64, z: &[f64]) -> Vec<f64> {
        let (u, n) = ((self.input)(t), self.x.len());
        let at = At { t, x: &z[..n], u: &u, p: &self.p, modes: &self.modes };
        let mut dz = vec![0.0; n + 1];
        self.model.rates(at, &mut dz[..n]);
        dz[n] = (self.power)(&at, self.model);
        dz
    }
    /// One step of Gragg's modified midpoint rule, extrapolated to order 14.
    fn step(&self, h: f64) -> Vec<f64> {
        let mut z0 = self.x.clone();
        z0.push(self.work);
        let first = self.slope(self.t, &z0);
        let mut table: Vec<Vec<f64>> = Vec::new();
        let counts = [2, 4, 6, 8, 10, 12, 14];
        for (i, n) in counts.iter().enumerate() {
            let s = h / f64::from(*n);
            let (mut a, mut b) =
                (z0.clone(), z0.iter().zip(&first).map(|(z, d)| z + s * d).collect::<Vec<_>>());
            for k in 1..=*n {
                let d = self.slope(self.t + s * f64::from(k), &b);
                if k == *n {
                    let end = a.iter().zip(&b).zip(&d).map(|((a, b), d)| 0.5 * (a + b + s * d)).collect();
                    table.push(end);
                } else {
                    let c = a.iter().zip(&d).map(|(a, d)| a + 2.0 * s * d).collect();
                    (a, b) = (b, c);
                }
            }
            for j in (0..i).rev() {
                let ratio = f64::from(counts[i]) / f64::from(counts[j]);
                let weight = 1.0 / (ratio * ratio - 1.0);
                for k in 0..z0.len() {
                    let better = table[j + 1][k] + (table[j + 1][k] - table[j][k]) * weight;
                    table[j][k] = better;
                }
            }
        }
        table.swap_remove(0)
    }
    fn indicators(&self, t: f64, x: &[f64]) -> Vec<f64> {
        let mut z = vec![0.0; self.model.sizes().indicators];
        let u = (self.input)(t);
        self.model.indicators(At { t, x, u: &u, p: &self.p, modes: &self.modes }, &mut z);
        z
    }
    /// On to `end` in steps of `h`, events located to 1e-13 s: by secants, each third time by halves.
    pub(crate) fn to(&mut self, end: f64, h: f64) {
        let n = self.x.len();
        while self.t < end - 1e-13 {
            let (mut h, mut at_low) = (h.min(end - self.t), self.indicators(self.t, &self.x));
            let mut z = self.step(h);
            let mut at_high = self.indicators(self.t + h, &z[..n]);
            let differ = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (*a > 0.0) != (*b > 0.0));
            let event = differ(&at_low, &at_high);
            if event {
                let (mut low, mut high) = (0.0, h);
                for pass in 1.. {
                    if high - low <= 1e-13 {
                        break;
                    }
                    let crossed = at_low.iter().zip(&at_high).filter(|(a, b)| (**a > 0.0) != (**b > 0.0));
                    let secant = crossed.map(|(a, b)| low + (high - low) * a / (a - b)).fold(high, f64::min);
                    let middle = if pass % 3 == 0 { 0.5 * (low + high) } else { secant };
                    let middle = middle.clamp(low + 0.5e-13, high - 0.5e-13);
                    let m = self.step(middle);
                    let now = self.indicators(self.t + middle, &m[..n]);
                    // The end that stays counts for half (Illinois).
                    if differ(&at_low, &now) {
                        (high, z, at_high) = (middle, m, now);
                        at_low.iter_mut().for_each(|v| *v *= 0.5);
                    } else {
                        (low, at_low) = (middle, now);
                        at_high.iter_mut().for_each(|v| *v *= 0.5);
                    }
                }
                h = high;
            }
            self.t += h;
            self.work = z[n];
            self.x.copy_from_slice(&z[..n]);
            if event {
                self.iterate();
                self.events.push((self.t, self.modes.clone()));
                assert!(self.events.len() < 10_000, "too many events by t = {}", self.t);
            }
        }
    }
}

/// Deterministic random numbers.
pub(crate) struct Random(pub(crate) u64);
impl Random {
    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
    pub(crate) fn vector(&mut self, n: usize, size: f64) -> Vec<f64> {
        (0..n).map(|_| self.within(-size, size)).collect()
    }
}

pub(crate) const NO_EFFECTS: &[&str] = &[];
