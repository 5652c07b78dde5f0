//! A model driven by the measured motion: at every instant the measured coordinates are where the recording has them, and
//! what the model lacks shows as the acceleration that is missing there and then.
//!
//! Nothing drifts, nothing bifurcates, and a look costs one evaluation of the rates per instant. Readings enter as they
//! are; what the model makes of them passes the Gaussian that their derivatives passed, so that both sides stay
//! consistent, fast torques (ripple, gear errors, play) included; coordinates that no sensor measures
//! and states of effects are integrated along. What is missing is split into octaves ([`super::octaves`]); each counts
//! in units of what a perfect model leaves there (noise, quantisation, hold of inputs, dry friction at reversals), which
//! a simulated recording of the nominal model shows, and of a tolerance for the forms of laws.

mod advance;
mod input;
mod links;
mod pace;
mod prescribed;
mod reversal;
mod sensed;
mod terms;

use std::collections::BTreeMap;

use trueup_identification::predict::PredictError;
use trueup_identification::run::IdentificationRun;
use trueup_identification::sensors::SensorSet;
use trueup_models::arm::ArmScalar;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_signals::spline::Spline;

use super::coordinate::median_step;
use super::octaves;
use super::problem::BalanceTarget;
use super::subject::EngineModel;
use advance::{AdvanceWorkspace, StepContext};
use input::{averaged, lag};
pub use links::Links;
pub use prescribed::{GriddedRecording, Leading, Smooth};
use trueup_identification::sizes::rates;

/// What forms of laws may err by, relative to the terms of the balance.
pub const FORM_ERROR: f64 = 3e-4;
/// The shortest kernel, in steps of the grid.
const KERNEL: f64 = 1.5;
/// Shortest steps of integration along the recording, s: behind a gear modes are faster than on an air-bearing table.
pub const PART: [f64; 2] = [2.5e-3, 5e-3];

/// The kernel for recordings, in steps of their grids: one for all, since what noise leaves depends on it. Velocities come
/// to about 2 % of what they are typically.
pub fn kernel<'a>(runs: impl Iterator<Item = &'a IdentificationRun>) -> f64 {
    // By channel: sum of squared rates, their count, the largest deviation of a reading over a step.
    let mut all: BTreeMap<&str, (f64, f64, f64)> = BTreeMap::new();
    for run in runs {
        let steps = run.channels.iter().filter_map(|c| median_step(&c.t));
        let step = steps.fold(f64::INFINITY, f64::min);
        for c in &run.channels {
            let (sum, count) = rates(&c.t, &c.y);
            let e = all.entry(&c.name).or_default();
            *e = (e.0 + sum, e.1 + count, e.2.max(c.sigma / step));
        }
    }
    all.values().fold(KERNEL, |kernel, (sum, count, rough)| {
        let rms = (sum / count.max(1.0)).sqrt().max(f64::MIN_POSITIVE);
        let optimal = (rough / (0.02 * rms)).powi(2) / (4.0 * std::f64::consts::PI.sqrt());
        kernel.max(optimal.cbrt().min(6.0))
    })
}

impl GriddedRecording {
    /// A recording on its grid, smoothed by a kernel of that many steps; floors not yet known.
    pub fn new(run: &IdentificationRun, inputs: usize, kernel: f64) -> Option<Self> {
        let steps = run.channels.iter().filter_map(|c| median_step(&c.t));
        let step = steps.fold(f64::INFINITY, f64::min);
        let ends = run.channels.iter().filter_map(|c| c.t.last()).fold(f64::INFINITY, |m, t| m.min(*t));
        if !step.is_finite() || ends <= run.start {
            return None;
        }
        let n = ((ends - run.start) / step).floor() as usize + 1;
        let t: Vec<f64> = (0..n).map(|k| run.start + k as f64 * step).collect();
        if n < 40 {
            return None;
        }
        let mut channels = Vec::with_capacity(run.channels.len());
        for c in &run.channels {
            let times: Vec<f64> = c.t.iter().map(|t| t - c.delay).collect();
            let spline = Spline::new(&times, &c.y, 0.0)?;
            let y: Vec<f64> = t.iter().map(|t| spline.at(*t)[0]).collect();
            let smoothed = |order| octaves::gaussian(&y, kernel, order);
            channels.push(Smooth {
                output: c.output,
                sigma: c.sigma,
                smooth_sigma: c.sigma / (2.0 * std::f64::consts::PI.sqrt() * kernel).sqrt(),
                rate_sigma: c.sigma / step / (4.0 * std::f64::consts::PI.sqrt() * kernel.powi(3)).sqrt(),
                dy: smoothed(1).iter().map(|v| v / step).collect(),
                ddy: smoothed(2).iter().map(|v| v / (step * step)).collect(),
                y: smoothed(0),
                enters: {
                    let narrow = (0.5 * kernel).max(1.0);
                    let rate = octaves::gaussian(&y, narrow, 1).iter().map(|v| v / step).collect();
                    [y, rate]
                },
            });
        }
        let mut u = vec![Vec::new(); inputs];
        for d in &run.drives {
            u[d.input] = averaged(d, &t, step);
        }
        let edge = (4.0 * kernel).ceil() as usize + 2;
        let counts = edge..n.saturating_sub(edge);
        Some(Self {
            name: run.name.clone(),
            part: PART[0],
            step,
            kernel,
            reversal: vec![false; n],
            turning: Vec::new(),
            t,
            channels,
            inputs: u,
            parts: octaves::parts(counts.len()),
            counts,
            whiten: Vec::new(),
            share: Vec::new(),
            floors: Vec::new(),
            leading: Leading::default(),
        })
    }

