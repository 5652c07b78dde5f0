//! A joint of any plant for the engine, such as an FMU with its ports.
//!
//! ```text
//! z = (q_m, v_m, n q_l, n v_l),   z' = A z + B_u u + B_f f + c + s c_s      s: sign of dry friction
//! ```
//!
//! A joint is linear but for dry friction, so evaluations of its rates give these matrices, and differences their derivatives with
//! respect to parameters. What is not linear is refused.

mod matrices;

use std::cell::RefCell;
use std::sync::Arc;

use trueup_plant::Plant;
use trueup_signals::Case;

use super::known_effects::KNOWN;
use super::plant::{
    BelievedParameter, ElasticElement, FilterCoordinateKind, FirstState, ForcedCoordinate, ForcedPlant,
    InputForce, JointFigures, StateReading, StepMeans, first_state, hold,
};
use matrices::{ACCELERATIONS, JointMatrices, JointRates, STATES};
pub use matrices::{ForeignJointError, JointRoles};

/// Half the relative width of a difference by a parameter.
const WIDTH: f64 = 1e-4;
/// Share of what acts below which a derivative is rounding.
const ROUNDED: f64 = 1e-6;
/// Usual torque of a joint without dry friction, in root mean squares of the drive torque.
const USUAL: f64 = 0.3;
/// Relative standard deviation of what the plant has and none of its parameters is.
const FIXED: f64 = 1e-4;
/// Halvings of the interval of a torque that breaks away, and of one that is compared with another.
const HALVINGS: [usize; 2] = [50, 20];
/// Relative change of a parameter that may be the torque that breaks away.
const BROKEN: f64 = 0.05;
/// Matrices that are kept, by parameters.
const CACHED: usize = 16;

/// Name of the torque that breaks away among those of the two-mass joint.
pub const BREAKAWAY: &str = "staticFriction";

