//! Smoothing cubic splines: a twice differentiable curve through noisy samples (C. H. Reinsch, Numerische Mathematik 10,
//! 1967).

/// A natural cubic spline: between knots a cubic, its second derivative continuous and 0 at both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    t: Vec<f64>,
    y: Vec<f64>,
    /// Second derivatives at the knots.
    m: Vec<f64>,
}

impl Spline {
    /// The smoothest curve, in the integral of its squared second derivative, that stays within the noise: the sum of
    /// ((y_i - s(t_i)) / noise)^2 is the number of samples. With `noise` 0 it goes through every sample.
    ///
    /// `None` for fewer than 2 samples, times that do not increase, or values that are not finite.
    pub fn new(t: &[f64], y: &[f64], noise: f64) -> Option<Self> {
        let n = t.len();
        let good = n >= 2
            && y.len() == n
            && noise >= 0.0
            && t.windows(2).all(|w| w[0] < w[1])
            && t.iter().chain(y).all(|x| x.is_finite());
        if !good {
            return None;
        }
        let fit = |weight: f64| Self::penalized(t, y, weight);
        if noise == 0.0 || n < 3 {
            return Some(fit(0.0));
        }
        let allowed = n as f64 * noise * noise;
        let excess = |s: &Self| s.y.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>() - allowed;
        // The misfit grows with the weight: from 0 to that of a straight line. Search over its logarithm.
        let span = t[n - 1] - t[0];
        let typical = (span / n as f64).powi(3);
        let (mut low, mut high) = ((typical * 1e-12).ln(), (span.powi(3) * n as f64 * 1e6).ln());
        let straight = fit(high.exp());
        if excess(&straight) <= 0.0 {
            return Some(straight);
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if excess(&fit(middle.exp())) > 0.0 { high = middle } else { low = middle }
        }
        Some(fit(low.exp()))
    }

    /// Minimizes sum (y_i - s_i)^2 + weight * integral of s''^2: (R + weight Q'Q) m = Q'y, s = y - weight Q m.
    fn penalized(t: &[f64], y: &[f64], weight: f64) -> Self {
        let n = t.len();
        let inner = n.saturating_sub(2);
        let h: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
        // Column k of Q has the entries q[k] in the rows k, k + 1, k + 2.
        let q: Vec<[f64; 3]> =
            (0..inner).map(|k| [1.0 / h[k], -1.0 / h[k] - 1.0 / h[k + 1], 1.0 / h[k + 1]]).collect();
        let dot = |a: &[f64; 3], b: &[f64; 3], shift: usize| -> f64 {
            (shift..3).map(|i| a[i] * b[i - shift]).sum()
        };
        // L D L' of the five-diagonal matrix: d, l1 and l2 are D and the subdiagonals of L.
        let (mut d, mut l1, mut l2) = (vec![0.0; inner], vec![0.0; inner], vec![0.0; inner]);
        let mut m = vec![0.0; n];
        for k in 0..inner {
            let mut diagonal = (h[k] + h[k + 1]) / 3.0 + weight * dot(&q[k], &q[k], 0);
            let mut rhs: f64 = (0..3).map(|i| q[k][i] * y[k + i]).sum();
            if k >= 2 {
                l2[k] = weight * dot(&q[k - 2], &q[k], 2) / d[k - 2];
                diagonal -= l2[k] * l2[k] * d[k - 2];
                rhs -= l2[k] * m[k - 1];
            }
            if k >= 1 {
                let mut below = h[k] / 6.0 + weight * dot(&q[k - 1], &q[k], 1);
                if k >= 2 {
                    below -= l2[k] * l1[k - 1] * d[k - 2];
                }
                l1[k] = below / d[k - 1];
                diagonal -= l1[k] * l1[k] * d[k - 1];
                rhs -= l1[k] * m[k];
            }
            d[k] = diagonal;
            m[k + 1] = rhs; // forward substitution; m[k + 1] belongs to the inner knot k
        }
        for k in (0..inner).rev() {
            m[k + 1] /= d[k];
            if k + 1 < inner {
                m[k + 1] -= l1[k + 1] * m[k + 2];
            }
            if k + 2 < inner {
                m[k + 1] -= l2[k + 2] * m[k + 3];
            }
        }
        let mut s = y.to_vec();
        for k in 0..inner {
            for i in 0..3 {
                s[k + i] -= weight * q[k][i] * m[k + 1];
            }
        }
        Self { t: t.to_vec(), y: s, m }
    }

    /// Knots in s.
    pub fn knots(&self) -> &[f64] {
        &self.t
    }

    /// Second derivatives at the knots; on the line between them, which is exact.
    pub fn accelerations(&self) -> &[f64] {
        &self.m
    }

