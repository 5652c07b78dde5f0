//! What is unknown of a joint, and a joint with values for it.

use trueup_models::compiled::Compiled;
use trueup_models::joint::{TwoMassJoint, output};

use crate::evidence::Prior;
use crate::intake::Lateness;

/// What an unknown sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// This parameter of the model.
    Parameter(usize),
    /// By how much parameter `at` exceeds parameter `base`.
    Above {
        /// Which parameter.
        at: usize,
        /// The one that it is compared with.
        base: usize,
    },
    /// A constant error of the readings of this output.
    Offset(usize),
    /// By how many times the readings of this output are too large.
    Gain(usize),
    /// A constant error of the readings of this input.
    InputOffset(usize),
    /// By how many times the readings of this input are too large.
    InputGain(usize),
    /// By how many seconds the readings of this output are late.
    SensorDelay(usize),
    /// By how many seconds this input acts late.
    InputDelay(usize),
    /// Time constant of a first-order lag of this input, s.
    InputLag(usize),
    /// By how many seconds the readings of this output are late, whatever they are believed to be.
    Delay(usize),
    /// The same of an input.
    InputReadingDelay(usize),
}

impl Target {
    /// It is of a sensor: its readings are gain x value + offset.
    pub fn is_of_sensor(self) -> bool {
        matches!(self, Self::Offset(_) | Self::Gain(_) | Self::InputOffset(_) | Self::InputGain(_))
    }
    /// It changes when things happen.
    pub fn shifts(self) -> bool {
        match self {
            Self::SensorDelay(_) | Self::InputDelay(_) | Self::InputLag(_) => true,
            Self::Delay(_) | Self::InputReadingDelay(_) => true,
            Self::Parameter(_) | Self::Above { .. } | Self::Offset(_) | Self::Gain(_) => false,
            Self::InputOffset(_) | Self::InputGain(_) => false,
        }
    }
}

/// The coordinate in which an unknown is searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// Coordinate ln(value): the value stays positive.
    Log,
    /// Coordinate value / this.
    Linear(f64),
}

impl Scale {
    /// The coordinate of a value.
    pub fn coordinate(self, value: f64) -> f64 {
        match self {
            Self::Log => value.max(f64::MIN_POSITIVE).ln(),
            Self::Linear(s) => value / s,
        }
    }
    /// The value at a coordinate, and its derivative by it.
    pub fn value(self, coordinate: f64) -> (f64, f64) {
        match self {
            Self::Log => (coordinate.exp(), coordinate.exp()),
            Self::Linear(s) => (coordinate * s, s),
        }
    }
}

/// One unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// FMU variable.
    pub name: String,
    /// What it sets.
    pub target: Target,
    /// How it is searched.
    pub scale: Scale,
    /// Coordinate of the smallest value.
    pub lower: f64,
    /// Coordinate of the largest value.
    pub upper: f64,
    /// Of its coordinate.
    pub prior: Prior,
}

/// A joint with what is unknown of it.
#[derive(Clone, Debug)]
pub struct ParametricJoint {
    /// With its effects.
    pub joint: Compiled<TwoMassJoint>,
    /// Its parameters where they are not unknown.
    pub p: Vec<f64>,
    /// Parameters that follow another: `(which, whom)`.
    pub ties: Vec<(usize, usize)>,
    /// What is unknown.
    pub unknowns: Vec<Unknown>,
}

/// Values for all that is unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Assigned {
    /// The model's parameters.
    pub p: Vec<f64>,
    /// How late signals are.
    pub late: Lateness,
    /// Constant errors of readings, by output.
    pub offsets: [f64; output::COUNT],
}

impl ParametricJoint {
    /// Coordinates where the priors are.
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|u| u.prior.mean.clamp(u.lower, u.upper)).collect()
    }
    /// The one assignment of coordinates to a model.
    pub fn assign(&self, theta: &[f64]) -> Assigned {
        let mut p = self.p.clone();
        let (mut late, mut offsets) = (Lateness::default(), [0.0; output::COUNT]);
        let mut above = Vec::new();
        for (u, coordinate) in self.unknowns.iter().zip(theta) {
            let value = u.scale.value(*coordinate).0;
            match u.target {
                Target::Parameter(i) => p[i] = value,
                Target::Above { at, base } => above.push((at, base, value)),
                Target::Offset(output) => offsets[output] = value,
                Target::SensorDelay(output) => late.outputs[output] = value,
                Target::InputDelay(input) => late.inputs[input] = value,
                Target::InputLag(input) => late.lags[input] = value,
                // The filter is given none.
                Target::Gain(_) | Target::InputOffset(_) | Target::InputGain(_) => {}
                Target::Delay(_) | Target::InputReadingDelay(_) => {}
            }
        }
        self.ties.iter().for_each(|&(which, whom)| p[which] = p[whom]);
        above.into_iter().for_each(|(at, base, v)| p[at] = p[base] + v);
        Assigned { p, late, offsets }
    }
}