/// A joint of any plant, with priors.
#[derive(Clone, Debug)]
pub struct ForeignJoint {
    rates: JointRates,
    /// All parameters of the plant.
    nominal: Vec<f64>,
    /// Index of each parameter of the engine among them; none of what the plant does not have as a parameter.
    indices: Vec<Option<usize>>,
    parameters: Vec<BelievedParameter>,
    coordinates: Vec<ForcedCoordinate>,
    readings: Vec<StateReading>,
    inputs: Vec<InputForce>,
    elements: Vec<ElasticElement>,
    usual: f64,
    gear_ratio: f64,
    refused: Vec<String>,
    counterparts: Vec<(&'static str, usize, f64)>,
    first: JointFigures,
    cache: RefCell<Vec<CachedMatrices>>,
}

/// Matrices at some parameters, and their derivatives by relative changes.
#[derive(Clone, Debug)]
struct CachedMatrices {
    theta: Vec<f64>,
    own: JointMatrices,
    by_parameter: Option<Vec<JointMatrices>>,
}

impl ForeignJoint {
    /// A plant whose coordinates are the motor and the link of one joint. `nominal`: all its parameters; `speed`: usual one of the motor,
    /// rad/s; `drive`: root mean square of the input that drives; `refused`: effects that cannot act in it, as
    /// [`ForcedPlant::refuses`] has them.
    ///
    /// # Errors
    /// See [`ForeignJointError`].
    pub fn new(
        plant: &Arc<dyn Plant>,
        roles: &JointRoles,
        case: &Case,
        nominal: Vec<f64>,
        [speed, drive]: [f64; 2],
        refused: Vec<String>,
    ) -> Result<Self, ForeignJointError> {
        let rates = JointRates::new(plant.clone(), roles.clone(), [speed, drive])?;
        let own = rates.matrices(&nominal)?;
        let rigid = rates.rigid;
        let per_force = ACCELERATIONS.map(|row| own.force(row, row / 2));
        let level = -own.dry(ACCELERATIONS[0]) / per_force[0];
        let gain = own.input(ACCELERATIONS[0], 0) / per_force[0];
        let usual = if level > ROUNDED * (gain * drive).abs() { level } else { USUAL * gain.abs() * drive };
        for (row, per_force) in ACCELERATIONS.iter().zip(per_force) {
            let constant = own.constant(*row) / per_force;
            let other = if *row == ACCELERATIONS[0] { 0.0 } else { own.dry(*row) / per_force };
            let worst = if constant.abs() > other.abs() { constant } else { other };
            if !rigid && worst.abs() > ROUNDED * usual || rigid && constant.abs() > ROUNDED * usual {
                return Err(ForeignJointError::Torque(format!("{worst:.3e}")));
            }
        }
        let starts = plant.coordinates().iter().flat_map(|c| [c.initial_position, c.initial_rate]);
        let left_out: Vec<usize> = starts.chain(roles.ratio).collect();
        let mut indices = Vec::new();
        let mut parameters = Vec::new();
        let mut slopes = Vec::new();
        for (k, q) in plant.table().parameters.iter().enumerate() {
            if left_out.contains(&k) || nominal[k] == 0.0 || !q.items.is_empty() {
                continue;
            }
            let Ok(slope) = slope(&rates, &nominal, k) else { continue };
            if !matters(&slope, &own) {
                continue;
            }
            let doubt = case.doubt(&q.name);
            parameters.push(BelievedParameter {
                name: text(&q.name),
                unit: q.unit,
                value: nominal[k],
                deviation: doubt.unwrap_or(0.0).max(KNOWN),
                declared: doubt.is_some(),
            });
            indices.push(Some(k));
            slopes.push(slope);
        }
        // The parameter that a figure is proportional to.
        let of = |figure: &dyn Fn(&JointMatrices) -> f64, value: f64| {
            let moves = |s: &JointMatrices| {
                let mut moved = own;
                moved.0.iter_mut().zip(s.0).for_each(|(m, s)| *m += WIDTH * s);
                (figure(&moved) - value) / (WIDTH * value)
            };
            slopes.iter().position(|s| (moves(s) - 1.0).abs() < 1e-3)
        };
        let per_unit = |input: usize| {
            move |m: &JointMatrices| {
                let row = ACCELERATIONS[input];
                m.input(row, input) / m.force(row, input)
            }
        };
        let gained = of(&per_unit(0), gain);
        let mut inputs = vec![InputForce {
            name: "motorCurrent",
            gain: gained,
            factor: gained.map_or(gain, |k| gain / parameters[k].value),
            coordinate: 0,
        }];
        let external = per_unit(1)(&own);
        inputs.push(InputForce { name: "externalTorque", gain: None, factor: external, coordinate: 1 });
        let dry = (level > ROUNDED * usual).then(|| {
            let figure = |m: &JointMatrices| -m.dry(ACCELERATIONS[0]) / m.force(ACCELERATIONS[0], 0);
            let own = of(&figure, level).filter(|k| (parameters[*k].value / level - 1.0).abs() < ROUNDED);
            own.unwrap_or_else(|| {
                parameters.push(BelievedParameter {
                    name: "dry friction",
                    unit: "N.m",
                    value: level,
                    deviation: FIXED,
                    declared: true,
                });
                indices.push(None);
                parameters.len() - 1
            })
        });
        let sticks = rates.breakaway(&nominal, HALVINGS[0]) * gain.abs();
        let breakaway = if level > 0.0 && sticks > level { sticks / level } else { 1.0 };
        // Within the last digits of the search it is the level itself.
        let breakaway = if breakaway - 1.0 < 1e-9 { 1.0 } else { breakaway };
        let coordinate = |name, kind, first: usize, dry: Option<usize>| ForcedCoordinate {
            name,
            kind,
            position: first,
            velocity: first + 1,
            dry,
            breakaway: if first == 0 { breakaway } else { 1.0 },
            holds: if first == 0 && dry.is_none() { sticks } else { 0.0 },
        };
        let gear_ratio = rates.gear_ratio(&nominal);
        let read = |(name, state, factor): (&'static str, usize, f64)| StateReading {
            name,
            state,
            factor,
            angle: state % 2 == 0,
            coordinate: state / 2,
            element: None,
        };
        let channels = [
            ("motorAngle", 0, 1.0),
            ("motorVelocity", 1, 1.0),
            ("loadAngle", 2, gear_ratio),
            ("loadVelocity", 3, gear_ratio),
        ];
        let row = |k: usize| (0..STATES).map(|i| f64::from(i == k) - f64::from(i == k + 2)).collect();
        // Stiffness and damping by [`ForcedPlant::elastic`], not by parameters.
        let spring = ElasticElement {
            weights: vec![-1.0, 1.0],
            deflection: row(0),
            rate: row(1),
            stiffness: usize::MAX,
            damping: usize::MAX,
        };
        let mut made = Self {
            rates,
            nominal,
            indices,
            coordinates: vec![
                coordinate("actuator", FilterCoordinateKind::Motor, 0, dry),
                coordinate("load", FilterCoordinateKind::Link, 2, None),
            ],
            readings: channels.map(read).to_vec(),
            inputs,
            elements: if rigid { Vec::new() } else { vec![spring] },
            usual,
            gear_ratio,
            refused,
            counterparts: Vec::new(),
            first: JointFigures::default(),
            cache: RefCell::default(),
            parameters,
        };
        let theta: Vec<f64> = made.parameters.iter().map(|p| p.value).collect();
        made.first = made.figures(&theta);
        made.counterparts = made.find_counterparts(&theta);
        Ok(made)
    }

