//! Series split into octaves, and Gaussian kernels.

use trueup_numerics::Scalar;

/// Samples below which an octave is not split further.
const FEW: usize = 12;

/// How many values [`split`] makes of `n`.
pub fn length(n: usize) -> usize {
    let (mut n, mut all) = (n, 0);
    while n >= FEW {
        all += n;
        n = n.div_ceil(2);
    }
    all + n
}

/// What a value of an octave represents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OctavePart {
    /// 0: the highest.
    pub octave: usize,
    /// First sample.
    pub first: usize,
    /// How many samples.
    pub width: usize,
}

/// The values of every octave, highest first. The last octave is what is left of slow change, mean included.
pub fn split<T: Scalar>(series: &[T]) -> Vec<T> {
    let mut all = Vec::with_capacity(length(series.len()));
    let mut now = series.to_vec();
    while now.len() >= FEW {
        let n = now.len();
        let at = |k: isize| now[k.unsigned_abs().min(2 * n - 2 - k.unsigned_abs().min(2 * n - 2))];
        let low: Vec<T> = (0..n as isize)
            .map(|k| (at(k) * 6.0 + (at(k - 1) + at(k + 1)) * 4.0 + at(k - 2) + at(k + 2)) / 16.0)
            .collect();
        all.extend(now.iter().zip(&low).map(|(v, l)| *v - *l));
        now = low.into_iter().step_by(2).collect();
    }
    all.extend(now);
    all
}

/// What each value of [`split`] of `n` samples represents.
pub fn parts(n: usize) -> Vec<OctavePart> {
    let (mut n, mut width, mut octave) = (n, 1, 0);
    let mut all = Vec::with_capacity(length(n));
    while n >= FEW {
        all.extend((0..n).map(|k| OctavePart { octave, first: k * width, width }));
        (n, width, octave) = (n.div_ceil(2), 2 * width, octave + 1);
    }
    all.extend((0..n).map(|k| OctavePart { octave, first: k * width, width }));
    all
}

/// Convolution with a Gaussian of deviation `width` samples, or with its first or second derivative; exact for straight
/// lines and parabolas. Beyond the ends the series goes on as a straight line.
pub fn gaussian<T: Scalar>(y: &[T], width: f64, order: usize) -> Vec<T> {
    let reach = (4.5 * width).ceil() as isize;
    let g: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / width).powi(2)).exp()).collect();
    let sum: f64 = g.iter().sum();
    let mut kernel: Vec<f64> = match order {
        0 => g.iter().map(|g| g / sum).collect(),
        1 => g.iter().zip(-reach..).map(|(g, k)| g * k as f64).collect(),
        _ => g.iter().zip(-reach..).map(|(g, k)| g * ((k as f64 / width).powi(2) - 1.0)).collect(),
    };
    if order == 1 {
        let slope: f64 = kernel.iter().zip(-reach..).map(|(g, k)| g * k as f64).sum();
        kernel.iter_mut().for_each(|k| *k /= slope);
    } else if order == 2 {
        let mean = kernel.iter().sum::<f64>() / sum;
        kernel.iter_mut().zip(&g).for_each(|(k, g)| *k -= mean * g);
        let curve: f64 = kernel.iter().zip(-reach..).map(|(g, k)| 0.5 * g * (k * k) as f64).sum();
        kernel.iter_mut().for_each(|k| *k /= curve);
    }
    let n = y.len() as isize;
    let at = |k: isize| {
        if k < 0 {
            y[0] * 2.0 - y[(-k).min(n - 1) as usize]
        } else if k >= n {
            y[n as usize - 1] * 2.0 - y[(2 * n - 2 - k).max(0) as usize]
        } else {
            y[k as usize]
        }
    };
    let sum = |i: isize| kernel.iter().zip(-reach..).fold(T::zero(), |sum, (g, k)| sum + at(i + k) * *g);
    (0..n).map(sum).collect()
}

/// Samples to either side that an instant between two is made from.
const TAPS: isize = 8;

