//! The noise floor: what a sensor reads when nothing changes.

use crate::case::Loaded;
use crate::recording::{Channel, Recording};

/// Where a floor comes from, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Source {
    /// Runs of one command against each other.
    Repeats,
    /// Recordings at rest.
    Rest,
    /// Declared noise and resolution.
    Declared,
}

/// Noise of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Floor {
    /// Standard deviation in the channel's unit.
    pub deviation: f64,
    /// Where it comes from.
    pub source: Source,
}

/// Noise of a channel of a case: from repeats, else recordings at rest, else declared noise and resolution
/// (noise^2 + resolution^2/12). `None` if nothing says anything.
///
/// Quantisation can hide noise altogether, so that neither repeats nor rest go below resolution^2/12.
pub fn floor(loaded: &Loaded, channel: &str) -> Option<Floor> {
    let runs = || loaded.recordings.values().filter_map(|run| run.channel(channel));
    let resolution = runs().filter_map(|c| c.sensor.resolution).fold(0.0, f64::max);
    let least = resolution * resolution / 12.0;
    let floor = |variance: f64, source| Floor { deviation: variance.max(least).sqrt(), source };
    let repeats = loaded.repeats();
    if let Some(variance) = pooled(repeats.iter().filter_map(|group| between(group, channel))) {
        return Some(floor(variance, Source::Repeats));
    }
    if let Some(variance) = pooled(loaded.rest().iter().filter_map(|run| at_rest(run.channel(channel)?))) {
        return Some(floor(variance, Source::Rest));
    }
    let deviation = runs()
        .filter_map(|c| c.sensor.deviation())
        .fold(None, |m: Option<f64>, d| Some(m.map_or(d, |m| m.max(d))))?;
    Some(Floor { deviation, source: Source::Declared })
}

/// How far the noise of a reading tells that of the next: their correlation at rest, what the resolution adds taken off. 0
/// without recordings at rest, or where they show nothing but the resolution.
pub fn correlation(loaded: &Loaded, channel: &str) -> f64 {
    let (mut own, mut next) = (0.0, 0.0);
    for c in loaded.rest().iter().filter_map(|run| run.channel(channel)).filter(|c| c.len() >= 100) {
        let n = c.len() as f64;
        let mean = c.values.iter().sum::<f64>() / n;
        let step = c.sensor.resolution.unwrap_or(0.0);
        own += c.values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() - n * step * step / 12.0;
        next += c.values.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>();
    }
    if own > 0.0 { (next / own).clamp(0.0, MOST_CORRELATED) } else { 0.0 }
}

/// More is no noise but a drift.
const MOST_CORRELATED: f64 = 0.98;

/// Sums of squares and degrees of freedom become a variance.
fn pooled(parts: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (squares, freedom) = parts.fold((0.0, 0.0), |(s, f), (squares, freedom)| (s + squares, f + freedom));
    (freedom > 0.0).then(|| squares / freedom)
}

/// Variance between runs of one command: at each time of the first the others are taken at the same time since start.
fn between(group: &[&Recording], channel: &str) -> Option<(f64, f64)> {
    let all: Option<Vec<_>> = group.iter().map(|run| Some((run.start, run.channel(channel)?))).collect();
    let all = all?;
    let (&(start, first), others) = all.split_first()?;
    let reach = |(start, c): &(f64, &Channel)| c.time.last().map_or(0.0, |t| t - start);
    let end = all.iter().map(reach).fold(f64::INFINITY, f64::min);
    let mut cursors: Vec<_> = others.iter().map(|(start, c)| (*start, c.cursor())).collect();
    let (n, mut squares, mut freedom) = (all.len() as f64, 0.0, 0.0);
    let mut values = Vec::with_capacity(all.len());
    for (t, x) in first.time.iter().zip(&first.values) {
        let since = t - start;
        if since > end + 1e-9 || n < 2.0 {
            break;
        }
        values.clear();
        values.push(*x);
        values.extend(cursors.iter_mut().map(|(start, cursor)| cursor.at(*start + since)));
        let mean = values.iter().sum::<f64>() / n;
        squares += values.iter().map(|x| (x - mean).powi(2)).sum::<f64>();
        freedom += n - 1.0;
    }
    Some((squares, freedom))
}

/// Variance about the mean of a recording at rest.
fn at_rest(c: &Channel) -> Option<(f64, f64)> {
    let n = c.len() as f64;
    let mean = c.values.iter().sum::<f64>() / n;
    (n >= 2.0).then(|| (c.values.iter().map(|x| (x - mean).powi(2)).sum(), n - 1.0))
}
