//! The matrices of a joint from evaluations of its rates.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use trueup_numerics::hybrid::At;
use trueup_plant::Plant;

/// States of the engine: angle and rate of motor and load, all on the motor's side.
pub(super) const STATES: usize = 4;
/// Rows of the accelerations of motor and load.
pub(super) const ACCELERATIONS: [usize; 2] = [1, 3];
/// Where the parts begin: by state, by input, by force, constant, by the sign of dry friction.
const PARTS: [usize; 6] = [0, 16, 24, 32, 36, 40];
/// Share of what acts below which a difference is rounding.
const ROUNDED: f64 = 1e-6;
/// Largest torque that is tried at rest, in usual ones.
const MOST: f64 = 1e4;

/// What the variables of a joint mean.
#[derive(Clone, Debug, PartialEq)]
pub struct JointRoles {
    /// Input that drives, by index.
    pub drive: usize,
    /// Input that is a torque on the load, by index.
    pub external: Option<usize>,
    /// Turns of the motor per turn of the load.
    pub gear_ratio: f64,
    /// Parameter that it is.
    pub ratio: Option<usize>,
}

/// A joint that this engine cannot take.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ForeignJointError {
    /// More than motor and load.
    #[error(
        "it has {states} states; causes are compared in a joint of 2 states (rigid) or 4 (motor and link): export it without further dynamics"
    )]
    States {
        /// How many.
        states: usize,
    },
    /// No force on the link.
    #[error(
        "no force acts on its link: name an input that is a torque on it, `externalTorque`, in ports.toml"
    )]
    Link,
    /// Its outputs are no complete state.
    #[error(
        "motorAngle, motorVelocity, linkAngle and linkVelocity of ports.toml do not determine its states"
    )]
    Shown,
    /// Not linear.
    #[error(
        "its motion is not linear but for dry friction of the motor; causes are compared in other plants where they are models of this project"
    )]
    Nonlinear,
    /// No finite rates.
    #[error("its rates are not finite at its start; correct [parameters]")]
    Evaluation,
    /// A constant torque.
    #[error(
        "a torque of {0} N.m acts on it without any input; set the parameters that cause it so that it is 0"
    )]
    Torque(String),
}

/// z' = A z + B_u u + B_f f + c + s c_s in one list, or its derivative with respect to a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct JointMatrices(pub(super) [f64; PARTS[5]]);

impl JointMatrices {
    pub(super) const NONE: Self = Self([0.0; PARTS[5]]);

    /// A, row by row.
    pub(super) fn by_state(&self) -> &[f64] {
        &self.0[PARTS[0]..PARTS[1]]
    }
    pub(super) fn state(&self, row: usize, state: usize) -> f64 {
        self.0[PARTS[0] + STATES * row + state]
    }
    pub(super) fn input(&self, row: usize, input: usize) -> f64 {
        self.0[PARTS[1] + 2 * row + input]
    }
    pub(super) fn force(&self, row: usize, coordinate: usize) -> f64 {
        self.0[PARTS[2] + 2 * row + coordinate]
    }
    pub(super) fn constant(&self, row: usize) -> f64 {
        self.0[PARTS[3] + row]
    }
    pub(super) fn dry(&self, row: usize) -> f64 {
        self.0[PARTS[4] + row]
    }
    /// B_f, row by row.
    pub(super) fn by_force(&self) -> &[f64] {
        &self.0[PARTS[2]..PARTS[3]]
    }

    /// The rate of a state.
    pub(super) fn rate(&self, row: usize, z: &[f64], u: &[f64], f: &[f64], sign: f64) -> f64 {
        let states: f64 = z.iter().take(STATES).enumerate().map(|(k, z)| self.state(row, k) * z).sum();
        let inputs: f64 = u.iter().take(2).enumerate().map(|(k, u)| self.input(row, k) * u).sum();
        let forces: f64 = f.iter().enumerate().map(|(k, f)| self.force(row, k) * f).sum();
        states + inputs + forces + self.constant(row) + self.dry(row) * sign
    }