/// The series at `samples` later, on sines (Lanczos) about a parabola: anything coarser would take noise out of
/// what is late, by which late would seem better than on time.
pub fn moved(y: &[f64], samples: f64) -> Vec<f64> {
    let n = y.len() as isize;
    let at = |k: isize| y[k.clamp(0, n - 1) as usize];
    let (whole, w) = (samples.floor() as isize, samples - samples.floor());
    let taps = 1 - TAPS..=TAPS;
    let bell = |x: f64| sinc(x) * sinc(x / TAPS as f64);
    let weights: Vec<f64> = taps.clone().map(|m| bell(w - m as f64)).collect();
    let sum: f64 = weights.iter().sum();
    (0..n)
        .map(|i| {
            let k = i + whole;
            let (before, here, behind) = (at(k - 1), at(k), at(k + 1));
            let (slope, bend) = (0.5 * (behind - before), 0.5 * (behind - 2.0 * here + before));
            let parabola = |m: f64| here + m * (slope + m * bend);
            let difference = |m: isize| at(k + m) - parabola(m as f64);
            let rest: f64 = taps.clone().zip(&weights).map(|(m, weight)| weight * difference(m)).sum();
            parabola(w) + rest / sum
        })
        .collect()
}

fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x.abs() < 1e-9 { 1.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use std::f64::consts::PI;

    #[test]
    fn noise_is_moved_whole_and_lines_exactly() {
        let line: Vec<f64> = (0..60).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        let there = moved(&line, 1.3);
        assert!((10..50).all(|k| (there[k] - line[k] - 0.65).abs() < 1e-12));
        // White noise up to four fifths of the highest frequency.
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let lines: Vec<(f64, f64)> =
            (0..200).map(|_| (rng.random_range(0.0..0.8 * PI), rng.random_range(0.0..2.0 * PI))).collect();
        let noise = |k: f64| lines.iter().map(|(w, p)| (w * k + p).sin()).sum::<f64>();
        let y: Vec<f64> = (0..2000).map(|k| noise(f64::from(k))).collect();
        let apart = |k: usize| (moved_at(&y, 0.5, k) - noise(k as f64 + 0.5)).powi(2);
        let missed = (100..1900).map(apart).sum::<f64>() / (100..1900).map(|k| y[k] * y[k]).sum::<f64>();
        assert!(missed < 1e-3, "{missed}");
    }
    fn moved_at(y: &[f64], samples: f64, k: usize) -> f64 {
        moved(&y[k - 20..k + 21], samples)[20]
    }

    #[test]
    fn kernels_are_exact_on_parabolas() {
        let y: Vec<f64> = (0..60).map(|k| 3.0 + 0.5 * f64::from(k) + 0.25 * f64::from(k * k)).collect();
        for width in [0.8, 1.5, 3.0] {
            let [_, first, second] = [0, 1, 2].map(|o| gaussian(&y, width, o)[30]);
            assert!((first - 15.5).abs() < 1e-9 && (second - 0.5).abs() < 1e-9, "{width}: {first} {second}");
        }
        let line: Vec<f64> = (0..60).map(f64::from).collect();
        assert!(gaussian(&line, 2.0, 0).iter().zip(&line).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!((moved(&y, 1.25)[30] - (3.0 + 0.5 * 31.25 + 0.25 * 31.25 * 31.25)).abs() < 1e-9);
    }

    #[test]
    fn an_octave_holds_its_frequencies() {
        let n = 512;
        for (period, octave) in [(3.0, 0), (12.0, 2), (48.0, 4)] {
            let y: Vec<f64> = (0..n).map(|k| (f64::from(k) / period * std::f64::consts::TAU).sin()).collect();
            let mut power = [0.0; 16];
            let (all, parts) = (split(&y), parts(512));
            assert_eq!((all.len(), parts.len()), (length(512), length(512)));
            all.iter().zip(parts).for_each(|(v, p)| power[p.octave] += v * v * p.width as f64);
            let most = power.iter().copied().fold(0.0, f64::max);
            assert!(power[octave] > 0.8 * most, "{period}: {power:?}");
        }
    }
}
