//! Whether residuals are white.

use realfft::RealFftPlanner;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Autocorrelation at the lags 0 to `lags`: sum of (x_i - mean)(x_i+k - mean) over that of lag 0. `None` without
/// variation or for `lags` >= samples.
pub fn autocorrelation(x: &[f64], lags: usize) -> Option<Vec<f64>> {
    let n = x.len();
    if lags >= n || x.windows(2).all(|w| w[0] == w[1]) {
        return None;
    }
    let mean = x.iter().sum::<f64>() / n as f64;
    // Zeros behind keep the ends from meeting.
    let size = (n + lags).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forth, back) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
    let mut padded = vec![0.0; size];
    padded.iter_mut().zip(x).for_each(|(p, x)| *p = x - mean);
    let mut spectrum = forth.make_output_vec();
    forth.process(&mut padded, &mut spectrum).ok()?;
    spectrum.iter_mut().for_each(|s| *s = s.norm_sqr().into());
    back.process(&mut spectrum, &mut padded).ok()?;
    let first = padded[0];
    Some(padded[..=lags].iter().map(|c| c / first).collect())
}

/// Outcome of the test of Ljung and Box (Biometrika 65, 1978).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LjungBox {
    /// Q = n (n + 2) sum of r_k^2 / (n - k).
    pub statistic: f64,
    /// Chance of a Q at least as large if the values are white.
    pub p_value: f64,
}

/// Tests residuals for whiteness over the lags 1 to `lags`; `fitted` parameters of a time-series model, if they came from
/// one, are taken off the degrees of freedom (0 for a physical model's residuals).
///
/// `None` without variation, for `lags` >= samples or `lags` <= `fitted`.
pub fn ljung_box(x: &[f64], lags: usize, fitted: usize) -> Option<LjungBox> {
    let n = x.len() as f64;
    let freedom = lags.checked_sub(fitted).filter(|f| *f > 0)?;
    let r = autocorrelation(x, lags)?;
    let sum: f64 = r.iter().enumerate().skip(1).map(|(k, r)| r * r / (n - k as f64)).sum();
    let statistic = n * (n + 2.0) * sum;
    let p_value = ChiSquared::new(freedom as f64).ok()?.sf(statistic);
    Some(LjungBox { statistic, p_value })
}
