//! A model as the engine evaluates it along a trajectory: its accelerations, the forces that a motion takes, its outputs.

use std::borrow::Cow;
use std::sync::Arc;

use trueup_models::effect::EffectChoice;
use trueup_models::plants;
use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{CoordinateKind, InverseMass, LANES, Lanes, Plant, PlantError};

use crate::innovations::intake::UnfitRecording;

/// Least cosine between the effects of an input and of a force that are the same.
const PARALLEL: f64 = 0.999;
/// Difference of a force from 1 that is rounding.
const ROUNDED: f64 = 1e-6;

/// A plant or its recordings, along which no trajectory can be had.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TrajectoryError {
    /// A coordinate without a state that is its position.
    #[error(
        "{model}: no state is the position of {coordinate}; describe the model by coordinates whose rates are their velocities"
    )]
    Position {
        /// Which model.
        model: String,
        /// Which coordinate.
        coordinate: String,
    },
    /// Nothing that its inputs drive.
    #[error("{model}: {input} moves no coordinate; it cannot drive the model")]
    Drive {
        /// Which model.
        model: String,
        /// Which input.
        input: String,
    },
    /// Coordinates that no forces move apart from each other.
    #[error("{0}")]
    Singular(String),
    /// One of the recordings.
    #[error(transparent)]
    Recording(#[from] UnfitRecording),
    /// Nothing holds the trajectory.
    #[error(
        "{case}: no reading of the model was recorded in all of train; record the angles of joints or motors in each of them"
    )]
    NoReading {
        /// Which case.
        case: String,
    },
}

/// The point at which a model is evaluated.
#[derive(Clone, Copy, Debug)]
pub struct TrajectoryPoint<'a> {
    /// All parameters, in the order of the model's table.
    pub theta: &'a [f64],
    /// Coordinates, then their rates.
    pub state: &'a [f64],
    /// Driving inputs, in the order of [`trueup_plant::VariableTable::driving`], behind them those of [`TrajectoryPlant::others`]; what is
    /// missing is 0.
    pub torque: &'a [f64],
    /// Time since the begin of the recording, s: known effects may depend on it.
    pub time: f64,
}

/// A model along trajectories. Its coordinates are those of [`Plant::coordinates`], in that order.
#[derive(Clone, Debug)]
pub struct TrajectoryPlant {
    plant: Arc<dyn Plant>,
    modes: Vec<i32>,
    /// States that no coordinate has: those of a base that is fixed, and of known effects whose states do not matter.
    fixed: Vec<f64>,
    /// State of each coordinate, then of each rate.
    places: Vec<usize>,
    /// Coordinate that each driving input acts on.
    pub drives: Vec<usize>,
    /// Coordinate of the joint that each driving input moves, behind a spring or directly.
    pub joints: Vec<usize>,
    /// Force on that coordinate by each driving input: 1 of a torque.
    pub drive_gains: Vec<f64>,
    /// Other inputs that were recorded, by index in the table.
    pub others: Vec<usize>,
}

