//! What is known of a rig up to a number: gain and offset of an input, known effects. The numbers are refitted with the plant's parameters and
//! follow these in `theta`; each is 1 where the rig is as was assumed.
//!
//! ```text
//! u = n_g u' - (n_o - 1) U                    u' = (reading - offset) / gain, as assumed
//! gain / n_g,  offset + (n_o - 1) U gain / n_g    are reported
//! ```

use trueup_signals::{Channel, Loaded, PriorGuess};

use super::known_effects::{KNOWN, UNIT};
use super::plant::ForcedPlant;

/// Relative standard deviation of a gain where the case gives none, as balances have it.
const GAIN: f64 = 0.5;

/// What a number of a rig is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RigNumber {
    /// The inverse of the gain of an input, by index among the plant's input forces.
    InputGain(usize),
    /// Offset of an input.
    InputOffset(usize),
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
}

/// All numbers of a rig.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RigTerms {
    /// In the order in which they follow the plant's parameters.
    pub terms: Vec<RigTerm>,
}

/// Root mean square of all samples of a channel of the recordings for fitting.
pub fn root_mean_square(loaded: &Loaded, channel: &str) -> f64 {
    let all = || loaded.train().into_iter().filter_map(|r| r.channel(channel)).flat_map(Channel::believed);
    (all().map(|v| v * v).sum::<f64>() / all().count().max(1) as f64).sqrt()
}

impl RigTerms {
    /// Of a case.
    pub fn new(loaded: &Loaded, plant: &dyn ForcedPlant) -> Self {
        let mut rig = Self::default();
        let train = loaded.train();
        for (k, force) in plant.input_forces().iter().enumerate() {
            let recorded = || train.iter().filter_map(|r| r.channel(force.name));
            let guess = |of: fn(&Channel) -> Option<PriorGuess>| recorded().find_map(of);
            if let Some(g) = guess(|c| c.sensor.gain) {
                rig.terms.push(RigTerm {
                    name: format!("{}.gain", force.name),
                    of: RigNumber::InputGain(k),
                    assumed: g.value,
                    unit: 0.0,
                    deviation: g.doubt.unwrap_or(GAIN).max(KNOWN),
                });
            }
            if let Some(o) = guess(|c| c.sensor.offset) {
                // Of an offset of which nothing is known the size of the input itself.
                let gain = recorded().next().map_or(1.0, |c| c.sensor.believed_gain());
                let usual = || root_mean_square(loaded, force.name);
                rig.terms.push(RigTerm {
                    name: format!("{}.offset", force.name),
                    of: RigNumber::InputOffset(k),
                    assumed: o.value,
                    unit: UNIT * o.doubt.map_or_else(usual, |d| d / gain.abs()),
                    deviation: 1.0 / UNIT,
                });
            }
        }
        let effects = plant.known_effects().map_or(&[][..], |e| &e.numbers);
        rig.terms.extend(effects.iter().enumerate().map(|(k, n)| RigTerm {
            name: n.name.clone(),
            of: RigNumber::Effect(k),
            assumed: n.assumed,
            unit: n.unit,
            deviation: n.deviation,
        }));
        rig
    }

    fn number(&self, numbers: &[f64], of: RigNumber) -> (f64, f64) {
        let at = self.terms.iter().position(|t| t.of == of);
        at.map_or((1.0, 0.0), |k| (numbers[k], self.terms[k].unit))
    }
    /// Factor of an input as assumed, and what is taken from it.
    pub fn of_input(&self, numbers: &[f64], input: usize) -> [f64; 2] {
        let (gain, _) = self.number(numbers, RigNumber::InputGain(input));
        let (offset, unit) = self.number(numbers, RigNumber::InputOffset(input));
        [gain, (offset - 1.0) * unit]
    }

    /// Names and values as they are reported.
    pub fn reported(&self, numbers: &[f64]) -> Vec<(String, f64)> {
        let value = |(t, n): (&RigTerm, &f64)| {
            let value = match t.of {
                RigNumber::InputGain(_) => t.assumed / n,
                RigNumber::InputOffset(k) => {
                    let gain = RigNumber::InputGain(k);
                    let assumed = self.terms.iter().find(|t| t.of == gain).map_or(1.0, |t| t.assumed);
                    t.assumed + (n - 1.0) * t.unit * assumed / self.number(numbers, gain).0
                }
                RigNumber::Effect(_) if t.unit == 0.0 => t.assumed * n,
                RigNumber::Effect(_) => t.assumed + (n - 1.0) * t.unit,
            };
            (t.name.clone(), value)
        };
        self.terms.iter().zip(numbers).map(value).collect()
    }
}
