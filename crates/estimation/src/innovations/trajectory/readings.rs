//! What the model reads along a trajectory, and its gradient.
//!
//! ```text
//! position:  h = y + m1 y' + m2 y'',   H = dy/dx + m1 dy'/dx        y' is an output, too; y'' = dy'/dx x'
//! velocity:  h = y + m1 y',            H = dy/dx
//! ```

use super::nodes::TrajectoryChannel;
use super::plant::{TrajectoryPlant, TrajectoryPoint};

/// How channels are read: what a channel shows alone from the state, other outputs from the model.
#[derive(Clone, Debug)]
pub(super) struct ReadOutputs {
    /// Outputs that are requested from the model.
    outputs: Vec<usize>,
    channels: Vec<ReadChannel>,
}

#[derive(Clone, Copy, Debug)]
enum ReadChannel {
    /// A coordinate, or its rate, by index among both.
    State(usize),
    /// An output, and the output that is its rate, by their places among those that are requested from the model.
    Output(usize, Option<usize>),
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
        let read = channels.iter().map(|c| match c.state {
            Some(state) => ReadChannel::State(state),
            None => ReadChannel::Output(place(c.output), rate_of(c.output).map(&mut place)),
        });
        let channels = read.collect();
        Self { outputs, channels }
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
        let asked = !self.outputs.is_empty();
        let (values, gradients) = if asked { plant.outputs(at, &self.outputs) } else { Default::default() };
        let gradient = |k: usize| &gradients[width * k..width * (k + 1)];
        let along = |k: usize| gradient(k).iter().zip(&rates).map(|(g, x)| g * x).sum::<f64>();
        let (mut read, mut rows) = (Vec::new(), Vec::new());
        for (channel, [m1, m2]) in self.channels.iter().zip(moments) {
            match channel {
                ReadChannel::State(k) => {
                    let mut row = vec![0.0; width];
                    row[*k] = 1.0;
                    let mut value = at.state[*k] + m1 * rates[*k];
                    if let Some(rate) = row.get_mut(k + width / 2) {
                        *rate = *m1;
                        value += m2 * rates[k + width / 2];
                    }
                    read.push(value);
                    rows.extend(row);
                }
                ReadChannel::Output(own, Some(rate)) => {
                    read.push(values[*own] + m1 * values[*rate] + m2 * along(*rate)); // (EST-13)
                    rows.extend(gradient(*own).iter().zip(gradient(*rate)).map(|(y, v)| y + m1 * v));
                }
                ReadChannel::Output(own, None) => {
                    read.push(values[*own] + m1 * along(*own));
                    rows.extend(gradient(*own));
                }
            }
        }
        (read, rows)
    }
}
