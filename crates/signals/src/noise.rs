//! The noise floor: what a sensor reads when nothing changes.

use crate::case::Loaded;
use crate::recording::{Channel, Recording};

/// Where a floor comes from, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NoiseFloorSource {
    /// Runs of one command against each other.
    Repeats,
    /// Recordings at rest.
    Rest,
    /// Declared noise and resolution.
    Declared,
}

/// Noise of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseFloor {
    /// Standard deviation in the channel's unit.
    pub deviation: f64,
    /// Where it comes from.
    pub source: NoiseFloorSource,
    /// Standard deviation of what changed from one repeat to the next and is no noise; 0: nothing.
    pub drift: f64,
}

/// Noise of a channel of a case: from repeats, else recordings at rest, else declared noise and resolution
/// (noise^2 + resolution^2/12). `None` if nothing gives it.
///
/// Quantisation can hide noise altogether, so that neither repeats nor rest go below resolution^2/12. What differs between repeats
/// as smoothly as a motion does is no noise but something that drifts from one to the next, and no part of the floor.
pub fn floor(loaded: &Loaded, channel: &str) -> Option<NoiseFloor> {
    let runs = || loaded.recordings.values().filter_map(|run| run.channel(channel));
    let resolution = runs().filter_map(|c| c.sensor.resolution).fold(0.0, f64::max);
    let least = resolution * resolution / 12.0;
    let floor =
        |variance: f64, source| NoiseFloor { deviation: variance.max(least).sqrt(), source, drift: 0.0 };
    let repeats = loaded.repeats();
    if let Some(all) =
        repeats.iter().filter_map(|group| RunScatter::of(group, channel)).reduce(RunScatter::and)
    {
        let (noise, drift) = all.parts();
        return Some(NoiseFloor { drift: drift.sqrt(), ..floor(noise, NoiseFloorSource::Repeats) });
    }
    if let Some(variance) = pooled(loaded.rest().iter().filter_map(|run| at_rest(run.channel(channel)?))) {
        return Some(floor(variance, NoiseFloorSource::Rest));
    }
    let deviation = runs()
        .filter_map(|c| c.sensor.deviation())
        .fold(None, |m: Option<f64>, d| Some(m.map_or(d, |m| m.max(d))))?;
    Some(NoiseFloor { deviation, source: NoiseFloorSource::Declared, drift: 0.0 })
}

/// x(k) - 2 x(k+1) + x(k+2) of neighbouring readings.
pub fn second_differences(readings: &[f64]) -> Vec<f64> {
    readings.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect()
}

/// Standard deviation of white noise by the median size of its differences, of which those of a unit deviation have this variance:
/// 6 of second ones, 70 of fourth ones. 0 without any.
pub fn by_differences(differences: &[f64], variance: f64) -> f64 {
    let mut sizes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN / variance.sqrt()
}

/// The median of |N(0, 1)|.
const MEDIAN: f64 = 0.6745;

/// Correlation of the noise of a reading with that of the next, at rest, what the resolution adds taken off. 0
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

/// More from reading to reading is no noise but a drift.
const MOST_CORRELATED: f64 = 0.98;

/// Sums of squares and degrees of freedom become a variance.
fn pooled(parts: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let (squares, freedom) = parts.fold((0.0, 0.0), |(s, f), (squares, freedom)| (s + squares, f + freedom));
    (freedom > 0.0).then(|| squares / freedom)
}

/// How runs of one command differ from their mean: sums of products with what is there one and two readings later, and degrees
/// of freedom.
#[derive(Clone, Copy, Debug)]
struct RunScatter {
    products: [f64; 3],
    freedom: f64,
}

impl RunScatter {
    /// Of a group: at each time of the first the others are taken at the same time since start.
    fn of(group: &[&Recording], channel: &str) -> Option<Self> {
        let all: Option<Vec<_>> = group.iter().map(|run| Some((run.start, run.channel(channel)?))).collect();
        let all = all.filter(|all| all.len() > 1)?;
        let (&(start, first), others) = all.split_first()?;
        let reach = |(start, c): &(f64, &Channel)| c.time.last().map_or(0.0, |t| t - start);
        let end = all.iter().map(reach).fold(f64::INFINITY, f64::min);
        let mut cursors: Vec<_> = others.iter().map(|(start, c)| (*start, c.cursor())).collect();
        let n = all.len() as f64;
        let mut own = Self { products: [0.0; 3], freedom: 0.0 };
        // What is left of this reading and of the two before.
        let mut last = [vec![0.0; all.len()], vec![0.0; all.len()], vec![0.0; all.len()]];
        for (t, x) in first.time.iter().zip(&first.values) {
            let since = t - start;
            if since > end + 1e-9 {
                break;
            }
            last.rotate_right(1);
            last[0].clear();
            last[0].push(*x);
            last[0].extend(cursors.iter_mut().map(|(start, cursor)| cursor.at(*start + since)));
            let mean = last[0].iter().sum::<f64>() / n;
            last[0].iter_mut().for_each(|x| *x -= mean);
            for (sum, before) in own.products.iter_mut().zip(&last) {
                *sum += last[0].iter().zip(before).map(|(a, b)| a * b).sum::<f64>();
            }
            own.freedom += n - 1.0;
        }
        (own.freedom > 0.0).then_some(own)
    }

    fn and(self, other: Self) -> Self {
        let products = [0, 1, 2].map(|k| self.products[k] + other.products[k]);
        Self { products, freedom: self.freedom + other.freedom }
    }

    /// Variances of noise and of drift: white noise is in the first product alone, what lasts in all of them, falling from one to
    /// the next as its readings do.
    fn parts(self) -> (f64, f64) {
        let [all, next, after] = self.products.map(|sum| sum / self.freedom);
        let lasts = next > 0.0 && after > MOST_CORRELATED * next;
        let drift = if lasts { (next * next / after).min(all) } else { 0.0 };
        (all - drift, drift)
    }
}

/// Variance about the mean of a recording at rest.
fn at_rest(c: &Channel) -> Option<(f64, f64)> {
    let n = c.len() as f64;
    let mean = c.values.iter().sum::<f64>() / n;
    (n >= 2.0).then(|| (c.values.iter().map(|x| (x - mean).powi(2)).sum(), n - 1.0))
}
