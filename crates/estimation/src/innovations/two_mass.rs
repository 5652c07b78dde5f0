//! The two-mass joint for the engine: motor, spring, load; all angles on the motor's side (psi = gear ratio times load angle).
//!
//! ```text
//! J_m v_m'   = -K tw - D tv - D_m v_m + f_m          tw = q_m - psi, tv = v_m - v_psi
//! J_2 v_psi' =  K tw + D tv           + f_l          J_2 = J_l / n^2
//! tip:  J_2 ((1 - m) v_psi' - m r) = K tw + D tv + f_l,   u'' = -v_psi' - r,   r = w^2 u + 2 zeta w u'
//! ```
//!
//! States: q_m, v_m, psi, v_psi and, with a tip on the load, its deflection u and u'. Rigid (no spring): one body of inertia
//! J_m + J_2, psi moves with q_m.

use trueup_models::joint::parameter as joint;
use trueup_models::presets;
use trueup_numerics::{Dual, Scalar};
use trueup_signals::Case;

use super::known_effects::KnownEffects;
use super::plant::{
    BelievedParameter, ElasticElement, FilterCoordinateKind, FirstState, ForcedCoordinate, ForcedPlant,
    GearTrain, InputForce, JointFigures, StateReading, StepMeans, first_state, hold,
};

/// Indices of the parameters.
pub mod parameter {
    #![allow(missing_docs)]
    pub const LOAD_INERTIA: usize = 0;
    pub const STIFFNESS: usize = 1;
    pub const DAMPING: usize = 2;
    pub const COULOMB_FRICTION: usize = 3;
    pub const VISCOUS_FRICTION: usize = 4;
    pub const TORQUE_CONSTANT: usize = 5;
    pub const MOTOR_INERTIA: usize = 6;
    pub const COUNT: usize = 7;
}
use parameter as p;

/// Indices of the coordinates.
pub mod coordinate {
    #![allow(missing_docs)]
    pub const MOTOR: usize = 0;
    pub const LOAD: usize = 1;
}
use coordinate::{LOAD, MOTOR};

/// Least relative standard deviation of a parameter that is assumed known.
const KNOWN: f64 = 0.01;
/// Usual torque of a joint without dry friction, in root mean squares of the drive torque.
const USUAL: f64 = 0.3;

/// Inputs before those of known effects.
const OWN_INPUTS: usize = 2;

/// A share of the load's inertia on a spring of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadTip {
    /// Share of J_2.
    pub share: f64,
    /// Frequency with the rest of the load held, Hz.
    pub frequency: f64,
    /// Damping ratio.
    pub damping: f64,
}

/// The joint with its priors.
#[derive(Clone, Debug)]
pub struct TwoMassPlant {
    /// Without a spring.
    pub rigid: bool,
    /// Turns of the motor per turn of the load.
    pub gear_ratio: f64,
    /// States of its own for a tip on the load.
    pub tip: Option<LoadTip>,
    /// Relative standard deviation of the gear ratio; `None`: it is known.
    ratio_deviation: Option<f64>,
    /// Static friction over Coulomb friction, 1 at least.
    breakaway: f64,
    /// Static friction without Coulomb friction, N.m.
    holds: f64,
    /// A recording has dry friction of its own.
    dry_somewhere: bool,
    known: Option<KnownEffects>,
    parameters: Vec<BelievedParameter>,
    coordinates: Vec<ForcedCoordinate>,
    readings: Vec<StateReading>,
    inputs: Vec<InputForce>,
    elements: Vec<ElasticElement>,
    usual: f64,
}

const SOURCES: [usize; p::COUNT] = [
    joint::LOAD_INERTIA,
    joint::STIFFNESS,
    joint::DAMPING,
    joint::COULOMB_FRICTION,
    joint::VISCOUS_FRICTION,
    joint::TORQUE_CONSTANT,
    joint::MOTOR_INERTIA,
];

