//! What is known of a rig up to a number: gains and offsets of inputs and readings, a gear ratio, delays, known effects. Numbers that
//! multiply are refitted with the plant's parameters and follow these in `theta`; each is 1 where the rig is as was assumed. What adds
//! to a reading has a column of its own, at 0 as was assumed.
//!
//! ```text
//! u = n_g u' - (n_o - 1) U                    u' = (reading - offset) / gain, as assumed
//! gain / n_g,  offset + (n_o - 1) U gain / n_g    are reported
//! y' = n_y h(x, t - d) + o                    y' likewise; gain n_y, offset + gain o and delay + d are reported
//! ```

use std::borrow::Cow;

use trueup_signals::{Channel, Loaded, PriorGuess, Recording, SensorData};

use super::intake_channel::IntakeChannel;
use super::known_effects::{KNOWN, KnownEffects, KnownPoint, UNIT};
use super::plant::{ForcedPlant, GearTrain};

/// Relative standard deviation of a gain where the case gives none.
pub(super) const GAIN: f64 = 0.5;
/// Standard deviation of the offset of a reading of which nothing is known, in the range of its readings.
pub(super) const OFFSET: f64 = 0.1;
/// Standard deviation of a delay of which nothing is known, s.
const DELAY: f64 = 0.01;

/// What a number of a rig is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigNumber {
    /// The inverse of the gain of an input, by index among the plant's input forces.
    InputGain(usize),
    /// Offset of an input.
    InputOffset(usize),
    /// Gain of the readings of a channel, by index among those of the intake.
    ReadingGain(usize),
    /// The plant's gear ratio.
    GearRatio,
    /// A number of the known effects.
    Effect(usize),
}

/// A number of a rig with its prior, whose mean is 1.
#[derive(Clone, Debug, PartialEq)]
pub struct RigTerm {
    /// A channel with `.gain` or `.offset`, or an FMU variable.
    pub name: String,
    /// Gain or offset, and of which input.
    pub of: RigNumber,
    /// Value in its unit where the number is 1.
    pub assumed: f64,
    /// By how much the value of an offset or an angle is larger where the number is 2 and the gain 1; 0: the number is a factor.
    pub unit: f64,
    /// Prior standard deviation of the number.
    pub deviation: f64,
    /// Recordings that have it; `None`: all of them.
    pub only: Option<Vec<usize>>,
}

impl RigTerm {
    /// Whether a recording has it.
    pub fn is_in(&self, recording: usize) -> bool {
        self.only.as_ref().is_none_or(|only| only.contains(&recording))
    }
}

/// What a number that adds is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddedNumber {
    /// Offset of the readings of a channel in one recording, by their indices in the intake.
    ReadingOffset {
        /// Which channel.
        channel: usize,
        /// Which recording.
        recording: usize,
    },
    /// Delay of the readings of a channel.
    ReadingDelay(usize),
    /// Delay of an input, by index among the plant's input forces.
    InputDelay(usize),
    /// State of a servo, by index among those of the known effects, when a recording begins.
    ServoState {
        /// Which state.
        state: usize,
        /// Which recording.
        recording: usize,
    },
}

/// A number of a rig that adds to what is read, in its prior standard deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedTerm {
    /// A channel with `.offset` or `.delay`.
    pub name: String,
    /// Offset or delay, and of what.
    pub of: AddedNumber,
    /// Value in its unit where the number is 0: that by which the readings were corrected.
    pub assumed: f64,
    /// By how much the value is larger where the number is 1: the standard deviation.
    pub unit: f64,
    /// The same as an error of the readings in the state's unit, of a delay in s.
    pub size: f64,
    /// Prior mean of the number.
    pub mean: f64,
    /// Recordings that have it; `None`: all of them. Offsets and states name theirs themselves.
    pub only: Option<Vec<usize>>,
}

/// All numbers of a rig.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RigTerms {
    /// In the order in which they follow the plant's parameters.
    pub terms: Vec<RigTerm>,
    /// Those that add, in the order of their columns behind those of `theta`.
    pub added: Vec<AddedTerm>,
    /// Parameters of the plant that are others in a recording, known there: index and value.
    pub own: Vec<Vec<(usize, f64)>>,
    /// The same of the known effects' parameters, by index among the model's.
    own_of_effects: Vec<Vec<(usize, f64)>>,
    /// What is on the other side of the plant's gear.
    gear: Option<GearSide>,
}

