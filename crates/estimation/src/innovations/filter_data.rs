//! What filter, columns and smoother take and give.

use std::rc::Rc;

use super::kernel::KernelSizes;
use super::linear::{PlantStep, ReadingRows, StepOrder};

/// A linear system along a recording.
#[derive(Clone, Debug)]
pub struct FilterInput<'a> {
    /// Steps, in the order of [`FilterInput::order`].
    pub steps: &'a [PlantStep],
    /// Covariance of what each of these steps adds.
    pub noise: Vec<Vec<f64>>,
    /// Which of them follows each node.
    pub order: StepOrder<'a>,
    /// Variance of an unknown force on coordinate `unknown_on` in the step after each node.
    pub unknown: &'a [f64],
    /// That coordinate, and the state that is its position.
    pub unknown_on: (usize, usize),
    /// Readings.
    pub rows: &'a ReadingRows,
    /// Variance of each reading; 0: there is none.
    pub variance: Vec<f64>,
    /// Which readings count.
    pub counted: &'a [bool],
    /// Covariance of the first state.
    pub first: Vec<f64>,
    /// Number of coordinates.
    pub forces: usize,
    /// Channels.
    pub channels: usize,
    /// Latent errors of readings, the last of the states: 0, or one a channel.
    pub errors: usize,
}

/// Gains of a recording.
#[derive(Clone, Debug)]
pub struct FilterGains<'a> {
    /// Of what.
    pub input: FilterInput<'a>,
    /// Gain of each reading, `size` numbers each.
    pub gain: Rc<Vec<f64>>,
    /// Variance of each innovation; 1 without a reading.
    pub variance: Rc<Vec<f64>>,
    /// Covariance of each node before its readings; empty unless requested.
    pub predicted: Vec<f64>,
}

impl FilterInput<'_> {
    /// States with latents.
    pub fn size(&self) -> usize {
        self.first.len().isqrt()
    }
    /// What decides which kernel takes it.
    pub(super) fn sizes(&self) -> KernelSizes {
        let by_mode = matches!(self.order, StepOrder::ByMode(_)) && self.errors == 0;
        KernelSizes { states: self.size(), forces: self.forces, by_mode }
    }
    /// States without latents.
    pub fn plain(&self) -> usize {
        self.size() - self.forces - self.errors
    }
    /// Readings that are there and count.
    pub fn counted_rows(&self) -> Vec<usize> {
        (0..self.counted.len()).filter(|k| self.counted[*k] && self.variance[*k] > 0.0).collect()
    }
}

/// What the recursion writes.
pub(super) struct Riccati<'a> {
    pub(super) input: &'a FilterInput<'a>,
    pub(super) gain: &'a mut [f64],
    pub(super) variance: &'a mut [f64],
    pub(super) predicted: Option<&'a mut Vec<f64>>,
}

/// The data column along a recording: what was read, and what is known to push.
#[derive(Clone, Debug)]
pub struct DataColumn {
    /// Force of each coordinate over the step after each node, N.m.
    pub forces: Vec<Vec<f64>>,
    /// Readings by node and channel.
    pub readings: Vec<f64>,
    /// First state with latents.
    pub first: Vec<f64>,
}

/// Columns that pass next to each other.
pub const LANES: usize = 16;

/// What is smaller is 0 in single precision: its products would be subnormal, with which processors take many times as long.
const LEAST: f64 = 1e-30;

/// A number in single precision.
#[inline(always)]
pub(super) fn in_single(x: f64) -> f32 {
    if x.abs() < LEAST { 0.0 } else { x as f32 }
}

/// Numbers of the lanes, one each.
pub type FilterLane = [f32; LANES];

/// [`LANES`] columns along a recording.
#[derive(Clone, Debug, Default)]
pub struct LaneBlock {
    /// Force of each coordinate over the step after each node; empty: none of these columns has one there.
    pub forces: Vec<Vec<FilterLane>>,
    /// Reading error of each channel at each node; empty: none.
    pub readings: Vec<Vec<FilterLane>>,
}

/// A block of columns that passes with gains of a recording.
pub struct LaneStream<'a> {
    /// Gains.
    pub gains: &'a FilterGains<'a>,
    /// [`single_rows`](super::lanes::single_rows) of these gains.
    pub rows: &'a [f32],
    /// Columns.
    pub block: &'a LaneBlock,
    /// Their whitened innovations, by node and channel; what was there before, where nothing counts.
    pub out: &'a mut Vec<FilterLane>,
}

/// A smoothed recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmoothedRecording {
    /// States with latents, `size` numbers a node.
    pub states: Vec<f64>,
    /// d log p / d (force of each coordinate, reading error of each channel), by node.
    pub scores: Vec<f64>,
    /// Power of the scores of each latent, and what the model expects of it; empty unless requested.
    pub powers: Vec<[f64; 2]>,
}

#[cfg(test)]
mod tests {
    use super::in_single;

    #[test]
    fn no_number_in_single_precision_is_subnormal_nor_near_it() {
        let all = [0.0, 1e-31, -9e-31, 2e-30, -1.5, 1e-40].map(in_single);
        assert_eq!(all, [0.0, 0.0, 0.0, 2e-30, -1.5, 0.0]);
    }
}