    /// The parameter of the plant that is this one of a two-mass joint, and the value of the latter per unit of the former.
    pub fn counterpart(&self, name: &str) -> Option<(usize, f64)> {
        self.counterparts.iter().find(|c| c.0 == name).map(|c| (c.1, c.2))
    }
    /// Name of a parameter of the plant.
    pub fn name_of(&self, parameter: usize) -> &str {
        self.rates.name_of(parameter)
    }
    /// All parameters of the plant with these of the engine.
    pub fn values(&self, theta: &[f64]) -> Vec<f64> {
        let mut p = self.nominal.clone();
        for (k, value) in self.indices.iter().zip(theta) {
            k.iter().for_each(|k| p[*k] = *value);
        }
        p
    }

    /// The parameter that is the torque at which it breaks away, where it moves nothing else.
    fn breakaway_parameter(&self, theta: &[f64]) -> Vec<(&'static str, usize, f64)> {
        let gain = self.figures(theta).torque_constant.abs();
        let sticks = |p: &[f64]| self.rates.breakaway(p, HALVINGS[1]) * gain;
        let own = sticks(&self.nominal);
        let is = |k: &usize| {
            let mut moved = self.nominal.clone();
            moved[*k] *= 1.0 + BROKEN;
            let (own_value, is_of_engine) = (self.nominal[*k], self.indices.contains(&Some(*k)));
            own_value > 0.0 && !is_of_engine && (sticks(&moved) / own - 1.0 - BROKEN).abs() < 0.1 * BROKEN
        };
        let found = (0..self.nominal.len()).filter(|_| own > 0.0).find(is);
        found.map(|k| (BREAKAWAY, k, own / self.nominal[k])).into_iter().collect()
    }

    /// Parameters that figures of the joint are proportional to.
    fn find_counterparts(&self, theta: &[f64]) -> Vec<(&'static str, usize, f64)> {
        let level = |theta: &[f64]| {
            let m = self.at(theta, false).own;
            -m.dry(ACCELERATIONS[0]) / m.force(ACCELERATIONS[0], 0)
        };
        let figures = |theta: &[f64]| {
            let f = self.figures(theta);
            [
                ("motorInertia", f.motor_inertia),
                ("loadInertia", f.load_inertia),
                ("stiffness", f.stiffness),
                ("damping", f.damping),
                ("viscousFriction", f.viscous),
                ("torqueConstant", f.torque_constant),
                ("coulombFriction", level(theta)),
            ]
        };
        let own = figures(theta);
        let mut found = self.breakaway_parameter(theta);
        for (k, index) in self.indices.iter().enumerate() {
            let Some(index) = index else { continue };
            let mut moved = theta.to_vec();
            moved[k] *= 1.0 + WIDTH;
            for ((name, value), (_, after)) in own.iter().zip(figures(&moved)) {
                if *value != 0.0 && ((after / value - 1.0) / WIDTH - 1.0).abs() < 1e-3 {
                    found.push((*name, *index, value / theta[k]));
                }
            }
        }
        found
    }

    fn at(&self, theta: &[f64], slopes: bool) -> CachedMatrices {
        let theta = &theta[..self.parameters.len()];
        let mut cache = self.cache.borrow_mut();
        if let Some(k) = cache.iter().position(|c| c.theta == theta) {
            if slopes && cache[k].by_parameter.is_none() {
                cache[k].by_parameter = Some(self.slopes(theta));
            }
            return cache[k].clone();
        }
        // What the plant refuses leaves the nominal one, and a fit that goes there gains nothing.
        let own = self.rates.matrices(&self.values(theta));
        let own = own.or_else(|_| self.rates.matrices(&self.nominal)).unwrap_or(JointMatrices::NONE);
        let made =
            CachedMatrices { theta: theta.to_vec(), own, by_parameter: slopes.then(|| self.slopes(theta)) };
        if cache.len() >= CACHED {
            cache.remove(0);
        }
        cache.push(made.clone());
        made
    }