    /// Accelerations as the forces that they take, and inertias in place of their inverses.
    fn as_forces(&self) -> Self {
        let mut out = *self;
        for (coordinate, row) in ACCELERATIONS.into_iter().enumerate() {
            let inverse = self.force(row, coordinate);
            out.scale_row(row, 1.0 / inverse);
            out.0[PARTS[2] + 2 * row + coordinate] = 1.0 / inverse;
        }
        out
    }
    /// The other way round.
    fn as_rates(&self) -> Self {
        let mut out = *self;
        for (coordinate, row) in ACCELERATIONS.into_iter().enumerate() {
            let inertia = self.force(row, coordinate);
            out.scale_row(row, 1.0 / inertia);
            out.0[PARTS[2] + 2 * row + coordinate] = 1.0 / inertia;
        }
        out
    }
    fn scale_row(&mut self, row: usize, by: f64) {
        let widths = [STATES, 2, 2, 1, 1];
        for (part, width) in widths.into_iter().enumerate() {
            let begin = PARTS[part] + width * row;
            self.0[begin..begin + width].iter_mut().for_each(|x| *x *= by);
        }
    }

    /// (self - other) times a factor.
    pub(super) fn less(&self, other: &Self, by: f64) -> Self {
        Self(core::array::from_fn(|i| by * (self.0[i] - other.0[i])))
    }
}

/// A plant whose rates are evaluated, and how its states become those of the engine.
#[derive(Clone, Debug)]
pub(super) struct JointRates {
    plant: Arc<dyn Plant>,
    roles: JointRoles,
    /// Speed of the motor at which dry friction slides, rad/s.
    speed: f64,
    /// Usual value of the input that drives.
    drive: f64,
    /// Whether motor and load are one body.
    pub(super) rigid: bool,
}

/// States of the plant as those of the engine, z = T x + d, at some parameters.
struct JointStates {
    map: DMatrix<f64>,
    inverse: DMatrix<f64>,
    offset: DVector<f64>,
}

impl JointRates {
    pub(super) fn new(
        plant: Arc<dyn Plant>,
        roles: JointRoles,
        [speed, drive]: [f64; 2],
    ) -> Result<Self, ForeignJointError> {
        let (states, coordinates) = (plant.sizes().states, plant.coordinates().len());
        let rigid = states == 2;
        match (states, coordinates) {
            (2, 1 | 2) | (4, 2) => Ok(Self { plant, roles, speed, drive, rigid }),
            (4, _) => Err(ForeignJointError::Link),
            _ => Err(ForeignJointError::States { states }),
        }
    }

    fn coordinate(&self, link: bool) -> &trueup_plant::Coordinate {
        let all = self.plant.coordinates();
        &all[usize::from(link).min(all.len() - 1)]
    }
    /// The same parameters, beginning at this speed of the motor.
    fn begun(&self, p: &[f64], speed: f64) -> Vec<f64> {
        let mut p = p.to_vec();
        for (k, c) in self.plant.coordinates().iter().enumerate() {
            p[c.initial_position] = 0.0;
            p[c.initial_rate] = if k == 0 { speed } else { speed / self.gear_ratio(&p) };
        }
        p
    }
    pub(super) fn name_of(&self, parameter: usize) -> &str {
        self.plant.table().parameters.get(parameter).map_or("", |q| &q.name)
    }
    pub(super) fn gear_ratio(&self, p: &[f64]) -> f64 {
        self.roles.ratio.map_or(self.roles.gear_ratio, |k| p[k])
    }

    /// Modes with which the plant begins there.
    fn modes(&self, p: &[f64], x: &[f64], u: &[f64]) -> Vec<i32> {
        let none = vec![0; self.plant.sizes().modes];
        let mut modes = none.clone();
        self.plant.start_modes(At { t: 0.0, x, u, p, modes: &none }, &mut modes);
        modes
    }

    fn states(
        &self,
        p: &[f64],
        x: &[f64],
        u: &[f64],
        modes: &[i32],
    ) -> Result<JointStates, ForeignJointError> {
        let (sizes, n) = (self.plant.sizes(), self.gear_ratio(p));
        let shown = |x: &[f64]| {
            let mut y = vec![0.0; sizes.outputs];
            self.plant.outputs(At { t: 0.0, x, u, p, modes }, &mut y);
            let [m, l] = [false, true].map(|link| self.coordinate(link));
            let turns = if self.plant.coordinates().len() > 1 { n } else { 1.0 };
            let z = [
                y[m.position_output],
                y[m.rate_output],
                turns * y[l.position_output],
                turns * y[l.rate_output],
            ];
            DVector::from_row_slice(&z[..sizes.states.min(STATES)])
        };
        let base = shown(x);
        let mut map = DMatrix::zeros(sizes.states, sizes.states);
        for k in 0..sizes.states {
            let mut moved = x.to_vec();
            moved[k] += self.speed;
            map.set_column(k, &((shown(&moved) - &base) / self.speed));
        }
        let offset = &base - &map * DVector::from_row_slice(x);
        let inverse = map.clone().try_inverse().ok_or(ForeignJointError::Shown)?;
        Ok(JointStates { map, inverse, offset })
    }

