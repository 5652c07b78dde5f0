//! Derivatives of filtered columns and what they make of noise.

use trueup_signals::process::Butterworth;

/// Values and the first two derivatives by central differences of fourth order, one-sided copies at the ends.
pub(crate) fn derivatives(x: &[f64], h: f64) -> [Vec<f64>; 3] {
    let n = x.len();
    if n < 5 {
        return [x.to_vec(), vec![0.0; n], vec![0.0; n]];
    }
    let at = |i: usize, k: isize| x[i.clamp(2, n - 3).saturating_add_signed(k)];
    let first = (0..n).map(|i| (at(i, -2) - 8.0 * at(i, -1) + 8.0 * at(i, 1) - at(i, 2)) / (12.0 * h));
    let second = (0..n).map(|i| {
        (-at(i, -2) + 16.0 * at(i, -1) - 30.0 * at(i, 0) + 16.0 * at(i, 1) - at(i, 2)) / (12.0 * h * h)
    });
    [x.to_vec(), first.collect(), second.collect()]
}

/// Standard deviation that white noise of deviation 1 has after the filter and a linear operation: the norm of the
/// response to one sample.
pub(crate) fn gain(filter: &Butterworth, operation: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
    let mut impulse = vec![0.0; 4001];
    impulse[2000] = 1.0;
    let smooth = filter.filtfilt(&impulse).unwrap_or(impulse);
    operation(&smooth).iter().map(|x| x * x).sum::<f64>().sqrt()
}