    fn slopes(&self, theta: &[f64]) -> Vec<JointMatrices> {
        let p = self.values(theta);
        let of = |k: &Option<usize>| match k {
            Some(k) => slope(&self.rates, &p, *k).unwrap_or(JointMatrices::NONE),
            None => {
                // The level of dry friction itself.
                let mut only = JointMatrices::NONE;
                if let Ok(own) = self.rates.matrices(&p) {
                    let first = only.0.len() - STATES;
                    only.0[first..].copy_from_slice(&own.0[first..]);
                }
                only
            }
        };
        self.indices.iter().map(of).collect()
    }
}

/// Derivative by a relative change of a parameter of the plant.
fn slope(rates: &JointRates, p: &[f64], k: usize) -> Result<JointMatrices, ForeignJointError> {
    let moved = |by: f64| {
        let mut p = p.to_vec();
        p[k] *= 1.0 + by;
        rates.matrices(&p)
    };
    Ok(moved(WIDTH)?.less(&moved(-WIDTH)?, 0.5 / WIDTH))
}

/// A parameter moves the joint.
fn matters(slope: &JointMatrices, own: &JointMatrices) -> bool {
    slope.0.iter().zip(own.0).any(|(s, o)| s.abs() > ROUNDED * o.abs() && s.abs() > 1e-9 * o.abs().max(1e-9))
}

/// A name for as long as the program: a few words for each FMU.
fn text(name: &str) -> &'static str {
    Box::leak(name.to_owned().into_boxed_str())
}

impl ForcedPlant for ForeignJoint {
    fn states(&self) -> usize {
        STATES
    }
    fn coordinates(&self) -> &[ForcedCoordinate] {
        &self.coordinates
    }
    fn readings(&self) -> &[StateReading] {
        &self.readings
    }
    fn parameters(&self) -> &[BelievedParameter] {
        &self.parameters
    }
    fn input_forces(&self) -> &[InputForce] {
        &self.inputs
    }
    fn elements(&self) -> &[ElasticElement] {
        &self.elements
    }
    fn refuses(&self, id: &str, place: &str) -> bool {
        self.refused.iter().any(|r| r == id || r.split_once(':') == Some((id, place)))
    }
    fn figures(&self, theta: &[f64]) -> JointFigures {
        let m = self.at(theta, false).own;
        let [motor, load] = ACCELERATIONS.map(|row| 1.0 / m.force(row, row / 2));
        let rigid = self.elements.is_empty();
        JointFigures {
            motor_inertia: motor,
            load_inertia: if rigid { 0.0 } else { load * self.gear_ratio.powi(2) },
            stiffness: if rigid { 0.0 } else { load * m.state(3, 0) },
            damping: if rigid { 0.0 } else { load * m.state(3, 1) },
            viscous: -motor * (m.state(1, 1) + m.state(1, 3)),
            torque_constant: motor * m.input(1, 0),
            gear_ratio: self.gear_ratio,
        }
    }
    fn elastic(&self, theta: &[f64], _: &ElasticElement) -> [f64; 2] {
        let f = self.figures(theta);
        [f.stiffness, f.damping]
    }
    fn usual_force(&self) -> f64 {
        self.usual
    }
    fn usual_deflection(&self) -> f64 {
        if self.first.stiffness > 0.0 { self.usual / self.first.stiffness } else { 0.0 }
    }
    fn held_with(&self, coordinate: usize, other: usize) -> bool {
        coordinate == other || self.elements.is_empty()
    }
    fn white_shares(&self, theta: &[f64], shares: &mut [f64]) {
        let f = self.figures(theta);
        let load = f.load_inertia / self.gear_ratio.powi(2);
        shares[0] = 1.0;
        shares[1] = 0.5 * (load / f.motor_inertia).min(1.0);
    }
    fn rates(&self, theta: &[f64], state: &[f64], force: &[f64], rates: &mut [f64]) {
        let m = self.at(theta, false).own;
        (0..STATES).for_each(|row| {
            let constant = m.constant(row);
            rates[row] = m.rate(row, state, &[], force, 0.0) - constant;
        });
    }
    fn tangent(&self, theta: &[f64], stuck: &[bool], by_state: &mut [f64], by_force: &mut [f64]) {
        let m = self.at(theta, false).own;
        by_state.copy_from_slice(m.by_state());
        by_force.copy_from_slice(m.by_force());
        hold(&self.coordinates, stuck, by_state, by_force);
    }
    fn sensitivities(&self, theta: &[f64], at: &StepMeans<'_>, forces: &mut [f64]) {
        let found = self.at(theta, true);
        let rigid = self.elements.is_empty();
        let own = &found.own;
        for (k, slope) in found.by_parameter.iter().flatten().enumerate() {
            let rate = |row: usize| slope.rate(row, at.state, at.input, at.own, at.sign[0]);
            let [motor, load] = ACCELERATIONS.map(rate);
            forces[2 * k] = motor / own.force(1, 0);
            forces[2 * k + 1] = if rigid { 0.0 } else { load / own.force(3, 1) };
        }
    }
    fn begin(&self, seen: &[Option<FirstState>], state: &mut [f64], variance: &mut [f64]) {
        let rigid = self.elements.is_empty();
        first_state(&self.coordinates, (rigid, self.usual_deflection()), seen, state, variance);
    }
}
