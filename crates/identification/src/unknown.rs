//! What is estimated: each unknown with its scale, bounds and prior.

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

/// What an unknown sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FitTarget {
    /// This parameter of the model (initial states are parameters too).
    Parameter(usize),
    /// A constant reading offset of the channel that shows this output; the readings are less its start.
    Offset(usize),
    /// By how many times the readings of this output are too large; the readings are over its start.
    Gain(usize),
    /// By how many times the readings of this input are too large; the readings are over its start.
    InputGain(usize),
    /// A constant added to this input.
    InputBias(usize),
    /// A constant that the readings of this input have too much; the readings are less its start.
    InputOffset(usize),
    /// By how many seconds the readings of this output are late.
    SensorDelay(usize),
    /// By how many seconds the readings of this input are late.
    InputSensorDelay(usize),
}

impl FitTarget {
    /// It changes when things are read, not what.
    pub fn shifts(self) -> bool {
        matches!(self, Self::SensorDelay(_) | Self::InputSensorDelay(_))
    }
}

/// One unknown.
#[derive(Clone, Debug)]
pub struct FitUnknown {
    /// FMU variable, for messages and results.
    pub name: String,
    /// What it sets.
    pub target: FitTarget,
    /// In this recording only (by index); `None`: in all.
    pub run: Option<usize>,
    /// Value to start from.
    pub start: f64,
    /// How it is searched.
    pub scale: Scale,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// Prior value and standard deviation, both as theta of [`FitUnknown::scale`].
    pub prior: Option<(f64, f64)>,
}

impl FitUnknown {
    /// Shared by all recordings, positive, searched by its logarithm between 1e-4 and 1e4 of its start.
    pub fn positive(name: &str, parameter: usize, start: f64) -> Self {
        Self {
            name: name.to_owned(),
            target: FitTarget::Parameter(parameter),
            run: None,
            start,
            scale: Scale::Log,
            lower: start * 1e-4,
            upper: start * 1e4,
            prior: None,
        }
    }
    /// Without bounds, of that typical magnitude, starting from 0.
    pub fn free(name: &str, target: FitTarget, run: Option<usize>, magnitude: f64) -> Self {
        Self {
            name: name.to_owned(),
            target,
            run,
            start: 0.0,
            scale: Scale::Linear(magnitude),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            prior: None,
        }
    }
    /// With a prior of relative standard deviation `doubt` about its start (of that share of the magnitude, if linear).
    pub fn believed(mut self, doubt: f64) -> Self {
        let mean = self.scale.coordinate(self.start);
        let doubt = match self.scale {
            Scale::Log => doubt,
            Scale::Linear(s) => doubt * (self.start / s).abs().max(f64::MIN_POSITIVE),
        };
        self.prior = Some((mean, doubt));
        self
    }
}