    /// The same with what moves in time moved: `(target, seconds)`.
    pub fn shifted(&self, moves: &[(BalanceTarget, f64)]) -> Self {
        let mut s = self.clone();
        for (target, by) in moves {
            match target {
                BalanceTarget::SensorDelay(output) => {
                    let samples = by / self.step;
                    for c in s.channels.iter_mut().filter(|c| c.output == *output) {
                        let [a, b] = &mut c.enters;
                        for v in [&mut c.y, &mut c.dy, &mut c.ddy, a, b] {
                            *v = octaves::moved(v, samples);
                        }
                    }
                    // What turns did so before it was read.
                    if self.turning.iter().any(|c| self.channels[*c].output == *output) {
                        let early = (samples.round().max(0.0) as usize).min(s.reversal.len());
                        s.reversal.rotate_left(early);
                    }
                }
                BalanceTarget::ActuatorDeadTime(input) => {
                    s.inputs[*input] = octaves::moved(&s.inputs[*input], -by / self.step);
                }
                BalanceTarget::ActuatorLag(input) => lag(&mut s.inputs[*input], by / self.step),
                _ => {}
            }
        }
        s
    }

    /// How many residuals there are.
    pub fn len(&self) -> usize {
        self.channels.len() * octaves::length(self.counts.len())
    }
    /// None.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// What each channel shows beyond what the model predicts: second derivative (of a velocity channel next to an
    /// angle: the reading itself), simulated less measured, at every instant of the grid.
    ///
    /// # Errors
    /// States that are not finite.
    pub fn missing<T: ArmScalar>(
        &self,
        model: &EngineModel,
        links: &Links,
        p: &[T],
        sensors: &SensorSet<T>,
    ) -> Result<Vec<Vec<T>>, PredictError> {
        let sizes = model.sizes();
        let n = self.t.len();
        let sensed = self.sensed(model, links, p, sensors);
        let read = sensors.inputs_of();
        let h = self.step;
        // Coordinates: position, velocity, acceleration; what a sensor adds is taken out of its readings.
        let pulls = self.accelerations(links);
        let bound = !pulls.is_empty();
        let at = |i: usize, k: usize| -> [T; 3] {
            let Some((c, f, rate)) = links.leads[i] else { return [T::zero(); 3] };
            let s = &self.channels[c];
            let less = |v: f64, d: usize| match &sensed[c] {
                Some(s) => (-s[d][k] + v) / f,
                None => T::constant(v / f),
            };
            let pull = |d: usize| pulls.get(i).map_or(T::zero(), |v| less(v[k], d));
            if rate {
                [T::zero(), less(s.enters[0][k], 0), pull(1)]
            } else {
                [less(s.enters[0][k], 0), less(s.enters[1][k], 1), pull(2)]
            }
        };
        let mut x = vec![T::zero(); sizes.states];
        T::start(model.plant(), p, &mut x);
        let (mut u, mut middle) = (vec![T::zero(); sizes.inputs], vec![T::zero(); sizes.inputs]);
        let mut modes = vec![0i32; sizes.modes];
        let none = modes.clone();
        let direct = links.shows.contains(&None);
        let mut shown = vec![T::zero(); sizes.outputs];
        let mut plain = (vec![0.0; sizes.states], vec![0.0; sizes.inputs]);
        let values: Vec<f64> = p.iter().map(|v| v.value()).collect();
        let (mut dx, mut work) = (vec![T::zero(); sizes.states], AdvanceWorkspace::new(sizes.states));
        let count = links.leads.len();
        let mut integral = vec![T::zero(); count];
        let mut coordinate = vec![[T::zero(); 3]; count];
        let mut ahead = vec![[T::zero(); 3]; count];
        let mut out: Vec<Vec<T>> = vec![Vec::with_capacity(n); self.channels.len()];
        let mut substeps = (h / self.part).ceil().max(1.0) as usize;
        for k in 0..n {
            for (i, c) in coordinate.iter_mut().enumerate() {
                *c = at(i, k);
                if matches!(links.leads[i], Some((.., true))) {
                    c[0] = integral[i];
                    integral[i] += c[1] * h;
                }
            }
            links.lead(&coordinate, &mut x);
            for (u, series) in u.iter_mut().zip(&self.inputs) {
                *u = T::constant(series.get(k).copied().unwrap_or(0.0));
            }
            for ((u, gain), bias) in u.iter_mut().zip(&read.gain).zip(&read.bias) {
                *u = *u * *gain + *bias;
            }
            if sizes.modes > 0 {
                plain.0.iter_mut().zip(&x).for_each(|(a, b)| *a = b.value());
                plain.1.iter_mut().zip(&u).for_each(|(a, b)| *a = b.value());
                for &i in &links.held {
                    let Some((c, f, rate)) = links.leads[i] else { continue };
                    let s = &self.channels[c];
                    let v = if rate { s.y[k] } else { s.dy[k] };
                    let moves = v.abs() >= 5.0 * s.rate_sigma;
                    plain.0[links.velocity[i]] = if moves { v / f } else { 0.0 };
                }
                let at = At { t: self.t[k], x: &plain.0, u: &plain.1, p: &values, modes: &none };
                modes.fill(0);
                model.plant().start_modes(at, &mut modes);
            }
            let t = T::constant(self.t[k]);
            T::rates(model.plant(), At { t, x: &x, u: &u, p, modes: &modes }, &[], &mut dx);
            if direct {
                T::outputs(model.plant(), At { t, x: &x, u: &u, p, modes: &modes }, &mut shown);
            }
            for (c, s) in self.channels.iter().enumerate() {
                out[c].push(match links.shows[c] {
                    // A torque or an acceleration that is measured: the reading itself.
                    None => {
                        let more = sensed[c].as_ref().map_or(T::zero(), |s| s[0][k]);
                        sensors.outputs[s.output].reads(shown[s.output] + more)
                    }
                    // It prescribes nothing: its readings.
                    Some((i, f, rate)) if links.leads[i].is_none() => {
                        let more = sensed[c].as_ref().map_or(T::zero(), |s| s[0][k]);
                        let state =
                            if rate { x[links.velocity[i]] } else { links.position(i, &coordinate, &x) };
                        state * f + more
                    }
                    // What prescribes its coordinate: its second derivative, or the slope of a velocity. Next to another one: the
                    // reading.
                    Some((i, f, rate)) => {
                        let leads = self.as_lead(links, i, c);
                        let d = if leads { 2 - usize::from(rate) } else { 0 };
                        let more = sensed[c].as_ref().map_or(T::zero(), |s| s[d][k]);
                        let own =
                            if leads { dx[links.velocity[i]] } else { coordinate[i][usize::from(rate)] };
                        own * f + more
                    }
                });
            }
            if k + 1 == n || (links.free.is_empty() && links.followers.is_empty()) {
                continue;
            }
            for (i, c) in ahead.iter_mut().enumerate() {
                *c = at(i, k + 1);
                if matches!(links.leads[i], Some((.., true))) {
                    c[0] = integral[i];
                }
            }
            if k == 0 && substeps > 1 && links.followers.is_empty() {
                plain.0.iter_mut().zip(&x).for_each(|(a, b)| *a = b.value());
                plain.1.iter_mut().zip(&u).for_each(|(a, b)| *a = b.value());
                // What sticks is slow: sliding as well.
                let sliding = vec![1; sizes.modes];
                let fastest = [&modes, &sliding].map(|modes| {
                    let at = At { t: self.t[0], x: &plain.0, u: &plain.1, p: &values, modes };
                    pace::fastest(model, links, &at)
                });
                substeps = pace::parts(h, fastest[0].max(fastest[1]), substeps);
            }
            let part = h / substeps as f64;
            for s in 0..substeps {
                let share = |w: f64, m: &mut Vec<[T; 3]>| {
                    let used = if bound { 3 } else { 2 };
                    for ((m, a), b) in m.iter_mut().zip(&coordinate).zip(&ahead) {
                        (0..used).for_each(|d| m[d] = a[d] * (1.0 - w) + b[d] * w);
                    }
                };
                let from = s as f64 / substeps as f64;
                for (i, (m, series)) in middle.iter_mut().zip(&self.inputs).enumerate() {
                    let w = from + 0.5 / substeps as f64;
                    let v = series.get(k).zip(series.get(k + 1)).map_or(0.0, |(a, b)| a * (1.0 - w) + b * w);
                    *m = read.gain[i] * v + read.bias[i];
                }
                let context = StepContext { model, links, p, u: &middle, modes: &modes, step: part };
                context.advance(self.t[k] + from * h, &mut x, &mut work, |w, m| {
                    share(from + w / substeps as f64, m);
                });
            }
            if let Some(state) = x.iter().position(|v| !v.value().is_finite()) {
                return Err(PredictError::NotFinite { run: self.name.clone(), t: self.t[k], state });
            }
        }
        // The model's side through the kernel that the readings passed.
        for (c, s) in self.channels.iter().enumerate() {
            let measured = match links.shows[c] {
                Some((i, _, false)) if self.as_lead(links, i, c) => &s.ddy,
                Some((i, _, true)) if self.as_lead(links, i, c) => &s.dy,
                _ => &s.y,
            };
            let series = octaves::gaussian(&out[c], self.kernel, 0);
            out[c] = series.into_iter().zip(measured).map(|(v, m)| v - *m).collect();
        }
        Ok(out)
    }

