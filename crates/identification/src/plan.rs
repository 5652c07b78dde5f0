//! A recording cut at every sample of its inputs and at every instant that a sensor shows, ready for simulation.

use trueup_numerics::Scalar;
use trueup_numerics::order::ascending;

use crate::run::{IdentificationRun, InputInterpolation};
use crate::sensors::InputMap;

/// Steps between two nodes after which a simulation gives up.
const MOST_STEPS: f64 = 5000.0;

/// Step of Runge-Kutta times largest eigenvalue: phase error 1e-6 per radian.
const RUNGE_KUTTA_STEP: f64 = 0.1;

/// An instant at which something happens.
#[derive(Clone, Debug)]
pub(crate) struct PlanNode {
    pub(crate) t: f64,
    /// Step to the next node, s.
    pub(crate) h: f64,
    /// An input jumps here.
    pub(crate) jump: bool,
    /// Readings: channel, sample.
    pub(crate) readings: Vec<(usize, usize)>,
}

/// A recording made ready for simulation.
#[derive(Clone, Debug)]
pub struct PredictionPlan {
    pub(crate) nodes: Vec<PlanNode>,
    /// Inputs and their slopes from each node on, node by node.
    pub(crate) u: Vec<f64>,
    pub(crate) du: Vec<f64>,
    pub(crate) inputs: usize,
    /// Output index per channel.
    pub(crate) wanted: Vec<usize>,
    /// Where each channel's readings begin in the prediction; last: how many there are.
    pub(crate) begin: Vec<usize>,
    pub(crate) name: String,
    /// Most steps between two nodes.
    pub(crate) most_steps: f64,
    /// Longest step of what is integrated by Runge-Kutta, in radians (or e-folds) of the fastest mode.
    pub(crate) radians: f64,
}

/// Times are rounded to this, s, such that an even clock has few step sizes.
pub(crate) const TICK: f64 = 1.0 / (1u64 << 40) as f64;

impl PredictionPlan {
    /// For a model with `inputs` inputs.
    pub fn new(run: &IdentificationRun, inputs: usize) -> Self {
        let mut marks: Vec<(f64, Option<(usize, usize)>)> = vec![(run.start, None)];
        for drive in &run.drives {
            marks.extend(drive.t.iter().filter(|t| **t > run.start).map(|t| (*t, None)));
        }
        for (c, channel) in run.channels.iter().enumerate() {
            let seen = |k: usize| channel.t[k] - channel.delay;
            // What a sensor shows from before the start is the start.
            marks.extend((0..channel.t.len()).map(|k| (seen(k).max(run.start), Some((c, k)))));
        }
        ascending(&mut marks, |item| item.0);
        let last = marks.iter().rposition(|m| m.1.is_some()).map_or(0, |i| i + 1);
        let mut nodes: Vec<PlanNode> = Vec::new();
        for (t, reading) in marks.drain(..last.max(1)) {
            match nodes.last_mut() {
                Some(node) if t - node.t < TICK => node.readings.extend(reading),
                _ => nodes.push(PlanNode { t, h: 0.0, jump: false, readings: reading.into_iter().collect() }),
            }
        }
        for i in 1..nodes.len() {
            let ticks = |i: usize| ((nodes[i].t - run.start) / TICK).round();
            nodes[i - 1].h = (ticks(i) - ticks(i - 1)) * TICK;
        }
        let (mut u, mut du) = (vec![0.0; nodes.len() * inputs], vec![0.0; nodes.len() * inputs]);
        for drive in run.drives.iter().filter(|d| !d.t.is_empty()) {
            let mut k = 0;
            for (i, node) in nodes.iter_mut().enumerate() {
                let before = k;
                while k + 1 < drive.t.len() && drive.t[k + 1] <= node.t + TICK {
                    k += 1;
                }
                let at = i * inputs + drive.input;
                let inside = k + 1 < drive.t.len() && node.t + TICK >= drive.t[0];
                match drive.between {
                    InputInterpolation::Hold => {
                        u[at] = drive.u[k];
                        node.jump |= i > 0 && drive.u[k] != drive.u[before];
                    }
                    InputInterpolation::Linear if inside => {
                        du[at] = (drive.u[k + 1] - drive.u[k]) / (drive.t[k + 1] - drive.t[k]);
                        u[at] = drive.u[k] + du[at] * (node.t - drive.t[k]);
                    }
                    InputInterpolation::Linear => u[at] = drive.u[k],
                }
            }
        }
        let mut begin = vec![0];
        for channel in &run.channels {
            begin.push(begin[begin.len() - 1] + channel.t.len());
        }
        let wanted = run.channels.iter().map(|c| c.output).collect();
        Self {
            nodes,
            u,
            du,
            inputs,
            wanted,
            begin,
            name: run.name.clone(),
            most_steps: MOST_STEPS,
            radians: RUNGE_KUTTA_STEP,
        }
    }
    /// Name of the recording.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// Time of an instant in s.
    pub fn time(&self, node: usize) -> f64 {
        self.nodes.get(node).map_or(0.0, |n| n.t)
    }
    /// From an instant to the next one, s.
    pub fn step(&self, node: usize) -> f64 {
        self.nodes[node].h
    }
    /// An input jumps there.
    pub fn jumps(&self, node: usize) -> bool {
        self.nodes[node].jump
    }
    /// What is read there: place in the prediction, channel.
    pub fn due(&self, node: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.nodes[node].readings.iter().map(|&(channel, k)| (self.begin[channel] + k, channel))
    }
    /// Output index per channel.
    pub fn wanted(&self) -> &[usize] {
        &self.wanted
    }
    /// Inputs from an instant on, and their slopes.
    pub fn inputs_at<T: Scalar>(&self, node: usize, map: &InputMap<T>, u: &mut [T], du: &mut [T]) {
        for i in 0..u.len() {
            let at = node * self.inputs + i;
            let gain = |v: f64| map.gain.get(i).map_or(T::constant(v), |g| *g * v);
            u[i] = map.bias.get(i).map_or(gain(self.u[at]), |b| gain(self.u[at]) + *b);
            du[i] = gain(self.du[at]);
        }
    }
    /// How many instants the simulation stops at.
    pub fn nodes(&self) -> usize {
        self.nodes.len()
    }
    /// Gives up on a model that needs more steps than this between two nodes.
    pub fn within(mut self, most_steps: f64) -> Self {
        self.most_steps = most_steps;
        self
    }
    /// Integrates models that are not affine in steps of so many radians (or e-folds) of their fastest mode at most, instead of
    /// 0.1: an oscillation is behind by the fourth power of that over 120 in each radian.
    pub fn stepping(mut self, radians: f64) -> Self {
        self.radians = radians;
        self
    }
    /// How many readings are predicted.
    pub fn len(&self) -> usize {
        self.begin.last().copied().unwrap_or(0)
    }
    /// Nothing is predicted.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Where the readings of each channel begin in a prediction; the last entry is its length.
    pub fn channels(&self) -> &[usize] {
        &self.begin
    }
}
