//! What a sensor reads when nothing changes.

use trueup_signals::process::{Spectrum, autocorrelation, ljung_box, welch};
use trueup_signals::{Channel, Loaded, Recording, noise};

/// Where a floor comes from, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ChannelFloorSource {
    /// Runs of one command against each other.
    Repeats,
    /// Recordings at rest.
    Rest,
    /// Declared noise and resolution.
    Declared,
    /// What differs from sample to sample faster than the motion does: a guess, to be reported as one.
    HighFrequency,
}

impl ChannelFloorSource {
    /// In words, for a report.
    pub fn text(self) -> &'static str {
        match self {
            Self::Repeats => "repeats of one command",
            Self::Rest => "recordings at rest",
            Self::Declared => "declared noise and resolution",
            Self::HighFrequency => {
                "a guess from the highest frequencies; declare noise or add a recording at rest"
            }
        }
    }
}

/// Noise of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelFloor {
    /// The channel.
    pub channel: String,
    /// Standard deviation in the channel's unit.
    pub deviation: f64,
    /// Where it comes from.
    pub source: ChannelFloorSource,
    /// Power spectral density, unit^2/Hz, where the noise was seen and is not white.
    pub spectrum: Option<Spectrum>,
    /// How many samples say as much as one independent one (1: white).
    pub correlation: f64,
}

/// Floor of a compared channel: from repeats, else recordings at rest, else declared noise and resolution, else a robust
/// estimate from differences of neighbouring samples. `None` if no recording has the channel, or it never changes.
pub fn output(loaded: &Loaded, channel: &str) -> Option<ChannelFloor> {
    match noise::floor(loaded, channel) {
        Some(found) => Some(seen(loaded, channel, found)),
        None => guess(loaded, channel),
    }
}

/// Floor of a measured input: declared noise and resolution, else recordings at rest; `None` means a command, which is
/// known. Repeats are not used: in a closed loop their inputs differ because the system was driven differently.
pub fn input(loaded: &Loaded, channel: &str) -> Option<ChannelFloor> {
    let declared = loaded.recordings.values().filter_map(|run| run.channel(channel)?.sensor.deviation());
    if let Some(deviation) = declared.fold(None, |m: Option<f64>, d| Some(m.map_or(d, |m| m.max(d)))) {
        return Some(white(channel, deviation, ChannelFloorSource::Declared));
    }
    let mut without = loaded.clone();
    without.case.repeats.clear();
    Some(seen(&without, channel, noise::floor(&without, channel)?))
}

fn white(channel: &str, deviation: f64, source: ChannelFloorSource) -> ChannelFloor {
    ChannelFloor { channel: channel.into(), deviation, source, spectrum: None, correlation: 1.0 }
}

/// With its colour, if noise itself was recorded.
fn seen(loaded: &Loaded, channel: &str, found: noise::NoiseFloor) -> ChannelFloor {
    let (source, noises) = match found.source {
        noise::NoiseFloorSource::Declared => {
            return white(channel, found.deviation, ChannelFloorSource::Declared);
        }
        // What drifts between repeats is no colour of the noise.
        noise::NoiseFloorSource::Repeats if found.drift > 0.0 => {
            return white(channel, found.deviation, ChannelFloorSource::Repeats);
        }
        noise::NoiseFloorSource::Rest => {
            let at_rest = |run: &&Recording| Some(centred(run.channel(channel)?));
            (ChannelFloorSource::Rest, loaded.rest().iter().filter_map(at_rest).collect::<Vec<_>>())
        }
        noise::NoiseFloorSource::Repeats => {
            let repeats = loaded.repeats();
            (
                ChannelFloorSource::Repeats,
                repeats.iter().filter_map(|group| differences(group, channel)).flatten().collect(),
            )
        }
    };
    let mut floor = white(channel, found.deviation, source);
    let Some((rate, longest)) = noises.iter().max_by_key(|(_, x)| x.len()) else { return floor };
    let coloured = longest.len() >= 100 && ljung_box(longest, 20, 0).is_some_and(|test| test.p_value < 1e-3);
    if coloured {
        let segment = (longest.len() / 8).clamp(32, 1024).min(longest.len());
        floor.spectrum = welch(longest, *rate, segment);
        floor.correlation = correlation(longest);
    }
    floor
}

