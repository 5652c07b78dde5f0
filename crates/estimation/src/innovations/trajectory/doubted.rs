//! What a case has estimated of its sensors, and the parameters of single recordings.

use trueup_signals::{Loaded, PriorGuess, SensorData};

use super::nodes::{TrajectoryChannel, TrajectoryIntake};
use super::plant::TrajectoryPlant;
use super::structures::number_of;
use crate::innovations::rig::{Guess, guesses};

/// Standard deviation of an unknown gain of an input and of a reading, where the case gives none.
const GAIN: [f64; 2] = [0.1, 0.05];
/// The same of an offset, of an input in usual torques, of a reading in its unit.
const OFFSET: [f64; 2] = [0.1, 0.05];
/// The same of a delay, s.
const DELAY: f64 = 0.01;

/// What a number is of, by index among the driving inputs or the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DoubtedScale {
    InputGain(usize),
    InputOffset(usize),
    InputDelay(usize),
    ReadingGain(usize),
    ReadingOffset(usize),
    ReadingDelay(usize),
}

/// A gain, an offset or a delay with its prior; its amplitude is what adds to what was assumed, of a gain as a share.
#[derive(Clone, Debug)]
pub(super) struct DoubtedNumber {
    /// A channel with `.gain`, `.offset` or `.delay`.
    pub(super) name: String,
    pub(super) of: DoubtedScale,
    assumed: f64,
    /// Gain by which the readings were corrected.
    gain: f64,
    /// Prior mean.
    pub(super) mean: f64,
    pub(super) deviation: f64,
    /// Recordings for fitting that have it; `None`: all of them.
    pub(super) only: Option<Vec<usize>>,
}

impl DoubtedNumber {
    /// The value at an amplitude, in its unit.
    pub(super) fn value(&self, a: f64) -> f64 {
        match self.of {
            // What acts is the torque as corrected times 1 + a, or a more.
            DoubtedScale::InputGain(_) => self.assumed / (1.0 + a),
            DoubtedScale::InputOffset(_) => self.assumed - self.gain * a,
            DoubtedScale::ReadingGain(_) => self.assumed * (1.0 + a),
            DoubtedScale::ReadingOffset(_) => self.assumed + self.gain * a,
            DoubtedScale::InputDelay(_) | DoubtedScale::ReadingDelay(_) => self.assumed + a,
        }
    }
    /// Whether a recording has it.
    pub(super) fn is_in(&self, recording: usize) -> bool {
        self.only.as_ref().is_none_or(|only| only.contains(&recording))
    }
    /// Whether it is a delay.
    pub(super) fn is_delay(&self) -> bool {
        matches!(self.of, DoubtedScale::InputDelay(_) | DoubtedScale::ReadingDelay(_))
    }
}

/// Gains, offsets and delays that the case has estimated: each guess once, with the recordings that have it; of offsets of readings each
/// recording has its own.
pub(super) fn doubted(
    loaded: &Loaded,
    plant: &TrajectoryPlant,
    intake: &TrajectoryIntake,
) -> Vec<DoubtedNumber> {
    let train = loaded.train();
    let mut all = Vec::new();
    let mut add = |name: &str, of: DoubtedScale, usual: f64| {
        let (figure, guess): (&str, fn(&SensorData) -> Option<PriorGuess>) = match of {
            DoubtedScale::InputGain(_) | DoubtedScale::ReadingGain(_) => ("gain", |s| s.gain),
            DoubtedScale::InputOffset(_) | DoubtedScale::ReadingOffset(_) => ("offset", |s| s.offset),
            DoubtedScale::InputDelay(_) | DoubtedScale::ReadingDelay(_) => ("delay", |s| s.late),
        };
        // Offsets of readings are each recording's own, however they are guessed.
        let each: Vec<Guess> = match of {
            DoubtedScale::ReadingOffset(_) => {
                let sensors =
                    train.iter().enumerate().filter_map(|(k, r)| Some((k, &r.channel(name)?.sensor)));
                sensors.filter_map(|(k, s)| Some((s.offset?, s.clone(), Some(vec![k])))).collect()
            }
            _ => guesses(&train, name, guess),
        };
        for (g, s, only) in each {
            let gain = s.gain.map_or(1.0, |g| g.value);
            // The standard deviation of an offset is in the unit of the reading, of what acts it is that over the gain.
            let unit = if figure == "offset" { gain.abs() } else { 1.0 };
            let deviation = g.doubt.map_or(usual, |d| d / unit);
            // Readings were put to the times of the delay in hand.
            let late = figure == "delay";
            let (assumed, mean) = if late { (s.delay, g.value - s.delay) } else { (g.value, 0.0) };
            let name = format!("{name}.{figure}");
            all.push(DoubtedNumber { name, of, assumed, gain, mean, deviation, only });
        }
    };
    let table = plant.plant().table();
    for (j, k) in table.driving.iter().enumerate() {
        let name = &table.inputs[*k].name;
        add(name, DoubtedScale::InputGain(j), GAIN[0]);
        let torque = intake.usual_torque[j] / plant.drive_gains[j].abs();
        add(name, DoubtedScale::InputOffset(j), OFFSET[0] * torque);
        add(name, DoubtedScale::InputDelay(j), DELAY);
    }
    for (c, TrajectoryChannel { name, .. }) in intake.channels.iter().enumerate() {
        add(name, DoubtedScale::ReadingGain(c), GAIN[1]);
        add(name, DoubtedScale::ReadingOffset(c), OFFSET[1]);
        add(name, DoubtedScale::ReadingDelay(c), DELAY);
    }
    all
}

/// Parameters of a model that a recording has by itself.
pub(super) fn own_parameters(loaded: &Loaded, plant: &TrajectoryPlant, recording: &str) -> Vec<(usize, f64)> {
    let table = plant.plant().table();
    let given = loaded.recordings.get(recording).into_iter().flat_map(|r| &r.parameters);
    let given = given.filter_map(|(name, value)| Some((table.parameter(name)?, value)));
    let given = given.filter(|(k, _)| !table.parameters[*k].is_initial());
    given.filter_map(|(k, value)| Some((k, number_of(&table.parameters[k], value)?))).collect()
}
