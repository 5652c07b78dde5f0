//! Butterworth low-pass, forwards and backwards.

use std::f64::consts::PI;

/// A digital Butterworth low-pass as second-order sections (bilinear transform), each with gain 1 at standstill.
#[derive(Clone, Debug, PartialEq)]
pub struct Butterworth {
    order: usize,
    sections: Vec<Section>,
}

/// y = (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2) x.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

impl Butterworth {
    /// Of this order, with -3 dB at `cutoff` in Hz (once; forwards and backwards -6 dB) for samples at `rate` in Hz.
    ///
    /// `None` unless the order is 1 to 20 and 0 < cutoff < rate / 2.
    pub fn low_pass(order: usize, cutoff: f64, rate: f64) -> Option<Self> {
        let ratio = cutoff / rate;
        if !((1..=20).contains(&order) && ratio > 0.0 && ratio < 0.5) {
            return None;
        }
        // Analog poles on a circle of radius w; the bilinear transform takes s to (1 + s/2) / (1 - s/2).
        let w = 2.0 * (PI * ratio).tan();
        let section = |k: usize| {
            let angle = PI * (2 * k + order + 1) as f64 / (2 * order) as f64;
            let (re, im) = (0.5 * w * angle.cos(), 0.5 * w * angle.sin());
            if 2 * k + 1 == order {
                let p = (1.0 + re) / (1.0 - re);
                let g = 0.5 * (1.0 - p);
                return Section { b: [g, g, 0.0], a: [-p, 0.0] };
            }
            let d = (1.0 - re).powi(2) + im * im;
            let (p_re, p_abs2) = ((1.0 - re * re - im * im) / d, ((1.0 + re).powi(2) + im * im) / d);
            let a = [-2.0 * p_re, p_abs2];
            // 1 + a1 + a2 without cancellation: |1 - p|^2.
            let g = (re * re + im * im) / d;
            Section { b: [g, 2.0 * g, g], a }
        };
        Some(Self { order, sections: (0..order.div_ceil(2)).map(section).collect() })
    }

    /// Fewest samples that [`filtfilt`](Self::filtfilt) takes: 3 (order + 1) + 1.
    pub fn least_samples(&self) -> usize {
        3 * (self.order + 1) + 1
    }

    /// Filters forwards, then backwards: no phase, twice the attenuation. Ends are extended by 3 (order + 1) samples,
    /// mirrored at the end point, and the filter starts in equilibrium, as SciPy's `filtfilt` and `sosfiltfilt` do.
    ///
    /// `None` for fewer than [`least_samples`](Self::least_samples).
    pub fn filtfilt(&self, x: &[f64]) -> Option<Vec<f64>> {
        let edge = self.least_samples() - 1;
        let (n, first, last) = (x.len(), *x.first()?, *x.last()?);
        if n <= edge {
            return None;
        }
        let before = x[1..=edge].iter().rev().map(|v| 2.0 * first - v);
        let after = x[n - 1 - edge..n - 1].iter().rev().map(|v| 2.0 * last - v);
        let mut y: Vec<f64> = before.chain(x.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            self.run(&mut y);
            y.reverse();
        }
        y.truncate(edge + n);
        y.drain(..edge);
        Some(y)
    }

    /// Forwards, in place, from the equilibrium of the first value.
    fn run(&self, y: &mut [f64]) {
        let Some(&start) = y.first() else { return };
        for Section { b, a } in &self.sections {
            let mut z = [(1.0 - b[0]) * start, (b[2] - a[1]) * start];
            for v in &mut *y {
                let out = b[0] * *v + z[0];
                z = [b[1] * *v - a[0] * out + z[1], b[2] * *v - a[1] * out];
                *v = out;
            }
        }
    }
}
