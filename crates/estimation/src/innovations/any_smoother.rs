//! Smoother for any sizes (modified Bryson-Frazier), with the powers of the latents' scores.
//!
//! With r the co-state of a node before its readings and W its covariance as the model expects it, a latent of memory f over the
//! step has the score (1 - f^2) r^2 per unit of its intensity, of which the model expects (1 - f^2) W. Their ratio over a recording
//! is 1 where the evidence is stationary in that intensity.

use super::any_size::{AnySizes, add, combine, dot, error_of, moved};
use super::filter_data::{DataColumn, FilterGains, SmoothedRecording};

/// Smooths a recording; `powers`: with the powers of the latents' scores.
#[inline(always)]
pub(super) fn smooth(g: &FilterGains<'_>, data: &DataColumn, powers: bool) -> SmoothedRecording {
    let input = &g.input;
    let n = AnySizes::of(input);
    let (all, nodes, channels) = (n.all, input.order.nodes(), input.channels);
    let mut predicted = vec![0.0; all * nodes];
    let mut errors = vec![0.0; nodes * channels];
    let (mut x, mut next) = (data.first.clone(), vec![0.0; all]);
    for t in 0..nodes {
        if t > 0 {
            moved(input, n, t - 1, &mut x, &mut next, data);
        }
        predicted[all * t..all * (t + 1)].copy_from_slice(&x);
        for at in (channels * t..channels * (t + 1)).filter(|at| input.variance[*at] > 0.0) {
            errors[at] = error_of(input, n, at, &x, data);
            add(&mut x, errors[at], &g.gain[all * at..all * (at + 1)]);
        }
    }
    let width = n.forces + channels;
    let (mut states, mut scores) = (predicted, vec![0.0; width * nodes]);
    let mut expected = powers.then(|| ExpectedPower::new(n));
    let (mut l, mut earlier) = (vec![0.0; all], vec![0.0; all]);
    for t in (0..nodes).rev() {
        for c in (0..channels).rev() {
            let at = channels * t + c;
            if input.variance[at] <= 0.0 {
                continue;
            }
            let (h, gain) = (&input.rows.h[all * at..all * (at + 1)], &g.gain[all * at..all * (at + 1)]);
            let s = errors[at] / g.variance[at] + dot(gain, &l);
            add(&mut l, -s, h);
            scores[width * t + n.forces + c] = s;
            for (k, d) in input.rows.direct[n.forces * at..][..n.forces].iter().enumerate() {
                scores[width * t + k] += 0.5 * d * s;
                if t > 0 {
                    scores[width * (t - 1) + k] += 0.5 * d * s;
                }
            }
            if let Some(w) = &mut expected {
                w.reading(h, gain, g.variance[at]);
            }
        }
        for i in 0..all {
            // The covariance is symmetric: by its rows.
            add(&mut states[all * t..][..all], -l[i], &g.predicted[all * (all * t + i)..][..all]); // (EST-6)
        }
        if t > 0 {
            let step = &input.steps[input.order.after(t - 1)];
            if let Some(w) = &mut expected {
                w.latents(&step.a, &l);
                w.step(&step.a);
            }
            earlier.fill(0.0);
            for k in 0..n.plain {
                for i in 0..n.forces {
                    scores[width * (t - 1) + i] -= step.b[n.forces * k + i] * l[k];
                }
                add(&mut earlier[..n.coupled], l[k], &step.a[all * k..][..n.coupled]);
            }
            (n.plain..all).for_each(|k| earlier[k] += step.a[(all + 1) * k] * l[k]);
            std::mem::swap(&mut l, &mut earlier);
        }
    }
    SmoothedRecording { states, scores, powers: expected.map_or_else(Vec::new, |w| w.powers) }
}

/// Covariance of the co-state as the model expects it, and the sums over the recording.
struct ExpectedPower {
    n: AnySizes,
    covariance: Vec<f64>,
    product: Vec<f64>,
    row: Vec<f64>,
    powers: Vec<[f64; 2]>,
}

impl ExpectedPower {
    fn new(n: AnySizes) -> Self {
        let square = || vec![0.0; n.all * n.all];
        let powers = vec![[0.0; 2]; n.all - n.plain];
        Self { n, covariance: square(), product: square(), row: vec![0.0; n.all], powers }
    }

    /// Back over a reading of row `h`, its gain, and the variance of its innovation.
    #[inline(always)]
    fn reading(&mut self, h: &[f64], gain: &[f64], variance: f64) {
        let all = self.n.all;
        // The covariance is symmetric: by its rows.
        combine(&mut self.row, gain, &self.covariance, all);
        let own = 1.0 / variance + dot(gain, &self.row);
        for (i, h_i) in h.iter().enumerate() {
            let to = &mut self.covariance[all * i..][..all];
            add(to, -self.row[i], h);
            if *h_i != 0.0 {
                add(to, -h_i, &self.row);
                add(to, h_i * own, h);
            }
        }
    }

    /// What the latents of a step add, with the co-state behind it.
    #[inline(always)]
    fn latents(&mut self, a: &[f64], l: &[f64]) {
        let all = self.n.all;
        for (sums, k) in self.powers.iter_mut().zip(self.n.plain..) {
            let new = 1.0 - a[(all + 1) * k].powi(2);
            sums[0] += new * l[k] * l[k]; // (EST-15)
            sums[1] += new * self.covariance[(all + 1) * k];
        }
    }

    /// Back over a step: A' W A.
    #[inline(always)]
    fn step(&mut self, a: &[f64]) {
        let AnySizes { all, plain, coupled, .. } = self.n;
        for i in 0..all {
            let (from, to) = (&self.covariance[all * i..][..all], &mut self.product[all * i..][..all]);
            combine(&mut to[..coupled], &from[..plain], a, all);
            to[coupled..].fill(0.0);
            for k in plain..all {
                to[k] += a[(all + 1) * k] * from[k];
            }
        }
        for i in 0..all {
            let to = &mut self.covariance[all * i..][..all];
            if i < coupled {
                let column = &mut self.row[..plain];
                column.iter_mut().enumerate().for_each(|(k, x)| *x = a[all * k + i]);
                combine(to, column, &self.product, all);
            } else {
                to.fill(0.0);
            }
            if i >= plain {
                add(to, a[(all + 1) * i], &self.product[all * i..][..all]);
            }
        }
    }
}
