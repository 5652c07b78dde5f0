//! One run of a system.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::columns::ColumnMapping;
use crate::value::ParameterValue;

/// How a signal goes between its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Interpolation {
    /// On the line between them.
    #[default]
    Linear,
    /// The last one holds until the next.
    Hold,
}

/// What is known of a figure of a sensor that is to be estimated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorGuess {
    /// The assumed value.
    pub value: f64,
    /// Standard deviation: of a gain as a share of it, of an offset in the channel's unit, of a delay in s; `None`: nothing is known.
    pub doubt: Option<f64>,
}

/// What is known of the sensor, in the channel's unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorData {
    /// Step of the reading (one count).
    pub resolution: Option<f64>,
    /// Standard deviation of white noise.
    pub noise: Option<f64>,
    /// By how many seconds the reading is late: the sample of time t shows the system at t - delay.
    pub delay: f64,
    /// To be estimated: the assumed value, and how far it may be off in s; `None`: it is known.
    pub late: Option<PriorGuess>,
    /// What a reading has too much, a constant; `None`: nothing.
    pub offset: Option<PriorGuess>,
    /// By how many times a reading is too large, the offset left out; `None`: by none.
    pub gain: Option<PriorGuess>,
}

impl SensorData {
    /// The assumed excess of a reading.
    pub fn believed_offset(&self) -> f64 {
        self.offset.map_or(0.0, |g| g.value)
    }
    /// The assumed factor by which a reading is too large.
    pub fn believed_gain(&self) -> f64 {
        self.gain.map_or(1.0, |g| g.value)
    }
    /// Standard deviation of a reading, from declared noise and quantisation (resolution / sqrt(12)); `None` if
    /// neither is declared.
    pub fn deviation(&self) -> Option<f64> {
        match (self.noise, self.resolution) {
            (None, None) => None,
            (noise, resolution) => Some(noise.unwrap_or(0.0).hypot(resolution.unwrap_or(0.0) / 12f64.sqrt())),
        }
    }
}

/// What a sidecar or a case declares for a channel; what is `None` is not declared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelSettings {
    /// See [`SensorData::resolution`].
    pub resolution: Option<f64>,
    /// See [`SensorData::noise`].
    pub noise: Option<f64>,
    /// See [`SensorData::delay`].
    pub delay: Option<f64>,
    /// See [`SensorData::late`].
    pub late: Option<PriorGuess>,
    /// See [`SensorData::offset`].
    pub offset: Option<PriorGuess>,
    /// See [`SensorData::gain`].
    pub gain: Option<PriorGuess>,
    /// See [`Channel::interpolation`].
    pub interpolation: Option<Interpolation>,
}

/// What a case declares for all its recordings; what a sidecar declares has precedence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeclaredFigures {
    /// By the names of channels; an array's name means its elements.
    pub channels: BTreeMap<String, ChannelSettings>,
    /// Rows a second, in Hz, evenly spaced whatever the clock shows; `None`: by the clock.
    pub rate: Option<f64>,
    /// What its columns are, by the file's names.
    pub columns: BTreeMap<String, ColumnMapping>,
}

/// One signal with samples of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name of the FMU variable that it measures, an element as `jointTorque[1]`.
    pub name: String,
    /// Unit of the values, SI; empty: none or not known.
    pub unit: String,
    /// Times in s, finite, strictly increasing, not necessarily even; missing samples are left out. At least one.
    pub time: Vec<f64>,
    /// Values, finite, as many as times.
    pub values: Vec<f64>,
    /// How it goes between samples.
    pub interpolation: Interpolation,
    /// What is known of its sensor.
    pub sensor: SensorData,
}

impl Channel {
    /// A channel without knowledge of a sensor.
    pub fn new(name: &str, unit: &str, time: Vec<f64>, values: Vec<f64>) -> Self {
        Self {
            name: name.into(),
            unit: unit.into(),
            time,
            values,
            interpolation: Interpolation::Linear,
            sensor: SensorData::default(),
        }
    }

    /// Values with the sensor's assumed errors taken out: the reading less the offset, over the gain.
    pub fn believed(&self) -> Vec<f64> {
        let (offset, gain) = (self.sensor.believed_offset(), self.sensor.believed_gain());
        self.values.iter().map(|v| (v - offset) / gain).collect()
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time.len().min(self.values.len())
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Value of the reading at `time` in s, by the channel's interpolation; the first and last value go on beyond the
    /// ends. The delay is not taken out. `NaN` without samples.
    pub fn at(&self, time: f64) -> f64 {
        self.cursor().at(time)
    }

    /// For many times in increasing order: each look-up begins where the last one ended.
    pub fn cursor(&self) -> Cursor<'_> {
        Cursor { channel: self, next: 0 }
    }

