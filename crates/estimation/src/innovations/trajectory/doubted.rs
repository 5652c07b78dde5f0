//! What a case has estimated of its sensors, and the parameters of single recordings.

use trueup_signals::{Loaded, PriorGuess, SensorData};

use super::nodes::TrajectoryIntake;
use super::plant::TrajectoryPlant;

/// Standard deviation of an unknown gain of an input and of a reading, where the case gives none.
const GAIN: [f64; 2] = [0.1, 0.05];
/// The same of an offset, of an input in usual torques, of a reading in its unit.
const OFFSET: [f64; 2] = [0.1, 0.05];

/// What a number is of, by index among the driving inputs or the channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DoubtedScale {
    InputGain(usize),
    InputOffset(usize),
    ReadingGain(usize),
    ReadingOffset(usize),
}

/// A gain or an offset with its prior; its amplitude is what adds to what was assumed, of a gain as a share.
#[derive(Clone, Debug)]
pub(super) struct DoubtedNumber {
    /// A channel with `.gain` or `.offset`.
    pub(super) name: String,
    pub(super) of: DoubtedScale,
    assumed: f64,
    /// Gain by which the readings were corrected.
    gain: f64,
    pub(super) deviation: f64,
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
        }
    }
}

/// Gains and offsets that the case has estimated.
pub(super) fn doubted(
    loaded: &Loaded,
    plant: &TrajectoryPlant,
    intake: &TrajectoryIntake,
) -> Vec<DoubtedNumber> {
    let mut all = Vec::new();
    let mut add = |name: &str, of: [DoubtedScale; 2], usual: [f64; 2]| {
        let sensor = loaded.train().first().and_then(|r| r.channel(name)).map(|c| c.sensor.clone());
        let Some(SensorData { gain, offset, .. }) = sensor else { return };
        let by = gain.map_or(1.0, |g| g.value);
        let guesses: [(&str, Option<PriorGuess>, f64); 2] =
            [("gain", gain, 1.0), ("offset", offset, by.abs())];
        for (((figure, guess, unit), of), usual) in guesses.into_iter().zip(of).zip(usual) {
            let Some(g) = guess else { continue };
            let (name, deviation) = (format!("{name}.{figure}"), g.doubt.map_or(usual, |d| d / unit));
            all.push(DoubtedNumber { name, of, assumed: g.value, gain: by, deviation });
        }
    };
    let table = plant.plant().table();
    for (j, k) in table.driving.iter().enumerate() {
        let of = [DoubtedScale::InputGain(j), DoubtedScale::InputOffset(j)];
        add(&table.inputs[*k].name, of, [GAIN[0], OFFSET[0] * intake.usual_torque[j]]);
    }
    for (c, channel) in intake.channels.iter().enumerate() {
        add(
            &channel.name,
            [DoubtedScale::ReadingGain(c), DoubtedScale::ReadingOffset(c)],
            [GAIN[1], OFFSET[1]],
        );
    }
    all
}

/// Parameters of a model that a recording has by itself.
pub(super) fn own_parameters(loaded: &Loaded, plant: &TrajectoryPlant, recording: &str) -> Vec<(usize, f64)> {
    let table = plant.plant().table();
    let given = loaded.recordings.get(recording).into_iter().flat_map(|r| &r.parameters);
    let given = given.filter(|(name, _)| !name.starts_with("initial"));
    given.filter_map(|(name, value)| Some((table.parameter(name)?, value.number()?))).collect()
}
