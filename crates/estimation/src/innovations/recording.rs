//! A recording at the nodes of a frame.

use std::rc::Rc;

use nalgebra::DMatrix;

use super::column::OwnForces;
use super::intake::{IntakeRecording, NodeIntake};
use super::linear::{PlantStep, ReadingRows};
use super::numeric::{gaussian, gradient, interpolated, quantile};
use super::plant::{FirstState, ForcedPlant};
use super::signs::DrySigns;

/// First readings of a channel make its first state, s, and so many of them at least.
const FIRST: (f64, usize) = (0.04, 6);
/// Standard deviations of an unknown gain and offset that the first state has: the readings decide then.
const UNSURE: f64 = 10.0;
/// Share of a step by which a reading's time is off by rounding at the most.
const ROUNDED: f64 = 1e-9;
/// Standard deviation of the smoothing of a speed from readings, s.
const SPEED: f64 = 0.016;

/// Value and slope at 0 of the cubic through (`time`, `values`) by least squares, and the variance of the slope over that of
/// a value.
fn cubic(time: &[f64], values: &[f64]) -> ([f64; 2], f64) {
    let unit = time.iter().fold(1e-12, |m: f64, t| m.max(t.abs()));
    let powers = DMatrix::from_fn(time.len(), 4, |i, j| (time[i] / unit).powi(j as i32));
    let Ok(inverse) = powers.pseudo_inverse(1e-14) else { return ([0.0; 2], 0.0) };
    let at = |j: usize| inverse.row(j).iter().zip(values).map(|(g, y)| g * y).sum::<f64>();
    ([at(0), at(1) / unit], inverse.row(1).iter().map(|g| (g / unit).powi(2)).sum())
}

/// A recording in a frame: readings of late channels are put back.
#[derive(Clone, Debug)]
pub struct NodeRecording {
    /// Step, s.
    pub dt: f64,
    /// Number of nodes.
    pub nodes: usize,
    /// Mean reading by node and channel.
    pub readings: Rc<Vec<f64>>,
    /// Readings by node and channel.
    pub count: Vec<f64>,
    /// Moments m1, m2, m3 of their times after the node, by node and channel.
    pub moments: Vec<[f64; 3]>,
    /// Whether they count.
    pub counted: Vec<bool>,
    /// Speed from the readings, rad/s.
    pub speed: Vec<f64>,
    /// First state of the plant and its variance.
    pub first: Vec<f64>,
    /// Covariance of the first state, rows of rows.
    pub first_variance: Vec<f64>,
    /// Rest and signs.
    pub signs: Rc<DrySigns>,
    /// Smoothed states with latents by node, `size` numbers each.
    pub states: Vec<f64>,
    /// Scores by node: forces by coordinate, then readings by channel.
    pub scores: Vec<f64>,
    /// What the hypothesis in hand added to this trajectory.
    pub own: OwnForces,
    pub(super) linear: Rc<Linearisation>,
}

/// Steps and rows about a point; the default is about none.
#[derive(Debug, Default)]
pub(super) struct Linearisation {
    pub(super) point: Vec<f64>,
    pub(super) signs: Rc<DrySigns>,
    pub(super) steps: Vec<PlantStep>,
    pub(super) rows: ReadingRows,
}

