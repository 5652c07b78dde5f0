//! What an unknown input at each place would have to be, and how well it would explain the readings.
//!
//! One hypothesis at a time: a random walk d enters the linear system at one place (a torque, or a reading), its intensity
//! is the one of the greatest likelihood (Kalman filter), its course that of the Rauch-Tung-Striebel smoother. The place
//! at which it leaves white innovations is where the gap arises.

use nalgebra::{SMatrix, SVector};
use trueup_numerics::order::descending;
use trueup_signals::process::ljung_box;

/// A system in N - 1 states, the unknown input being the N-th, in steps of one sample.
#[derive(Clone, Debug)]
pub struct UnknownInputSystem<'a, const N: usize> {
    /// x(k+1) = transition x(k) + push(k), by the place at which the unknown input enters.
    pub places: Vec<InputPlace<N>>,
    /// What known inputs add from each sample to the next.
    pub push: Vec<SVector<f64, N>>,
    /// Variance that they add beyond it (where friction is not known because the motor sticks); empty: none.
    pub process_noise: Vec<SMatrix<f64, N, N>>,
    /// Readings.
    pub readings: Vec<ChannelReading<'a, N>>,
    /// State at the first sample, d = 0.
    pub start: SVector<f64, N>,
    /// Its standard deviation; that of d is the place's.
    pub start_deviation: SVector<f64, N>,
    /// Length of a step, s.
    pub step: f64,
}

/// A place at which something unknown may enter.
#[derive(Clone, Debug)]
pub struct InputPlace<const N: usize> {
    /// `motor`, `transmission`, `load`, `sensor:<channel>`.
    pub name: String,
    /// With the unknown input's effect on the states in its last column.
    pub transition: SMatrix<f64, N, N>,
    /// The reading that it is added to, if it is an error of a sensor.
    pub reading: Option<usize>,
    /// Size that it may have, in its unit.
    pub scale: f64,
}

/// A measured channel: row times state, with white noise.
#[derive(Clone, Debug)]
pub struct ChannelReading<'a, const N: usize> {
    /// What it shows.
    pub row: SVector<f64, N>,
    /// Readings; missing ones are `NaN`.
    pub value: &'a [f64],
    /// Factor from reading to the row's unit.
    pub factor: f64,
    /// Standard deviation in the row's unit.
    pub deviation: f64,
}

/// The unknown input at one place.
#[derive(Clone, Debug, PartialEq)]
pub struct UnknownInputEstimate {
    /// The place.
    pub place: String,
    /// Twice the gain in log likelihood over no unknown input anywhere.
    pub gain: f64,
    /// Share of what there is to explain: 1 leaves innovations of the size of the sensors' noise; 0 for all where there
    /// is next to nothing to explain.
    pub explained: f64,
    /// Chance of innovations as correlated as these if nothing else were missing (first reading; Ljung-Box, 20 lags).
    pub whiteness: f64,
    /// Its course, sample by sample.
    pub value: Vec<f64>,
    /// Standard deviation of `value`.
    pub deviation: Vec<f64>,
}

/// One run of the filter.
struct FilterRun<const N: usize> {
    log_likelihood: f64,
    /// Sum of the logarithms of the innovations' variances, and how many there are.
    spread: f64,
    count: usize,
    /// Whitened innovations of the first reading.
    first: Vec<f64>,
    /// State and covariance before and after each sample's readings, if kept.
    kept: Vec<[(SVector<f64, N>, SMatrix<f64, N, N>); 2]>,
}

