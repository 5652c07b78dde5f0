//! Recordings as numbers: what drives a model, and what is compared with its outputs.

use trueup_numerics::Scalar;
use trueup_signals::{FitWeight, PriorGuess};

use crate::sensors::{LinearSensor, SensorSet};
use crate::unknown::FitTarget;

/// How an input goes between its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum InputInterpolation {
    /// On a straight line.
    #[default]
    Linear,
    /// It keeps the last value.
    Hold,
}

/// A measured input; before its first sample the first value, after the last the last.
#[derive(Clone, Debug, Default)]
pub struct InputDrive {
    /// Index of the model's input.
    pub input: usize,
    /// Times in s, strictly increasing.
    pub t: Vec<f64>,
    /// Values.
    pub u: Vec<f64>,
    /// Between the samples.
    pub between: InputInterpolation,
    /// Standard deviation of a sample's noise; 0: not known, or none.
    pub sigma: f64,
    /// It may read a constant off, which is to be estimated; the values are less the assumed one.
    pub offset: Option<PriorGuess>,
    /// It may read too large, by a factor which is to be estimated; the values are over the assumed one.
    pub gain: Option<PriorGuess>,
    /// How late it is is to be estimated; its times are earlier by the assumed delay.
    pub late: Option<PriorGuess>,
}

/// Factor on the deviation of a reading that counts for nothing.
const LEFT_OUT: f64 = 1e9;

/// A measured output.
#[derive(Clone, Debug, Default)]
pub struct OutputChannel {
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
    /// Step of the readings (one count); 0: none.
    pub resolution: f64,
    /// By how much less than one reading each counts, as a factor on `sigma` ([`OutputChannel::weigh_rests`]); empty: 1.
    pub spread: Vec<f64>,
    /// It may read a constant off, which is to be estimated; the values are less the assumed one.
    pub offset: Option<PriorGuess>,
    /// It may read too large, by a factor which is to be estimated; the values are over the assumed one.
    pub gain: Option<PriorGuess>,
    /// How late it is is to be estimated; `delay` is the assumed one.
    pub late: Option<PriorGuess>,
}

impl OutputChannel {
    /// Standard deviation of reading `k`.
    pub fn deviation(&self, k: usize) -> f64 {
        self.sigma * self.spread.get(k).copied().unwrap_or(1.0)
    }

    /// Quantisation is most of what its readings err by.
    pub fn counts(&self) -> bool {
        self.resolution > 0.0 && self.resolution / 12f64.sqrt() > 0.7 * self.sigma
    }

    /// These readings count for nothing.
    pub fn leave_out(&mut self, readings: &[usize]) {
        self.spread.resize(self.y.len(), 1.0);
        readings.iter().for_each(|k| self.spread[*k] = LEFT_OUT);
    }

    /// How much of a reading `k` counts for, 0 to 1: a factor on its part of the logarithm of the likelihood.
    pub fn worth(&self, k: usize) -> f64 {
        self.spread.get(k).map_or(1.0, |s| s.powi(-2))
    }

    /// A sensor at rest repeats one count, and with it one quantisation error: a thousand such readings say no
    /// more than one. While it moves on evenly the errors within a count cancel, and its readings stay as they are.
    /// So a count that lasts for more than twice as long as the shorter one of its neighbours is weighed like that.
    pub fn weigh_rests(&mut self) {
        if !self.counts() {
            return;
        }
        let mut begins: Vec<usize> = (1..self.y.len()).filter(|&k| self.y[k] != self.y[k - 1]).collect();
        begins.insert(0, 0);
        begins.push(self.y.len());
        let lengths: Vec<usize> = begins.windows(2).map(|w| w[1] - w[0]).collect();
        self.spread = vec![1.0; self.y.len()];
        for (i, &length) in lengths.iter().enumerate() {
            let neighbours =
                [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|j| lengths.get(j));
            let worth = 2 * neighbours.min().copied().unwrap_or(1);
            if length > worth {
                self.spread[begins[i]..begins[i + 1]].fill((length as f64 / worth as f64).sqrt());
            }
        }
    }
}