impl NodeRecording {
    pub(super) fn new(
        intake: &NodeIntake,
        plant: &dyn ForcedPlant,
        raw: &IntakeRecording,
        late: LateChannel,
    ) -> Self {
        let channels = intake.channels.len();
        let all = raw.nodes * channels;
        let (mut readings, mut count, mut counted) = (vec![0.0; all], vec![0.0; all], vec![false; all]);
        let mut moments = vec![[0.0; 3]; all];
        for (c, r) in raw.readings.iter().enumerate() {
            let delay = late.filter(|l| l.0 == c).map_or(0.0, |l| l.1);
            let back = (delay / raw.dt).round_ties_even() as isize;
            for i in 0..r.node.len() {
                let node = r.node[i] as isize - back;
                if node < 0 || node >= raw.nodes as isize {
                    continue;
                }
                let at = channels * node as usize + c;
                let late = r.time[i] - delay - raw.dt * node as f64;
                // Rounded times would make rows of products that are next to 0: processors take many times as long with these.
                let x = if late.abs() > ROUNDED * raw.dt { late } else { 0.0 };
                let v = if r.spread[i] > (ROUNDED * raw.dt).powi(2) { r.spread[i] } else { 0.0 };
                (readings[at], count[at], counted[at]) = (r.mean[i], r.count[i], r.counted[i]);
                moments[at] = [x, 0.5 * (x * x + v), (x.powi(3) + 3.0 * x * v) / 6.0];
            }
        }
        let mut seen: Vec<Option<FirstState>> = vec![None; plant.coordinates().len()];
        let driven = plant.input_forces().first().map_or(0, |i| i.coordinate);
        let mut speed = vec![0.0; raw.nodes];
        let mut driven_is_read = false;
        // Without any angle the rates begin; where it is then does not matter, but for the twist.
        let rates = !intake.channels.iter().any(|c| c.angle);
        for (c, channel) in
            intake.channels.iter().enumerate().filter(|(_, c)| c.state.is_some() && (c.angle || rates))
        {
            let at: Vec<usize> = (0..raw.nodes).filter(|t| count[channels * t + c] > 0.0).collect();
            let time: Vec<f64> =
                at.iter().map(|t| *t as f64 * raw.dt + moments[channels * t + c][0]).collect();
            let values: Vec<f64> = at.iter().map(|t| readings[channels * t + c]).collect();
            let coordinate = plant.readings()[channel.reading].coordinate;
            let nodes: Vec<f64> = (0..raw.nodes).map(|t| t as f64 * raw.dt).collect();
            let even = interpolated(&nodes, &time, &values);
            let smooth = gaussian(&even, SPEED / raw.dt);
            let own: Vec<f64> =
                if rates { smooth } else { gradient(&smooth).iter().map(|v| v / raw.dt).collect() };
            let usual = quantile(own.iter().map(|v| v.abs()).collect(), 0.97);
            let m = ((FIRST.0 / raw.dt) as usize).max(FIRST.1).min(time.len());
            let (value, slope) = cubic(&time[..m], &values[..m]);
            let r = channel.variance;
            let noise = 100.0 * r + 100.0 * channel.resolution.powi(2);
            // What is not known of gain and offset leaves the first readings next to no say.
            let [gain, offset] = intake.rig.unsure(c).map(|x| UNSURE * x);
            let unsure = (gain * value[0]).powi(2) + offset.powi(2);
            let (value, variance) = if rates {
                let twist = (3.0 * plant.usual_deflection()).powi(2);
                ([0.0, value[0]], [twist, noise + unsure + (0.02 * usual).powi(2)])
            } else {
                let speed = (10.0 * (slope * r).sqrt() + 0.02 * usual).powi(2);
                (value, [noise + unsure, speed + (gain * usual).powi(2)])
            };
            seen[coordinate] = Some(FirstState { value, variance, usual_speed: usual });
            if coordinate == driven || !driven_is_read {
                speed = own;
                driven_is_read = coordinate == driven;
            }
        }
        let states = plant.states();
        let (mut first, mut first_variance) = (vec![0.0; states], vec![0.0; states * states]);
        plant.begin(&seen, &mut first, &mut first_variance);
        let signs = DrySigns { misplaced: vec![false; raw.nodes], ..DrySigns::default() };
        Self {
            dt: raw.dt,
            nodes: raw.nodes,
            readings: Rc::new(readings),
            count,
            moments,
            counted,
            speed,
            first,
            first_variance,
            signs: Rc::new(signs),
            states: Vec::new(),
            scores: Vec::new(),
            own: OwnForces::none(plant.coordinates().len(), channels, raw.nodes),
            linear: Rc::default(),
        }
    }

    /// Series of a state.
    pub fn state(&self, k: usize) -> Vec<f64> {
        let size = self.states.len() / self.nodes;
        self.states.iter().skip(k).step_by(size).copied().collect()
    }
    /// Series of a score: a coordinate, or behind these a channel.
    pub fn score(&self, k: usize) -> Vec<f64> {
        let width = self.scores.len() / self.nodes;
        self.scores.iter().skip(k).step_by(width).copied().collect()
    }
    /// Time of a node, s.
    pub fn time(&self, node: usize) -> f64 {
        node as f64 * self.dt
    }
}

/// A channel that is taken to be late, by how many s.
pub type LateChannel = Option<(usize, f64)>;
