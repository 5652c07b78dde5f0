//! An arm at rest with its motors held (LNK-8).

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use trueup_models::compiled::Compiled;
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::flexible_arm::layout::Outputs;
use trueup_models::friction::STUCK;
use trueup_models::space::layout::{Inputs, Outputs as RobotOutputs, Parameters, States};
use trueup_models::space::{PrescribedAccelerations, RobotScalar};
use trueup_numerics::hybrid::At;
use trueup_plant::{LANES, Lanes};

/// Why there is no such rest.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EquilibriumError {
    /// Not one angle a joint.
    #[error("{given} angles for {joints} joints: give one each, rad")]
    Angles {
        /// How many there are.
        given: usize,
        /// How many there must be.
        joints: usize,
    },
    /// Everything is rigid.
    #[error("no joint and no link of this arm bends: give one a spring or modes")]
    Rigid,
    /// The search did not end.
    #[error(
        "no rest was found: the arm still moves by {0:.1e} (rad, m) a step; it buckles under its load, or it is far too soft"
    )]
    Restless(f64),
    /// The weight is too much for the springs.
    #[error(
        "the arm has no stable equilibrium at this pose: its stiffness, including that of its weight, is not positive; it falls over"
    )]
    Unstable,
}

/// Steps of Newton's at most.
const STEPS: usize = 30;
/// A step that is as good as none, rad or m.
const NOTHING: f64 = 1e-13;

/// An arm at rest. Coordinates: the joints that have a spring, in their order, then the modes of links.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    /// All states of the model; rates are 0.
    pub state: Vec<f64>,
    /// Angles of the motors, joint side, rad.
    pub motors: Vec<f64>,
    /// Which joints (from 0) have a spring.
    pub joints: Vec<usize>,
    /// Of the coordinates, motors held.
    pub mass: DMatrix<f64>,
    /// The same, weight and load counted: minus the derivative of all generalised forces.
    pub stiffness: DMatrix<f64>,
    /// Of the springs of joints and links alone: diagonal.
    pub springs: DVector<f64>,
}

/// Indices of coordinates among states and rows of the mass matrix.
struct CoordinateRows {
    /// Of positions.
    states: Vec<usize>,
    /// Of velocities.
    rates: Vec<usize>,
    /// In the mass matrix.
    mass: Vec<usize>,
    /// Motors that are held, joints without a spring.
    flexible: Vec<usize>,
    rigid: Vec<usize>,
}

/// Rows of a base in the mass matrix.
const BASE: usize = trueup_models::space::composite::BASE;

impl CoordinateRows {
    fn of(arm: &FlexibleArm) -> Self {
        let s = &arm.structure().robot;
        let at = States::new(s);
        let n = s.bodies();
        let (flexible, rigid): (Vec<usize>, Vec<usize>) = (0..n).partition(|j| s.flexible[*j]);
        let modal = BASE + n + flexible.len();
        let mut rows = Self { states: vec![], rates: vec![], mass: vec![], flexible, rigid };
        for j in &rows.flexible {
            rows.states.push(at.joint_angle + j);
            rows.rates.push(at.joint_velocity + j);
            rows.mass.push(BASE + j);
        }
        for m in 0..s.modes() {
            rows.states.push(at.modal_coordinate + m);
            rows.rates.push(at.modal_velocity + m);
            rows.mass.push(modal + m);
        }
        rows
    }
}

/// Mass matrix of the coordinates, row by row, and the generalised forces on them with the motors held.
fn forces<T: RobotScalar>(arm: &FlexibleArm, rows: &CoordinateRows, at: At<'_, T>) -> (Vec<T>, Vec<T>) {
    let n = rows.states.len();
    let s = &arm.structure().robot;
    let size = BASE + s.bodies() + s.springs() + s.modes();
    let mut all = vec![T::zero(); size * size];
    T::mass_matrix(arm.bodies(), &at, &mut all);
    let mass: Vec<T> =
        rows.mass.iter().flat_map(|i| rows.mass.iter().map(move |j| i * size + j)).map(|k| all[k]).collect();
    let held = |list: &[usize]| list.iter().map(|j| (*j, T::zero())).collect::<Vec<_>>();
    let (motors, joints) = (held(&rows.flexible), held(&rows.rigid));
    let mut dx = vec![T::zero(); at.x.len()];
    let led = PrescribedAccelerations { base: None, joints: &joints, motors: &motors };
    T::rates_prescribed(arm.bodies(), at, led, &mut dx);
    let force =
        (0..n).map(|i| (0..n).fold(T::zero(), |sum, j| sum + mass[i * n + j] * dx[rows.rates[j]])).collect();
    (mass, force)
}

