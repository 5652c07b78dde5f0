//! What follows from a plant's equations by dual numbers: its tangent, and forces that have the effect of a parameter.
//!
//! With a the rates of the coordinates' velocities, x the states, f the forces on the coordinates and p the parameters,
//!
//! ```text
//! dx/dt = F x + B f         F = d rates/d states, B = d rates/d forces
//! B_v f = p_k da/dp_k       the force that has the effect of a relative change of p_k; B_v: rows of a
//! ```
//!
//! B_v is the inverse of the mass matrix in these coordinates, so f = -d(M a - Q)/d(ln p_k) at the model's own accelerations.

use crate::{LANES, Lanes, Plant, PlantError};
use trueup_numerics::hybrid::At;
use trueup_numerics::linear::{lu_factor, lu_solve};
use trueup_numerics::{Dual, Scalar};

/// The tangent of a plant at one instant; rows are states.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlantTangent {
    /// F, states x states, row by row.
    pub by_state: Vec<f64>,
    /// B, states x coordinates, row by row.
    pub by_force: Vec<f64>,
}

fn lanes(values: &[f64]) -> Vec<Lanes> {
    values.iter().map(|v| Dual::constant(*v)).collect()
}

/// Where lanes are sown: which of the plant's values moves, one to one.
enum AlongTrajectory {
    State(usize),
    Force(usize),
    /// So many of its units for one.
    Parameter(usize, f64),
}

/// Derivatives of all rates along these values: one column of rates each.
fn columns(plant: &dyn Plant, at: At<f64>, force: &[f64], along: &[AlongTrajectory]) -> Vec<Vec<f64>> {
    let coordinates = plant.coordinates().len();
    let mut all = Vec::with_capacity(along.len());
    for group in along.chunks(LANES) {
        let (mut x, u, mut p) = (lanes(at.x), lanes(at.u), lanes(at.p));
        let mut f = lanes(force);
        f.resize(coordinates, Dual::constant(0.0));
        for (lane, value) in group.iter().enumerate() {
            match value {
                AlongTrajectory::State(i) => x[*i].eps[lane] = 1.0,
                AlongTrajectory::Force(i) => f[*i].eps[lane] = 1.0,
                AlongTrajectory::Parameter(i, unit) => p[*i].eps[lane] = *unit,
            }
        }
        let mut dx = vec![Lanes::default(); at.x.len()];
        let at = At { t: Dual::constant(at.t), x: &x, u: &u, p: &p, modes: at.modes };
        plant.rates_lanes(at, &f, &mut dx);
        all.extend((0..group.len()).map(|lane| dx.iter().map(|d| d.eps[lane]).collect()));
    }
    all
}

/// Rates of the velocities of some coordinates by forces on them, with its factors: of all coordinates the inverse of the mass matrix,
/// which depends on positions and parameters only.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InverseMass {
    /// Coordinates x coordinates, row by row.
    pub by_force: Vec<f64>,
    factors: Vec<f64>,
    pivots: Vec<usize>,
}

impl InverseMass {
    /// Of these coordinates; `by_force` is B.
    fn among(plant: &dyn Plant, by_force: &[f64], coordinates: &[usize]) -> Result<Self, PlantError> {
        let (all, own, c) = (plant.coordinates(), coordinates.len(), plant.coordinates().len());
        let mut rows: Vec<f64> = Vec::with_capacity(own * own);
        for row in coordinates {
            rows.extend(coordinates.iter().map(|column| by_force[all[*row].rate * c + column]));
        }
        let (mut factors, mut pivots) = (rows.clone(), vec![0; own]);
        lu_factor(&mut factors, own, &mut pivots).map_err(|e| {
            let name = coordinates.get(e.index).map_or("", |k| all[*k].name.as_str());
            PlantError(format!(
                "no force moves the coordinate {name:?} by itself here; let its friction slide"
            ))
        })?;
        Ok(Self { by_force: rows, factors, pivots })
    }

