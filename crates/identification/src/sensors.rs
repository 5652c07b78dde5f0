//! What sensors make of what is there: reading = gain x value + offset.

use trueup_numerics::Scalar;

/// A sensor of an input or an output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearSensor<T> {
    /// By how many times a reading is too large.
    pub gain: T,
    /// What it has too much.
    pub offset: T,
}

impl<T: Scalar> LinearSensor<T> {
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

/// Input gains and biases: u = gain * measured + bias. Empty: as measured.
#[derive(Clone, Debug, Default)]
pub struct InputMap<T> {
    /// Per input.
    pub gain: Vec<T>,
    /// Per input.
    pub bias: Vec<T>,
}

/// Sensors of all inputs and outputs of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorSet<T> {
    /// By input.
    pub inputs: Vec<LinearSensor<T>>,
    /// By output.
    pub outputs: Vec<LinearSensor<T>>,
}

impl<T: Scalar> SensorSet<T> {
    /// All of them read what is there.
    pub fn none(inputs: usize, outputs: usize) -> Self {
        Self { inputs: vec![LinearSensor::none(); inputs], outputs: vec![LinearSensor::none(); outputs] }
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
        let all = |own: &[LinearSensor<T>], others: &[LinearSensor<T>]| {
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
        let (truth, believed) =
            (LinearSensor { gain: 2.5, offset: -0.3 }, LinearSensor { gain: 2.0, offset: 0.1 });
        for value in [-1.0, 0.0, 7.5] {
            let corrected = (truth.reads(value) - believed.offset) / believed.gain;
            assert!((truth.beside(&believed).reads(value) - corrected).abs() < 1e-14);
        }
        assert_eq!(truth.beside(&LinearSensor::none()), truth);
    }
}
