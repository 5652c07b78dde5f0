//! From recordings to the nodes of a trajectory.
//!
//! Nodes are rows of a recording, every k-th so that a step is not below [`STEP`]; gaps are filled. Each step is cut into equal
//! parts, over which inputs have their exact means. A reading goes to the nearest node with the moments of its time there, and
//! several at a node are averaged.

use trueup_plant::CoordinateKind;
use trueup_signals::{Channel, Interpolation, Loaded, Recording};

use super::plant::{TrajectoryError, TrajectoryPlant, TrajectoryPoint};
use crate::innovations::intake::{UnfitRecording, begun, integral, rows, shown_at};
use crate::innovations::numeric::median;

/// Shortest step of the nodes, s.
const STEP: f64 = 0.018;
/// Longest part of a step, s, and how many there are at least and at most.
const PART: (f64, [usize; 2]) = (0.006, [2, 10]);
/// What is read before counts for nothing, s: the filter settles. Longer than the longest delay that is looked for.
pub const START: f64 = 0.55;
/// Readings of a channel in every recording, below which it is not used.
const FEW: usize = 20;
/// Nodes below which a recording has no trajectory.
const LEAST: usize = 8;
/// A gap of so many steps is filled.
const GAP: f64 = 1.6;
/// Variance of rounding over that of a uniform distribution, where the declared noise is that of the rounding.
const ROUNDING: f64 = 1.2;

/// A channel that is compared.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryChannel {
    /// Its name.
    pub name: String,
    /// The output of the model that it shows.
    pub output: usize,
    /// What alone it shows, by index among coordinates, then their rates; none: it shows several.
    pub state: Option<usize>,
    /// Variance of one reading.
    pub variance: f64,
}

/// Samples of a channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeSamples {
    /// Times, s, increasing.
    pub time: Vec<f64>,
    /// Values.
    pub values: Vec<f64>,
    /// Held until the next one, else joined by lines.
    hold: bool,
}

/// Nodes of a recording with its inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryNodes {
    /// Its name.
    pub name: String,
    /// Time of each node, s.
    pub time: Vec<f64>,
    /// Begin of the recording, s.
    pub begin: f64,
    /// Step after each node, s; the last one repeats.
    pub step: Vec<f64>,
    /// Parts of a step.
    pub parts: usize,
    /// Means of the inputs over the parts: by node, part and input, those that drive first.
    pub torque: Vec<f64>,
    /// Samples of the inputs.
    pub inputs: Vec<NodeSamples>,
    /// Samples of the channels.
    pub samples: Vec<NodeSamples>,
}

/// Readings at the nodes, by node and channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrajectoryReadings {
    /// Mean reading.
    pub mean: Vec<f64>,
    /// How many.
    pub count: Vec<f64>,
    /// Means of x and of x^2 / 2, x the time of a reading after its node.
    pub moments: Vec<[f64; 2]>,
    /// Whether they count.
    pub counted: Vec<bool>,
    /// What averaging hides: readings but the first of a node count as if each were alone, ln R + 1.
    pub merged: f64,
}

/// The recordings of a case for fitting.
#[derive(Clone, Debug)]
pub struct TrajectoryIntake {
    /// Recordings, in the order of the case.
    pub recordings: Vec<TrajectoryNodes>,
    /// Channels that all of them have and that the model's motion shows.
    pub channels: Vec<TrajectoryChannel>,
    /// Channels that are late together, with what they are named together.
    pub groups: Vec<(String, Vec<usize>)>,
    /// Standard deviation of the noise of each driving input, as a force on what it drives.
    pub input_noise: Vec<f64>,
    /// Usual size of each driving input, as that force: root mean square, about its mean where nothing floats.
    pub usual_torque: Vec<f64>,
}

impl TrajectoryReadings {
    /// Whether a reading, by node and channel, is there and counts.
    pub fn is_counted(&self, at: usize) -> bool {
        self.counted[at] && self.count[at] > 0.0
    }
}

