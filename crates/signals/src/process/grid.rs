//! Channels brought to common times.

use crate::recording::{Channel, Recording};

/// Several channels at the same, even times, known delays taken out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChannelGrid {
    /// First time in s.
    pub start: f64,
    /// Distance in s.
    pub step: f64,
    /// Values of each channel, in the requested order.
    pub columns: Vec<Vec<f64>>,
}

impl ChannelGrid {
    /// Brings these channels to steps of `step` in s over the time that all of them cover. `None` if one is not there,
    /// they have no time in common, or `step` is not positive.
    ///
    /// Nothing is filtered before: a step longer than a channel's own folds what is above its half rate.
    pub fn of(run: &Recording, names: &[&str], step: f64) -> Option<Self> {
        let channels: Option<Vec<_>> = names.iter().map(|n| run.channel(n)).collect();
        let channels = channels?;
        let from = |c: &&Channel| c.time.first().map(|t| t - c.sensor.delay);
        let to = |c: &&Channel| c.time.last().map(|t| t - c.sensor.delay);
        let start = channels.iter().filter_map(from).fold(f64::NEG_INFINITY, f64::max);
        let end = channels.iter().filter_map(to).fold(f64::INFINITY, f64::min);
        let steps = (end - start) / step;
        if !(steps.is_finite() && steps >= 0.0 && step > 0.0 && steps < 1e9) {
            return None;
        }
        // A last point is not lost to rounding.
        let n = (steps + 1e-6).floor() as usize + 1;
        let time: Vec<f64> = (0..n).map(|i| start + i as f64 * step).collect();
        Some(Self { start, step, columns: channels.iter().map(|c| c.aligned(&time)).collect() })
    }

    /// Times in s.
    pub fn time(&self) -> Vec<f64> {
        let n = self.columns.first().map_or(0, Vec::len);
        (0..n).map(|i| self.start + i as f64 * self.step).collect()
    }
}

impl Channel {
    /// What the system did at these times in s, the sensor's known delay taken out: the reading at time + delay.
    pub fn aligned(&self, times: &[f64]) -> Vec<f64> {
        let mut cursor = self.cursor();
        times.iter().map(|t| cursor.at(t + self.sensor.delay)).collect()
    }
}
