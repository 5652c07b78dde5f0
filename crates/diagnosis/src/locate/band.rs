//! At which frequencies.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use trueup_signals::process::{Spectrum, welch};

use super::ResidualSeries;
use trueup_numerics::order::descending;

/// A band of frequencies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Lower edge in Hz.
    pub low: f64,
    /// Upper edge in Hz.
    pub high: f64,
    /// Share of the whole excess.
    pub share: f64,
}

/// The spectrum of a residual, that of the noise, and the bands that hold most of the difference.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bands {
    /// In Hz.
    pub frequency: Vec<f64>,
    /// Density of the residual in unit^2/Hz, over all recordings.
    pub residual: Vec<f64>,
    /// Density that noise alone has.
    pub floor: Vec<f64>,
    /// Most excess first.
    pub bands: Vec<Band>,
}

/// The fewest frequencies that hold this much of the excess make the bands.
const HELD: f64 = 0.85;
/// Bands are joined over gaps of this part of the width of both together, and over two bins.
const CLOSE: f64 = 0.15;
/// Bands with less than this are not reported.
const LEAST: f64 = 0.03;

/// Bands of one channel over all recordings; `noise` is its coloured floor, if it is (else it is white).
///
/// `None` for fewer than 64 samples in every recording, or rates that differ by more than 1 %.
pub fn bands(residuals: &[ResidualSeries<'_>], noise: Option<&Spectrum>) -> Option<Bands> {
    let step = |r: &ResidualSeries<'_>| {
        let n = r.time.len().min(r.value.len());
        (n >= 64).then(|| (r.time[n - 1] - r.time[0]) / (n - 1) as f64)
    };
    let usable: Vec<(&ResidualSeries<'_>, f64)> =
        residuals.iter().filter_map(|r| Some((r, step(r)?))).collect();
    let h = usable.first()?.1;
    if !usable.iter().all(|(_, step)| (step / h - 1.0).abs() < 0.01) {
        return None;
    }
    let even: Vec<Vec<f64>> = usable.iter().map(|(r, _)| evenly(r, h)).collect();
    let shortest = even.iter().map(Vec::len).min()?;
    let segment = (shortest / 6).clamp(32, 2048);
    let mut out = Bands::default();
    let (mut weights, mut segments, mut white) = (0.0, 0.0, 0.0);
    for ((r, _), x) in usable.iter().zip(&even) {
        let s = welch(x, 1.0 / h, segment)?;
        let weight = x.len() as f64;
        out.residual.resize(s.value.len(), 0.0);
        out.residual.iter_mut().zip(&s.value).for_each(|(a, p)| *a += weight * p);
        out.frequency = s.frequency;
        weights += weight;
        white += weight * 2.0 * r.floor * r.floor * h;
        segments += (2.0 * weight / segment as f64 - 1.0).max(1.0);
    }
    out.residual.iter_mut().for_each(|p| *p /= weights);
    white /= weights;
    out.floor = out.frequency.iter().map(|f| noise.map_or(white, |s| at(s, *f))).collect();
    // Half-overlapping segments under a Hann window: a density is chi-squared with 1.6 times as many degrees of freedom.
    let freedom = 1.6 * segments;
    let sure = ChiSquared::new(freedom).ok()?.inverse_cdf(1.0 - 0.01 / out.floor.len() as f64) / freedom;
    let excess: Vec<f64> =
        out.residual.iter().zip(&out.floor).map(|(p, f)| if *p > sure * f { p - f } else { 0.0 }).collect();
    out.bands = strongest(&excess, &out.frequency);
    Some(out)
}

/// The fewest bins that hold most, side by side as bands.
fn strongest(excess: &[f64], frequency: &[f64]) -> Vec<Band> {
    let whole: f64 = excess.iter().sum();
    if whole <= 0.0 {
        return Vec::new();
    }
    let mut by: Vec<usize> = (0..excess.len()).collect();
    descending(&mut by, |item| excess[*item]);
    let mut kept = vec![false; excess.len()];
    let mut sum = 0.0;
    for i in by {
        if sum >= HELD * whole {
            break;
        }
        sum += excess[i];
        kept[i] = true;
    }
    let half = 0.5 * (frequency[1] - frequency[0]);
    let mut bands: Vec<Band> = Vec::new();
    for i in (0..kept.len()).filter(|i| kept[*i]) {
        let share = excess[i] / whole;
        match bands.last_mut() {
            Some(band) if i > 0 && kept[i - 1] => {
                (band.high, band.share) = (frequency[i] + half, band.share + share);
            }
            _ => bands.push(Band { low: (frequency[i] - half).max(0.0), high: frequency[i] + half, share }),
        }
    }
    // A spectrum scatters: what is close together is one band.
    let mut joined: Vec<Band> = Vec::new();
    for band in bands {
        match joined.last_mut() {
            Some(b) if band.low - b.high <= (4.0 * half).max(CLOSE * (band.high - b.low)) => {
                (b.high, b.share) = (band.high, b.share + band.share);
            }
            _ => joined.push(band),
        }
    }
    let mut bands = joined;
    bands.retain(|b| b.share >= LEAST);
    descending(&mut bands, |item| item.share);
    bands
}

/// On even steps; between samples on the line.
fn evenly(r: &ResidualSeries<'_>, h: f64) -> Vec<f64> {
    let n = r.time.len().min(r.value.len());
    let mut next = 1;
    (0..n)
        .map(|i| {
            let t = r.time[0] + i as f64 * h;
            while next + 1 < n && r.time[next] < t {
                next += 1;
            }
            let (a, b) = (r.time[next - 1], r.time[next]);
            r.value[next - 1] + (r.value[next] - r.value[next - 1]) * ((t - a) / (b - a)).clamp(0.0, 1.0)
        })
        .collect()
}

/// A spectrum between its frequencies.
fn at(s: &Spectrum, f: f64) -> f64 {
    let i = s.frequency.partition_point(|x| *x <= f).clamp(1, s.frequency.len().max(2) - 1);
    match (s.frequency.get(i - 1), s.frequency.get(i)) {
        (Some(a), Some(b)) => {
            s.value[i - 1] + (s.value[i] - s.value[i - 1]) * ((f - a) / (b - a)).clamp(0.0, 1.0)
        }
        _ => s.value.first().copied().unwrap_or(0.0),
    }
}