impl TwoMassPlant {
    /// Of a case; what it does not say of a parameter is that of the preset. `rms`: root mean square of the recorded
    /// current, A, which sizes a joint without dry friction.
    pub fn of(case: &Case, rms: f64) -> Self {
        let preset = presets::delian(1).map_or_else(Vec::new, |p| p.to_vec());
        let value = |k: usize| {
            let name = joint::NAMES[k].0;
            case.number(name).or_else(|| preset.get(k).copied()).unwrap_or(0.0)
        };
        let rigid = case.elements("jointFlexible").first().and_then(|v| v.boolean()) == Some(false);
        let mut parameters: Vec<BelievedParameter> = (SOURCES.iter())
            .map(|k| {
                let (name, unit) = joint::NAMES[*k];
                let doubt = case.doubt(name);
                let deviation = doubt.unwrap_or(0.0).max(KNOWN);
                BelievedParameter { name, unit, value: value(*k), deviation, declared: doubt.is_some() }
            })
            .collect();
        if rigid {
            parameters[p::STIFFNESS].value = 0.0;
            parameters[p::DAMPING].value = 0.0;
        }
        let friction = parameters[p::COULOMB_FRICTION].value;
        let usual =
            if friction > 0.0 { friction } else { USUAL * parameters[p::TORQUE_CONSTANT].value * rms };
        let n = value(joint::GEAR_RATIO);
        let sticks = case.number("staticFriction").unwrap_or(friction);
        let mut plant = Self {
            rigid,
            gear_ratio: n,
            tip: None,
            ratio_deviation: case.doubt("gearRatio"),
            breakaway: if sticks > friction && friction > 0.0 { sticks / friction } else { 1.0 },
            holds: if friction > 0.0 { 0.0 } else { sticks },
            dry_somewhere: false,
            known: None,
            parameters,
            coordinates: Vec::new(),
            readings: Vec::new(),
            inputs: vec![
                InputForce {
                    name: "motorCurrent",
                    gain: Some(p::TORQUE_CONSTANT),
                    factor: 1.0,
                    coordinate: MOTOR,
                },
                InputForce { name: "externalTorque", gain: None, factor: 1.0 / n, coordinate: LOAD },
            ],
            elements: Vec::new(),
            usual,
        };
        plant.readings = [
            ("motorAngle", 0, 1.0, true, MOTOR),
            ("motorVelocity", 1, 1.0, false, MOTOR),
            ("loadAngle", 2, n, true, LOAD),
            ("loadVelocity", 3, n, false, LOAD),
        ]
        .map(|(name, state, factor, angle, coordinate)| StateReading {
            name,
            state,
            factor,
            angle,
            coordinate,
            element: None,
        })
        .to_vec();
        plant.arrange();
        plant
    }

