//! What sensors make of what is there: reading = gain x value + offset, late by a delay; which of it is to be estimated.

use trueup_numerics::Scalar;
use trueup_signals::Guess;

use crate::predict::InputMap;
use crate::run::Run;

/// Share of the largest reading that an offset may be of which nothing is known.
pub const OFFSET: f64 = 0.3;
/// Size of a delay of which nothing is known, s.
const DELAY: f64 = 0.01;
/// No delay is estimated further than this from what it is believed to be, s.
const MOST_DELAY: f64 = 0.5;

/// Whose readings they are, by index in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Of {
    /// Of an input.
    Input(usize),
    /// Of an output.
    Output(usize),
}

/// A figure of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// By how many times readings are too large.
    Gain,
    /// What they have too much.
    Offset,
    /// By how much they are late.
    Delay,
}

impl Figure {
    /// Behind the channel's name and a full stop, as cases and results have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gain => "gain",
            Self::Offset => "offset",
            Self::Delay => "delay",
        }
    }
}

/// A figure of a sensor that is to be estimated, the same in all recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sought {
    /// Whose readings.
    pub of: Of,
    /// Which figure.
    pub figure: Figure,
    /// What is known of it.
    pub guess: Guess,
    /// Its size: of a gain itself, else how far it may be off.
    pub size: f64,
}

impl Sought {
    /// How far from what it is believed to be it is looked for, where that is not left to the method.
    pub fn bounds(&self) -> Option<(f64, f64)> {
        let believed = self.guess.value;
        (self.figure == Figure::Delay).then_some((believed - MOST_DELAY, believed + MOST_DELAY))
    }
}

/// What is to be estimated of the sensors of these recordings, each figure once, as the first recording has it. Offsets of
/// outputs are not among it: they are estimated in each recording anew.
pub fn sought<'a>(runs: impl IntoIterator<Item = &'a Run>) -> Vec<Sought> {
    let mut all: Vec<Sought> = Vec::new();
    let mut add = |of: Of, figure: Figure, guess: Option<Guess>, wide: f64| {
        let Some(guess) = guess.filter(|_| !all.iter().any(|s| (s.of, s.figure) == (of, figure))) else {
            return;
        };
        let size = match figure {
            Figure::Gain => guess.value.abs(),
            Figure::Offset | Figure::Delay => guess.doubt.unwrap_or(wide).max(f64::MIN_POSITIVE),
        };
        all.push(Sought { of, figure, guess, size });
    };
    for run in runs {
        for d in &run.drives {
            let (of, largest) = (Of::Input(d.input), d.u.iter().fold(0.0, |m: f64, v| m.max(v.abs())));
            add(of, Figure::Offset, d.offset, OFFSET * largest);
            add(of, Figure::Gain, d.gain, 0.0);
            add(of, Figure::Delay, d.late, DELAY);
        }
        for c in &run.channels {
            add(Of::Output(c.output), Figure::Gain, c.gain, 0.0);
            add(Of::Output(c.output), Figure::Delay, c.late, DELAY);
        }
    }
    all
}

/// A sensor of an input or an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor<T> {
    /// By how many times a reading is too large.
    pub gain: T,
    /// What it has too much.
    pub offset: T,
}

impl<T: Scalar> Sensor<T> {
    /// Reads what is there.
    pub fn none() -> Self {
        Self { gain: T::one(), offset: T::zero() }
    }
    /// The reading of a value.
    pub fn reads(&self, value: T) -> T {
        value * self.gain + self.offset
    }
    /// What it makes of readings that another one was taken out of, as if it were in its place.
    pub fn beside(&self, other: &Self) -> Self {
        Self { gain: self.gain / other.gain, offset: (self.offset - other.offset) / other.gain }
    }
}

/// Sensors of all inputs and outputs of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors<T> {
    /// By input.
    pub inputs: Vec<Sensor<T>>,
    /// By output.
    pub outputs: Vec<Sensor<T>>,
}

impl<T: Scalar> Sensors<T> {
    /// All of them read what is there.
    pub fn none(inputs: usize, outputs: usize) -> Self {
        Self { inputs: vec![Sensor::none(); inputs], outputs: vec![Sensor::none(); outputs] }
    }
    /// From readings of the inputs to what is there.
    pub fn inputs_of(&self) -> InputMap<T> {
        let all = || self.inputs.iter();
        InputMap {
            gain: all().map(|s| T::one() / s.gain).collect(),
            bias: all().map(|s| -s.offset / s.gain).collect(),
        }
    }
    /// Each as it is where another one was taken out of its readings.
    pub fn beside(&self, others: &Self) -> Self {
        let all = |own: &[Sensor<T>], others: &[Sensor<T>]| {
            own.iter().zip(others).map(|(s, o)| s.beside(o)).collect()
        };
        Self { inputs: all(&self.inputs, &others.inputs), outputs: all(&self.outputs, &others.outputs) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_in_the_place_of_another_one_reads_the_same() {
        let (truth, believed) = (Sensor { gain: 2.5, offset: -0.3 }, Sensor { gain: 2.0, offset: 0.1 });
        for value in [-1.0, 0.0, 7.5] {
            let corrected = (truth.reads(value) - believed.offset) / believed.gain;
            assert!((truth.beside(&believed).reads(value) - corrected).abs() < 1e-14);
        }
        assert_eq!(truth.beside(&Sensor::none()), truth);
    }
}