impl TrajectoryNodes {
    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.time.len()
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.time.is_empty()
    }
    /// Time of a node since the begin of the recording, s.
    pub fn since(&self, node: usize) -> f64 {
        self.time[node] - self.begin
    }
    /// Means of the inputs over a part of the step after a node, those that drive first.
    pub fn torque(&self, node: usize, part: usize) -> &[f64] {
        let inputs = self.inputs.len();
        &self.torque[inputs * (self.parts * node + part)..][..inputs]
    }
    /// Means over the parts of all steps of an input as it was `delay` s before: by node and part.
    pub fn late_torque(&self, input: usize, delay: f64) -> Vec<f64> {
        let samples = &self.inputs[input];
        if samples.time.is_empty() {
            return vec![0.0; self.len() * self.parts];
        }
        let mut integral = integral(&samples.time, &samples.values, samples.hold);
        let mut out = Vec::with_capacity(self.len() * self.parts);
        for (t, step) in self.time.iter().zip(&self.step) {
            let edge = |part: usize| t + step * part as f64 / self.parts as f64 - delay;
            let mut before = integral(edge(0));
            for part in 1..=self.parts {
                let now = integral(edge(part));
                out.push((now - before) / (step / self.parts as f64));
                before = now;
            }
        }
        out
    }

    /// With these inputs, the first `driving` of which have to be there.
    fn new(
        r: &Recording,
        inputs: &[String],
        driving: usize,
        channels: &[TrajectoryChannel],
    ) -> Result<Self, UnfitRecording> {
        // Where delays are declared, channels have rows of their own: nodes are those of the channel with the most samples.
        let delayed = r.channels.iter().any(|c| c.sensor.delay != 0.0);
        let densest = r.channels.iter().max_by_key(|c| c.len()).filter(|_| delayed);
        let all: Vec<f64> = densest.map_or_else(
            || rows(r),
            |c| {
                let first = begun(r);
                shown_at(c).filter(|t| *t >= first).collect()
            },
        );
        if all.len() <= FEW {
            return Err(UnfitRecording::Short { recording: r.name.clone(), samples: all.len() });
        }
        let sample = median(all.windows(2).map(|w| w[1] - w[0]).collect());
        let every = ((STEP / sample + 0.25) as usize).max(1);
        let time: Vec<f64> = all.iter().step_by(every).copied().collect();
        let gaps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
        let usual = median(gaps.clone());
        let mut filled = Vec::with_capacity(time.len());
        for (t, gap) in time.iter().zip(&gaps) {
            filled.push(*t);
            if *gap > GAP * usual {
                let pieces = (gap / usual).round_ties_even();
                filled.extend((1..pieces as usize).map(|k| t + k as f64 * gap / pieces));
            }
        }
        filled.extend(time.last());
        if filled.len() < LEAST {
            return Err(UnfitRecording::Short { recording: r.name.clone(), samples: all.len() });
        }
        let mut step: Vec<f64> = filled.windows(2).map(|w| w[1] - w[0]).collect();
        step.extend(step.last().copied());
        let parts = ((usual / PART.0).ceil() as usize).clamp(PART.1[0], PART.1[1]);
        let samples = |name: &str| {
            r.channel(name).map_or_else(NodeSamples::default, |c| NodeSamples {
                time: shown_at(c).collect(),
                values: c.believed(),
                hold: c.interpolation == Interpolation::Hold,
            })
        };
        if let Some(unfit) = inputs[..driving].iter().find_map(|name| UnfitRecording::of_input(r, name, FEW))
        {
            return Err(unfit);
        }
        let mut made = Self {
            name: r.name.clone(),
            time: filled,
            begin: r.start,
            step,
            parts,
            torque: Vec::new(),
            inputs: inputs.iter().map(|name| samples(name)).collect(),
            samples: channels.iter().map(|c| samples(&c.name)).collect(),
        };
        let each: Vec<Vec<f64>> = (0..inputs.len()).map(|j| made.late_torque(j, 0.0)).collect();
        made.torque = (0..made.len() * parts).flat_map(|k| each.iter().map(move |u| u[k])).collect();
        Ok(made)
    }

    /// Readings at the nodes; `late`: how late each channel is, s, by which its readings are put back.
    pub fn readings(&self, channels: &[TrajectoryChannel], late: &[f64]) -> TrajectoryReadings {
        let (nodes, width) = (self.len(), channels.len());
        let mut out = TrajectoryReadings {
            mean: vec![0.0; nodes * width],
            count: vec![0.0; nodes * width],
            moments: vec![[0.0; 2]; nodes * width],
            counted: vec![false; nodes * width],
            merged: 0.0,
        };
        for (c, channel) in channels.iter().enumerate() {
            let mut counted = vec![0.0; nodes];
            for (read, y) in self.samples[c].time.iter().zip(&self.samples[c].values) {
                let t = read - late[c];
                if t <= self.time[0] - 0.5 * self.step[0] {
                    continue;
                }
                let k = self.time.partition_point(|x| *x < t).clamp(1, nodes - 1);
                let k = if t - self.time[k - 1] < self.time[k] - t { k - 1 } else { k };
                let (at, x) = (width * k + c, t - self.time[k]);
                out.mean[at] += y;
                out.count[at] += 1.0;
                out.moments[at][0] += x;
                out.moments[at][1] += 0.5 * x * x;
                counted[k] += f64::from(u8::from(read - self.time[0] > START));
            }
            for (k, counted) in counted.iter().enumerate() {
                let at = width * k + c;
                let count = out.count[at];
                if count > 0.0 {
                    out.mean[at] /= count;
                    out.moments[at].iter_mut().for_each(|m| *m /= count);
                }
                out.counted[at] = *counted > 0.0;
                out.merged += (counted - 1.0).max(0.0) * (channel.variance.ln() + 1.0);
            }
        }
        out
    }
}

