//! What is to be estimated of sensors: their gains, offsets and delays.

use trueup_signals::Guess;

use crate::run::Run;

/// Share of the largest reading that an offset may be of which nothing is known.
pub const OFFSET: f64 = 0.3;

/// Size of a delay of which nothing is known, s.
const DELAY: f64 = 0.01;

/// No delay is estimated further than this from the assumed one, s.
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
    /// How far from the assumed value it is searched, where that is not left to the method.
    pub fn bounds(&self) -> Option<(f64, f64)> {
        let believed = self.guess.value;
        (self.figure == Figure::Delay).then_some((believed - MOST_DELAY, believed + MOST_DELAY))
    }
}

/// What is to be estimated of the sensors of these recordings, each figure once, as the first recording has it. Offsets of
/// outputs are not among it: they are estimated in each recording.
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
