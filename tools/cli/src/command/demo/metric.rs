//! The measure of vibration.

/// Root mean square of a signal (samples `h` s apart) less its centred moving average over one period of the
/// mode of `frequency_hz`; the ends are filled up with the end values.
pub(super) fn vibration(signal: &[f64], h: f64, frequency_hz: f64) -> f64 {
    let half = (1.0 / frequency_hz / h / 2.0).round() as isize;
    let n = signal.len() as isize;
    let at = |i: isize| signal[i.clamp(0, n - 1) as usize];
    // A running sum of the window.
    let mut sum: f64 = (-half..=half).map(at).sum();
    let mut square = 0.0;
    for i in 0..n {
        let rest = at(i) - sum / (2 * half + 1) as f64;
        square += rest * rest;
        sum += at(i + half + 1) - at(i - half);
    }
    (square / n as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn a_sine_of_the_mode_counts_whole_and_a_ramp_not_at_all() {
        let (h, f) = (1e-3, 2.0);
        let sine: Vec<f64> = (0..20_001).map(|k| (2.0 * PI * f * h * f64::from(k)).sin()).collect();
        assert!((vibration(&sine, h, f) - 0.5f64.sqrt()).abs() < 0.01);
        let constant = vec![3.0; 5000];
        assert!(vibration(&constant, h, f) < 1e-12);
    }
}
