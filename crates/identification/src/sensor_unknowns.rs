//! What is to be estimated of sensors: their gains, offsets and delays.

use trueup_signals::PriorGuess;

use crate::run::IdentificationRun;

/// Share of the largest reading that an offset may be of which nothing is known.
pub const OFFSET: f64 = 0.3;

/// Size of a delay of which nothing is known, s.
const DELAY: f64 = 0.01;

/// No delay is estimated further than this from the assumed one, s.
const MOST_DELAY: f64 = 0.5;

/// Whose readings they are, by index in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorOf {
    /// Of an input.
    Input(usize),
    /// Of an output.
    Output(usize),
}

/// A figure of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorFigure {
    /// By how many times readings are too large.
    Gain,
    /// What they have too much.
    Offset,
    /// By how much they are late.
    Delay,
}

impl SensorFigure {
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
pub struct SensorUnknown {
    /// Whose readings.
    pub of: SensorOf,
    /// Which figure.
    pub figure: SensorFigure,
    /// What is known of it.
    pub guess: PriorGuess,
    /// Its size: of a gain itself, else how far it may be off.
    pub size: f64,
}

impl SensorUnknown {
    /// How far from the assumed value it is searched, where that is not left to the method.
    pub fn bounds(&self) -> Option<(f64, f64)> {
        let believed = self.guess.value;
        (self.figure == SensorFigure::Delay).then_some((believed - MOST_DELAY, believed + MOST_DELAY))
    }
}

/// What is to be estimated of the sensors of these recordings, each figure once, as the first recording has it. Offsets of
/// outputs are not among it: they are estimated in each recording.
pub fn sought<'a>(runs: impl IntoIterator<Item = &'a IdentificationRun>) -> Vec<SensorUnknown> {
    let mut all: Vec<SensorUnknown> = Vec::new();
    let mut add = |of: SensorOf, figure: SensorFigure, guess: Option<PriorGuess>, wide: f64| {
        let Some(guess) = guess.filter(|_| !all.iter().any(|s| (s.of, s.figure) == (of, figure))) else {
            return;
        };
        let size = match figure {
            SensorFigure::Gain => guess.value.abs(),
            SensorFigure::Offset | SensorFigure::Delay => guess.doubt.unwrap_or(wide).max(f64::MIN_POSITIVE),
        };
        all.push(SensorUnknown { of, figure, guess, size });
    };
    for run in runs {
        for d in &run.drives {
            let (of, largest) = (SensorOf::Input(d.input), d.u.iter().fold(0.0, |m: f64, v| m.max(v.abs())));
            add(of, SensorFigure::Offset, d.offset, OFFSET * largest);
            add(of, SensorFigure::Gain, d.gain, 0.0);
            add(of, SensorFigure::Delay, d.late, DELAY);
        }
        for c in &run.channels {
            add(SensorOf::Output(c.output), SensorFigure::Gain, c.gain, 0.0);
            add(SensorOf::Output(c.output), SensorFigure::Delay, c.late, DELAY);
        }
    }
    all
}
