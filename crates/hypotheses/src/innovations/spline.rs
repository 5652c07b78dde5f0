//! The cubic spline through values at increasing times, without a knot at the second and at the last but one.

/// A piecewise cubic with continuous curvature; its ends go on beyond the first and the last time.
#[derive(Clone, Debug, PartialEq)]
pub struct CubicSpline {
    time: Vec<f64>,
    value: Vec<f64>,
    slope: Vec<f64>,
}

impl CubicSpline {
    /// Through (`time`, `value`): at least four of them, or the slope is 0.
    ///
    /// Slopes s with widths h and slopes d of the chords solve h_k s_(k-1) + 2 (h_(k-1) + h_k) s_k + h_(k-1) s_(k+1) =
    /// 3 (h_k d_(k-1) + h_(k-1) d_k) inside (continuous curvature), and continuous third derivatives at the second time and at the last
    /// but one.
    pub fn new(time: &[f64], value: &[f64]) -> Self {
        let n = time.len();
        let (time, value) = (time.to_vec(), value.to_vec());
        if n < 4 {
            return Self { slope: vec![0.0; n], time, value };
        }
        let h: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
        let d: Vec<f64> = value.windows(2).zip(&h).map(|(w, h)| (w[1] - w[0]) / h).collect();
        let (mut low, mut middle, mut high, mut right) =
            (vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]);
        for k in 1..n - 1 {
            (low[k], middle[k], high[k]) = (h[k], 2.0 * (h[k - 1] + h[k]), h[k - 1]);
            right[k] = 3.0 * (h[k] * d[k - 1] + h[k - 1] * d[k]);
        }
        let end = |h: [f64; 2], d: [f64; 2]| {
            let both = h[0] + h[1];
            (h[1], both, ((h[0] + 2.0 * both) * h[1] * d[0] + h[0] * h[0] * d[1]) / both)
        };
        (middle[0], high[0], right[0]) = end([h[0], h[1]], [d[0], d[1]]);
        (middle[n - 1], low[n - 1], right[n - 1]) = end([h[n - 2], h[n - 3]], [d[n - 2], d[n - 3]]);
        for k in 1..n {
            let f = low[k] / middle[k - 1];
            middle[k] -= f * high[k - 1];
            right[k] -= f * right[k - 1];
        }
        let mut slope = right;
        slope[n - 1] /= middle[n - 1];
        for k in (0..n - 1).rev() {
            slope[k] = (slope[k] - high[k] * slope[k + 1]) / middle[k];
        }
        Self { time, value, slope }
    }

    /// Index of the piece of a time, and the share of it that has passed.
    fn at(&self, t: f64) -> (usize, f64, f64) {
        let k = self.time.partition_point(|x| *x <= t).clamp(1, self.time.len().max(2) - 1) - 1;
        let h = self.time[k + 1] - self.time[k];
        (k, h, (t - self.time[k]) / h)
    }
    /// Value at a time.
    pub fn value(&self, t: f64) -> f64 {
        let (k, h, x) = self.at(t);
        let y = 1.0 - x;
        let ends = self.value[k] * (1.0 + 2.0 * x) * y * y + self.value[k + 1] * x * x * (3.0 - 2.0 * x);
        ends + h * (self.slope[k] * x * y * y - self.slope[k + 1] * x * x * y)
    }
    /// Rate at a time.
    pub fn slope(&self, t: f64) -> f64 {
        let (k, h, x) = self.at(t);
        let rise = 6.0 * x * (1.0 - x) * (self.value[k + 1] - self.value[k]) / h;
        rise + self.slope[k] * (1.0 - 4.0 * x + 3.0 * x * x) + self.slope[k + 1] * (3.0 * x * x - 2.0 * x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_its_own_spline_inside_and_beyond_the_ends() {
        let f = |t: f64| 1.0 - 2.0 * t + 0.7 * t * t - 0.3 * t.powi(3);
        let rate = |t: f64| -2.0 + 1.4 * t - 0.9 * t * t;
        let time = [0.0, 0.3, 0.5, 1.1, 1.2, 2.0];
        let s = CubicSpline::new(&time, &time.map(f));
        for t in [-0.5, 0.0, 0.1, 0.5, 0.77, 1.15, 2.0, 2.6] {
            assert!((s.value(t) - f(t)).abs() < 1e-12, "{t}: {} {}", s.value(t), f(t));
            assert!((s.slope(t) - rate(t)).abs() < 1e-11, "{t}");
        }
    }
}
