//! An arm about its rest with its motors free, sampled controllers on all of its joints, and whether the two are stable together.
//!
//! The plant is [`FlexibleArm`] linearised at rest by dual numbers: viscous friction counted, dry friction left out, no limits.
//! Between two samples its inputs are held, and it is advanced exactly. The controllers are those of
//! [`trueup_models::controller`], their matrices likewise by dual numbers of the very law that runs. All is in deviations from
//! the rest.
//!
//! What it gets wrong: it holds for small motions, and for motors that slide. Dry friction takes energy out of a vibration
//! and may hold still what is unstable here; a motor at its limit has no gain at all.

use crate::equilibrium::{EquilibriumError, equilibrium};
use nalgebra::{Complex, DMatrix, DVector};
use trueup_models::controller::{Strategy, input, law, parameter, state};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::friction::SMOOTH;
use trueup_models::plants;
use trueup_models::space::layout::{Inputs, Outputs};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{LANES, Lanes};

/// Why there is no such loop.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ClosedLoopError {
    /// There is nothing to linearise about.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The motors cannot hold it.
    #[error(
        "no torques of the motors hold the arm at this pose: accelerations of {0:.1e} (rad/s2, m/s2) are left over"
    )]
    Unheld(f64),
    /// Not one controller a joint.
    #[error("{given} controllers for {joints} joints: give one each")]
    Controllers {
        /// How many there are.
        given: usize,
        /// How many there must be.
        joints: usize,
    },
    /// A period or a setting that no loop can have.
    #[error("{0} is refused: give a finite number above 0")]
    NotPositive(&'static str),
    /// A strategy that is not linear.
    #[error("{0:?} adapts and is not linear: take its strategy with a constant wave frequency")]
    Adapts(Strategy),
    /// No eigenvalues came out, or no rest.
    #[error(
        "the matrix of the loop is singular or has entries that are not finite, or no eigenvalues of it were found"
    )]
    Singular,
}

/// Rows of [`LinearPlant::c`]: row `MOTOR_ANGLE * n + j` is that of joint j of n, and so on; behind them three of the first tip.
pub mod measured {
    /// Of the motor, joint side, rad.
    pub const MOTOR_ANGLE: usize = 0;
    /// Of the motor, joint side, rad/s.
    pub const MOTOR_VELOCITY: usize = 1;
    /// Of the joint, rad.
    pub const JOINT_ANGLE: usize = 2;
    /// Of the joint, rad/s.
    pub const JOINT_VELOCITY: usize = 3;
    /// Kinds of rows per joint; at `COUNT * n` begins the tip's place, m, inertial axes (if the arm has a tip).
    pub const COUNT: usize = 4;
}

/// The arm about its rest: dx/dt = A x + B u, y = C x, of N states and n joints.
#[derive(Clone, Debug)]
pub struct LinearPlant {
    /// N x N, by the states of the model in their order: rad, m and their rates.
    pub a: DMatrix<f64>,
    /// N x n, by what drives the motors: torques on the joint's side in N.m (or currents in A).
    pub b: DMatrix<f64>,
    /// (4 n + 3) x N, rows as [`measured`] has them; 4 n rows of an arm without a tip.
    pub c: DMatrix<f64>,
    /// All states at rest.
    pub state: Vec<f64>,
    /// What drives the motors at rest: N.m on the joint's side (or A).
    pub drive: Vec<f64>,
}

/// The same from sample to sample: x(k+1) = A x(k) + B u(k), y = C x.
#[derive(Clone, Debug)]
pub struct SampledPlant {
    /// N x N.
    pub a: DMatrix<f64>,
    /// N x n.
    pub b: DMatrix<f64>,
    /// As [`LinearPlant::c`].
    pub c: DMatrix<f64>,
}

fn positive(value: f64, name: &'static str) -> Result<f64, ClosedLoopError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(ClosedLoopError::NotPositive(name)) }
}