    /// Of all coordinates, from the first columns of rates.
    fn of_columns(plant: &dyn Plant, columns: &[Vec<f64>]) -> Result<Self, PlantError> {
        let (n, c) = (columns.first().map_or(0, Vec::len), plant.coordinates().len());
        let by_force: Vec<f64> = (0..n).flat_map(|row| columns[..c].iter().map(move |b| b[row])).collect();
        Self::among(plant, &by_force, &(0..c).collect::<Vec<_>>())
    }

    /// Of all coordinates.
    ///
    /// # Errors
    /// Coordinates that a force does not move by itself (held by friction, or by a base that is fixed).
    pub fn of(plant: &dyn Plant, at: At<f64>) -> Result<Self, PlantError> {
        let along: Vec<_> = (0..plant.coordinates().len()).map(AlongTrajectory::Force).collect();
        Self::of_columns(plant, &columns(plant, at, &[], &along))
    }

    /// The same under forces, and in one pass the accelerations by these states: a row of them for each coordinate.
    ///
    /// # Errors
    /// As [`InverseMass::of`].
    pub fn with_tangent(
        plant: &dyn Plant,
        at: At<f64>,
        force: &[f64],
        states: &[usize],
    ) -> Result<(Self, Vec<f64>), PlantError> {
        let c = plant.coordinates().len();
        let along =
            (0..c).map(AlongTrajectory::Force).chain(states.iter().copied().map(AlongTrajectory::State));
        let columns = columns(plant, at, force, &along.collect::<Vec<_>>());
        let mut by_state = Vec::with_capacity(c * states.len());
        for row in plant.coordinates() {
            by_state.extend(columns[c..].iter().map(|column| column[row.rate]));
        }
        Ok((Self::of_columns(plant, &columns)?, by_state))
    }

    /// Solves for the forces that give the rates these changes; `changes` becomes them.
    pub fn forces_for(&self, changes: &mut [f64]) {
        lu_solve(&self.factors, self.pivots.len(), &self.pivots, changes);
    }

    /// The mass matrix, row by row.
    pub fn mass(&self) -> Vec<f64> {
        let n = self.pivots.len();
        let mut mass = vec![0.0; n * n];
        let mut column = vec![0.0; n];
        for k in 0..n {
            column.fill(0.0);
            column[k] = 1.0;
            self.forces_for(&mut column);
            (0..n).for_each(|i| mass[n * i + k] = column[i]);
        }
        mass
    }

    /// [`force_of_changes`] where this is at hand.
    pub fn force_of_changes(
        &self,
        plant: &dyn Plant,
        at: At<f64>,
        force: &[f64],
        changes: &[(usize, f64)],
    ) -> Vec<f64> {
        let along: Vec<_> = changes.iter().map(|(k, unit)| AlongTrajectory::Parameter(*k, *unit)).collect();
        self.forces_of_columns(plant, &columns(plant, at, force, &along))
    }

    fn forces_of_columns(&self, plant: &dyn Plant, columns: &[Vec<f64>]) -> Vec<f64> {
        let rates = plant.coordinates().iter().map(|c| c.rate);
        let mut all: Vec<f64> =
            columns.iter().flat_map(|column| rates.clone().map(|row| column[row])).collect();
        all.chunks_mut(self.pivots.len().max(1)).for_each(|change| self.forces_for(change));
        all
    }
}

