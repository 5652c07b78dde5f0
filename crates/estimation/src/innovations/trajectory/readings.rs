//! What the model reads along a trajectory, and its gradient.
//!
//! ```text
//! position:  h = y + m1 y' + m2 y'',   H = dy/dx + m1 dy'/dx        y' is an output, too; y'' = dy'/dx x'
//! velocity:  h = y + m1 y',            H = dy/dx
//! ```

use super::nodes::TrajectoryChannel;
use super::plant::{TrajectoryPlant, TrajectoryPoint};

/// Outputs that channels show, each with the output that is its rate.
#[derive(Clone, Debug)]
pub(super) struct ReadOutputs {
    outputs: Vec<usize>,
    /// Of each channel: where its output is among `outputs`, and where its rate.
    places: Vec<(usize, Option<usize>)>,
}

impl ReadOutputs {
    pub(super) fn new(plant: &TrajectoryPlant, channels: &[TrajectoryChannel]) -> Self {
        let table = &plant.plant().table().outputs;
        let mut outputs = Vec::new();
        let mut place = |k: usize| {
            outputs.push(k);
            outputs.len() - 1
        };
        let rate_of = |k: usize| table.iter().position(|q| q.rate_of == Some(k));
        let places = channels.iter().map(|c| (place(c.output), rate_of(c.output).map(&mut place))).collect();
        Self { outputs, places }
    }

    /// Of each channel at a node: what is read, and its gradient by coordinates and rates; `moments` of the channels' times,
    /// `accelerations` the model's own.
    pub(super) fn read(
        &self,
        plant: &TrajectoryPlant,
        at: TrajectoryPoint<'_>,
        moments: &[[f64; 2]],
        accelerations: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let width = at.state.len();
        let rates: Vec<f64> = at.state[width / 2..].iter().chain(accelerations).copied().collect();
        let (values, gradients) = plant.outputs(at, &self.outputs);
        let gradient = |k: usize| &gradients[width * k..width * (k + 1)];
        let along = |k: usize| gradient(k).iter().zip(&rates).map(|(g, x)| g * x).sum::<f64>();
        let (mut read, mut rows) = (Vec::new(), Vec::new());
        for ((own, rate), [m1, m2]) in self.places.iter().zip(moments) {
            match rate {
                Some(rate) => {
                    read.push(values[*own] + m1 * values[*rate] + m2 * along(*rate)); // (EST-13)
                    rows.extend(gradient(*own).iter().zip(gradient(*rate)).map(|(y, v)| y + m1 * v));
                }
                None => {
                    read.push(values[*own] + m1 * along(*own));
                    rows.extend(gradient(*own));
                }
            }
        }
        (read, rows)
    }
}
