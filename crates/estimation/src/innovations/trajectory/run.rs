//! A recording along its trajectory.

use std::borrow::Cow;
use std::rc::Rc;

use trueup_plant::{Coordinate, InverseMass};

use super::nodes::{TrajectoryChannel, TrajectoryNodes, TrajectoryReadings};
use super::plant::{TrajectoryError, TrajectoryPlant, TrajectoryPoint};
use super::readings::ReadOutputs;
use super::steps::{NodeTangent, model_step, step_between};
use super::unknowns::UnknownParameter;
use crate::innovations::column::ColumnPart;
use crate::innovations::linear::{PlantStep, ReadingRows};
use crate::innovations::numeric::{gaussian, interpolated, median, rates_at};

/// Memory of the latent forces and of the latent errors of readings, s.
pub const MEMORIES: [f64; 2] = [0.1, 0.3];
/// Standard deviation of the smoothing of the first speeds, s.
const SPEED: f64 = 0.08;

/// Tangents of the laws in force along a recording: forces on the coordinates by coordinates and rates, n x 2n a node. Empty: none.
pub type LawTangent = Vec<f64>;

/// A recording in a frame, along its trajectory.
#[derive(Clone, Debug)]
pub struct TrajectoryRun {
    /// Nodes and inputs.
    pub nodes: Rc<TrajectoryNodes>,
    /// Readings.
    pub readings: Rc<TrajectoryReadings>,
    /// The trajectory: coordinates, then rates, a node.
    pub states: Vec<f64>,
    /// Forces that hold over the step after each node, by node and coordinate: own and latent ones.
    pub forces: Vec<f64>,
    /// Those of the hypothesis among them.
    pub own: Vec<f64>,
    /// The model's own accelerations at both ends of the step after each node, without latent forces.
    pub accelerations: Vec<f64>,
    /// What the model reads, by node and channel.
    pub model_readings: Vec<f64>,
    /// Scores by node: forces by coordinate, then readings by channel.
    pub scores: Vec<f64>,
    /// Parameters that are others in this recording, known there: index and value.
    pub own_parameters: Vec<(usize, f64)>,
    /// Steps and rows about the trajectory.
    pub(super) linear: Rc<TrajectoryLinear>,
}

/// Steps and rows about a trajectory.
#[derive(Clone, Debug, Default)]
pub(super) struct TrajectoryLinear {
    pub(super) steps: Vec<PlantStep>,
    pub(super) rows: ReadingRows,
    /// Covariance of what white forces add to coordinates and rates in each step.
    pub(super) noise: Vec<Vec<f64>>,
    /// Inverse of the mass matrix at each node.
    inverses: Vec<InverseMass>,
}

/// States with latents: coordinates, rates, latent forces, latent errors.
fn size_of(channels: usize, coordinates: usize) -> usize {
    3 * coordinates + channels
}