impl<const N: usize> UnknownInputSystem<'_, N> {
    fn samples(&self) -> usize {
        self.readings.iter().map(|r| r.value.len()).min().unwrap_or(0).min(self.push.len() + 1)
    }

    /// Of every place, most likely first. Empty without readings or places.
    pub fn estimate(&self) -> Vec<UnknownInputEstimate> {
        let n = self.samples();
        if n < 50 || self.places.is_empty() {
            return Vec::new();
        }
        let none = self.filter(&self.places[0], None, false);
        // What is there to explain: white innovations as small as those of a filter with the true input.
        let white = -0.5 * (none.spread + none.count as f64);
        let all: Vec<UnknownInputEstimate> =
            self.places.iter().map(|place| self.at(place, &none, white)).collect();
        let mut all: Vec<UnknownInputEstimate> = all.into_iter().filter(|e| e.gain.is_finite()).collect();
        descending(&mut all, |item| item.gain);
        all
    }

    fn at(&self, place: &InputPlace<N>, none: &FilterRun<N>, white: f64) -> UnknownInputEstimate {
        // Standard deviation of the walk over the whole run, in parts of the scale, as a logarithm.
        let duration = self.step * self.samples() as f64;
        let intensity = |z: f64| (place.scale * z.exp()).powi(2) / duration;
        let likelihood = |z: f64| self.filter(place, Some(intensity(z)), false).log_likelihood;
        let grid: Vec<(f64, f64)> =
            (0..9).map(|k| -9.0 + 1.75 * f64::from(k)).map(|z| (z, likelihood(z))).collect();
        let best = grid.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |b| b.0);
        let z = golden(best - 1.75, best + 1.75, likelihood);
        let run = self.filter(place, Some(intensity(z)), true);
        let (value, deviation) = self.smooth(place, &run);
        let gain = 2.0 * (run.log_likelihood - none.log_likelihood);
        let room = white - none.log_likelihood;
        // A few hundredths per reading are what a model may be wrong by without anything missing.
        let little = 0.05 * none.count as f64;
        let explained = if room > little { (0.5 * gain / room).clamp(0.0, 1.0) } else { 0.0 };
        let whiteness = ljung_box(&run.first, 20, 0).map_or(f64::NAN, |t| t.p_value);
        UnknownInputEstimate { place: place.name.clone(), gain, explained, whiteness, value, deviation }
    }

    /// `intensity` of the walk in unit^2/s; `None`: d = 0.
    fn filter(&self, place: &InputPlace<N>, intensity: Option<f64>, keep: bool) -> FilterRun<N> {
        let last = N - 1;
        let mut x = self.start;
        let mut p =
            SMatrix::<f64, N, N>::from_diagonal(&self.start_deviation.component_mul(&self.start_deviation));
        p[(last, last)] = if intensity.is_some() { place.scale * place.scale } else { 0.0 };
        x[last] = 0.0;
        let walk = intensity.unwrap_or(0.0) * self.step;
        self.run(place, (x, p), 0..self.samples(), |_| walk, keep)
    }

    /// The filter over these samples, from a state before the first one's readings; `walk` is the variance that d gets
    /// from a sample to the next.
    fn run(
        &self,
        place: &InputPlace<N>,
        (mut x, mut p): (SVector<f64, N>, SMatrix<f64, N, N>),
        samples: std::ops::Range<usize>,
        walk: impl Fn(usize) -> f64,
        keep: bool,
    ) -> FilterRun<N> {
        let last = N - 1;
        let rows: Vec<SVector<f64, N>> = self
            .readings
            .iter()
            .enumerate()
            .map(|(k, r)| {
                let mut row = r.row;
                row[last] = if place.reading == Some(k) { 1.0 } else { 0.0 };
                row
            })
            .collect();
        let mut run = FilterRun {
            log_likelihood: 0.0,
            spread: 0.0,
            count: 0,
            first: Vec::with_capacity(samples.len()),
            kept: Vec::new(),
        };
        for k in samples.clone() {
            let before = (x, p);
            for (i, (reading, row)) in self.readings.iter().zip(&rows).enumerate() {
                let y = reading.value[k] * reading.factor;
                if !y.is_finite() {
                    continue;
                }
                let pr = p * row;
                let s = row.dot(&pr) + reading.deviation * reading.deviation;
                let innovation = y - row.dot(&x);
                let gain = pr / s;
                x += gain * innovation;
                // Joseph's form keeps it positive.
                let keep = SMatrix::<f64, N, N>::identity() - gain * row.transpose();
                p = keep * p * keep.transpose()
                    + gain * gain.transpose() * (reading.deviation * reading.deviation);
                run.log_likelihood -= 0.5 * (s.ln() + innovation * innovation / s);
                run.spread += s.ln();
                run.count += 1;
                if i == 0 {
                    run.first.push(innovation / s.sqrt());
                }
            }
            if keep {
                run.kept.push([before, (x, p)]);
            }
            if k + 1 < samples.end {
                let f = &place.transition;
                x = f * x + self.push[k];
                p = f * p * f.transpose();
                p[(last, last)] += walk(k);
                if let Some(process_noise) = self.process_noise.get(k) {
                    p += process_noise;
                }
            }
        }
        run
    }

    /// Edges of the unknown input at a place, as sharp as the readings allow: the smoother makes ramps of them. Around each
    /// of these samples d is assumed to be constant but for one jump, and the likeliest sample for it is taken, `reach`
    /// samples away at most.
    pub fn sharpen(&self, place: &str, edges: &[usize], reach: usize) -> Vec<usize> {
        let n = self.samples();
        let Some(place) = self.places.iter().find(|p| p.name == place) else { return edges.to_vec() };
        let jump = place.scale * place.scale;
        let intensity = jump / (self.step * n.max(1) as f64);
        let wide = self.filter(place, Some(intensity), true);
        let likeliest = |edge: &usize| {
            let (from, to) = (edge.saturating_sub(2 * reach), (edge + 2 * reach).min(n));
            let Some([start, _]) = wide.kept.get(from).copied() else { return *edge };
            let at = |e: usize| {
                self.run(place, start, from..to, |k| if k + 1 == e { jump } else { 0.0 }, false)
                    .log_likelihood
            };
            let (low, high) =
                ((edge.saturating_sub(reach)).max(from + 1), (edge + reach).min(to.saturating_sub(1)));
            (low..=high).map(|e| (e, at(e))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(*edge, |b| b.0)
        };
        edges.iter().map(likeliest).collect()
    }

    /// d and its standard deviation, all readings used.
    fn smooth(&self, place: &InputPlace<N>, run: &FilterRun<N>) -> (Vec<f64>, Vec<f64>) {
        let last = N - 1;
        let n = run.kept.len();
        let (mut value, mut deviation) = (vec![0.0; n], vec![0.0; n]);
        let Some([_, (mut x, mut p)]) = run.kept.last().copied() else { return (value, deviation) };
        for k in (0..n).rev() {
            if k + 1 < n {
                let [_, (filtered, covariance)] = run.kept[k];
                let [(predicted, ahead), _] = run.kept[k + 1];
                // States differ by many orders of magnitude: scaled before it is inverted.
                let scale = ahead.diagonal().map(|d| 1.0 / d.max(1e-300).sqrt());
                let scaled = SMatrix::<f64, N, N>::from_fn(|i, j| ahead[(i, j)] * scale[i] * scale[j]);
                let Some(inverse) = scaled.cholesky().map(|c| c.inverse()).or_else(|| scaled.try_inverse())
                else {
                    (x, p) = (filtered, covariance);
                    value[k] = x[last];
                    deviation[k] = p[(last, last)].max(0.0).sqrt();
                    continue;
                };
                let inverse = SMatrix::<f64, N, N>::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]);
                let gain = covariance * place.transition.transpose() * inverse;
                x = filtered + gain * (x - predicted);
                p = covariance + gain * (p - ahead) * gain.transpose();
            }
            value[k] = x[last];
            deviation[k] = p[(last, last)].max(0.0).sqrt();
        }
        (value, deviation)
    }
}

/// Maximum of a function with one, by golden section.
fn golden(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const R: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (high - R * (high - low), low + R * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..7 {
        if fa > fb {
            (high, b, fb) = (b, a, fa);
            a = high - R * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + R * (high - low);
            fb = f(b);
        }
    }
    if fa > fb { a } else { b }
}

/// Shares of places: the best one's is what it explains, the others divide the rest as they would explain it alone.
pub fn place_shares(estimates: &[UnknownInputEstimate]) -> Vec<(String, f64)> {
    let Some((best, others)) = estimates.split_first() else { return Vec::new() };
    let sum: f64 = others.iter().map(|e| e.explained).sum();
    let rest =
        |e: &UnknownInputEstimate| if sum > 0.0 { (1.0 - best.explained) * e.explained / sum } else { 0.0 };
    std::iter::once((best.place.clone(), best.explained))
        .chain(others.iter().map(|e| (e.place.clone(), rest(e))))
        .collect()
}