impl TrajectoryIntake {
    /// Of a case's recordings for fitting; `theta`: parameters of the model.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn new(loaded: &Loaded, plant: &TrajectoryPlant, theta: &[f64]) -> Result<Self, TrajectoryError> {
        let train = loaded.train();
        let table = plant.plant().table();
        let inputs = table.driving.iter().chain(&plant.others).map(|k| table.inputs[*k].name.clone());
        let inputs: Vec<String> = inputs.collect();
        let driving = table.driving.len();
        // Readings that all recordings have; where there is none, those that any of them has.
        let shown = |every| recorded(&train, every).into_iter().filter_map(|c| channel_of(plant, theta, c));
        let mut channels: Vec<TrajectoryChannel> = shown(true).collect();
        if channels.is_empty() {
            channels = shown(false).collect();
        }
        if channels.is_empty() {
            return Err(TrajectoryError::NoReading { case: loaded.case.file.display().to_string() });
        }
        let recordings: Vec<TrajectoryNodes> = train
            .iter()
            .map(|r| TrajectoryNodes::new(r, &inputs, driving, &channels))
            .collect::<Result<_, _>>()?;
        let noise = |name: &String| {
            train.iter().find_map(|r| r.channel(name)).and_then(|c| c.sensor.noise).unwrap_or(0.0)
        };
        let usual = |j: usize| {
            let width = inputs.len();
            let all = || recordings.iter().flat_map(move |r| r.torque.iter().skip(j).step_by(width));
            let count = all().count().max(1) as f64;
            let mean = if plant.floats() { 0.0 } else { all().sum::<f64>() / count };
            (all().map(|u| (u - mean).powi(2)).sum::<f64>() / count).sqrt().max(1e-6)
        };
        let usual_torque = (0..driving).map(|j| plant.drive_gains[j].abs() * usual(j)).collect();
        let groups = groups(plant, &channels);
        let noise_of = |(j, name): (usize, &String)| plant.drive_gains[j].abs() * noise(name);
        let input_noise = inputs[..driving].iter().enumerate().map(noise_of).collect();
        Ok(Self { recordings, channels, groups, input_noise, usual_torque })
    }
}