/// What is on the other side of a gear.
#[derive(Clone, Debug, PartialEq)]
struct GearSide {
    train: GearTrain,
    channels: Vec<bool>,
    inputs: Vec<bool>,
}

/// Root mean square of all samples of a channel of the recordings for fitting.
pub fn root_mean_square(loaded: &Loaded, channel: &str) -> f64 {
    let all = || loaded.train().into_iter().filter_map(|r| r.channel(channel)).flat_map(Channel::believed);
    (all().map(|v| v * v).sum::<f64>() / all().count().max(1) as f64).sqrt()
}

/// A channel whose delay is estimated, in all recordings (`None`) or in these.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LateGroup {
    /// Its name.
    pub channel: String,
    /// Recordings for fitting.
    pub only: Option<Vec<usize>>,
}

impl LateGroup {
    /// Those of a case.
    pub fn all(loaded: &Loaded) -> Vec<Self> {
        let train = loaded.train();
        let mut names: Vec<&str> = Vec::new();
        for c in train.iter().flat_map(|r| &r.channels).filter(|c| c.sensor.late.is_some()) {
            if !names.contains(&&*c.name) {
                names.push(&c.name);
            }
        }
        let of = |name: &str| {
            let groups = guesses(&train, name, |s| s.late).into_iter();
            groups.map(|g| Self { channel: name.to_owned(), only: g.2 }).collect::<Vec<_>>()
        };
        names.into_iter().flat_map(of).collect()
    }
    /// Makes it later by so much, s.
    pub fn delay(&self, loaded: &mut Loaded, by: f64) {
        let train = &loaded.case.train;
        let has =
            |name: &String| self.only.as_ref().is_none_or(|only| only.iter().any(|k| train[*k] == *name));
        let channels =
            loaded.recordings.iter_mut().filter(|(name, _)| has(name)).flat_map(|r| &mut r.1.channels);
        channels.filter(|c| c.name == self.channel).for_each(|c| c.sensor.delay += by);
    }
}

/// What is estimated of a channel, the sensor, and the recordings that have it; `None`: all that have the channel.
pub(super) type Guess = (PriorGuess, SensorData, Option<Vec<usize>>);

/// What is estimated of a channel, each guess once: with the sensor of the first recording that has it, and the recordings that have it
/// (`None`: all that have the channel).
pub(super) fn guesses(
    train: &[&Recording],
    name: &str,
    of: fn(&SensorData) -> Option<PriorGuess>,
) -> Vec<Guess> {
    let all: Vec<(usize, &SensorData)> =
        train.iter().enumerate().filter_map(|(k, r)| Some((k, &r.channel(name)?.sensor))).collect();
    let mut found: Vec<(PriorGuess, SensorData, Vec<usize>)> = Vec::new();
    for (k, sensor) in &all {
        let Some(guess) = of(sensor) else { continue };
        match found.iter_mut().find(|f| f.0 == guess) {
            Some(same) => same.2.push(*k),
            None => found.push((guess, (*sensor).clone(), vec![*k])),
        }
    }
    let only = |k: Vec<usize>| (k.len() < all.len()).then_some(k);
    found.into_iter().map(|(guess, sensor, k)| (guess, sensor, only(k))).collect()
}

