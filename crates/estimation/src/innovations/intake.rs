//! From a case's recordings to even nodes for the filter.
//!
//! A step is 2 to 6 ms, so that a held input has one value in it. Readings keep their own times: those nearest to a node are
//! averaged and enter there through the moments of their times. The input is its exact mean over each step. Nothing is
//! interpolated between readings and nothing is left out.

use std::rc::Rc;

use trueup_signals::noise::{by_differences, second_differences};
use trueup_signals::{Channel, Interpolation, Loaded, Recording};

use super::intake_channel::IntakeChannel;
use super::numeric::median;
use super::plant::{ForcedPlant, InputForce};
use super::rig::RigTerms;

/// What goes before counts for nothing, s: the filter settles. Longer than the longest delay that is looked for.
pub const START: f64 = 0.12;
/// Readings of a channel in every recording, below which it is not used.
const FEW: usize = 50;
/// Shortest step to which readings alone have nodes, s.
const SHORTEST: f64 = 5e-4;
/// Correlation of noise from reading to reading, below which it counts as white.
const WHITE: f64 = 0.1;
/// Least error of an angle, in usual deflections: what no model of a joint resolves.
const UNRESOLVED: f64 = 5e-4;

/// A case that cannot be taken to nodes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NodesError {
    /// Nothing holds the trajectory.
    #[error(
        "{case}: no angle or rate was recorded in all of train; record motorAngle or loadAngle in each of them"
    )]
    NoReading {
        /// Which case.
        case: String,
    },
    /// One of its recordings.
    #[error(transparent)]
    Recording(#[from] UnfitRecording),
}

/// A recording that cannot be taken to nodes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnfitRecording {
    /// The drive is not known.
    #[error("{recording}: {channel} was not recorded; record it, or leave the recording out of train")]
    NoInput {
        /// Which recording.
        recording: String,
        /// Which channel.
        channel: String,
    },
    /// The drive is hardly known.
    #[error(
        "{recording}: {channel} has {samples} samples, too few for nodes; record it throughout, or leave the recording out of train"
    )]
    FewInputs {
        /// Which recording.
        recording: String,
        /// Which channel.
        channel: String,
        /// How many samples.
        samples: usize,
    },
    /// Too few samples to begin with.
    #[error("{recording}: {samples} samples are too few for nodes; leave the recording out of train")]
    Short {
        /// Which recording.
        recording: String,
        /// How many.
        samples: usize,
    },
}

impl UnfitRecording {
    /// What is wrong with an input of a recording: it was not recorded, or has at most `few` samples; `None`: nothing.
    pub(super) fn of_input(r: &Recording, name: &str, few: usize) -> Option<Self> {
        let (recording, channel) = (r.name.clone(), name.to_owned());
        match r.channel(name).map_or(0, Channel::len) {
            0 => Some(Self::NoInput { recording, channel }),
            samples if samples <= few => Some(Self::FewInputs { recording, channel, samples }),
            _ => None,
        }
    }
}

/// An input as it was recorded.
#[derive(Clone, Debug)]
pub struct RecordedInput {
    /// Since the first node, s, increasing.
    pub time: Vec<f64>,
    /// Values.
    pub values: Vec<f64>,
    hold: bool,
    dt: f64,
    nodes: usize,
}

/// Readings of a channel by node.
#[derive(Clone, Debug, Default)]
pub struct NodeReadings {
    /// Nodes with a reading, increasing.
    pub node: Vec<usize>,
    /// Readings there.
    pub count: Vec<f64>,
    /// Their mean.
    pub mean: Vec<f64>,
    /// Mean of their times since the first node, s.
    pub time: Vec<f64>,
    /// Variance of these times, s2.
    pub spread: Vec<f64>,
    /// Whether they count.
    pub counted: Vec<bool>,
}

/// A recording before any channel is taken to be late.
#[derive(Clone, Debug)]
pub struct IntakeRecording {
    /// Its name.
    pub name: String,
    /// Step of the nodes, s.
    pub dt: f64,
    /// Number of nodes.
    pub nodes: usize,
    /// Rounding of time stamps that are not even, s; 0 for even ones.
    pub stamp: f64,
    /// The inputs, in the order of the plant's input forces; `None`: not recorded.
    pub inputs: Vec<Option<RecordedInput>>,
    /// Their means over each step.
    pub means: Vec<Vec<f64>>,
    /// Readings, one entry a channel.
    pub readings: Vec<NodeReadings>,
}