impl TrajectoryRun {
    /// With a trajectory to begin with: readings smoothed; a joint that is not read follows its motor, and the other way.
    pub(super) fn new(
        nodes: Rc<TrajectoryNodes>,
        readings: TrajectoryReadings,
        channels: &[TrajectoryChannel],
        plant: &TrajectoryPlant,
    ) -> Self {
        let (n, length) = (plant.coordinates(), nodes.len());
        let dt = median(nodes.step.clone());
        let mut seen: Vec<Option<Vec<f64>>> = vec![None; n];
        for (c, channel) in channels.iter().enumerate() {
            let Some(k) = channel.state.filter(|k| *k < n && seen[*k].is_none()) else { continue };
            let at: Vec<usize> = (0..length).map(|t| channels.len() * t + c).collect();
            let there: Vec<usize> = (0..length).filter(|t| readings.count[at[*t]] > 0.0).collect();
            if there.is_empty() {
                continue;
            }
            let time: Vec<f64> = there.iter().map(|t| nodes.time[*t] + readings.moments[at[*t]][0]).collect();
            let values: Vec<f64> = there.iter().map(|t| readings.mean[at[*t]]).collect();
            let wide = (0.12 * (channel.variance.sqrt() / 3e-4).sqrt()).clamp(0.03, 0.12);
            seen[k] = Some(gaussian(&interpolated(&nodes.time, &time, &values), wide / dt));
        }
        for (joint, motor) in plant.joints.iter().zip(&plant.drives) {
            let either = seen[*joint].clone().or_else(|| seen[*motor].clone());
            for k in [*joint, *motor] {
                seen[k] = seen[k].take().or_else(|| either.clone());
            }
        }
        let positions: Vec<Vec<f64>> =
            seen.into_iter().map(|q| q.unwrap_or_else(|| vec![0.0; length])).collect();
        let rates: Vec<Vec<f64>> =
            positions.iter().map(|q| gaussian(&rates_at(&nodes.time, q), SPEED / dt)).collect();
        let states =
            (0..length).flat_map(|t| positions.iter().chain(&rates).map(move |series| series[t])).collect();
        let mut run = Self {
            nodes,
            readings: Rc::new(readings),
            states: Vec::new(),
            forces: Vec::new(),
            own: Vec::new(),
            accelerations: Vec::new(),
            model_readings: Vec::new(),
            scores: Vec::new(),
            own_parameters: Vec::new(),
            linear: Rc::default(),
        };
        run.put(states, vec![0.0; n * length], vec![0.0; n * length]);
        run
    }

