//! Small numerical functions of series.

/// Quantile `p` (0 to 1) of values, linear between order statistics; 0 without values.
pub fn quantile(mut values: Vec<f64>, p: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_unstable_by(f64::total_cmp);
    let at = p * (values.len() - 1) as f64;
    let (k, rest) = (at.floor() as usize, at - at.floor());
    let next = values[(k + 1).min(values.len() - 1)];
    values[k] + (next - values[k]) * rest
}

/// Median of values; 0 without values.
pub fn median(values: Vec<f64>) -> f64 {
    quantile(values, 0.5)
}

/// Mean over each step of what is known at nodes; the last node represents its own step.
pub fn over_steps(nodes: &[f64]) -> Vec<f64> {
    let mut out: Vec<f64> = nodes.windows(2).map(|w| 0.5 * (w[1] + w[0])).collect();
    out.extend(nodes.last());
    out
}

/// Values at increasing times `at` on the line through (`time`, `values`), constant beyond the ends.
pub fn interpolated(at: &[f64], time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = time.len().saturating_sub(1);
    let value = |t: f64| {
        let k = time.partition_point(|x| *x <= t);
        if k == 0 {
            return values.first().copied().unwrap_or(0.0);
        }
        if k > last {
            return values[last];
        }
        let slope = (values[k] - values[k - 1]) / (time[k] - time[k - 1]);
        values[k - 1] + slope * (t - time[k - 1])
    };
    at.iter().map(|t| value(*t)).collect()
}

/// Gaussian smoothing with standard deviation `sigma` in samples, cut at 4 sigma, reflected at the ends.
pub fn gaussian(values: &[f64], sigma: f64) -> Vec<f64> {
    let n = values.len() as isize;
    let radius = (4.0 * sigma + 0.5) as isize;
    let mut weights: Vec<f64> =
        (-radius..=radius).map(|k| (-0.5 * (k * k) as f64 / (sigma * sigma)).exp()).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|w| *w /= sum);
    let reflected = |k: isize| {
        let k = k.rem_euclid(2 * n);
        values[if k < n { k } else { 2 * n - 1 - k } as usize]
    };
    let one = |k: isize| weights.iter().zip(-radius..).map(|(w, d)| w * reflected(k + d)).sum();
    (0..n).map(one).collect()
}

/// Differences per sample: central inside, one-sided at the ends.
pub fn gradient(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let one = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
        if b > a { (values[b] - values[a]) / (b - a) as f64 } else { 0.0 }
    };
    (0..n).map(one).collect()
}

/// Rates of values at increasing times: of the parabola through three inside, of the line at the ends.
pub fn rates_at(time: &[f64], values: &[f64]) -> Vec<f64> {
    let last = time.len().saturating_sub(1);
    let slope = |k: usize| (values[k + 1] - values[k]) / (time[k + 1] - time[k]);
    let one = |k: usize| {
        if last == 0 {
            return 0.0;
        }
        if k == 0 || k == last {
            return slope(k.min(last - 1));
        }
        let (before, after) = (time[k] - time[k - 1], time[k + 1] - time[k]);
        (slope(k - 1) * after + slope(k) * before) / (before + after)
    };
    (0..=last).map(one).collect()
}

/// Sign, 0 at 0.
pub fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_a_constant_and_the_gradient_of_a_line_is_its_slope() {
        let flat = gaussian(&[3.0; 5], 4.0);
        assert!(flat.iter().all(|x| (x - 3.0).abs() < 1e-12));
        let line: Vec<f64> = (0..9).map(|k| 2.0 * f64::from(k)).collect();
        assert!(gradient(&line).iter().all(|x| (x - 2.0).abs() < 1e-12));
        assert_eq!(quantile(vec![4.0, 1.0, 3.0, 2.0], 0.5), 2.5);
        assert_eq!(interpolated(&[-1.0, 0.5, 9.0], &[0.0, 1.0], &[1.0, 3.0]), [1.0, 2.0, 3.0]);
    }
}