    /// All matrices with these parameters (EST-23). Where a fit takes some beyond what the plant accepts, forces and inertias go on in a straight
    /// line, as those of a joint do along stiffness, damping and friction.
    pub(super) fn matrices(&self, p: &[f64]) -> Result<JointMatrices, ForeignJointError> {
        let table = &self.plant.table().parameters;
        let inside: Vec<f64> = p.iter().zip(table).map(|(p, q)| p.max(q.min).min(q.max)).collect();
        let beyond: Vec<usize> = (0..p.len()).filter(|k| p[*k] != inside[*k]).collect();
        let base = self.evaluated(&inside)?;
        if beyond.is_empty() {
            return Ok(base);
        }
        let (first, mut forces) = (base.as_forces(), base.as_forces());
        for k in beyond {
            let by = p[k] - inside[k];
            let mut mirrored = inside.clone();
            mirrored[k] = (inside[k] - by).max(table[k].min).min(table[k].max);
            let step = mirrored[k] - inside[k];
            let other = self.evaluated(&mirrored)?.as_forces();
            let moved = forces.0.iter_mut().zip(other.0.iter().zip(first.0));
            moved.for_each(|(f, (other, first))| *f += by / step * (other - first));
        }
        Ok(forces.as_rates())
    }

    /// Those with parameters that the plant accepts.
    fn evaluated(&self, p: &[f64]) -> Result<JointMatrices, ForeignJointError> {
        let [forward, backward] = [1.0, -1.0].map(|sign| self.sliding(p, sign));
        let (forward, backward) = (forward?, backward?);
        let mut out = forward;
        for row in 0..STATES {
            let [a, b] = [forward.constant(row), backward.constant(row)];
            out.0[PARTS[3] + row] = 0.5 * (a + b);
            out.0[PARTS[4] + row] = 0.5 * (a - b); // (EST-23)
        }
        let largest = |part: usize| {
            forward.0[PARTS[part]..PARTS[part + 1]].iter().fold(0.0, |m: f64, x| m.max(x.abs()))
        };
        let differs = |part: usize| {
            let both = (PARTS[part]..PARTS[part + 1]).map(|i| (forward.0[i] - backward.0[i]).abs());
            both.fold(0.0, f64::max) > ROUNDED * largest(part)
        };
        if (0..3).any(differs) {
            return Err(ForeignJointError::Nonlinear);
        }
        Ok(out)
    }