    /// Values at these times, in s; see [`at`](Self::at).
    pub fn sample(&self, times: &[f64]) -> Vec<f64> {
        let mut cursor = self.cursor();
        times.iter().map(|t| cursor.at(*t)).collect()
    }

    /// Median distance between samples in s; `None` with fewer than two.
    pub fn median_step(&self) -> Option<f64> {
        let mut steps: Vec<f64> = self.time.windows(2).map(|w| w[1] - w[0]).collect();
        if steps.is_empty() {
            return None;
        }
        let middle = steps.len() / 2;
        Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
    }

    /// Least and largest value; `None` without samples.
    pub fn range(&self) -> Option<(f64, f64)> {
        let first = *self.values.first()?;
        Some(self.values.iter().fold((first, first), |(low, high), x| (low.min(*x), high.max(*x))))
    }

    pub(crate) fn declare(&mut self, settings: &ChannelSettings) {
        let ChannelSettings { resolution, noise, delay, late, offset, gain, interpolation } = settings;
        self.sensor.resolution = resolution.or(self.sensor.resolution);
        self.sensor.noise = noise.or(self.sensor.noise);
        if let Some(delay) = delay {
            (self.sensor.delay, self.sensor.late) = (*delay, *late);
        }
        self.sensor.offset = offset.or(self.sensor.offset);
        self.sensor.gain = gain.or(self.sensor.gain);
        self.interpolation = interpolation.unwrap_or(self.interpolation);
    }
}

/// Looks values up; made by [`Channel::cursor`].
#[derive(Clone, Debug)]
pub struct Cursor<'a> {
    channel: &'a Channel,
    /// Index of the first sample after the last requested time.
    next: usize,
}

impl Cursor<'_> {
    /// See [`Channel::at`].
    pub fn at(&mut self, time: f64) -> f64 {
        let (t, x) = (&self.channel.time, &self.channel.values);
        let after = |i: usize| t.get(i).is_none_or(|t| *t > time);
        let before = |i: usize| i == 0 || t[i - 1] <= time;
        if !(before(self.next) && after(self.next)) {
            self.next += 1;
            if self.next > t.len() || !(before(self.next) && after(self.next)) {
                self.next = t.partition_point(|t| *t <= time);
            }
        }
        match (self.next.checked_sub(1), t.get(self.next)) {
            (None, _) => x.first().copied().unwrap_or(f64::NAN),
            (Some(i), Some(end)) if self.channel.interpolation == Interpolation::Linear => {
                x[i] + (x[self.next] - x[i]) * ((time - t[i]) / (end - t[i]))
            }
            (Some(i), _) => x[i],
        }
    }
}

/// One run of the real system, or of a simulation in its place.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// As its case names it (`train-1.csv`).
    pub name: String,
    /// Where it was read from.
    pub file: PathBuf,
    /// Its signals, in the order of the file.
    pub channels: Vec<Channel>,
    /// First time of the file in s.
    pub start: f64,
    /// Last time of the file in s.
    pub end: f64,
    /// Start values known for this run, element by element.
    pub parameters: BTreeMap<String, ParameterValue>,
}

impl Recording {
    /// The channel of that name.
    pub fn channel(&self, name: &str) -> Option<&Channel> {
        self.channels.iter().find(|c| c.name == name)
    }

    /// Length in s.
    pub fn duration(&self) -> f64 {
        self.end - self.start
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cursor_finds_what_a_search_finds_whatever_the_order() {
        let mut c = Channel::new("x", "", vec![0.0, 1.0, 1.5, 4.0], vec![0.0, 2.0, 1.0, 6.0]);
        let mut cursor = c.cursor();
        for (t, x) in [
            (-1.0, 0.0),
            (0.5, 1.0),
            (1.0, 2.0),
            (9.0, 6.0),
            (1.25, 1.5),
            (0.0, 0.0),
            (2.75, 3.5),
            (4.0, 6.0),
        ] {
            assert_eq!(cursor.at(t), x, "at {t}");
        }
        c.interpolation = Interpolation::Hold;
        assert_eq!(c.sample(&[-1.0, 0.9, 1.0, 1.49, 3.0, 9.0]), [0.0, 0.0, 2.0, 2.0, 1.0, 6.0]);
        assert!(Channel::new("x", "", vec![], vec![]).at(0.0).is_nan());
    }
}
