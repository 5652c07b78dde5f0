//! Parameters that are refitted with every hypothesis, with their priors.

use trueup_models::plants;
use trueup_plant::{PlantQuantity, QuantityRole};
use trueup_signals::Case;

use super::plant::{TrajectoryError, TrajectoryPlant, TrajectoryPoint};
use crate::innovations::known_effects::is_refitted;

/// Least relative standard deviation of a parameter that is assumed known.
const KNOWN: f64 = 0.01;
/// An element below this share of the largest of its array is not refitted unless it has a prior standard deviation.
const SMALL: f64 = 0.1;
/// Farthest relative change of a parameter that may have either sign, down and up.
const FARTHEST: [f64; 2] = [0.6, 2.6];
/// Farthest change of a parameter with an absolute standard deviation, in those.
const DEVIATIONS: f64 = 5.0;
/// Largest step of a logarithm.
const TRUST: f64 = 0.7;

/// A parameter that is refitted.
#[derive(Clone, Debug, PartialEq)]
pub struct UnknownParameter {
    /// Index among all parameters of the model.
    pub index: usize,
    /// The nominal value.
    pub nominal: f64,
    /// Unit of the unknown: the size of the nominal value, 1 where the standard deviation is absolute.
    pub unit: f64,
    /// Standard deviation in that unit; of a logarithm its own.
    pub deviation: f64,
    /// The unknown is the logarithm: the value stays positive.
    pub logarithm: bool,
    absolute: bool,
    /// The least value of the parameter.
    least: f64,
}

impl UnknownParameter {
    /// Parameters that say how a plant moves: those of a model's dynamics that are not 0, and sizes of known effects, whose change is worth
    /// a force there.
    ///
    /// # Errors
    /// [`TrajectoryError::Singular`].
    pub fn all(case: &Case, plant: &TrajectoryPlant, theta: &[f64]) -> Result<Vec<Self>, TrajectoryError> {
        let table = &plant.plant().table().parameters;
        let array = |q: &PlantQuantity| q.name.split('[').next().unwrap_or("").to_owned();
        let mut found = Vec::new();
        let effects = plants::effects(plant.plant());
        for (index, q) in table.iter().enumerate() {
            let (nominal, doubt, least) = (theta[index], case.doubt(&q.name), q.min);
            let of_effect = is_refitted(effects, index, nominal, doubt);
            if q.role != QuantityRole::Dynamics && !of_effect {
                continue;
            }
            if q.absolute_deviation {
                let deviation = doubt.unwrap_or(0.0);
                if deviation > 0.0 {
                    let (unit, logarithm) = (1.0, false);
                    found.push(Self { index, nominal, unit, deviation, logarithm, absolute: true, least });
                }
                continue;
            }
            let of_array = table.iter().zip(theta).filter(|(o, _)| array(o) == array(q));
            let largest = of_array.fold(0.0, |m: f64, (_, v)| m.max(v.abs()));
            let small = q.min < 0.0 && nominal.abs() < SMALL * largest && doubt.is_none_or(|d| d <= KNOWN);
            if nominal == 0.0 || small {
                continue;
            }
            let deviation = doubt.unwrap_or(0.0).max(KNOWN);
            let (unit, logarithm) = (nominal.abs(), q.min >= 0.0 && nominal > 0.0);
            found.push(Self { index, nominal, unit, deviation, logarithm, absolute: false, least });
        }
        // A stiffness of a joint that has no spring is worth no force anywhere.
        let n = plant.coordinates();
        let state: Vec<f64> = (0..2 * n).map(|k| 0.1 + 0.07 * k as f64).collect();
        let torque = vec![1.0; plant.drives.len()];
        let changes: Vec<(usize, f64)> = found.iter().map(|u| (u.index, u.unit)).collect();
        // A standard deviation off: where a payload has no mass yet, its centre is worth no force.
        let mut theta = theta.to_vec();
        found.iter().filter(|u| u.absolute).for_each(|u| theta[u.index] += u.deviation);
        let at = TrajectoryPoint { theta: &theta, state: &state, torque: &torque, time: 0.0 };
        let inverse = plant.inverse_mass(&theta, &state)?;
        let forces = plant.sensitivity(at, &vec![1.0; n], &changes, &inverse);
        let mut worth = forces.chunks(n).map(|f| f.iter().any(|x| *x != 0.0));
        found.retain(|_| worth.next().unwrap_or(false));
        Ok(found)
    }

    /// Size of the unknown's unit at the parameters in hand.
    pub fn unit_at(&self, theta: &[f64]) -> f64 {
        if self.logarithm { theta[self.index] } else { self.unit }
    }
    /// Prior mean of the unknown at the parameters in hand.
    pub fn mean_at(&self, theta: &[f64]) -> f64 {
        let value = theta[self.index];
        if self.logarithm { (self.nominal / value).ln() } else { (self.nominal - value) / self.unit }
    }
    /// Value after a step of the unknown.
    pub fn moved(&self, theta: &[f64], step: f64) -> f64 {
        let value = theta[self.index];
        if self.logarithm { value * step.clamp(-9.0, 9.0).exp() } else { value + self.unit * step }
    }
    /// Value after a step as far as it is trusted.
    pub fn moved_within(&self, theta: &[f64], step: f64) -> f64 {
        if self.logarithm {
            return self.moved(theta, step.clamp(-TRUST, TRUST));
        }
        let [down, up] =
            if self.absolute { [DEVIATIONS * self.deviation; 2] } else { FARTHEST.map(|x| x * self.unit) };
        self.moved(theta, step).clamp((self.nominal - down).max(self.least), self.nominal + up)
    }
}