    /// Second derivatives of what prescribes each coordinate, as the channel has them, with what the kernel takes off passed through it
    /// once more (Tukey's twicing): with them is integrated what nothing prescribes, which no other kernel makes up for. None where
    /// no row is given.
    fn accelerations(&self, links: &Links) -> Vec<Vec<f64>> {
        let one = |lead: &Option<(usize, f64, bool)>| {
            let Some((c, _, rate)) = *lead else { return Vec::new() };
            let s = &self.channels[c];
            if rate {
                return s.dy.clone();
            }
            let once = octaves::gaussian(&s.enters[0], self.kernel, 2);
            let twice = octaves::gaussian(&once, self.kernel, 0);
            once.iter().zip(twice).map(|(a, b)| (2.0 * a - b) / (self.step * self.step)).collect()
        };
        if links.given.is_empty() { Vec::new() } else { links.leads.iter().map(one).collect() }
    }

    /// Whether a channel is looked at as one that prescribes its coordinate: as its acceleration.
    fn as_lead(&self, links: &Links, coordinate: usize, channel: usize) -> bool {
        links.lead_of(coordinate) == Some(channel) || self.leading.apart.contains(&channel)
    }

    /// Whether a channel is compared as an acceleration, not by its readings.
    pub fn shows_acceleration(&self, links: &Links, channel: usize) -> bool {
        matches!(links.shows[channel], Some((i, ..)) if links.leads[i].is_some() && self.as_lead(links, i, channel))
    }