    /// Those of sliding in one direction: dry friction is in the constant part.
    fn sliding(&self, p: &[f64], sign: f64) -> Result<JointMatrices, ForeignJointError> {
        let sizes = self.plant.sizes();
        let speed = sign * self.speed;
        let p = &self.begun(p, speed)[..];
        let mut x = vec![0.0; sizes.states];
        self.plant.start(p, &mut x);
        let rest = vec![0.0; sizes.inputs];
        let modes = self.modes(p, &x, &rest);
        let map = self.states(p, &x, &rest, &modes)?;
        let n = sizes.states;
        let forces = self.plant.coordinates().len();
        let rates = |z: &DVector<f64>, u: &[f64], f: &[f64]| {
            let x = &map.inverse * (z - &map.offset);
            let mut dx = vec![0.0; n];
            self.plant.rates(At { t: 0.0, x: x.as_slice(), u, p, modes: &modes }, f, &mut dx);
            &map.map * DVector::from_vec(dx)
        };
        let mut base = DVector::zeros(n);
        (1..n).step_by(2).for_each(|k| base[k] = speed);
        let none = vec![0.0; forces];
        let at_base = rates(&base, &rest, &none);
        let mut columns: Vec<(usize, DVector<f64>)> = Vec::new();
        let width = 0.5 * self.speed;
        for k in 0..n {
            let mut moved = base.clone();
            moved[k] += sign * width;
            columns.push((k, (rates(&moved, &rest, &none) - &at_base) * (sign / width)));
        }
        for (k, input) in [Some(self.roles.drive), self.roles.external].into_iter().enumerate() {
            let Some(input) = input else { continue };
            let mut u = rest.clone();
            u[input] = self.drive;
            columns.push((STATES + k, (rates(&base, &u, &none) - &at_base) / self.drive));
        }
        for k in 0..forces {
            // A force on the load is on the motor's side.
            let by = if k == 0 { 1.0 } else { self.gear_ratio(p) };
            let f: Vec<f64> = (0..forces).map(|i| if i == k { by } else { 0.0 }).collect();
            columns.push((STATES + 2 + k, rates(&base, &rest, &f) - &at_base));
        }
        let mut constant = at_base.clone();
        columns[..n].iter().zip(base.iter()).for_each(|(c, z)| constant -= &c.1 * *z);
        // Linear means that any other point is met, too.
        let other = DVector::from_fn(n, |k, _| speed * (1.0 + 0.37 * (k as f64 + 1.0)));
        let u: Vec<f64> =
            (0..sizes.inputs).map(|k| if k == self.roles.drive { 0.6 * self.drive } else { 0.0 }).collect();
        let found = rates(&other, &u, &none);
        let drive = columns.iter().find(|c| c.0 == STATES).map_or_else(|| DVector::zeros(n), |c| c.1.clone());
        let mut meant = &constant + drive.clone() * (0.6 * self.drive);
        let mut size = constant.abs() + (drive * self.drive).abs();
        for (c, z) in columns[..n].iter().zip(other.iter()) {
            meant += &c.1 * *z;
            size += (&c.1 * *z).abs();
        }
        if !found.iter().all(|x| x.is_finite()) {
            return Err(ForeignJointError::Evaluation);
        }
        if (0..n).any(|i| (found[i] - meant[i]).abs() > ROUNDED * size[i]) {
            return Err(ForeignJointError::Nonlinear);
        }
        columns.push((STATES + 4, constant));
        Ok(self.listed(&columns))
    }

    /// Columns by state, input, force, and the constant one, as one list; of one body its rows twice.
    fn listed(&self, columns: &[(usize, DVector<f64>)]) -> JointMatrices {
        let mut out = JointMatrices::NONE;
        for (k, column) in columns {
            for row in 0..STATES {
                let own = if self.rigid { row % 2 } else { row };
                let value = column[own];
                let at = match *k {
                    // The load's angle moves with its own rate.
                    k if k < STATES && self.rigid && row == 2 => STATES * row + if k == 1 { 3 } else { 2 },
                    k if k < STATES => STATES * row + k,
                    k if k < STATES + 2 => PARTS[1] + 2 * row + k - STATES,
                    k if k < STATES + 4 => PARTS[2] + 2 * row + k - STATES - 2,
                    _ => PARTS[3] + row,
                };
                out.0[at] = value;
            }
        }
        if self.rigid {
            for row in 0..STATES {
                out.0[PARTS[2] + 2 * row + 1] = out.0[PARTS[2] + 2 * row];
            }
        }
        out
    }

    /// Torque at which the motor breaks away from rest, as a value of the input that drives; 0: it does not rest.
    /// `halvings`: of the interval in which it is.
    pub(super) fn breakaway(&self, p: &[f64], halvings: usize) -> f64 {
        let sizes = self.plant.sizes();
        let p = &self.begun(p, 0.0)[..];
        let mut x = vec![0.0; sizes.states];
        self.plant.start(p, &mut x);
        let rate = self.coordinate(false).rate;
        let rests = |drive: f64| {
            let mut u = vec![0.0; sizes.inputs];
            u[self.roles.drive] = drive;
            let modes = self.modes(p, &x, &u);
            let mut dx = vec![0.0; sizes.states];
            self.plant.rates(At { t: 0.0, x: &x, u: &u, p, modes: &modes }, &[], &mut dx);
            dx[rate] == 0.0
        };
        let most = |sign: f64| {
            let (mut low, mut high) = (0.0, 1e-6 * self.drive);
            if !rests(sign * high) {
                return 0.0;
            }
            while rests(sign * high) && high < MOST * self.drive {
                (low, high) = (high, 4.0 * high);
            }
            for _ in 0..halvings {
                let middle = 0.5 * (low + high);
                if rests(sign * middle) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        };
        0.5 * (most(1.0) + most(-1.0))
    }
}