impl TrajectoryPlant {
    /// A model whose fixed states are those that these parameters declare.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn new(plant: Arc<dyn Plant>, theta: &[f64]) -> Result<Self, TrajectoryError> {
        let sizes = plant.sizes();
        let coordinates = plant.coordinates();
        let mut places = Vec::new();
        for c in coordinates {
            places.push(c.position.ok_or_else(|| TrajectoryError::Position {
                model: plant.model().to_owned(),
                coordinate: c.name.clone(),
            })?);
        }
        places.extend(coordinates.iter().map(|c| c.rate));
        let (mut fixed, mut modes) = (vec![0.0; sizes.states], vec![0; sizes.modes]);
        plant.start(theta, &mut fixed);
        let u = vec![0.0; sizes.inputs];
        plant
            .start_modes(At { t: 0.0, x: &fixed, u: &u, p: theta, modes: &vec![0; sizes.modes] }, &mut modes);
        let mut made = Self {
            plant,
            modes,
            fixed,
            places,
            drives: Vec::new(),
            joints: Vec::new(),
            drive_gains: Vec::new(),
            others: Vec::new(),
        };
        made.find_drives(theta)?;
        Ok(made)
    }

    /// The model.
    pub fn plant(&self) -> &dyn Plant {
        &*self.plant
    }
    /// Whether it can have this effect, wherever that acts.
    pub fn can_have(&self, id: &str) -> bool {
        EffectChoice::all(plants::effect_plant(&*self.plant)).any(|c| c.spec().id == id)
    }
    /// Axes of its tip's place: 2 in a plane, 3 in space.
    pub fn tip_axes(&self) -> usize {
        if self.tip_output(2).is_some() { 3 } else { 2 }
    }
    /// The output that shows its tip's place along an axis, from 0; of a robot with several tips that of the first.
    pub fn tip_output(&self, axis: usize) -> Option<usize> {
        let table = self.plant.table();
        let name = |index: String| table.output(&format!("tipPosition[{index}]"));
        name((axis + 1).to_string()).or_else(|| name(format!("1,{}", axis + 1)))
    }
    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.places.len() / 2
    }
    /// Whether the joint of a driving input has a spring between motor and link.
    pub fn flexible(&self, input: usize) -> bool {
        self.drives[input] != self.joints[input]
    }
    /// Whether a body floats that nothing drives.
    pub fn floats(&self) -> bool {
        self.plant.coordinates().iter().any(|c| c.kind == CoordinateKind::Base)
    }
    /// Coordinates and rates of the initial state that parameters declare.
    pub fn first(&self) -> Vec<f64> {
        self.places.iter().map(|k| self.fixed[*k]).collect()
    }

    /// Each driving input acts on the coordinate whose force has the same effect.
    fn find_drives(&mut self, theta: &[f64]) -> Result<(), TrajectoryError> {
        let (n, inputs) = (self.coordinates(), self.plant.table().driving.len());
        let first = self.first();
        let rest = vec![0.0; inputs];
        let none = vec![0.0; n];
        let base =
            self.accelerations(TrajectoryPoint { theta, state: &first, torque: &rest, time: 0.0 }, &none);
        let effect = |after: Vec<f64>| -> Vec<f64> { after.iter().zip(&base).map(|(a, b)| a - b).collect() };
        let of_force =
            |k: usize| {
                let force: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i == k))).collect();
                effect(self.accelerations(
                    TrajectoryPoint { theta, state: &first, torque: &rest, time: 0.0 },
                    &force,
                ))
            };
        let forces: Vec<Vec<f64>> = (0..n).map(of_force).collect();
        let (mut drives, mut gains) = (Vec::new(), Vec::new());
        for j in 0..inputs {
            let torque: Vec<f64> = (0..inputs).map(|i| f64::from(u8::from(i == j))).collect();
            let own =
                effect(self.accelerations(
                    TrajectoryPoint { theta, state: &first, torque: &torque, time: 0.0 },
                    &none,
                ));
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            let cosine = |f: &Vec<f64>| dot(f, &own) / (dot(f, f) * dot(&own, &own)).sqrt();
            let best = (0..n).max_by(|a, b| cosine(&forces[*a]).total_cmp(&cosine(&forces[*b])));
            let best = best.filter(|k| cosine(&forces[*k]) > PARALLEL);
            let best = best.ok_or_else(|| TrajectoryError::Drive {
                model: self.plant.model().to_owned(),
                input: self.plant.table().inputs[self.plant.table().driving[j]].name.clone(),
            })?;
            let gain = dot(&forces[best], &own) / dot(&forces[best], &forces[best]);
            // A torque is the force, whatever rounding makes of it.
            gains.push(if (gain - 1.0).abs() < ROUNDED { 1.0 } else { gain });
            drives.push(best);
        }
        let coordinates = self.plant.coordinates();
        self.joints = drives.iter().map(|k| coordinates[*k].follows.map_or(*k, |f| f.coordinate)).collect();
        (self.drives, self.drive_gains) = (drives, gains);
        Ok(())
    }

    fn states(&self, state: &[f64]) -> Vec<f64> {
        let mut x = self.fixed.clone();
        self.places.iter().zip(state).for_each(|(k, v)| x[*k] = *v);
        x
    }
    fn inputs(&self, torque: &[f64]) -> Vec<f64> {
        let table = self.plant.table();
        let mut u = vec![0.0; table.inputs.len()];
        table.driving.iter().chain(&self.others).zip(torque).for_each(|(k, v)| u[*k] = *v);
        u
    }
    /// Modes of known effects there; dry friction slides the way that its motor turns.
    fn modes_at(&self, at: At<'_, f64>) -> Cow<'_, [i32]> {
        if self.modes.is_empty() {
            return Cow::Borrowed(&self.modes);
        }
        let mut modes = self.modes.clone();
        self.plant.start_modes(At { modes: &self.modes, ..at }, &mut modes);
        for c in self.plant.coordinates() {
            c.friction_mode.into_iter().for_each(|k| modes[k] = if at.x[c.rate] < 0.0 { -1 } else { 1 });
        }
        Cow::Owned(modes)
    }
    fn ask<R>(&self, at: TrajectoryPoint<'_>, ask: impl FnOnce(At<'_, f64>) -> R) -> R {
        let (x, u) = (self.states(at.state), self.inputs(at.torque));
        let at = At { t: at.time, x: &x, u: &u, p: at.theta, modes: &[] };
        ask(At { modes: &self.modes_at(at), ..at })
    }

    /// Accelerations of the coordinates under these forces on them.
    pub fn accelerations(&self, at: TrajectoryPoint<'_>, force: &[f64]) -> Vec<f64> {
        let mut dx = vec![0.0; self.fixed.len()];
        self.ask(at, |at| self.plant.rates(at, force, &mut dx));
        self.places[self.coordinates()..].iter().map(|k| dx[*k]).collect()
    }

    /// Tangent of the accelerations: by coordinates and rates (n x 2n), and by forces: the inverse of the mass matrix.
    ///
    /// # Errors
    /// [`TrajectoryError::Singular`].
    pub fn tangent(
        &self,
        at: TrajectoryPoint<'_>,
        force: &[f64],
    ) -> Result<(Vec<f64>, InverseMass), TrajectoryError> {
        let found = self.ask(at, |at| InverseMass::with_tangent(&*self.plant, at, force, &self.places));
        found.map(|(inverse, by_state)| (by_state, inverse)).map_err(singular)
    }

    /// Forces that have the effect of a change of each parameter by so many of its units, at the model's own accelerations: rows of
    /// coordinates. `inverse`: of the mass matrix there.
    pub fn sensitivity(
        &self,
        at: TrajectoryPoint<'_>,
        force: &[f64],
        changes: &[(usize, f64)],
        inverse: &InverseMass,
    ) -> Vec<f64> {
        self.ask(at, |at| inverse.force_of_changes(&*self.plant, at, force, changes))
    }

    /// Inverse of the mass matrix by the model's answer to forces.
    ///
    /// # Errors
    /// [`TrajectoryError::Singular`].
    pub fn inverse_mass(&self, theta: &[f64], state: &[f64]) -> Result<InverseMass, TrajectoryError> {
        let torque = vec![0.0; self.drives.len()];
        let at = TrajectoryPoint { theta, state, torque: &torque, time: 0.0 };
        self.ask(at, |at| InverseMass::of(&*self.plant, at)).map_err(singular)
    }

    /// M a + h: forces on the coordinates that accelerations take, no input acting.
    ///
    /// # Errors
    /// [`TrajectoryError::Singular`].
    pub fn needed(&self, theta: &[f64], state: &[f64], a: &[f64]) -> Result<Vec<f64>, TrajectoryError> {
        Ok(self.needed_by(theta, state, a, &self.inverse_mass(theta, state)?))
    }
    /// The same with the inverse of the mass matrix there.
    pub fn needed_by(&self, theta: &[f64], state: &[f64], a: &[f64], inverse: &InverseMass) -> Vec<f64> {
        let rest = vec![0.0; self.drives.len()];
        let none = vec![0.0; self.coordinates()];
        let own = self.accelerations(TrajectoryPoint { theta, state, torque: &rest, time: 0.0 }, &none);
        let mut force: Vec<f64> = a.iter().zip(own).map(|(a, b)| a - b).collect();
        inverse.forces_for(&mut force);
        force
    }

    /// Value of an output.
    pub fn output(&self, at: TrajectoryPoint<'_>, output: usize) -> f64 {
        let mut y = vec![0.0; self.plant.sizes().outputs];
        self.ask(at, |at| self.plant.outputs(at, &mut y));
        y[output]
    }

    /// Outputs of these indices, and their gradients by coordinates and rates (2n each).
    pub fn outputs(&self, at: TrajectoryPoint<'_>, outputs: &[usize]) -> (Vec<f64>, Vec<f64>) {
        self.outputs_by(at, outputs, &self.places)
    }
    /// Derivatives of these outputs with respect to a coordinate.
    pub fn outputs_along(&self, at: TrajectoryPoint<'_>, outputs: &[usize], coordinate: usize) -> Vec<f64> {
        self.outputs_by(at, outputs, &self.places[coordinate..=coordinate]).1
    }

    fn outputs_by(
        &self,
        at: TrajectoryPoint<'_>,
        outputs: &[usize],
        states: &[usize],
    ) -> (Vec<f64>, Vec<f64>) {
        let lanes = |v: &[f64]| -> Vec<Lanes> { v.iter().map(|v| Dual::constant(*v)).collect() };
        let (time, theta) = (at.time, at.theta);
        let (x, u) = (self.states(at.state), self.inputs(at.torque));
        let modes = self.modes_at(At { t: time, x: &x, u: &u, p: theta, modes: &[] });
        let (u, p) = (lanes(&u), lanes(theta));
        let width = states.len();
        let (mut values, mut gradient) = (vec![0.0; outputs.len()], vec![0.0; outputs.len() * width]);
        let mut y = vec![Lanes::default(); self.plant.sizes().outputs];
        for first in (0..width).step_by(LANES) {
            let mut x = lanes(&x);
            let some = &states[first..(first + LANES).min(width)];
            some.iter().enumerate().for_each(|(lane, k)| x[*k].eps[lane] = 1.0);
            let at = At { t: Dual::constant(time), x: &x, u: &u, p: &p, modes: &modes };
            self.plant.outputs_lanes(at, &mut y);
            for (i, k) in outputs.iter().enumerate() {
                values[i] = y[*k].re;
                gradient[width * i + first..][..some.len()].copy_from_slice(&y[*k].eps[..some.len()]);
            }
        }
        (values, gradient)
    }
}

fn singular(e: PlantError) -> TrajectoryError {
    TrajectoryError::Singular(e.0)
}