/// The recordings of a case for fitting.
#[derive(Clone, Debug)]
pub struct NodeIntake {
    /// Recordings, in the order of the case.
    pub recordings: Vec<IntakeRecording>,
    /// Channels that all of them have, in the order of the plant's readings.
    pub channels: Vec<IntakeChannel>,
    /// Standard deviation of the noise of the first input.
    pub input_noise: f64,
    /// What is known of the rig up to a number.
    pub rig: Rc<RigTerms>,
}

impl NodeIntake {
    /// Of a case's recordings for fitting.
    ///
    /// # Errors
    /// See [`NodesError`].
    pub fn new(loaded: &Loaded, plant: &dyn ForcedPlant) -> Result<Self, NodesError> {
        Self::in_steps(loaded, plant, None)
    }

    /// The same in steps of at most `longest` s, one reading each where it can be.
    ///
    /// # Errors
    /// See [`NodesError`].
    pub fn in_steps(
        loaded: &Loaded,
        plant: &dyn ForcedPlant,
        longest: Option<f64>,
    ) -> Result<Self, NodesError> {
        let train = loaded.train();
        let enough = |name: &str| {
            train.iter().all(|r| r.channel(name).is_some_and(|c| c.len() > FEW)) && !train.is_empty()
        };
        let mut channels = Vec::new();
        for (reading, r) in plant.readings().iter().enumerate().filter(|(_, r)| enough(r.name)) {
            let sensor = train.iter().find_map(|t| t.channel(r.name)).map(|c| c.sensor.clone());
            let sensor = sensor.unwrap_or_default();
            let factor = r.factor / sensor.believed_gain().abs();
            let resolution = sensor.resolution.unwrap_or(0.0) * factor;
            let noise = sensor.deviation().map_or_else(
                || if r.angle { 0.0 } else { by_readings(&train, r.name) },
                |_| sensor.noise.unwrap_or(0.0),
            ) * factor;
            // Where the rounding alone was declared as noise it is not counted twice.
            let rounding = (noise - resolution / 12f64.sqrt()).abs() < 0.02 * resolution;
            let white = if rounding { 0.0 } else { noise * noise };
            let floor = if r.angle { (UNRESOLVED * plant.usual_deflection()).powi(2) } else { 0.0 };
            let counting = 1.5 * resolution * resolution / 12.0;
            channels.push(IntakeChannel {
                name: r.name.to_owned(),
                reading,
                state: r.element.is_none().then_some(r.state),
                angle: r.angle,
                resolution: (resolution * resolution + 12.0 * white).sqrt(),
                variance: (counting + white) * colour(loaded, r.name) + floor + 1e-300,
            });
        }
        if channels.is_empty() {
            return Err(NodesError::NoReading { case: loaded.case.file.display().to_string() });
        }
        let drive = plant.input_forces().first().map_or("", |i| i.name);
        let known = train.iter().find_map(|r| r.channel(drive)).and_then(|c| c.sensor.noise);
        let recordings =
            train.iter().map(|r| recording(r, plant, &channels, longest)).collect::<Result<_, _>>()?;
        let rig = Rc::new(RigTerms::new(loaded, plant, &channels));
        Ok(Self { recordings, channels, input_noise: known.unwrap_or(0.0), rig })
    }

    /// Index of a channel by its name.
    pub fn channel(&self, name: &str) -> Option<usize> {
        self.channels.iter().position(|c| c.name == name)
    }
    /// Index of the channel that shows a state.
    pub fn channel_of(&self, state: usize) -> Option<usize> {
        self.channels.iter().position(|c| c.state == Some(state))
    }
    /// By how much the zeros of the angles differ, as a standard deviation: the sum of their resolutions.
    pub fn zero(&self) -> f64 {
        self.channels.iter().filter(|c| c.angle).map(|c| c.resolution).sum()
    }
}

/// Noise of a rate that is not declared: of an angle what no model resolves is its least error.
pub(super) fn by_readings(train: &[&Recording], channel: &str) -> f64 {
    let all = train.iter().filter_map(|r| r.channel(channel)).flat_map(|c| second_differences(&c.values));
    by_differences(&all.collect::<Vec<_>>(), 6.0)
}