impl RigTerms {
    /// Of a case, whose readings are these channels.
    pub fn new(loaded: &Loaded, plant: &dyn ForcedPlant, channels: &[IntakeChannel]) -> Self {
        let train = loaded.train();
        let own = train.iter().map(|r| {
            let given = plant.parameters().iter().enumerate();
            given.filter_map(|(k, p)| Some((k, r.parameters.get(p.name)?.number()?))).collect()
        });
        let of_effects = train.iter().map(|r| {
            let given = plant.known_effects().into_iter().flat_map(|e| {
                r.parameters.iter().filter_map(|(name, value)| Some((e.parameter(name)?, value.number()?)))
            });
            given.collect()
        });
        let mut rig = Self { own: own.collect(), own_of_effects: of_effects.collect(), ..Self::default() };
        for (k, force) in plant.input_forces().iter().enumerate() {
            for (g, _, only) in guesses(&train, force.name, |s| s.gain) {
                rig.gain(force.name, RigNumber::InputGain(k), g, only);
            }
            for (o, s, only) in guesses(&train, force.name, |s| s.offset) {
                // Of an offset of which nothing is known the size of the input itself.
                let usual = || root_mean_square(loaded, force.name);
                rig.terms.push(RigTerm {
                    name: format!("{}.offset", force.name),
                    of: RigNumber::InputOffset(k),
                    assumed: o.value,
                    unit: UNIT * o.doubt.map_or_else(usual, |d| d / s.believed_gain().abs()),
                    deviation: 1.0 / UNIT,
                    only,
                });
            }
            for (d, s, only) in guesses(&train, force.name, |s| s.late) {
                rig.delay(force.name, AddedNumber::InputDelay(k), d, s.delay, only);
            }
        }
        for (c, channel) in channels.iter().enumerate() {
            for (g, _, only) in guesses(&train, &channel.name, |s| s.gain) {
                rig.gain(&channel.name, RigNumber::ReadingGain(c), g, only);
            }
            for (d, s, only) in guesses(&train, &channel.name, |s| s.late) {
                rig.delay(&channel.name, AddedNumber::ReadingDelay(c), d, s.delay, only);
            }
            let factor = plant.readings()[channel.reading].factor;
            for (recording, read) in train.iter().enumerate() {
                let Some(read) = read.channel(&channel.name) else { continue };
                let Some(o) = read.sensor.offset else { continue };
                let range = read.range().map_or(0.0, |(low, high)| high - low);
                let unit = o.doubt.unwrap_or(OFFSET * range).max(1e-12);
                rig.added.push(AddedTerm {
                    name: format!("{}.offset", channel.name),
                    of: AddedNumber::ReadingOffset { channel: c, recording },
                    assumed: o.value,
                    unit,
                    size: unit / read.sensor.believed_gain() * factor,
                    mean: 0.0,
                    only: None,
                });
            }
        }
        if let Some(train) = plant.gear() {
            if let Some(deviation) = train.deviation {
                rig.terms.push(RigTerm {
                    name: train.name.to_owned(),
                    of: RigNumber::GearRatio,
                    assumed: train.ratio,
                    unit: 0.0,
                    deviation: deviation.max(KNOWN),
                    only: None,
                });
            }
            let beyond = |c: usize| c == train.coordinate;
            let read = |c: &IntakeChannel| beyond(plant.readings()[c.reading].coordinate);
            rig.gear = Some(GearSide {
                channels: channels.iter().map(read).collect(),
                inputs: plant.input_forces().iter().map(|f| beyond(f.coordinate)).collect(),
                train,
            });
        }
        if let Some(effects) = plant.known_effects() {
            rig.servo_states(effects, plant, train.len());
        }
        let effects = plant.known_effects().map_or(&[][..], |e| &e.numbers);
        rig.terms.extend(effects.iter().enumerate().map(|(k, n)| RigTerm {
            name: n.name.clone(),
            of: RigNumber::Effect(k),
            assumed: n.assumed,
            unit: n.unit,
            deviation: n.deviation,
            only: None,
        }));
        rig
    }

    /// What a servo has integrated when a recording begins.
    fn servo_states(&mut self, effects: &KnownEffects, plant: &dyn ForcedPlant, recordings: usize) {
        let numbers = vec![1.0; effects.numbers.len()];
        let at = KnownPoint {
            time: 0.0,
            parameters: &effects.parameters(&numbers, &[]),
            state: &vec![0.0; plant.states()],
            inner: &[],
            input: &[],
            sign: 0.0,
            rigid: plant.elements().is_empty(),
        };
        for (state, force) in effects.kept_states(&at) {
            let size = UNIT * plant.usual_force() / force;
            self.added.extend((0..recordings).map(|recording| AddedTerm {
                name: String::new(),
                of: AddedNumber::ServoState { state, recording },
                assumed: 0.0,
                unit: size,
                size,
                mean: 0.0,
                only: None,
            }));
        }
    }