/// The arm about its rest with its motors at these angles (joint side, rad) under its weight. `p`: its parameters; dry friction
/// among them is taken as 0.
///
/// # Errors
/// An arm that does not rest there, and one that its motors cannot hold.
pub fn linearised(arm: &FlexibleArm, p: &[f64], motors: &[f64]) -> Result<LinearPlant, ClosedLoopError> {
    let s = &arm.structure().robot;
    let plant = plants::flexible_arm(arm.clone());
    let (n, sizes) = (s.bodies(), plant.sizes());
    let rest = equilibrium(arm, p, motors, [0.0; 3])?;
    let mut p = p.to_vec();
    for name in ["coulombFriction[1]", "staticFriction[1]"] {
        plant.table().parameter(name).into_iter().for_each(|first| p[first..][..n].fill(0.0));
    }
    let modes = vec![SMOOTH; sizes.modes];
    let drive = Inputs::new(s).joint_torque;
    let mut u = vec![0.0; sizes.inputs];

    let lift = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
    let (mut at_x, mut at_u, dual_p) = (lift(&rest.state), lift(&u), lift(&p));
    let t = Lanes::default();
    let mut dx = lift(&vec![0.0; sizes.states]);
    // Rates are affine in what drives the motors, so B is the same everywhere at this pose.
    let mut b = DMatrix::zeros(sizes.states, n);
    for first in (0..n).step_by(LANES) {
        let group = first..n.min(first + LANES);
        group.clone().for_each(|j| at_u[drive + j].eps[j - first] = 1.0);
        plant.rates_lanes(At { t, x: &at_x, u: &at_u, p: &dual_p, modes: &modes }, &[], &mut dx);
        for j in group {
            dx.iter().enumerate().for_each(|(row, d)| b[(row, j)] = d.eps[j - first]);
            at_u[drive + j].eps[j - first] = 0.0;
        }
    }
    let mut free = DVector::zeros(sizes.states);
    let at = At { t: 0.0, x: &rest.state, u: &u, p: &p, modes: &modes };
    plant.rates(at, &[], free.as_mut_slice());
    let found = b.clone().svd(true, true).solve(&-&free, 0.0).map_err(|_| ClosedLoopError::Singular)?;
    let left = (&b * &found + &free).amax();
    if left.is_nan() || left > 1e-6 * free.amax().max(1.0) {
        return Err(ClosedLoopError::Unheld(left));
    }
    u[drive..][..n].copy_from_slice(found.as_slice());
    at_u = lift(&u);

    let to = Outputs::new(s);
    let mut rows: Vec<usize> = [to.motor_angle, to.motor_velocity, to.joint_angle, to.joint_velocity]
        .into_iter()
        .flat_map(|from| from..from + n)
        .collect();
    if !s.tips.is_empty() {
        rows.extend(to.tip_position..to.tip_position + 3);
    }
    let mut y = lift(&vec![0.0; sizes.outputs]);
    let (mut a, mut c) =
        (DMatrix::zeros(sizes.states, sizes.states), DMatrix::zeros(rows.len(), sizes.states));
    for first in (0..sizes.states).step_by(LANES) {
        let group = first..sizes.states.min(first + LANES);
        group.clone().for_each(|k| at_x[k].eps[k - first] = 1.0);
        let at = At { t, x: &at_x, u: &at_u, p: &dual_p, modes: &modes };
        plant.rates_lanes(at, &[], &mut dx);
        plant.outputs_lanes(at, &mut y);
        for k in group {
            let lane = k - first;
            dx.iter().enumerate().for_each(|(row, d)| a[(row, k)] = d.eps[lane]);
            rows.iter().enumerate().for_each(|(r, i)| c[(r, k)] = y[*i].eps[lane]);
            at_x[k].eps[lane] = 0.0;
        }
    }
    Ok(LinearPlant { a, b, c, state: rest.state, drive: found.as_slice().to_vec() })
}

impl LinearPlant {
    /// Number n of joints.
    pub fn joints(&self) -> usize {
        self.b.ncols()
    }

    /// From sample to sample, `period` s apart, with what drives the motors held between: exact.
    ///
    /// # Errors
    /// A period that is not above 0, and a plant that it takes beyond all bounds.
    pub fn sampled(&self, period: f64) -> Result<SampledPlant, ClosedLoopError> {
        let h = positive(period, "the sample period")?;
        let (n, m) = self.b.shape();
        let mut whole = DMatrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(&(&self.a * h));
        whole.view_mut((0, n), (n, m)).copy_from(&(&self.b * h));
        let advance = whole.exp();
        if advance.iter().any(|v| !v.is_finite()) {
            return Err(ClosedLoopError::Singular);
        }
        let part = |from: usize, count: usize| advance.view((0, from), (n, count)).into_owned();
        Ok(SampledPlant { a: part(0, n), b: part(n, m), c: self.c.clone() })
    }