    /// All parameters as they are in this recording.
    pub fn parameters_of<'a>(&self, theta: &'a [f64]) -> Cow<'a, [f64]> {
        let mut theta = Cow::Borrowed(theta);
        self.own_parameters.iter().for_each(|(k, value)| theta.to_mut()[*k] = *value);
        theta
    }

    /// Takes a trajectory, the forces that hold over its steps, and those of the hypothesis among them.
    pub fn put(&mut self, states: Vec<f64>, forces: Vec<f64>, own: Vec<f64>) {
        (self.states, self.forces, self.own) = (states, forces, own);
    }

    /// Number of coordinates.
    fn coordinates(&self) -> usize {
        self.states.len() / self.nodes.len() / 2
    }
    /// Coordinates, then rates, at a node.
    pub fn state(&self, node: usize) -> &[f64] {
        let width = 2 * self.coordinates();
        &self.states[width * node..width * (node + 1)]
    }
    /// Coordinates at a node.
    pub fn q(&self, node: usize) -> &[f64] {
        &self.state(node)[..self.coordinates()]
    }
    /// Rates of the coordinates at a node.
    pub fn v(&self, node: usize) -> &[f64] {
        &self.state(node)[self.coordinates()..]
    }
    /// The model's own accelerations at the begin (0) or the end (1) of the step after a node.
    pub fn acceleration(&self, node: usize, end: usize) -> &[f64] {
        let n = self.coordinates();
        &self.accelerations[n * (2 * node + end)..][..n]
    }
    /// Where and under which torque the model is at an end of the step after a node.
    pub fn end<'a>(&'a self, theta: &'a [f64], node: usize, end: usize) -> TrajectoryPoint<'a> {
        let (later, part) = ((node + end).min(self.nodes.len() - 1), end * (self.nodes.parts - 1));
        let torque = self.nodes.torque(node, part);
        TrajectoryPoint { theta, state: self.state(later), torque, time: self.nodes.since(later) }
    }
    /// Inverse of the mass matrix at a node, with the parameters of the last linearisation.
    pub fn inverse_mass(&self, node: usize) -> &InverseMass {
        &self.linear.inverses[node]
    }
    fn row<'a>(&self, all: &'a [f64], node: usize) -> &'a [f64] {
        let n = self.coordinates();
        &all[n * node..n * (node + 1)]
    }

    /// Accelerations, readings, steps and rows about the trajectory; `white`: variance of a white force on each coordinate, and the speed
    /// below which it may rest.
    pub(super) fn linearise(
        &mut self,
        plant: &TrajectoryPlant,
        theta: &[f64],
        outputs: &ReadOutputs,
        [white, creep]: [&[f64]; 2],
        laws: &LawTangent,
    ) -> Result<(), TrajectoryError> {
        let theta = &*self.parameters_of(theta);
        let (n, length) = (self.coordinates(), self.nodes.len());
        let channels = self.readings.mean.len() / length;
        self.accelerations.clear();
        for t in 0..length {
            for end in 0..2 {
                let a = plant.accelerations(self.end(theta, t, end), self.row(&self.own, t));
                self.accelerations.extend(a);
            }
        }
        let size = size_of(channels, n);
        let mut rows =
            ReadingRows { h: vec![0.0; size * channels * length], direct: vec![0.0; n * channels * length] };
        self.model_readings.clear();
        let (mut tangents, mut inverses) = (Vec::with_capacity(length), Vec::with_capacity(length));
        for t in 0..length {
            let (by_state, inverse) = plant.tangent(self.end(theta, t, 0), self.row(&self.forces, t))?;
            let tangent = NodeTangent { by_state, by_force: inverse.by_force.clone() };
            inverses.push(inverse);
            tangents.push(match laws.get(2 * n * n * t..2 * n * n * (t + 1)) {
                Some(laws) => tangent.with_laws(laws),
                None => tangent,
            });
            let moments = &self.readings.moments[channels * t..channels * (t + 1)];
            let (read, h) = outputs.read(plant, self.end(theta, t, 0), moments, self.acceleration(t, 0));
            self.model_readings.extend(read);
            for (c, h) in h.chunks(2 * n).enumerate() {
                let row = &mut rows.h[size * (channels * t + c)..][..size];
                row[..2 * n].copy_from_slice(h);
                row[3 * n + c] = 1.0;
            }
        }
        let step = |t: usize| {
            let dt = self.nodes.step[t];
            let [a, b] = step_between(&tangents[t], &tangents[t + 1], dt);
            let force = self.row(&self.forces, t);
            let torques = (0..self.nodes.parts).map(|part| self.nodes.torque(t, part));
            let after = model_step(plant, theta, self.state(t), torques, force, [self.nodes.since(t), dt]);
            let pushed = |i: usize| b[n * i..n * (i + 1)].iter().zip(force).map(|(b, f)| b * f).sum::<f64>();
            let next = self.state(t + 1);
            let defect = (0..2 * n).map(|i| after[i] - pushed(i) - next[i]).collect();
            with_latents(&a, &b, defect, channels, dt)
        };
        let steps: Vec<PlantStep> = (0..length - 1).map(step).collect();
        self.linear = Rc::new(TrajectoryLinear { steps, rows, noise: Vec::new(), inverses });
        self.renew_noise(plant, theta, [white, creep]);
        Ok(())
    }

    /// Covariances of what white forces add in each step, the steps as they are.
    pub(super) fn renew_noise(
        &mut self,
        plant: &TrajectoryPlant,
        theta: &[f64],
        [white, creep]: [&[f64]; 2],
    ) {
        let (theta, n) = (self.parameters_of(theta), self.coordinates());
        let noise = |(t, s): (usize, &PlantStep)| {
            let holds = self.held(plant, &theta, t, creep, &self.linear.inverses[t].by_force);
            let all = holds.map_or_else(
                || Cow::Borrowed(white),
                |held| Cow::Owned(white.iter().zip(held).map(|(w, h)| w + h * h).collect::<Vec<_>>()),
            );
            pushed_noise(&s.b[..2 * n * n], &all)
        };
        let noise = self.linear.steps.iter().enumerate().map(noise).collect();
        Rc::make_mut(&mut self.linear).noise = noise;
    }

    /// Force up to which known dry friction holds each coordinate that may rest in the step after a node: friction is any force up to that
    /// there. `None`: no coordinate has dry friction. `creep`: speeds below which coordinates may rest; `by_force`: inverse of the mass matrix.
    fn held(
        &self,
        plant: &TrajectoryPlant,
        theta: &[f64],
        node: usize,
        creep: &[f64],
        by_force: &[f64],
    ) -> Option<Vec<f64>> {
        let n = self.coordinates();
        let all = plant.plant().coordinates();
        all.iter().any(|c| c.dry_friction.is_some()).then(|| {
            let of = |(k, c): (usize, &Coordinate)| {
                let level = c
                    .dry_friction
                    .map_or(0.0, |levels| levels.map(|p| theta[p]).into_iter().fold(0.0, f64::max));
                let [before, after] = [node, node + 1].map(|t| self.v(t)[k]);
                // What friction takes from the speed in a step. (EST-20)
                let stops = level * by_force[(n + 1) * k] * self.nodes.step[node];
                let rests = before * after <= 0.0 || before.abs().min(after.abs()) < creep[k] + stops;
                if rests { level } else { 0.0 }
            };
            all.iter().enumerate().map(of).collect()
        })
    }

    /// Forces that changes of parameters by their units are worth, means over both ends of each step: a column each.
    pub(super) fn columns_of(
        &self,
        plant: &TrajectoryPlant,
        theta: &[f64],
        unknown: &[UnknownParameter],
    ) -> Vec<ColumnPart> {
        let theta = &*self.parameters_of(theta);
        let (n, length) = (self.coordinates(), self.nodes.len());
        let changes: Vec<(usize, f64)> = unknown.iter().map(|u| (u.index, u.unit_at(theta))).collect();
        let mut series = vec![vec![vec![0.0; length]; n]; unknown.len()];
        for t in 0..length {
            for end in 0..2 {
                let at = self.end(theta, t, end);
                let inverse = self.inverse_mass((t + end).min(length - 1));
                let forces = plant.sensitivity(at, self.row(&self.own, t), &changes, inverse);
                for (series, f) in series.iter_mut().zip(forces.chunks(n)) {
                    series.iter_mut().zip(f).for_each(|(s, f)| s[t] += 0.5 * f);
                }
            }
        }
        let column = |all: Vec<Vec<f64>>| {
            let mut part = ColumnPart::default();
            for (k, values) in all.into_iter().enumerate().filter(|(_, v)| v.iter().any(|x| *x != 0.0)) {
                part.forces.extend(ColumnPart::force(k, values).forces);
            }
            part
        };
        let own = |u: &UnknownParameter| self.own_parameters.iter().any(|(k, _)| *k == u.index);
        let all = series.into_iter().zip(unknown);
        all.map(|(s, u)| if own(u) { ColumnPart::default() } else { column(s) }).collect()
    }
}

