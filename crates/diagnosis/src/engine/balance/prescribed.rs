//! A recording on its grid, and the channels that prescribe its coordinates.

use crate::engine::octaves;

/// A channel smoothed: itself and its derivatives on the grid.
#[derive(Clone, Debug)]
pub struct Smooth {
    /// Its output.
    pub output: usize,
    /// Standard deviation of a reading.
    pub sigma: f64,
    /// Standard deviation of it smoothed.
    pub smooth_sigma: f64,
    /// Standard deviation of its smoothed rate.
    pub rate_sigma: f64,
    /// Reading as it is, and its rate (of a velocity: itself) through a narrow kernel: what enters the model.
    pub enters: [Vec<f64>; 2],
    /// Reading.
    pub y: Vec<f64>,
    /// First derivative.
    pub dy: Vec<f64>,
    /// Second derivative.
    pub ddy: Vec<f64>,
}

/// One recording on its grid.
#[derive(Clone, Debug)]
pub struct GriddedRecording {
    /// Of the recording.
    pub name: String,
    /// Step of the grid, s.
    pub step: f64,
    /// Shortest step of integration, s.
    pub part: f64,
    /// Instants, s.
    pub t: Vec<f64>,
    /// Per channel.
    pub channels: Vec<Smooth>,
    /// Per input of the model; empty: 0.
    pub inputs: Vec<Vec<f64>>,
    /// Deviation of the kernel, in steps.
    pub kernel: f64,
    /// First and last instant that count.
    pub counts: std::ops::Range<usize>,
    /// What each residual represents.
    pub parts: Vec<octaves::OctavePart>,
    /// By octave: the lower triangle that makes the channels' values independent and of
    /// deviation 1, row by row.
    pub whiten: Vec<Vec<f64>>,
    /// By octave the share of its values that count: a law's form errs alike in all that are fast.
    pub share: Vec<f64>,
    /// Deviation of each channel by octave.
    pub floors: Vec<Vec<f64>>,
    /// The channels that prescribe its coordinates.
    pub leading: Leading,
    /// Instants at a reversal of something with dry friction: they do not count.
    pub reversal: Vec<bool>,
    /// Channels that showed it, as they prescribe the model as it is: in a set where a joint is compliant they may prescribe nothing that has
    /// friction.
    pub turning: Vec<usize>,
}

/// Which channels prescribe coordinates of a model.
#[derive(Clone, Debug, Default)]
pub struct Leading {
    /// Coordinates that may be prescribed.
    pub coordinates: Vec<bool>,
    /// Channels whose coordinate another one prescribes in the model as it is: they prescribe nothing in any model. Where a joint that was
    /// assumed to be rigid is compliant its spring's torque would else follow from the small difference of two angles.
    pub secondary: Vec<usize>,
    /// Channels next to another one that plainly differ from it: they are looked at as those that prescribe, and prescribe where their
    /// joint is compliant.
    pub apart: Vec<usize>,
    /// In the model as it is what nothing prescribes is integrated with accelerations that were measured, not that it makes up.
    pub as_measured: bool,
}