/// Channels with enough samples, of `every` recording or of any, each once.
fn recorded<'a>(train: &[&'a Recording], every: bool) -> Vec<&'a Channel> {
    let enough = |r: &Recording, name: &str| r.channel(name).is_some_and(|c| c.len() > FEW);
    let mut all: Vec<&Channel> = Vec::new();
    for c in train.iter().take(if every { 1 } else { train.len() }).flat_map(|r| &r.channels) {
        let mut there = train.iter().map(|r| enough(r, &c.name));
        let there = if every { there.all(|t| t) } else { there.any(|t| t) };
        if there && !all.iter().any(|a| a.name == c.name) {
            all.push(c);
        }
    }
    all
}

/// A channel that the model's motion shows.
fn channel_of(plant: &TrajectoryPlant, theta: &[f64], c: &Channel) -> Option<TrajectoryChannel> {
    let output = plant.plant().table().output(&c.name)?;
    let state = shown(plant, theta, output)?;
    let [resolution, noise] =
        [c.sensor.resolution, c.sensor.noise].map(|x| x.unwrap_or(0.0) / c.sensor.believed_gain().abs());
    let rounding = resolution * resolution / 12.0;
    let pure = resolution > 0.0 && (noise - rounding.sqrt()).abs() < 0.02 * resolution;
    let variance = if pure { ROUNDING * rounding } else { noise * noise + rounding + 1e-14 };
    Some(TrajectoryChannel { name: c.name.clone(), output, state, variance })
}

/// What alone an output shows, among coordinates and rates, or that it shows several; `None`: the motion does not show there.
fn shown(plant: &TrajectoryPlant, theta: &[f64], output: usize) -> Option<Option<usize>> {
    // Off the first state, at which a tip may not move at all along an axis.
    let state: Vec<f64> = plant.first().iter().enumerate().map(|(k, x)| x + 0.1 + 0.07 * k as f64).collect();
    let torque = vec![0.0; plant.drives.len()];
    let at = TrajectoryPoint { theta, state: &state, torque: &torque, time: 0.0 };
    let gradient = plant.outputs(at, &[output]).1;
    let mut moving = gradient.iter().enumerate().filter(|(_, g)| **g != 0.0);
    let (first, value) = moving.next()?;
    Some((moving.next().is_none() && *value == 1.0).then_some(first))
}

/// What one instrument reads is late together: the elements of an array, and the positions of a floating body; what shows a
/// motor or a link is alone.
fn groups(plant: &TrajectoryPlant, channels: &[TrajectoryChannel]) -> Vec<(String, Vec<usize>)> {
    let n = plant.coordinates();
    let kind = |c: &TrajectoryChannel| Some(plant.plant().coordinates()[c.state? % n].kind);
    let array = |c: &TrajectoryChannel| c.name.split('[').next().unwrap_or(&c.name).to_owned();
    let floats = |c: &TrajectoryChannel| kind(c) == Some(CoordinateKind::Base);
    let mut all: Vec<(String, Vec<usize>)> = Vec::new();
    for (k, c) in channels.iter().enumerate() {
        let name = if kind(c).is_none() || floats(c) { array(c) } else { c.name.clone() };
        match all.iter_mut().find(|g| g.0 == name) {
            Some(group) => group.1.push(k),
            None => all.push((name, vec![k])),
        }
    }
    let positions = |(_, c): &(usize, &TrajectoryChannel)| floats(c) && c.state.is_some_and(|s| s < n);
    let (camera, mut names): (Vec<usize>, Vec<String>) =
        channels.iter().enumerate().filter(positions).map(|(k, c)| (k, array(c))).unzip();
    names.dedup();
    if names.len() > 1 {
        all.push((names.join("+"), camera));
    }
    all
}