    /// Octaves of what is missing, in units of their floors; the channels of one part after each other.
    pub fn weighted<T: Scalar>(&self, missing: &[Vec<T>]) -> Vec<T> {
        let split: Vec<Vec<T>> = missing.iter().map(|v| octaves::split(&self.counted(v))).collect();
        let m = missing.len();
        let mut all = Vec::with_capacity(self.len());
        for (k, part) in self.parts.iter().enumerate() {
            let Some(rows) = self.whiten.get(part.octave) else {
                all.extend(split.iter().map(|s| s[k]));
                continue;
            };
            let w = rows;
            for i in 0..m {
                all.push((0..=i).fold(T::zero(), |sum, j| sum + split[j][k] * w[i * m + j]));
            }
        }
        all
    }

    /// Sums of products of the channels' values by octave, with their counts.
    pub fn products(&self, series: &[Vec<f64>]) -> Vec<(Vec<f64>, f64)> {
        let split: Vec<Vec<f64>> = series.iter().map(|v| octaves::split(&self.counted(v))).collect();
        let m = series.len();
        let octaves = self.parts.last().map_or(0, |p| p.octave + 1);
        let mut all = vec![(vec![0.0; m * m], 0.0); octaves];
        for (k, part) in self.parts.iter().enumerate() {
            let (sums, count) = &mut all[part.octave];
            *count += 1.0;
            for i in 0..m {
                for j in 0..m {
                    sums[i * m + j] += split[i][k] * split[j][k];
                }
            }
        }
        all
    }
}