/// 1 + 2 sum of the autocorrelation up to where it first is negative.
pub(crate) fn correlation(x: &[f64]) -> f64 {
    let lags = x.len().saturating_sub(1).min(x.len() / 4);
    let Some(r) = autocorrelation(x, lags) else { return 1.0 };
    1.0 + 2.0 * r.iter().skip(1).take_while(|r| **r > 0.0).sum::<f64>()
}

/// Rate in Hz, and values about their mean.
fn centred(c: &Channel) -> (f64, Vec<f64>) {
    let mean = c.values.iter().sum::<f64>() / c.len() as f64;
    (rate(c), c.values.iter().map(|x| x - mean).collect())
}

fn rate(c: &Channel) -> f64 {
    c.median_step().map_or(1.0, |step| 1.0 / step)
}

/// Of each run of a group its distance from the mean of all, as large as the noise is: times sqrt(n / (n - 1)).
fn differences(group: &[&Recording], channel: &str) -> Option<Vec<(f64, Vec<f64>)>> {
    let runs: Option<Vec<_>> = group.iter().map(|run| Some((run.start, run.channel(channel)?))).collect();
    let runs = runs.filter(|r| r.len() >= 2)?;
    let (start, first) = runs[0];
    let end = runs.iter().filter_map(|(s, c)| Some(c.time.last()? - s)).fold(f64::INFINITY, f64::min);
    let since: Vec<f64> = first.time.iter().map(|t| t - start).filter(|t| *t <= end + 1e-9).collect();
    let all: Vec<Vec<f64>> =
        runs.iter().map(|(s, c)| c.sample(&since.iter().map(|t| s + t).collect::<Vec<_>>())).collect();
    let n = all.len() as f64;
    let mean: Vec<f64> = (0..since.len()).map(|i| all.iter().map(|x| x[i]).sum::<f64>() / n).collect();
    let scale = (n / (n - 1.0)).sqrt();
    Some(
        all.iter()
            .map(|x| (rate(first), x.iter().zip(&mean).map(|(x, m)| scale * (x - m)).collect()))
            .collect(),
    )
}

/// Median over the recordings of what differences of neighbouring samples say.
fn guess(loaded: &Loaded, channel: &str) -> Option<ChannelFloor> {
    let of = |run: &Recording| from_differences(&run.channel(channel)?.values);
    let mut all: Vec<f64> = loaded.recordings.values().filter_map(of).collect();
    all.sort_unstable_by(f64::total_cmp);
    Some(white(channel, *all.get(all.len() / 2)?, ChannelFloorSource::HighFrequency))
}

/// Differences of order k of white noise have a variance of C(2k, k) times its own, while a smooth motion has ever less
/// of them: the least over k = 2 .. 6 of the median absolute deviation. Never below that of one count.
fn from_differences(x: &[f64]) -> Option<f64> {
    let mut d = x.to_vec();
    let (mut gain, mut least) = (1.0, f64::INFINITY);
    for k in 1..=6 {
        d = d.windows(2).map(|w| w[1] - w[0]).collect();
        gain *= 2.0 * (2 * k - 1) as f64 / k as f64; // C(2k, k) from C(2k - 2, k - 1)
        if k >= 2 && d.len() >= 8 {
            let mut size: Vec<f64> = d.iter().map(|d| d.abs()).collect();
            let middle = size.len() / 2;
            let (_, median, _) = size.select_nth_unstable_by(middle, f64::total_cmp);
            least = f64::min(least, *median / 0.6745 / f64::sqrt(gain));
        }
    }
    let count = lattice(x).map_or(0.0, |count| count / 12f64.sqrt());
    let deviation = least.max(count);
    (deviation.is_finite() && deviation > 0.0).then_some(deviation)
}

/// The count of a quantised reading: the smallest step, if every other is a multiple of it.
fn lattice(x: &[f64]) -> Option<f64> {
    let steps = || x.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0);
    let size = x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let least = steps().filter(|d| *d > 1e-9 * size).fold(f64::INFINITY, f64::min);
    let whole = |d: f64| (d / least - (d / least).round()).abs() < 0.02;
    (least.is_finite() && steps().count() >= 3 && steps().all(whole)).then_some(least)
}