    /// The rest of the linear plant with its motors this far from where they are, rad: N states, and n values of what drives
    /// the motors, both as deviations.
    ///
    /// # Errors
    /// Not one angle a joint; no such rest.
    pub fn rest(&self, motors: &[f64]) -> Result<(DVector<f64>, DVector<f64>), ClosedLoopError> {
        let (n, m) = self.b.shape();
        if motors.len() != m {
            return Err(EquilibriumError::Angles { given: motors.len(), joints: m }.into());
        }
        let mut whole = DMatrix::zeros(n + m, n + m);
        whole.view_mut((0, 0), (n, n)).copy_from(&self.a);
        whole.view_mut((0, n), (n, m)).copy_from(&self.b);
        whole
            .view_mut((n, 0), (m, n))
            .copy_from(&self.c.view((measured::MOTOR_ANGLE * m, 0), (m, n)).into_owned());
        let mut right = DVector::zeros(n + m);
        right.rows_mut(n, m).copy_from_slice(motors);
        let found = whole.lu().solve(&right).ok_or(ClosedLoopError::Singular)?;
        Ok((found.rows(0, n).into_owned(), found.rows(n, m).into_owned()))
    }
}

/// Columns of [`SampledController::b`] and [`SampledController::d`]: as the controller's inputs without the feedforward.
const FEEDS: [usize; 5] = [
    input::POSITION_REFERENCE,
    input::MOTOR_ANGLE,
    input::MOTOR_VELOCITY,
    input::LOAD_ANGLE,
    input::LOAD_VELOCITY,
];

/// A sampled controller of one joint away from its limit: xi(k+1) = A xi(k) + B v(k), u(k) = C xi(k) + D v(k), with v: reference,
/// angle and velocity of the motor, angle and velocity of the joint (rad, rad/s).
#[derive(Clone, Debug)]
pub struct SampledController {
    /// By the states that the strategy uses.
    pub a: DMatrix<f64>,
    /// By v.
    pub b: DMatrix<f64>,
    /// One row: N.m (or A) by the states.
    pub c: DMatrix<f64>,
    /// One row by v.
    pub d: DMatrix<f64>,
}

/// The law of a joint, `period` s from sample to sample. `p`: its parameters as
/// [`parameter`](trueup_models::controller::parameter) has them, the limit left out of account. Angles of motors are those of the joint's side here, so the gear ratio
/// among them is 1, and the torque constant 1 too, or n K_t of motors that are driven by currents.
///
/// # Errors
/// An adaptive strategy; a period, gear ratio, torque constant, integral time or (with waves) wave frequency that is not above 0.
pub fn law(
    strategy: Strategy,
    p: &[f64; parameter::COUNT],
    period: f64,
) -> Result<SampledController, ClosedLoopError> {
    if strategy.adapts() {
        return Err(ClosedLoopError::Adapts(strategy));
    }
    let period = positive(period, "the sample period")?;
    positive(p[parameter::GEAR_RATIO], "the gear ratio")?;
    positive(p[parameter::TORQUE_CONSTANT], "the torque constant")?;
    positive(p[parameter::VELOCITY_INTEGRAL_TIME], "the integral time")?;
    let used: Vec<usize> = match strategy {
        Strategy::PPi => vec![],
        Strategy::Wbc | Strategy::WbcAdaptive => (state::POSITION_WAVES..).take(4).collect(),
        Strategy::Vwbc | Strategy::VwbcAdaptive => (state::VELOCITY_WAVES..).take(4).collect(),
        Strategy::VwbcWashout => (state::VELOCITY_WAVES..).take(4).chain([state::WASHOUT]).collect(),
    };
    if !used.is_empty() {
        positive(p[parameter::WAVE_FREQUENCY], "the wave frequency")?;
    }
    let used: Vec<usize> = used.into_iter().chain([state::INTEGRAL_TORQUE]).collect();
    let mut settings = p.map(Lanes::constant);
    settings[parameter::LIMIT] = Lanes::constant(f64::INFINITY);
    // At 0, the values are 0 and the derivatives those of the whole law, which is linear away from its limit.
    let columns = |x: &[usize], u: &[usize]| {
        let seed = |by: &[usize], i: usize| {
            by.iter().position(|k| *k == i).map_or(Lanes::zero(), |lane| Lanes::variable(0.0, lane))
        };
        let joint = law::ControlledJoint {
            strategy,
            p: settings,
            u: core::array::from_fn(|i| seed(u, i)),
            x: core::array::from_fn(|i| seed(x, i)),
            omega: settings[parameter::WAVE_FREQUENCY],
            feedforward: Lanes::zero(),
        };
        let next = joint.sample_lanes(period);
        let by = x.len() + u.len();
        (
            DMatrix::from_fn(used.len(), by, |row, lane| next[used[row]].eps[lane]),
            DMatrix::from_fn(1, by, |_, lane| next[state::HELD_OUTPUT].eps[lane]),
        )
    };
    let (a, c) = columns(&used, &[]);
    let (b, d) = columns(&[], &FEEDS);
    Ok(SampledController { a, b, c, d })
}

