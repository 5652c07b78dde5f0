//! Recordings as numbers: what drives a model, and what is compared with its outputs.

/// How an input goes between its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// On a straight line.
    #[default]
    Linear,
    /// It keeps the last value.
    Hold,
}

/// A measured input; before its first sample the first value, after the last the last.
#[derive(Clone, Debug, Default)]
pub struct Drive {
    /// Index of the model's input.
    pub input: usize,
    /// Times in s, strictly increasing.
    pub t: Vec<f64>,
    /// Values.
    pub u: Vec<f64>,
    /// Between the samples.
    pub between: Between,
}

/// A measured output.
#[derive(Clone, Debug, Default)]
pub struct Channel {
    /// FMU variable.
    pub name: String,
    /// Index of the model's output.
    pub output: usize,
    /// Times of the readings in s, strictly increasing.
    pub t: Vec<f64>,
    /// Readings.
    pub y: Vec<f64>,
    /// Standard deviation of a reading: noise and quantisation, sqrt(noise^2 + resolution^2/12).
    pub sigma: f64,
    /// A reading shows what was this long ago, s.
    pub delay: f64,
}

/// One recording.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Its name in messages and results.
    pub name: String,
    /// Inputs; those that are missing are 0.
    pub drives: Vec<Drive>,
    /// Outputs to compare.
    pub channels: Vec<Channel>,
    /// When the simulation starts, s; readings from before are left out.
    pub start: f64,
    /// The run starts at rest and in equilibrium.
    pub at_rest: bool,
}

impl Run {
    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.channels.iter().map(|c| c.t.len()).sum()
    }
    /// Nothing to compare.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
