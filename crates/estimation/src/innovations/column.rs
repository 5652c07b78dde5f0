//! Columns: forces and reading errors per unit amplitude along the smoothed trajectory.

use std::rc::Rc;

use super::filter_data::{LANES, LaneBlock, in_single};

/// A series by node, times a weight.
#[derive(Clone, Debug)]
pub struct WeightedSeries {
    /// Coordinate of a force, or channel of a reading error.
    pub on: usize,
    /// Factor of the values.
    pub weight: f64,
    /// By node; of a force its mean over the step that follows.
    pub values: Rc<[f64]>,
}

/// A column along one recording.
#[derive(Clone, Debug, Default)]
pub struct ColumnPart {
    /// Forces, N.m.
    pub forces: Vec<WeightedSeries>,
    /// Reading errors, in the unit of the channel's state.
    pub readings: Vec<WeightedSeries>,
}

impl ColumnPart {
    /// A force on one coordinate.
    pub fn force(on: usize, values: Vec<f64>) -> Self {
        Self { forces: vec![WeightedSeries { on, weight: 1.0, values: values.into() }], readings: Vec::new() }
    }
    /// A force with these weights on the coordinates.
    pub fn forces(weights: &[f64], values: Vec<f64>) -> Self {
        let values: Rc<[f64]> = values.into();
        let one =
            |(on, weight): (usize, &f64)| WeightedSeries { on, weight: *weight, values: values.clone() };
        Self { forces: weights.iter().enumerate().map(one).collect(), readings: Vec::new() }
    }
    /// A reading error of one channel.
    pub fn reading(on: usize, values: Vec<f64>) -> Self {
        Self { forces: Vec::new(), readings: vec![WeightedSeries { on, weight: 1.0, values: values.into() }] }
    }
}

/// A column: one part a recording.
pub type FilterColumn = Vec<ColumnPart>;

/// Prior standard deviation of the amplitude of a law of fixed size (mean 1) in a fit, over that in a screen.
const FIXED_SIZE: f64 = 0.4;

/// Columns with the normal priors of their amplitudes: what a law adds to the model.
#[derive(Clone, Debug, Default)]
pub struct AppliedLaw {
    /// The columns; the first is the effect, the others absorb the form of its law.
    pub columns: Vec<FilterColumn>,
    /// Prior mean of each amplitude.
    pub mean: Vec<f64>,
    /// Prior standard deviation of each amplitude.
    pub deviation: Vec<f64>,
    /// Spring of the plant in which it acts, whose tangent it changes.
    pub spring: Option<usize>,
}

impl AppliedLaw {
    /// With the priors of a fit: narrower than in a screen where the law has a fixed size.
    pub fn narrowed(&self) -> Self {
        let priors = self.deviation.iter().zip(&self.mean);
        let deviation = priors.map(|(d, mean)| if *mean == 1.0 { FIXED_SIZE * d } else { *d });
        Self { deviation: deviation.collect(), ..self.clone() }
    }
}

/// The part of recording `recording` of up to [`LANES`] columns next to each other.
pub fn beside(columns: &[&FilterColumn], recording: usize, coordinates: usize, channels: usize) -> LaneBlock {
    let mut block = LaneBlock { forces: vec![Vec::new(); coordinates], readings: vec![Vec::new(); channels] };
    for (lane, column) in columns.iter().take(LANES).enumerate() {
        let part = &column[recording];
        let places = part.forces.iter().map(|s| (true, s)).chain(part.readings.iter().map(|s| (false, s)));
        for (force, s) in places {
            let all = if force { &mut block.forces[s.on] } else { &mut block.readings[s.on] };
            all.resize(s.values.len(), [0.0; LANES]);
            all.iter_mut().zip(s.values.iter()).for_each(|(x, v)| x[lane] += in_single(s.weight * v));
        }
    }
    block
}

/// What a hypothesis adds along one recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OwnForces {
    /// By coordinate and node, N.m.
    pub forces: Vec<Vec<f64>>,
    /// By channel and node; empty: none.
    pub readings: Vec<Vec<f64>>,
}

impl OwnForces {
    /// Nothing.
    pub fn none(coordinates: usize, channels: usize, nodes: usize) -> Self {
        Self { forces: vec![vec![0.0; nodes]; coordinates], readings: vec![Vec::new(); channels] }
    }

    /// Of columns at these amplitudes, in a recording of `nodes`.
    pub fn of<'a>(
        columns: impl IntoIterator<Item = &'a FilterColumn>,
        amplitudes: &[f64],
        recording: usize,
        [coordinates, channels, nodes]: [usize; 3],
    ) -> Self {
        let mut own = Self::none(coordinates, channels, nodes);
        columns.into_iter().zip(amplitudes).for_each(|(c, a)| own.add(&c[recording], *a));
        own
    }

    /// Takes its reading errors from readings by node and channel.
    pub fn correct(&self, readings: &mut [f64]) {
        for (c, error) in self.readings.iter().enumerate() {
            let all = readings.iter_mut().skip(c).step_by(self.readings.len());
            all.zip(error).for_each(|(y, e)| *y -= e);
        }
    }

    /// Adds a column at an amplitude.
    pub fn add(&mut self, part: &ColumnPart, amplitude: f64) {
        for s in &part.forces {
            let sum = self.forces[s.on].iter_mut();
            sum.zip(s.values.iter()).for_each(|(x, v)| *x += amplitude * s.weight * v);
        }
        for s in &part.readings {
            let sum = &mut self.readings[s.on];
            sum.resize(s.values.len(), 0.0);
            sum.iter_mut().zip(s.values.iter()).for_each(|(x, v)| *x += amplitude * s.weight * v);
        }
    }
}