    /// A parameter without which there is no such joint.
    pub fn missing(&self) -> Option<&'static str> {
        let needed = [p::LOAD_INERTIA, p::MOTOR_INERTIA, p::TORQUE_CONSTANT];
        let needed = needed.iter().chain((!self.rigid).then_some(&p::STIFFNESS));
        let none = |x: f64| x.is_nan() || x <= 0.0;
        let missing =
            needed.copied().find(|k| none(self.parameters[*k].value)).map(|k| self.parameters[k].name);
        missing.or(none(self.gear_ratio).then_some("gearRatio"))
    }

    /// The same with other beliefs: values and relative standard deviations, in the order of the parameters.
    pub fn believed(&self, values: &[f64], deviations: &[f64]) -> Self {
        let mut plant = self.clone();
        for ((own, value), deviation) in plant.parameters.iter_mut().zip(values).zip(deviations) {
            (own.value, own.deviation) = (*value, *deviation);
        }
        plant.rigid &= values[p::STIFFNESS] <= 0.0;
        plant.arrange();
        plant
    }

    /// The same with effects that the case declares, and their inputs.
    pub fn with_known(self, known: Option<KnownEffects>) -> Self {
        let own = known.iter().flat_map(KnownEffects::inputs);
        let own = own.map(|(name, _)| InputForce { name, gain: None, factor: 0.0, coordinate: MOTOR });
        let inputs = self.inputs.iter().cloned().chain(own).collect();
        Self { known, inputs, ..self }
    }
    /// The same with the torque of its spring among its readings.
    pub fn with_torque_reading(self) -> Self {
        let mut plant = self;
        if !plant.elements.is_empty() {
            let (name, state, factor, angle) = ("transmissionTorque", 0, 1.0, false);
            plant.readings.push(StateReading {
                name,
                state,
                factor,
                angle,
                coordinate: MOTOR,
                element: Some(0),
            });
        }
        plant
    }
    /// The same with dry friction in some recordings.
    pub fn with_dry_recordings(self) -> Self {
        let mut plant = Self { dry_somewhere: true, ..self };
        plant.arrange();
        plant
    }
    /// The same, driven by torques of this root mean square, N.m, which size a joint without dry friction.
    pub fn driven_by(self, torque: f64) -> Self {
        let usual =
            if self.parameters[p::COULOMB_FRICTION].value > 0.0 { self.usual } else { USUAL * torque };
        Self { usual, ..self }
    }
    /// The same with a tip on the load.
    pub fn with_tip(&self, tip: LoadTip) -> Self {
        let mut plant = Self { tip: Some(tip), ..self.clone() };
        plant.arrange();
        plant
    }

    /// Coordinates and elements, as the structure has them.
    fn arrange(&mut self) {
        let row = |k: usize| {
            let mut row = vec![0.0; self.states()];
            (row[k], row[k + 2]) = (1.0, -1.0);
            row
        };
        let spring = ElasticElement {
            weights: vec![-1.0, 1.0],
            deflection: row(0),
            rate: row(1),
            stiffness: p::STIFFNESS,
            damping: p::DAMPING,
        };
        self.elements = if self.rigid { Vec::new() } else { vec![spring] };
        let dry = self.dry_somewhere || self.parameters[p::COULOMB_FRICTION].value > 0.0;
        let dry = dry.then_some(p::COULOMB_FRICTION);
        let motor = ForcedCoordinate {
            name: "actuator",
            kind: FilterCoordinateKind::Motor,
            position: 0,
            velocity: 1,
            dry,
            breakaway: self.breakaway,
            holds: self.holds,
        };
        let load = ForcedCoordinate {
            name: "load",
            kind: FilterCoordinateKind::Link,
            position: 2,
            velocity: 3,
            dry: None,
            breakaway: 1.0,
            holds: 0.0,
        };
        self.coordinates = vec![motor, load];
    }

    /// J_2, kg.m2 on the motor's side.
    fn load_inertia<S: Scalar>(&self, theta: &[S]) -> S {
        theta[p::LOAD_INERTIA] / (self.gear_ratio * self.gear_ratio)
    }

    /// Rates of the states, generic over the scalar.
    fn rates_of<S: Scalar>(&self, theta: &[S], x: &[S], force: &[S], rates: &mut [S]) {
        let j2 = self.load_inertia(theta);
        rates[0] = x[1];
        rates[2] = x[3];
        if self.rigid {
            let inertia = theta[p::MOTOR_INERTIA] + j2;
            rates[1] = (-theta[p::VISCOUS_FRICTION] * x[1] + force[MOTOR] + force[LOAD]) / inertia;
            rates[3] = rates[1];
            return;
        }
        let torque = theta[p::STIFFNESS] * (x[0] - x[2]) + theta[p::DAMPING] * (x[1] - x[3]);
        rates[1] = (-torque - theta[p::VISCOUS_FRICTION] * x[1] + force[MOTOR]) / theta[p::MOTOR_INERTIA];
        rates[3] = (torque + force[LOAD]) / j2;
        if let Some(tip) = self.tip {
            let w = 2.0 * core::f64::consts::PI * tip.frequency;
            let r = x[4] * (w * w) + x[5] * (2.0 * tip.damping * w);
            rates[3] = (rates[3] + r * tip.share) / (1.0 - tip.share);
            rates[4] = x[5];
            rates[5] = -rates[3] - r;
        }
    }

    /// Forces that are needed beyond the known ones for these accelerations (those of J_2 alone where there is a tip).
    fn inverse_dynamics<S: Scalar>(&self, theta: &[S], at: &StepMeans<'_>, acceleration: [f64; 2]) -> [S; 2] {
        let (x, own) = (at.state, at.own);
        let drive = theta[p::TORQUE_CONSTANT] * at.input[0]
            - theta[p::COULOMB_FRICTION] * at.sign[MOTOR]
            - theta[p::VISCOUS_FRICTION] * x[1];
        let external = at.input[1] * self.inputs[1].factor + own[LOAD];
        let j2 = self.load_inertia(theta);
        if self.rigid {
            let needed = (theta[p::MOTOR_INERTIA] + j2) * acceleration[MOTOR];
            return [needed - drive - own[MOTOR] - external, S::default()];
        }
        let torque = theta[p::STIFFNESS] * (x[0] - x[2]) + theta[p::DAMPING] * (x[1] - x[3]);
        let motor = theta[p::MOTOR_INERTIA] * acceleration[MOTOR] + torque - drive - own[MOTOR];
        [motor, j2 * acceleration[LOAD] - torque - external]
    }
}