    /// Value, first and second derivative at `t`; beyond the ends a straight line.
    pub fn at(&self, t: f64) -> [f64; 3] {
        let n = self.t.len();
        let (first, last) = (self.t[0], self.t[n - 1]);
        if t < first || t > last {
            let [y, v, _] = self.at(t.clamp(first, last));
            return [y + v * (t - t.clamp(first, last)), v, 0.0];
        }
        let i = self.t.partition_point(|knot| *knot <= t).clamp(1, n - 1) - 1;
        let h = self.t[i + 1] - self.t[i];
        let (a, b) = ((self.t[i + 1] - t) / h, (t - self.t[i]) / h);
        let (y, m) = (&self.y[i..], &self.m[i..]);
        [
            a * y[0] + b * y[1] + ((a * a * a - a) * m[0] + (b * b * b - b) * m[1]) * h * h / 6.0,
            (y[1] - y[0]) / h + ((1.0 - 3.0 * a * a) * m[0] + (3.0 * b * b - 1.0) * m[1]) * h / 6.0,
            a * m[0] + b * m[1],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(state: &mut u64) -> f64 {
        (0..12).fold(-6.0, |sum, _| {
            *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            sum + (*state >> 11) as f64 / (1u64 << 53) as f64
        })
    }

    #[test]
    fn without_noise_it_goes_through_the_samples_and_is_smooth() {
        let t = [0.0, 0.4, 1.0, 1.1, 2.0, 3.5];
        let y = [1.0, -0.3, 2.0, 2.2, 0.0, 5.0];
        let s = Spline::new(&t, &y, 0.0).unwrap();
        for (t, y) in t.iter().zip(y) {
            assert!((s.at(*t)[0] - y).abs() < 1e-13);
        }
        for knot in &t[1..5] {
            let (before, after) = (s.at(knot - 1e-9), s.at(knot + 1e-9));
            (0..3).for_each(|i| assert!((before[i] - after[i]).abs() < 1e-6, "{before:?} {after:?}"));
        }
        assert_eq!([s.at(0.0)[2], s.at(3.5)[2]], [0.0, 0.0]);
        // Its derivatives are derivatives.
        let h = 1e-5;
        for x in [0.2, 0.7, 1.05, 1.7, 3.0] {
            let [low, here, high] = [s.at(x - h), s.at(x), s.at(x + h)];
            assert!(((high[0] - low[0]) / (2.0 * h) - here[1]).abs() < 1e-7);
            assert!(((high[1] - low[1]) / (2.0 * h) - here[2]).abs() < 1e-7);
        }
    }

    /// The minimizer of the penalized misfit: any change of its knots makes the sum larger.
    #[test]
    fn it_is_the_smoothest_within_the_noise() {
        let mut state = 3;
        let t: Vec<f64> = (0..200).map(|i| 0.05 * f64::from(i)).collect();
        let y: Vec<f64> = t.iter().map(|t| 0.1 * t * t + t.sin() + 0.02 * noise(&mut state)).collect();
        let s = Spline::new(&t, &y, 0.02).unwrap();
        let misfit: f64 = t.iter().zip(&y).map(|(t, y)| (s.at(*t)[0] - y).powi(2)).sum::<f64>();
        assert!((misfit / (200.0 * 0.02 * 0.02) - 1.0).abs() < 1e-6, "{misfit}");
        let rms = |i: usize, truth: &dyn Fn(f64) -> f64| {
            (t[20..180].iter().map(|t| (s.at(*t)[i] - truth(*t)).powi(2)).sum::<f64>() / 160.0).sqrt()
        };
        // Better than the samples by far, and the derivatives are of use.
        assert!(rms(0, &|t| 0.1 * t * t + t.sin()) < 0.008);
        assert!(rms(1, &|t| 0.2 * t + t.cos()) < 0.02);
        assert!(rms(2, &|t| 0.2 - t.sin()) < 0.1);
    }

    #[test]
    fn a_line_within_the_noise_is_a_line_and_bad_samples_are_refused() {
        let s = Spline::new(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.01, 1.99, 3.0], 1.0).unwrap();
        assert!(s.accelerations().iter().all(|m| m.abs() < 1e-6));
        assert!((s.at(5.0)[0] - 5.0).abs() < 0.05);
        assert_eq!(Spline::new(&[0.0, 0.0], &[1.0, 1.0], 0.0), None);
        assert_eq!(Spline::new(&[0.0, 1.0], &[1.0, f64::NAN], 0.0), None);
        assert_eq!(Spline::new(&[0.0], &[1.0], 0.0), None);
    }
}