/// The arm unbent: joints where their motors are, at these angles (joint side, rad).
fn unbent(arm: &FlexibleArm, rows: &CoordinateRows, motors: &[f64]) -> Result<Vec<f64>, EquilibriumError> {
    let n = arm.structure().robot.bodies();
    if motors.len() != n {
        return Err(EquilibriumError::Angles { given: motors.len(), joints: n });
    }
    if rows.states.is_empty() {
        return Err(EquilibriumError::Rigid);
    }
    let at = States::new(&arm.structure().robot);
    let mut x = vec![0.0; at.count];
    x[at.joint_angle..][..n].copy_from_slice(motors);
    for (k, j) in rows.flexible.iter().enumerate() {
        x[at.motor_angle + k] = motors[*j];
    }
    Ok(x)
}

/// What the weight does to each coordinate (joints with a spring, then modes of links) of the unbent arm, N.m or N.
///
/// # Errors
/// Angles that do not fit, an arm that does not bend.
pub fn weight(arm: &FlexibleArm, p: &[f64], motors: &[f64]) -> Result<Vec<f64>, EquilibriumError> {
    let rows = CoordinateRows::of(arm);
    let x = unbent(arm, &rows, motors)?;
    let robot = &arm.structure().robot;
    let u = vec![0.0; Inputs::new(robot).count];
    let p = &p[..Parameters::new(robot).count];
    Ok(forces(arm, &rows, At { t: 0.0, x: &x, u: &u, p, modes: &[] }).1)
}

/// Where the arm rests with its motors at these angles (joint side, rad) under its weight and this force at its first tip (N,
/// inertial axes). `p`: its parameters.
///
/// # Errors
/// Angles that do not fit, an arm that does not bend or has no stable equilibrium.
pub fn equilibrium(
    arm: &FlexibleArm,
    p: &[f64],
    motors: &[f64],
    tip_force: [f64; 3],
) -> Result<Equilibrium, EquilibriumError> {
    let rows = CoordinateRows::of(arm);
    let x = unbent(arm, &rows, motors)?;
    settled(arm, p, motors, tip_force, x)
}

/// As [`equilibrium`], from a state that is near it.
pub(crate) fn settled(
    arm: &FlexibleArm,
    p: &[f64],
    motors: &[f64],
    tip_force: [f64; 3],
    mut x: Vec<f64>,
) -> Result<Equilibrium, EquilibriumError> {
    let s = &arm.structure().robot;
    let rows = CoordinateRows::of(arm);
    let (input, parameter) = (Inputs::new(s), Parameters::new(s));
    let mut u = vec![0.0; input.count];
    if !s.tips.is_empty() {
        u[input.tip_force..][..3].copy_from_slice(&tip_force);
    }
    let p = &p[..parameter.count];
    let mut largest = f64::INFINITY;
    for _ in 0..STEPS {
        let stiffness = stiffness(arm, &rows, &x, &u, p);
        let (_, force) = forces(arm, &rows, At { t: 0.0, x: &x, u: &u, p, modes: &[] });
        let step = stiffness.lu().solve(&DVector::from_vec(force)).ok_or(EquilibriumError::Unstable)?; // (LNK-8)
        rows.states.iter().zip(step.iter()).for_each(|(i, d)| x[*i] += d);
        largest = step.amax();
        if largest.is_nan() || largest < NOTHING {
            break;
        }
    }
    // Rounding may hold the last steps above nothing.
    if largest.is_nan() || largest >= 1e-9 {
        return Err(EquilibriumError::Restless(largest));
    }
    let k = stiffness(arm, &rows, &x, &u, p);
    let (mass, _) = forces(arm, &rows, At { t: 0.0, x: &x, u: &u, p, modes: &[] });
    let n = rows.states.len();
    let of_joints = rows.flexible.iter().map(|j| p[parameter.joint_stiffness + j]);
    let springs = of_joints.chain(arm.bodies().modal_stiffness(p)).collect::<Vec<_>>();
    let found = Equilibrium {
        state: x,
        motors: motors.to_vec(),
        joints: rows.flexible,
        mass: DMatrix::from_row_slice(n, n, &mass),
        stiffness: (&k + k.transpose()) * 0.5,
        springs: DVector::from_vec(springs),
    };
    found.stiffness.clone().cholesky().ok_or(EquilibriumError::Unstable)?;
    Ok(found)
}