/// Variance of a mean of coloured noise over that of white noise, from a recording at rest.
fn colour(loaded: &Loaded, channel: &str) -> f64 {
    let rest = loaded.rest();
    let Some(c) = rest.first().and_then(|r| r.channel(channel)).filter(|c| c.len() > FEW) else { return 1.0 };
    let mean = c.values.iter().sum::<f64>() / c.len() as f64;
    let square = c.values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / c.len() as f64;
    let next = c.values.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>();
    if square <= 0.0 {
        return 1.0;
    }
    let r = (next / (c.len() - 1) as f64 / square).clamp(0.0, 0.9);
    if r > WHITE { (1.0 + r) / (1.0 - r) } else { 1.0 }
}

/// Times of all rows with a sample of any channel.
pub(super) fn rows(r: &Recording) -> Vec<f64> {
    let mut all: Vec<f64> = r.channels.iter().flat_map(|c| c.time.iter().copied()).collect();
    all.sort_unstable_by(f64::total_cmp);
    all.dedup();
    all
}

fn recording(
    r: &Recording,
    plant: &dyn ForcedPlant,
    channels: &[IntakeChannel],
    longest: Option<f64>,
) -> Result<IntakeRecording, UnfitRecording> {
    // With delays the channels of a file have rows of their own: the channel with the most samples has its step.
    let delayed = r.channels.iter().any(|c| c.sensor.delay != 0.0);
    let densest = r.channels.iter().max_by_key(|c| c.len()).filter(|_| delayed);
    let times = densest.map_or_else(|| rows(r), |c| c.time.clone());
    if times.len() <= FEW {
        return Err(UnfitRecording::Short { recording: r.name.clone(), samples: times.len() });
    }
    // A channel whose delay is declared shows what was so much earlier: before all channels show something is no node.
    let shown = || r.channels.iter().flat_map(shown_at);
    let last = shown().fold(f64::MIN, f64::max);
    let first = if delayed { begun(r) } else { shown().fold(f64::MAX, f64::min) };
    let gaps: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    let sample = median(gaps.clone());
    let dt = match longest {
        // One reading a node, where that is not too many nodes.
        Some(longest) => {
            let dt = sample * (SHORTEST / sample).round_ties_even().max(1.0);
            dt / (dt / longest - 1e-6).ceil().max(1.0)
        }
        None if sample < 6e-3 => sample * (2e-3 / sample).round_ties_even().max(1.0),
        None => sample / (sample / 4e-3).round_ties_even(),
    };
    let rounded =
        |d: i32| times.iter().all(|t| (t * 10f64.powi(d) - (t * 10f64.powi(d)).round()).abs() < 1e-3);
    let stamp = (3..9).find(|d| rounded(*d)).map_or(0.0, |d| 10f64.powi(-d));
    let uneven = gaps.iter().any(|g| (g - sample).abs() > 1.5 * stamp);
    let nodes = ((last - first) / dt + 0.5) as usize + 1;
    let mut inputs = Vec::new();
    for (k, force) in plant.input_forces().iter().enumerate() {
        let input = r.channel(force.name).filter(|c| !c.is_empty());
        if let Some(unfit) =
            UnfitRecording::of_input(r, force.name, FEW).filter(|_| k == plant.required_input())
        {
            return Err(unfit);
        }
        inputs.push(input.map(|c| RecordedInput::new(c, first, dt, nodes)));
    }
    let means = inputs.iter().map(|i| i.as_ref().map_or_else(|| vec![0.0; nodes], RecordedInput::means));
    let means = means.collect();
    let reading = |c: &IntakeChannel| {
        let factor = plant.readings()[c.reading].factor;
        r.channel(&c.name).map_or_else(NodeReadings::default, |x| by_node(x, factor, first, dt, nodes))
    };
    let readings = channels.iter().map(reading).collect();
    let stamp = if uneven { stamp } else { 0.0 };
    Ok(IntakeRecording { name: r.name.clone(), dt, nodes, stamp, inputs, means, readings })
}

/// First time that all channels with samples show, s.
pub(super) fn begun(r: &Recording) -> f64 {
    r.channels.iter().filter_map(|c| shown_at(c).next()).fold(f64::MIN, f64::max)
}

/// Times of what the samples of a channel show, s.
pub(super) fn shown_at(c: &Channel) -> impl Iterator<Item = f64> {
    c.time.iter().map(|t| t - c.sensor.delay)
}

