//! Welch's spectra.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

/// A quantity over frequency.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// In Hz, from 0 to half the rate.
    pub frequency: Vec<f64>,
    /// Density in unit^2/Hz, one-sided; or coherence, 0 to 1.
    pub value: Vec<f64>,
}

/// Power spectral density of samples at `rate` in Hz: the mean over segments of `segment` samples, overlapping by half,
/// each without its mean and under a Hann window (SciPy's `welch`). Its sum times the frequency step is the variance.
///
/// `None` unless 2 <= segment <= samples and `rate` > 0.
pub fn welch(x: &[f64], rate: f64, segment: usize) -> Option<Spectrum> {
    let power = cross(x, x, rate, segment)?;
    Some(Spectrum { frequency: power.0, value: power.1.iter().map(|p| p.re).collect() })
}

/// Share of y's power that x explains linearly, by frequency: |Pxy|^2 / (Pxx Pyy) (SciPy's `coherence`). With one segment
/// it is 1 everywhere and has no meaning.
///
/// `None` as for [`welch`], or for other lengths.
pub fn coherence(x: &[f64], y: &[f64], rate: f64, segment: usize) -> Option<Spectrum> {
    let (frequency, xy) = cross(x, y, rate, segment)?;
    let (xx, yy) = (cross(x, x, rate, segment)?.1, cross(y, y, rate, segment)?.1);
    let value = xy.iter().zip(xx.iter().zip(&yy)).map(|(p, (x, y))| p.norm_sqr() / (x.re * y.re)).collect();
    Some(Spectrum { frequency, value })
}

fn cross(x: &[f64], y: &[f64], rate: f64, segment: usize) -> Option<(Vec<f64>, Vec<Complex64>)> {
    if x.len() != y.len() || segment < 2 || segment > x.len() || rate.is_nan() || rate <= 0.0 {
        return None;
    }
    let window: Vec<f64> =
        (0..segment).map(|i| 0.5 - 0.5 * (TAU * i as f64 / segment as f64).cos()).collect();
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(segment);
    let transform = |x: &[f64]| -> Option<Vec<Complex64>> {
        let mean = x.iter().sum::<f64>() / segment as f64;
        let mut windowed: Vec<f64> = x.iter().zip(&window).map(|(x, w)| (x - mean) * w).collect();
        let mut out = fft.make_output_vec();
        fft.process(&mut windowed, &mut out).ok()?;
        Some(out)
    };
    let mut sum = vec![Complex64::default(); segment / 2 + 1];
    let hop = segment - segment / 2;
    let mut count = 0.0;
    for (x, y) in x.windows(segment).step_by(hop).zip(y.windows(segment).step_by(hop)) {
        for (sum, (a, b)) in sum.iter_mut().zip(transform(x)?.iter().zip(&transform(y)?)) {
            *sum += a.conj() * b;
        }
        count += 1.0;
    }
    let scale = 1.0 / (rate * window.iter().map(|w| w * w).sum::<f64>() * count);
    let half = segment / 2;
    for (k, p) in sum.iter_mut().enumerate() {
        // One-sided: negative frequencies are added, where there are any.
        let lonely = k == 0 || (segment.is_multiple_of(2) && k == half);
        *p *= if lonely { scale } else { 2.0 * scale };
    }
    let frequency = (0..=half).map(|k| k as f64 * rate / segment as f64).collect();
    Some((frequency, sum))
}
