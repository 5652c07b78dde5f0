//! From a case's recordings to an even grid of nodes for the joint's filter.
//!
//! Readings that fall to one node are one sample, with the mean of their times; inputs are exact means from each node to the
//! next. Delays and lags that a hypothesis asks for are taken out here, so that what follows knows of none.

use trueup_models::joint::{input, output, parameter};
use trueup_signals::{Interpolation, Loaded, noise};

use crate::joint::{Channel, Recording, Sample};

/// Nodes are at least so far apart where readings come more often, s.
const STEP: f64 = 4e-3;
/// A step turns the joint's fastest mode by less than this, rad.
const TURN: f64 = 0.3;
/// Readings so soon after the begin, s, or within this share of the recording, are left out: whatever delay up to that is
/// tried, the same readings stay.
const LATEST: [f64; 2] = [0.1, 0.05];

/// A recording that cannot be taken.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IntakeError {
    /// No angle to hold a trajectory by.
    #[error(
        "{0}: neither motorAngle nor loadAngle was recorded; record one of them, or leave the recording out"
    )]
    NoAngle(String),
    /// A channel whose noise nobody knows.
    #[error(
        "{recording}: nothing is known of the noise of {channel}; declare [channels.{channel}] noise or resolution"
    )]
    Noise {
        /// Which recording.
        recording: String,
        /// FMU variable.
        channel: String,
    },
}

/// By how much signals are taken to be later than they say, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// Of the reading of each output.
    pub outputs: [f64; output::COUNT],
    /// Dead time of each input.
    pub inputs: [f64; input::COUNT],
    /// Time constant of a first-order lag of each input.
    pub lags: [f64; input::COUNT],
}

#[derive(Clone, Debug)]
struct Drive {
    input: usize,
    time: Vec<f64>,
    values: Vec<f64>,
    hold: bool,
    deviation: f64,
}

#[derive(Clone, Debug)]
struct Sensor {
    output: usize,
    time: Vec<f64>,
    values: Vec<f64>,
    /// Of a count, and of noise beside it.
    counting: f64,
    white: f64,
    /// How far the noise of a reading tells that of the next.
    correlation: f64,
    offset: bool,
}

/// A recording as it was read.
#[derive(Clone, Debug)]
pub struct Raw {
    /// Its name.
    pub name: String,
    start: f64,
    end: f64,
    dt: f64,
    drives: Vec<Drive>,
    sensors: Vec<Sensor>,
}