fn by_node(c: &Channel, factor: f64, first: f64, dt: f64, nodes: usize) -> NodeReadings {
    let mut out = NodeReadings::default();
    let values = c.believed();
    let times: Vec<f64> = shown_at(c).map(|t| t - first).collect();
    let time = |k: usize| times[k];
    let mut begin = times.partition_point(|t| *t < -0.5 * dt);
    let node = |k: usize| ((time(k) / dt).round_ties_even().max(0.0) as usize).min(nodes - 1);
    while begin < c.len() {
        let at = node(begin);
        let end = (begin..c.len()).find(|k| node(*k) != at).unwrap_or(c.len());
        let count = (end - begin) as f64;
        let mean = |f: &dyn Fn(usize) -> f64| (begin..end).map(f).sum::<f64>() / count;
        let middle = mean(&time);
        out.node.push(at);
        out.count.push(count);
        out.mean.push(mean(&|k| values[k] * factor));
        out.time.push(middle);
        out.spread.push(mean(&|k| (time(k) - middle).powi(2)));
        out.counted.push(middle > START);
        begin = end;
    }
    out
}

impl RecordedInput {
    fn new(c: &Channel, first: f64, dt: f64, nodes: usize) -> Self {
        let time = shown_at(c).map(|t| t - first).collect();
        Self { time, values: c.believed(), hold: c.interpolation == Interpolation::Hold, dt, nodes }
    }

    /// Of means over each step of `dt` s, held.
    pub fn of_steps(values: Vec<f64>, dt: f64) -> Self {
        let nodes = values.len();
        Self { time: (0..nodes).map(|t| t as f64 * dt).collect(), values, hold: true, dt, nodes }
    }
    /// With other values: times `factor`, less `taken`.
    pub fn corrected(&self, [factor, taken]: [f64; 2]) -> Self {
        let values = self.values.iter().map(|u| factor * u - taken).collect();
        Self { values, ..self.clone() }
    }
    /// Samples in a step, on average.
    pub fn samples_per_step(&self) -> f64 {
        self.time.len() as f64 / self.nodes as f64
    }
    /// Exact means over each step.
    pub fn means(&self) -> Vec<f64> {
        self.shaped(&self.values, 0.0)
    }
    /// Exact means over each step of other values at the same times.
    pub fn means_of(&self, values: &[f64]) -> Vec<f64> {
        self.shaped(values, 0.0)
    }
    /// The same after a dead time, s.
    pub fn delayed(&self, delay: f64) -> Vec<f64> {
        self.shaped(&self.values, delay)
    }
    /// The same after a first-order lag of this time constant, s: x follows (i - x) / T, mean of x = mean of i - T (rise of x) / step.
    pub fn lagged(&self, lag: f64) -> Vec<f64> {
        let mut means = self.means();
        let kept = (-self.dt / lag).exp();
        let mut x = means.first().copied().unwrap_or(0.0);
        for m in &mut means {
            let next = (1.0 - kept) * *m + kept * x;
            *m -= lag * (next - x) / self.dt;
            x = next;
        }
        means
    }

    /// Differences of the integral at the nodes; the first and the last value go on beyond the ends.
    fn shaped(&self, u: &[f64], delay: f64) -> Vec<f64> {
        let mut integral = integral(&self.time, u, self.hold);
        let mut before = integral(-delay);
        let step = |k: usize| {
            let now = integral((k + 1) as f64 * self.dt - delay);
            let mean = (now - before) / self.dt;
            before = now;
            mean
        };
        (0..self.nodes).map(step).collect()
    }
}

/// Integral of samples, held or joined by lines, at increasing times; the first and the last value go on beyond the ends.
pub(super) fn integral<'a>(t: &'a [f64], u: &'a [f64], hold: bool) -> impl FnMut(f64) -> f64 + 'a {
    let last = t.len() - 1;
    let mut sums = vec![0.0];
    for k in 0..last {
        let value = if hold { u[k] } else { 0.5 * (u[k + 1] + u[k]) };
        sums.push(sums[k] + value * (t[k + 1] - t[k]));
    }
    let mut at = 0;
    move |e: f64| {
        if e < t[0] {
            return (e - t[0]) * u[0];
        }
        if e >= t[last] {
            return sums[last] + (e - t[last]) * u[last];
        }
        while t[at + 1] < e {
            at += 1;
        }
        let x = e - t[at];
        let slope = if hold { 0.0 } else { (u[at + 1] - u[at]) / (t[at + 1] - t[at]) };
        sums[at] + u[at] * x + 0.5 * slope * x * x
    }
}

/// Means over each step of the force of one input, N.m.
pub fn input_force(force: &InputForce, theta: &[f64], means: &[f64]) -> Vec<f64> {
    let gain = force.per_unit(theta);
    means.iter().map(|u| gain * u).collect()
}