    fn gain(&mut self, channel: &str, of: RigNumber, guess: PriorGuess, only: Option<Vec<usize>>) {
        let deviation = guess.doubt.unwrap_or(GAIN).max(KNOWN);
        self.terms.push(RigTerm {
            name: format!("{channel}.gain"),
            of,
            assumed: guess.value,
            unit: 0.0,
            deviation,
            only,
        });
    }
    fn delay(
        &mut self,
        channel: &str,
        of: AddedNumber,
        guess: PriorGuess,
        taken: f64,
        only: Option<Vec<usize>>,
    ) {
        let unit = guess.doubt.unwrap_or(DELAY).max(1e-6);
        let mean = (guess.value - taken) / unit;
        self.added.push(AddedTerm {
            name: format!("{channel}.delay"),
            of,
            assumed: taken,
            unit,
            size: unit,
            mean,
            only,
        });
    }

    fn number(&self, numbers: &[f64], of: RigNumber, recording: usize) -> (f64, f64) {
        let at = self.terms.iter().position(|t| t.of == of && t.is_in(recording));
        at.map_or((1.0, 0.0), |k| (numbers[k], self.terms[k].unit))
    }
    /// Number of the gear ratio where it is estimated and this is on its other side.
    fn geared(&self, numbers: &[f64], beyond: impl Fn(&GearSide) -> bool) -> f64 {
        if self.gear.as_ref().is_some_and(beyond) {
            self.number(numbers, RigNumber::GearRatio, 0).0
        } else {
            1.0
        }
    }
    /// Whether an input is on the other side of the gear.
    pub fn is_geared(&self, input: usize) -> bool {
        self.gear.as_ref().is_some_and(|g| g.inputs[input])
    }
    /// Whether the readings of a channel are on the other side of the gear.
    pub fn is_read_geared(&self, channel: usize) -> bool {
        self.gear.as_ref().is_some_and(|g| g.channels[channel])
    }
    /// Parameter that counts by the inverse square of the gear ratio.
    pub fn geared_inertia(&self) -> Option<usize> {
        self.gear.as_ref().map(|g| g.train.inertia)
    }
    /// Factor of an input as assumed in a recording, and what is taken from it.
    pub fn of_input(&self, numbers: &[f64], input: usize, recording: usize) -> [f64; 2] {
        let (gain, _) = self.number(numbers, RigNumber::InputGain(input), recording);
        let (offset, unit) = self.number(numbers, RigNumber::InputOffset(input), recording);
        let gear = self.geared(numbers, |g| g.inputs[input]);
        [gain / gear, (offset - 1.0) * unit / gear]
    }
    /// Factor of the readings of a channel in a recording: what is read over the state that it shows.
    pub fn of_reading(&self, numbers: &[f64], channel: usize, recording: usize) -> f64 {
        let (gain, _) = self.number(numbers, RigNumber::ReadingGain(channel), recording);
        gain / self.geared(numbers, |g| g.channels[channel])
    }
    /// Parameters of the plant (the first of `theta`, which has the numbers behind) as they are in a recording.
    pub fn parameters_in<'a>(&self, theta: &'a [f64], recording: usize) -> Cow<'a, [f64]> {
        let own = self.own.get(recording).filter(|own| !own.is_empty());
        let gear = self.terms.iter().rposition(|t| t.of == RigNumber::GearRatio);
        if own.is_none() && gear.is_none() {
            return Cow::Borrowed(theta);
        }
        let mut theta = theta.to_vec();
        own.into_iter().flatten().for_each(|(k, value)| theta[*k] = *value);
        if let (Some(k), Some(inertia)) = (gear, self.geared_inertia()) {
            let number = theta[theta.len() - self.terms.len() + k];
            theta[inertia] /= number * number;
        }
        Cow::Owned(theta)
    }
    /// Parameters of known effects that a recording has by itself, by index among the model's.
    pub fn of_effects(&self, recording: usize) -> impl Iterator<Item = &(usize, f64)> {
        self.own_of_effects.get(recording).into_iter().flatten()
    }
    /// Whether a parameter is known by itself in a recording.
    pub fn is_own(&self, parameter: usize, recording: usize) -> bool {
        self.own.get(recording).is_some_and(|own| own.iter().any(|(k, _)| *k == parameter))
    }
    /// How far the readings of a channel may be from what was assumed: as a share of them, and in the unit of the state.
    pub fn unsure(&self, channel: usize) -> [f64; 2] {
        let gain = self.terms.iter().filter(|t| {
            t.of == RigNumber::ReadingGain(channel)
                || t.of == RigNumber::GearRatio && self.is_read_geared(channel)
        });
        let of_channel =
            |t: &&AddedTerm| matches!(t.of, AddedNumber::ReadingOffset { channel: c, .. } if c == channel);
        let offset = self.added.iter().filter(of_channel).map(|t| t.size.abs());
        [gain.map(|t| t.deviation).fold(0.0, f64::hypot), offset.fold(0.0, f64::max)]
    }

    /// A number as it is reported; `numbers` of `theta`.
    fn value(&self, t: &RigTerm, n: f64, numbers: &[f64]) -> f64 {
        match t.of {
            RigNumber::InputGain(_) => t.assumed / n,
            RigNumber::InputOffset(k) => {
                let (gain, recording) = (RigNumber::InputGain(k), t.only.as_ref().map_or(0, |o| o[0]));
                let own = self.terms.iter().find(|t| t.of == gain && t.is_in(recording));
                let assumed = own.map_or(1.0, |t| t.assumed);
                t.assumed + (n - 1.0) * t.unit * assumed / self.number(numbers, gain, recording).0
            }
            RigNumber::ReadingGain(_) | RigNumber::GearRatio => t.assumed * n,
            RigNumber::Effect(_) if t.unit == 0.0 => t.assumed * n,
            RigNumber::Effect(_) => t.assumed + (n - 1.0) * t.unit,
        }
    }
    /// Names and values as they are reported, of all recordings together; `numbers` of `theta`, `added` those that add.
    pub fn reported(&self, numbers: &[f64], added: &[f64]) -> Vec<(String, f64)> {
        let common = self.terms.iter().zip(numbers).filter(|(t, _)| t.only.is_none());
        let common = common.map(|(t, n)| (t.name.clone(), self.value(t, *n, numbers)));
        let delay = |(t, a): (&AddedTerm, &f64)| {
            let of_one = matches!(t.of, AddedNumber::ReadingOffset { .. } | AddedNumber::ServoState { .. });
            (!of_one && t.only.is_none()).then(|| (t.name.clone(), t.assumed + t.unit * a))
        };
        common.chain(self.added.iter().zip(added).filter_map(delay)).collect()
    }
    /// What single recordings have as it is reported: name, recording, value.
    pub fn reported_of_single(&self, numbers: &[f64], added: &[f64]) -> Vec<(String, usize, f64)> {
        let own = self.terms.iter().zip(numbers).flat_map(|(t, n)| {
            let value = self.value(t, *n, numbers);
            t.only.iter().flatten().map(move |recording| (t.name.clone(), *recording, value))
        });
        let added = self.added.iter().zip(added).flat_map(|(t, a)| {
            let value = t.assumed + t.unit * a;
            let of_one = match t.of {
                AddedNumber::ReadingOffset { recording, .. } => Some(recording),
                _ => None,
            };
            let all = of_one.into_iter().chain(t.only.iter().flatten().copied());
            all.map(move |recording| (t.name.clone(), recording, value))
        });
        own.chain(added).collect()
    }
    /// Delays at these numbers: the channel, the recordings, and how much later it is than was assumed, s.
    pub fn later(&self, added: &[f64]) -> Vec<(LateGroup, f64)> {
        let of = |(t, a): (&AddedTerm, &f64)| {
            let channel = t.name.strip_suffix(".delay")?.to_owned();
            Some((LateGroup { channel, only: t.only.clone() }, t.unit * a))
        };
        self.added.iter().zip(added).filter_map(of).collect()
    }
    /// How many of the numbers that add are assumed to be 0: those before a servo's states, of which nothing is assumed.
    pub fn assumed(&self) -> usize {
        self.added.iter().filter(|t| !matches!(t.of, AddedNumber::ServoState { .. })).count()
    }
    /// Whether the delay of a channel is estimated.
    pub fn is_late(&self, channel: usize) -> bool {
        self.added.iter().any(|t| t.of == AddedNumber::ReadingDelay(channel))
    }
}