fn median_step(t: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return STEP;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

impl Raw {
    /// Those recordings of a case that are for fitting, for a joint with these parameters.
    ///
    /// # Errors
    /// See [`IntakeError`].
    pub fn train(loaded: &Loaded, p: &[f64]) -> Result<Vec<Self>, IntakeError> {
        loaded.train().into_iter().map(|r| Self::new(loaded, r, p)).collect()
    }

    fn new(loaded: &Loaded, r: &trueup_signals::Recording, p: &[f64]) -> Result<Self, IntakeError> {
        let (mut drives, mut sensors) = (Vec::new(), Vec::new());
        for c in &r.channels {
            let known = noise::floor(loaded, &c.name).map(|f| f.deviation);
            let time: Vec<f64> = c.time.iter().map(|t| t - c.sensor.delay).collect();
            if let Some(input) = input::NAMES.iter().position(|n| n.0 == c.name) {
                let (values, hold) = (c.values.clone(), c.interpolation == Interpolation::Hold);
                drives.push(Drive { input, time, values, hold, deviation: known.unwrap_or(0.0) });
            } else if let Some(output) = output::NAMES.iter().position(|n| n.0 == c.name) {
                let quiet = c.range().is_none_or(|(low, high)| high <= low);
                if quiet || output == output::STICKING {
                    continue;
                }
                let counting = c.sensor.resolution.unwrap_or(0.0) / 12f64.sqrt();
                let deviation = known.filter(|d| *d > 0.0).ok_or_else(|| IntakeError::Noise {
                    recording: r.name.clone(),
                    channel: c.name.clone(),
                })?;
                sensors.push(Sensor {
                    output,
                    time,
                    values: c.values.clone(),
                    counting,
                    white: (deviation.powi(2) - counting.powi(2)).max(0.0).sqrt(),
                    correlation: noise::correlation(loaded, &c.name),
                    offset: c.sensor.offset.is_some(),
                });
            }
        }
        let angle = |s: &Sensor| s.output == output::MOTOR_ANGLE || s.output == output::LOAD_ANGLE;
        let Some(first) = sensors.iter().find(|s| angle(s)) else {
            return Err(IntakeError::NoAngle(r.name.clone()));
        };
        let n = p[parameter::GEAR_RATIO];
        let mode = p[parameter::STIFFNESS]
            * (1.0 / p[parameter::MOTOR_INERTIA] + n * n / p[parameter::LOAD_INERTIA]);
        let step = median_step(&first.time);
        let mut dt = step * (STEP / step).round().max(1.0);
        while dt > TURN / mode.max(1e-9).sqrt() && dt > 1e-4 {
            dt *= 0.5;
        }
        let ends = |pick: fn(&Vec<f64>) -> Option<&f64>| sensors.iter().filter_map(move |s| pick(&s.time));
        let start = ends(|t| t.first()).fold(f64::INFINITY, |m, t| m.min(*t));
        let end = ends(|t| t.last()).fold(start, |m, t| m.max(*t));
        Ok(Self { name: r.name.clone(), start, end, dt, drives, sensors })
    }

    /// Outputs whose constant reading offset is to be estimated.
    pub fn offsets(&self) -> impl Iterator<Item = usize> {
        self.sensors.iter().filter(|s| s.offset).map(|s| s.output)
    }

    /// The largest delay of a sensor that can be tried, s: a whole number of nodes.
    pub fn latest(&self) -> f64 {
        self.reserve() as f64 * self.dt
    }
    fn reserve(&self) -> usize {
        (LATEST[0].min(LATEST[1] * (self.end - self.start)) / self.dt).floor() as usize
    }
    fn nodes(&self) -> usize {
        ((self.end - self.start) / self.dt).round() as usize + 1
    }
    /// Means of the inputs from each node to the next, moved to when they are taken to act.
    pub fn inputs(&self, late: &Lateness) -> Vec<[f64; input::COUNT]> {
        let mut inputs = vec![[0.0; input::COUNT]; self.nodes()];
        for d in &self.drives {
            let mut mean = d.means(self.start - late.inputs[d.input], self.dt, inputs.len());
            lag(&mut mean, late.lags[d.input], self.dt);
            inputs.iter_mut().zip(mean).for_each(|(u, m)| u[d.input] = m);
        }
        inputs
    }
    /// On the grid, signals moved to when they are taken to have been.
    pub fn grid(&self, late: &Lateness) -> Recording {
        let (dt, nodes, inputs) = (self.dt, self.nodes(), self.inputs(late));
        let mut input_variance = [0.0; input::COUNT];
        for d in &self.drives {
            let readings = (dt / median_step(&d.time)).max(1.0);
            input_variance[d.input] = d.deviation.powi(2) / readings;
        }
        let channel =
            |s: &Sensor| s.sampled(self.start, dt, nodes).delayed(late.outputs[s.output], dt, self.reserve());
        let channels: Vec<Channel> = self.sensors.iter().map(channel).collect();
        let speed = |output: usize, by: f64| {
            channels.iter().find(|c| c.output == output).map(|c| by * c.variance.sqrt() / dt)
        };
        let resolved_speed = speed(output::MOTOR_ANGLE, 1.0).or_else(|| speed(output::LOAD_ANGLE, 1.0));
        Recording {
            dt,
            inputs,
            input_variance,
            resolved_speed: resolved_speed.unwrap_or(0.0),
            friction: Vec::new(),
            channels,
        }
    }
}

/// A first-order lag of means, which are taken to be held over each step.
fn lag(means: &mut [f64], time: f64, dt: f64) {
    let Some(first) = means.first().copied().filter(|_| time > 0.0) else { return };
    let (kept, mut state) = ((-dt / time).exp(), first);
    for u in means {
        let now = *u;
        *u += (state - now) * (1.0 - kept) * time / dt;
        state = now + (state - now) * kept;
    }
}

impl Drive {
    /// Exact means over `nodes` steps from `start` on; the first and the last value go on beyond the ends.
    fn means(&self, start: f64, dt: f64, nodes: usize) -> Vec<f64> {
        let (t, u) = (&self.time, &self.values);
        let last = t.len() - 1;
        let mut at = 0;
        // Integral from `a` to `b` within one piece or beyond the ends.
        let piece = |at: usize, a: f64, b: f64| -> f64 {
            if b <= t[0] {
                return u[0] * (b - a);
            }
            if at >= last {
                return u[last] * (b - a);
            }
            if self.hold {
                return u[at] * (b - a);
            }
            let slope = (u[at + 1] - u[at]) / (t[at + 1] - t[at]);
            (u[at] + slope * (0.5 * (a + b) - t[at])) * (b - a)
        };
        let step = |k: usize| {
            let (mut a, b) = (start + k as f64 * dt, start + (k + 1) as f64 * dt);
            let mut sum = 0.0;
            while a < b {
                while at < last && t[at + 1] <= a {
                    at += 1;
                }
                let end = if a < t[0] {
                    t[0]
                } else if at < last {
                    t[at + 1]
                } else {
                    b
                };
                let end = end.min(b);
                sum += piece(at, a, end);
                a = end;
            }
            sum / dt
        };
        (0..nodes).map(step).collect()
    }
}

impl Channel {
    /// Taken to be so much later than it says: by whole nodes, and a rest. The first readings are left out, however late.
    fn delayed(mut self, delay: f64, dt: f64, reserve: usize) -> Self {
        let nodes = ((delay / dt).round().max(0.0) as usize).min(reserve);
        self.delay = delay - nodes as f64 * dt;
        let first = reserve.min(self.samples.len());
        self.samples[..first].fill(None);
        self.samples.rotate_left(nodes);
        self
    }
}

impl Sensor {
    /// Readings by node; a reading belongs to the node that is nearest.
    fn sampled(&self, start: f64, dt: f64, nodes: usize) -> Channel {
        let mut sums = vec![[0.0; 4]; nodes];
        for (t, y) in self.time.iter().zip(&self.values) {
            let at = (t - start) / dt;
            // A hair below half a step, so that even readings fall to nodes evenly.
            let node = (at + 0.5 - 1e-6).floor();
            if node >= 0.0 && (node as usize) < nodes {
                let late = (at - node) * dt;
                let s = &mut sums[node as usize];
                *s = [s[0] + 1.0, s[1] + y, s[2] + late, s[3] + late * late];
            }
        }
        let sample = |s: &[f64; 4]| {
            (s[0] > 0.0).then(|| Sample {
                value: s[1] / s[0],
                late: s[2] / s[0],
                spread: (s[3] / s[0] - (s[2] / s[0]).powi(2)).max(0.0),
            })
        };
        let samples: Vec<Option<Sample>> = sums.iter().map(sample).collect();
        let filled = sums.iter().filter(|s| s[0] > 0.0).count().max(1);
        let readings = sums.iter().map(|s| s[0]).sum::<f64>() / filled as f64;
        let told = (1.0 + self.correlation) / (1.0 - self.correlation).max(0.02);
        let white = self.white.powi(2) * (told / readings).min(1.0);
        Channel { output: self.output, variance: self.counting.powi(2) + white, delay: 0.0, samples }
    }
}