/// One recording.
#[derive(Clone, Debug, Default)]
pub struct IdentificationRun {
    /// Its name in messages and results.
    pub name: String,
    /// Inputs; those that are missing are 0.
    pub drives: Vec<InputDrive>,
    /// Outputs to compare.
    pub channels: Vec<OutputChannel>,
    /// When the simulation starts, s; readings from before are left out.
    pub start: f64,
    /// The run starts at rest and in equilibrium.
    pub at_rest: bool,
    /// Parameters known for this run, initial states among them: index and value.
    pub known: Vec<(usize, f64)>,
    /// Stretches of it whose readings count for less, which `spread` of its channels contains.
    pub weights: Vec<FitWeight>,
}

impl IdentificationRun {
    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.channels.iter().map(|c| c.t.len()).sum()
    }
    /// Nothing to compare.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// What a reading at `t` seconds counts for by the case, 0 to 1.
    pub fn weight(&self, t: f64) -> f64 {
        self.weights.iter().filter(|w| w.holds(&self.name, t)).map(|w| w.weight).product()
    }
    /// Lets readings of a stretch count for less; how many there are.
    pub fn weigh(&mut self, stretch: &FitWeight) -> usize {
        let mut count = 0;
        for channel in &mut self.channels {
            let held: Vec<usize> =
                (0..channel.t.len()).filter(|&k| stretch.holds(&self.name, channel.t[k])).collect();
            count += held.len();
            if held.is_empty() {
                continue;
            }
            channel.spread.resize(channel.y.len(), 1.0);
            held.iter().for_each(|k| {
                channel.spread[*k] = (channel.spread[*k] / stretch.weight.sqrt()).min(LEFT_OUT)
            });
        }
        if count > 0 {
            self.weights.push(stretch.clone());
        }
        count
    }
}

impl IdentificationRun {
    /// Lets the readings of an output be late by `delay` seconds, whatever is assumed; of one whose delay is known:
    /// nothing.
    pub fn read_late(&mut self, output: usize, delay: f64) {
        let of = |c: &&mut OutputChannel| c.output == output && c.late.is_some();
        self.channels.iter_mut().filter(of).for_each(|c| c.delay = delay);
    }
    /// The same of an input.
    pub fn driven_late(&mut self, input: usize, delay: f64) {
        for d in self.drives.iter_mut().filter(|d| d.input == input) {
            let Some(late) = &mut d.late else { continue };
            d.t.iter_mut().for_each(|t| *t -= delay - late.value);
            late.value = delay;
        }
    }
    /// Takes the estimates of a sensor instead of what was assumed.
    pub fn calibrate(&mut self, target: FitTarget, value: f64) {
        let scaled = |gain: &mut Option<PriorGuess>| {
            let before = gain.map_or(1.0, |g| g.value);
            *gain = Some(PriorGuess { value, doubt: None });
            before / value
        };
        match target {
            FitTarget::SensorDelay(output) => self.read_late(output, value),
            FitTarget::InputSensorDelay(input) => self.driven_late(input, value),
            FitTarget::Gain(output) => {
                for c in self.channels.iter_mut().filter(|c| c.output == output && c.gain.is_some()) {
                    let by = scaled(&mut c.gain);
                    c.y.iter_mut().for_each(|y| *y *= by);
                    (c.sigma, c.resolution) = (c.sigma * by.abs(), c.resolution * by.abs());
                }
            }
            FitTarget::InputGain(input) => {
                for d in self.drives.iter_mut().filter(|d| d.input == input && d.gain.is_some()) {
                    let by = scaled(&mut d.gain);
                    d.u.iter_mut().for_each(|u| *u *= by);
                    d.sigma *= by.abs();
                }
            }
            FitTarget::Parameter(_)
            | FitTarget::Offset(_)
            | FitTarget::InputBias(_)
            | FitTarget::InputOffset(_) => {}
        }
    }
    /// The assumed errors of its sensors, which were taken out of the values.
    pub fn believed<T: Scalar>(&self, inputs: usize, outputs: usize) -> SensorSet<T> {
        let mut all = SensorSet::none(inputs, outputs);
        let sensor = |gain: Option<PriorGuess>, offset: Option<PriorGuess>| LinearSensor {
            gain: T::constant(gain.map_or(1.0, |g| g.value)),
            offset: T::constant(offset.map_or(0.0, |g| g.value)),
        };
        self.drives.iter().for_each(|d| all.inputs[d.input] = sensor(d.gain, d.offset));
        self.channels.iter().for_each(|c| all.outputs[c.output] = sensor(c.gain, c.offset));
        all
    }
}