/// A step with latent forces, which it holds, and latent errors of readings behind them.
fn with_latents(a: &[f64], b: &[f64], defect: Vec<f64>, channels: usize, dt: f64) -> PlantStep {
    let n = b.len().div_ceil(2).isqrt();
    let size = size_of(channels, n);
    let (mut all, mut by_force) = (vec![0.0; size * size], vec![0.0; size * n]);
    for i in 0..2 * n {
        all[size * i..][..2 * n].copy_from_slice(&a[2 * n * i..2 * n * (i + 1)]);
        all[size * i + 2 * n..][..n].copy_from_slice(&b[n * i..n * (i + 1)]);
        by_force[n * i..n * (i + 1)].copy_from_slice(&b[n * i..n * (i + 1)]);
    }
    let kept = MEMORIES.map(|memory| (-dt / memory).exp()); // (EST-14)
    (2 * n..size).for_each(|k| all[(size + 1) * k] = kept[usize::from(k >= 3 * n)]);
    PlantStep { stuck: Vec::new(), a: all, b: by_force, defect }
}

/// Covariance that forces of these variances have over a step of `b`, rows of forces.
fn pushed_noise(b: &[f64], variance: &[f64]) -> Vec<f64> {
    let n = variance.len();
    let size = b.len() / n;
    let mut noise = vec![0.0; size * size];
    for (i, to) in b.chunks(n).enumerate() {
        for (j, from) in b.chunks(n).enumerate().take(i + 1) {
            let sum: f64 = variance.iter().zip(to).zip(from).map(|((q, a), b)| q * a * b).sum();
            (noise[size * i + j], noise[size * j + i]) = (sum, sum);
        }
    }
    noise
}
