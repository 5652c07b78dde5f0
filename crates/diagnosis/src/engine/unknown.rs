//! What is unknown of a model and its recordings, and its prior.

use trueup_identification::unknown::Scale;

/// Standard deviation of a parameter that the user declares as known.
pub const KNOWN: f64 = 0.01;

/// Standard deviation of one that is wrong by a hypothesis, of its logarithm.
pub const WRONG: f64 = 0.5;

/// What an unknown sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BalanceTarget {
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
    ActuatorDeadTime(usize),
    /// Time constant of a first-order lag of this input, s.
    ActuatorLag(usize),
    /// By how many seconds the readings of this output are late, whatever the declared delay is.
    TotalSensorDelay(usize),
    /// The same of an input.
    InputSensorDelay(usize),
}

impl BalanceTarget {
    /// It is of a sensor: its readings are gain x value + offset.
    pub fn is_of_sensor(self) -> bool {
        matches!(self, Self::Offset(_) | Self::Gain(_) | Self::InputOffset(_) | Self::InputGain(_))
    }
    /// It is a gain, an offset or a delay that the case has estimated.
    pub fn is_of_case_sensor(self) -> bool {
        self.is_of_sensor() || matches!(self, Self::TotalSensorDelay(_) | Self::InputSensorDelay(_))
    }
    /// It changes when things happen.
    pub fn shifts(self) -> bool {
        match self {
            Self::SensorDelay(_) | Self::ActuatorDeadTime(_) | Self::ActuatorLag(_) => true,
            Self::TotalSensorDelay(_) | Self::InputSensorDelay(_) => true,
            Self::Parameter(_) | Self::Above { .. } | Self::Offset(_) | Self::Gain(_) => false,
            Self::InputOffset(_) | Self::InputGain(_) => false,
        }
    }
}

/// One unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct BalanceUnknown {
    /// FMU variable, or a description.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// What it sets.
    pub target: BalanceTarget,
    /// In this recording only; `None`: in all.
    pub run: Option<usize>,
    /// Value to start from.
    pub start: f64,
    /// How it is searched.
    pub scale: Scale,
    /// Smallest value.
    pub lower: f64,
    /// Largest value.
    pub upper: f64,
    /// Its prior, as a coordinate of `scale`.
    pub prior: Option<UnknownPrior>,
}

/// The prior of an unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnknownPrior {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, above 0.
    pub deviation: f64,
    /// It may be far beyond that deviation: the prior has a heavy tail.
    heavy: bool,
}

/// Of a heavy tail: near the mean it is a normal distribution of the deviation given, far from it a density that falls with the
/// fourth power.
const TAIL: f64 = 4.0;

impl UnknownPrior {
    /// A normal distribution.
    pub const fn normal(mean: f64, deviation: f64) -> Self {
        Self { mean, deviation, heavy: false }
    }
    /// Student's t of that scale (EST-9).
    pub const fn heavy(mean: f64, deviation: f64) -> Self {
        Self { mean, deviation, heavy: true }
    }
    /// With a standard deviation smaller by this factor.
    pub fn tightening(self, times: f64) -> Self {
        Self { deviation: self.deviation / times, ..self }
    }
    /// The residual at a coordinate, whose square is -2 log density up to a constant, and how it changes with the coordinate.
    /// Heavy: TAIL log(1 + r^2 / TAIL) instead of r^2 (Student's t), r in deviations (EST-9).
    pub fn residual(&self, theta: f64) -> (f64, f64) {
        let r = (theta - self.mean) / self.deviation;
        if !self.heavy || r.abs() < 1e-6 {
            return (r, 1.0 / self.deviation);
        }
        let residual = (TAIL * (r * r / TAIL).ln_1p()).sqrt().copysign(r);
        (residual, r / (residual * (1.0 + r * r / TAIL)) / self.deviation)
    }
}

impl BalanceUnknown {
    /// Its name without the joint or element.
    pub fn stem(&self) -> &str {
        self.name.split('[').next().unwrap_or(&self.name)
    }
    /// The coordinate of its start.
    pub fn coordinate(&self) -> f64 {
        self.scale.coordinate(self.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// EST-9
    #[test]
    fn a_heavy_tail_is_normal_near_its_mean_and_a_power_far_from_it() {
        let (normal, heavy) = (UnknownPrior::normal(0.5, 2.0), UnknownPrior::heavy(0.5, 2.0));
        assert_eq!(normal.residual(6.5), (3.0, 0.5));
        for theta in [-60.0, -1.5, 0.4, 0.5, 0.5 + 1e-7, 0.6, 3.0, 60.0] {
            let at = |t: f64| heavy.residual(t).0;
            let r: f64 = (theta - 0.5) / 2.0;
            assert!((at(theta).powi(2) - 4.0 * (1.0 + r * r / 4.0).ln()).abs() < 1e-12);
            let slope = heavy.residual(theta).1;
            let by_difference = (at(theta + 1e-4) - at(theta - 1e-4)) / 2e-4;
            assert!((slope - by_difference).abs() < 1e-7, "{theta}: {slope}, {by_difference}");
        }
    }
}