/// The tangent under these forces (one per coordinate; empty: none), the coordinates of `stuck` (empty: none) held by whatever
/// force that takes: they keep their position, and the force acts on what they are coupled to. `at.modes` has their dry friction
/// sliding; one that it holds already stays as it is.
///
/// # Errors
/// Coordinates that no forces hold apart from each other.
pub fn tangent(
    plant: &dyn Plant,
    at: At<f64>,
    force: &[f64],
    stuck: &[bool],
) -> Result<PlantTangent, PlantError> {
    let (n, c) = (at.x.len(), plant.coordinates().len());
    let rows = |columns: &[Vec<f64>]| -> Vec<f64> {
        (0..n).flat_map(|row| columns.iter().map(move |column| column[row])).collect()
    };
    let mut by_force =
        rows(&columns(plant, at, force, &(0..c).map(AlongTrajectory::Force).collect::<Vec<_>>()));
    let all = plant.coordinates();
    let moves = |k: &usize| by_force[all[*k].rate * c + k] != 0.0;
    let held: Vec<usize> = (0..c).filter(|k| stuck.get(*k) == Some(&true)).collect();
    let reacting: Vec<usize> = held.iter().copied().filter(moves).collect();
    let mut force = force.to_vec();
    force.resize(c, 0.0);
    if !reacting.is_empty() {
        // F depends on the force that holds them, B does not.
        let mut dx = vec![0.0; n];
        plant.rates(at, &force, &mut dx);
        let mut reaction: Vec<f64> = reacting.iter().map(|k| -dx[all[*k].rate]).collect();
        InverseMass::among(plant, &by_force, &reacting)?.forces_for(&mut reaction);
        reacting.iter().zip(reaction).for_each(|(k, r)| force[*k] += r);
    }
    let mut by_state =
        rows(&columns(plant, at, &force, &(0..n).map(AlongTrajectory::State).collect::<Vec<_>>()));
    for k in reacting {
        let own = all[k].rate;
        let pivot = by_force[own * c + k];
        for row in (0..n).filter(|row| *row != own) {
            let share = by_force[row * c + k] / pivot;
            (0..n).for_each(|i| by_state[row * n + i] -= share * by_state[own * n + i]);
            (0..c).for_each(|i| by_force[row * c + i] -= share * by_force[own * c + i]);
        }
        by_state[own * n..(own + 1) * n].fill(0.0);
        by_force[own * c..(own + 1) * c].fill(0.0);
    }
    for k in held {
        for row in all[k].position.into_iter().chain([all[k].rate]) {
            by_state[row * n..(row + 1) * n].fill(0.0);
            by_force[row * c..(row + 1) * c].fill(0.0);
        }
        (0..n).for_each(|row| by_state[row * n + all[k].rate] = 0.0);
    }
    Ok(PlantTangent { by_state, by_force })
}

/// Force on each coordinate that has the effect of a relative change of each of these parameters, at the model's own
/// accelerations under `force`: parameter by parameter, a row of coordinates each. Scaling all inertias, stiffnesses, dampings,
/// friction levels and torque constants together, with the forces, changes no motion, so their sum is minus `force` less what
/// inputs apply directly.
///
/// # Errors
/// Coordinates that a force does not move by itself (held by friction, or by a base that is fixed).
pub fn force_sensitivity(
    plant: &dyn Plant,
    at: At<f64>,
    force: &[f64],
    parameters: &[usize],
) -> Result<Vec<f64>, PlantError> {
    let relative: Vec<(usize, f64)> = parameters.iter().map(|k| (*k, at.p[*k])).collect();
    force_of_changes(plant, at, force, &relative)
}

/// Force on each coordinate that has the effect of a change of each of these parameters by so many of its own units, as
/// [`force_sensitivity`] has it of a relative change: also of a parameter that is 0.
///
/// # Errors
/// As [`force_sensitivity`].
pub fn force_of_changes(
    plant: &dyn Plant,
    at: At<f64>,
    force: &[f64],
    changes: &[(usize, f64)],
) -> Result<Vec<f64>, PlantError> {
    let c = plant.coordinates().len();
    let along = (0..c)
        .map(AlongTrajectory::Force)
        .chain(changes.iter().map(|(k, unit)| AlongTrajectory::Parameter(*k, *unit)));
    let columns = columns(plant, at, force, &along.collect::<Vec<_>>());
    Ok(InverseMass::of_columns(plant, &columns)?.forces_of_columns(plant, &columns[c..]))
}