/// Minus the derivative of the generalised forces by the coordinates, as many columns at once as there are lanes.
fn stiffness(arm: &FlexibleArm, rows: &CoordinateRows, x: &[f64], u: &[f64], p: &[f64]) -> DMatrix<f64> {
    let n = rows.states.len();
    let none = [0.0; LANES];
    let lift = |v: &[f64]| v.iter().map(|v| Lanes { re: *v, eps: none }).collect::<Vec<Lanes>>();
    let (mut x, u, p) = (lift(x), lift(u), lift(p));
    let mut k = DMatrix::zeros(n, n);
    for first in (0..n).step_by(LANES) {
        let columns = first..n.min(first + LANES);
        columns.clone().for_each(|c| x[rows.states[c]].eps[c - first] = 1.0);
        let t = Lanes { re: 0.0, eps: none };
        let (_, force) = forces(arm, rows, At { t, x: &x, u: &u, p: &p, modes: &[] });
        for c in columns {
            x[rows.states[c]].eps = none;
            force.iter().enumerate().for_each(|(r, f)| k[(r, c)] = -f.eps[c - first]); // (LNK-8)
        }
    }
    k
}

/// Frequencies, rad/s, ascending, and shapes (columns, mass-normalised) of M, K.
///
/// # Errors
/// [`EquilibriumError::Unstable`]: M is not positive definite.
pub fn modes(
    mass: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
) -> Result<(Vec<f64>, DMatrix<f64>), EquilibriumError> {
    let root = mass.clone().cholesky().ok_or(EquilibriumError::Unstable)?.l();
    let inverse = root.clone().try_inverse().ok_or(EquilibriumError::Unstable)?;
    let reduced = &inverse * stiffness * inverse.transpose();
    let found = SymmetricEigen::new((&reduced + reduced.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..found.eigenvalues.len()).collect();
    order.sort_by(|a, b| found.eigenvalues[*a].total_cmp(&found.eigenvalues[*b]));
    let shapes = inverse.transpose() * found.eigenvectors;
    let frequencies = order.iter().map(|k| found.eigenvalues[*k].max(0.0).sqrt()).collect();
    Ok((frequencies, DMatrix::from_columns(&order.iter().map(|k| shapes.column(*k)).collect::<Vec<_>>())))
}

impl Equilibrium {
    /// Frequencies with the motors held, rad/s, ascending.
    ///
    /// # Errors
    /// [`EquilibriumError::Unstable`]
    pub fn frequencies(&self) -> Result<Vec<f64>, EquilibriumError> {
        modes(&self.mass, &self.stiffness).map(|m| m.0)
    }

    /// How far the first tip is from where it would be unbent, m, inertial axes; `None` without a tip. `p`: all parameters.
    pub fn tip_deflection(&self, arm: &FlexibleArm, p: &[f64]) -> Option<[f64; 3]> {
        let s = &arm.structure().robot;
        if s.tips.is_empty() {
            return None;
        }
        let at = Outputs::new(arm.structure()).behind(RobotOutputs::new(s).count).tip_deflection;
        let compiled = Compiled::new(arm.clone());
        let sizes = compiled.plant().sizes();
        let (u, mut y) = (vec![0.0; sizes.inputs], vec![0.0; sizes.outputs]);
        let held = vec![STUCK; arm.joints()];
        let at_rest = At { t: 0.0, x: &self.state, u: &u, p, modes: &held };
        compiled.plant().outputs(at_rest, &mut y);
        Some([y[at], y[at + 1], y[at + 2]])
    }
}