impl ForcedPlant for TwoMassPlant {
    fn states(&self) -> usize {
        if self.tip.is_some() { 6 } else { 4 }
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
    fn required_input(&self) -> usize {
        let servo = self.known.as_ref().and_then(|k| k.inputs().position(|i| i.1));
        servo.map_or(0, |k| OWN_INPUTS + k)
    }
    fn gear(&self) -> Option<GearTrain> {
        Some(GearTrain {
            name: "gearRatio",
            ratio: self.gear_ratio,
            deviation: self.ratio_deviation,
            coordinate: LOAD,
            inertia: p::LOAD_INERTIA,
        })
    }
    fn elements(&self) -> &[ElasticElement] {
        &self.elements
    }
    fn known_effects(&self) -> Option<&KnownEffects> {
        self.known.as_ref()
    }
    fn model_parameters(&self, theta: &[f64]) -> Vec<(usize, f64)> {
        SOURCES.iter().copied().zip(theta.iter().copied()).collect()
    }
    fn figures(&self, theta: &[f64]) -> JointFigures {
        JointFigures {
            motor_inertia: theta[p::MOTOR_INERTIA],
            load_inertia: theta[p::LOAD_INERTIA],
            stiffness: theta[p::STIFFNESS],
            damping: theta[p::DAMPING],
            viscous: theta[p::VISCOUS_FRICTION],
            torque_constant: theta[p::TORQUE_CONSTANT],
            gear_ratio: self.gear_ratio,
        }
    }
    fn usual_force(&self) -> f64 {
        self.usual
    }
    fn usual_deflection(&self) -> f64 {
        let stiffness = self.parameters[p::STIFFNESS].value;
        if stiffness > 0.0 { self.usual / stiffness } else { 0.0 }
    }
    fn held_with(&self, coordinate: usize, other: usize) -> bool {
        coordinate == other || self.rigid
    }
    fn white_shares(&self, theta: &[f64], shares: &mut [f64]) {
        shares[MOTOR] = 1.0;
        shares[LOAD] = 0.5 * (self.load_inertia(theta) / theta[p::MOTOR_INERTIA]).min(1.0);
    }
    fn rates(&self, theta: &[f64], state: &[f64], force: &[f64], rates: &mut [f64]) {
        self.rates_of(theta, state, force, rates);
    }
    fn tangent(&self, theta: &[f64], stuck: &[bool], by_state: &mut [f64], by_force: &mut [f64]) {
        const DIRECTIONS: usize = 8;
        let n = self.states();
        let constant = |v: &f64| Dual::<DIRECTIONS>::new(*v, [0.0; DIRECTIONS]);
        let theta: Vec<_> = theta.iter().map(constant).collect();
        let x: Vec<_> = (0..n).map(|i| Dual::variable(0.0, i)).collect();
        let force = [Dual::variable(0.0, n), Dual::variable(0.0, n + 1)];
        let mut rates = [Dual::<DIRECTIONS>::default(); 6];
        self.rates_of(&theta, &x, &force, &mut rates[..n]);
        for (i, rate) in rates[..n].iter().enumerate() {
            by_state[n * i..n * (i + 1)].copy_from_slice(&rate.eps[..n]);
            by_force[2 * i..2 * (i + 1)].copy_from_slice(&rate.eps[n..n + 2]);
        }
        hold(&self.coordinates, stuck, by_state, by_force);
    }
    fn sensitivities(&self, theta: &[f64], at: &StepMeans<'_>, forces: &mut [f64]) {
        let needed = self.inverse_dynamics(theta, at, [0.0; 2]);
        let inertia = self.load_inertia(theta);
        let own = if self.rigid {
            [-needed[MOTOR] / (theta[p::MOTOR_INERTIA] + inertia); 2]
        } else {
            [-needed[MOTOR] / theta[p::MOTOR_INERTIA], -needed[LOAD] / inertia]
        };
        // Directions are relative changes.
        let relative = |k: usize| {
            let mut dual = Dual::<{ p::COUNT }>::variable(theta[k], k);
            dual.eps[k] = theta[k];
            dual
        };
        let dual: [Dual<{ p::COUNT }>; p::COUNT] = core::array::from_fn(relative);
        let needed = self.inverse_dynamics(&dual, at, own);
        for k in 0..p::COUNT {
            (0..2).for_each(|c| forces[2 * k + c] = -needed[c].eps[k]);
        }
    }
    fn begin(&self, seen: &[Option<FirstState>], state: &mut [f64], variance: &mut [f64]) {
        let n = self.states();
        let usual = (self.rigid, self.usual_deflection());
        let usual_speed = first_state(&self.coordinates, usual, seen, state, variance);
        if let Some(tip) = self.tip {
            let w = 2.0 * core::f64::consts::PI * tip.frequency;
            variance[4 * n + 4] = (0.1 * usual_speed / w).powi(2);
            variance[5 * n + 5] = (0.1 * usual_speed).powi(2);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All values scaled together change no trajectory, where nothing else acts: forces of its own act on the inertias alone.
    #[test]
    fn sensitivities_sum_to_zero() {
        let case = Case::default();
        let mut seed = 0x9e37_79b9_u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for rigid in [false, true] {
            let mut plant = TwoMassPlant::of(&case, 1.0);
            plant.rigid = rigid;
            for _ in 0..50 {
                let theta: Vec<f64> = plant.parameters.iter().map(|p| p.value * (1.0 + draw())).collect();
                let (state, own): ([f64; 4], [f64; 2]) =
                    (core::array::from_fn(|_| 10.0 * draw()), core::array::from_fn(|_| draw()));
                let at = StepMeans { state: &state, input: &[draw(), 0.0], sign: &[1.0, 0.0], own: &own };
                let (mut sum, mut size) = ([0.0; 2], 0.0);
                let mut forces = [0.0; 2 * p::COUNT];
                plant.sensitivities(&theta, &at, &mut forces);
                for force in forces.chunks(2) {
                    (0..2).for_each(|c| sum[c] += force[c]);
                    size += force[0].abs().max(force[1].abs());
                }
                let felt = if rigid { [own[0] + own[1], 0.0] } else { own };
                let rest = [sum[0] + felt[0], sum[1] + felt[1]];
                assert!(rest.iter().all(|s| s.abs() < 1e-12 * size), "{rest:?} of {size}");
            }
        }
    }
}