/// Plant and controllers over one sample, references at 0: z(k+1) = M z(k), z the plant's N states and then those of the
/// controllers, joint by joint.
///
/// # Errors
/// Not one controller a joint.
pub fn closed(plant: &SampledPlant, laws: &[SampledController]) -> Result<DMatrix<f64>, ClosedLoopError> {
    let (n, joints) = plant.b.shape();
    if laws.len() != joints {
        return Err(ClosedLoopError::Controllers { given: laws.len(), joints });
    }
    let own: usize = laws.iter().map(|l| l.a.nrows()).sum();
    let mut m = DMatrix::zeros(n + own, n + own);
    m.view_mut((0, 0), (n, n)).copy_from(&plant.a);
    let mut from = n;
    for (j, law) in laws.iter().enumerate() {
        let k = law.a.nrows();
        // Of v what is measured: all but the reference.
        let seen = DMatrix::from_rows(
            &(0..measured::COUNT).map(|i| plant.c.row(i * joints + j).into_owned()).collect::<Vec<_>>(),
        );
        let drive = plant.b.column(j);
        let mut own = m.view_mut((0, 0), (n, n));
        own += drive * law.d.columns(1, measured::COUNT) * &seen;
        m.view_mut((0, from), (n, k)).copy_from(&(drive * &law.c));
        m.view_mut((from, 0), (k, n)).copy_from(&(law.b.columns(1, measured::COUNT) * &seen));
        m.view_mut((from, from), (k, k)).copy_from(&law.a);
        from += k;
    }
    Ok(m)
}

/// A pole of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pole {
    /// From sample to sample.
    pub z: Complex<f64>,
    /// The continuous one that it samples: ln(z) / period, rad/s.
    pub s: Complex<f64>,
}

impl Pole {
    /// Damping ratio: -Re(s) / |s|; negative where it grows.
    pub fn damping(&self) -> f64 {
        -self.s.re / self.s.norm()
    }
}

/// The poles of a loop, and what they say of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Poles(pub Vec<Pole>);

/// Slower than this, rad/s, counts as at rest: the split of a wave has a line of equilibria, a pole at z = 1.
pub const STANDING: f64 = 1e-3;

/// Steps of the search for eigenvalues at most.
const SEARCH: usize = 2_000;

/// Poles of the matrix of a loop, whose samples are `period` s apart.
///
/// # Errors
/// A matrix that is not finite; a period that is not above 0.
pub fn poles(matrix: &DMatrix<f64>, period: f64) -> Result<Poles, ClosedLoopError> {
    let h = positive(period, "the sample period")?;
    if matrix.iter().any(|v| !v.is_finite()) {
        return Err(ClosedLoopError::Singular);
    }
    // Torques next to angles: balanced, the same eigenvalues come out of entries of like size.
    let mut balanced = matrix.clone();
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut balanced);
    // The poles at z = 1, as many as there are waves, may want a looser end of the search, or another way round.
    let turned = balanced.transpose();
    let all = [1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6]
        .iter()
        .flat_map(|loose| [(&balanced, loose), (&turned, loose)])
        .find_map(|(m, loose)| nalgebra::Schur::try_new(m.clone(), loose * f64::EPSILON, SEARCH))
        .ok_or(ClosedLoopError::Singular)?
        .complex_eigenvalues();
    Ok(Poles(all.iter().map(|z| Pole { z: *z, s: z.ln() / h }).collect()))
}

impl Poles {
    /// Those that move: without the ones at rest.
    pub fn moving(&self) -> impl Iterator<Item = &Pole> + '_ {
        self.0.iter().filter(|p| p.s.norm() > STANDING)
    }
    /// Largest |z| of those that move; above 1: unstable. 0 if none does.
    pub fn largest(&self) -> f64 {
        self.moving().map(|p| p.z.norm()).fold(0.0, f64::max)
    }
    /// The least damped of those that move and are slower than `below` rad/s.
    pub fn least_damped(&self, below: f64) -> Option<&Pole> {
        self.moving().filter(|p| p.s.norm() < below).min_by(|a, b| a.damping().total_cmp(&b.damping()))
    }
}
