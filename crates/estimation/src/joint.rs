//! The two-mass joint about a trajectory: states q_m, w_m, twist, w_l, then the latent torques on motor and load.
//!
//! Steps are those of the model itself (Runge-Kutta of order 4, friction sliding or sticking as the trajectory does), with
//! exact derivatives by dual numbers; so they are right for every effect that the model has. Where the motor sticks its row
//! is off, the speed known to what the sensor resolves, and where it breaks away or turns the speed is less sure for a step.
//!
//! What it gets wrong: whether the motor sticks is decided by the trajectory, not estimated; a torque that is held at rest
//! tells nothing of friction's level. Effects with states of their own are no part of the state here.

mod along;
mod columns;
mod trajectory;

pub use columns::{Column, of_effect, of_error, of_parameter};
pub use trajectory::{sensed_trajectory, smoothed_trajectory};

use nalgebra::{SMatrix, SVector};
use trueup_models::friction::STUCK;
use trueup_models::joint::{TwoMassJoint, input, parameter};
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_numerics::{Dual, Scalar};

use crate::system::{Latent, Reading, Step, System};

/// States of the joint itself.
pub const STATES: usize = 4;
/// States of the joint with those of its effects, at most.
const MOST_STATES: usize = 32;
/// Places at which a torque may act: motor, load.
pub const PLACES: usize = 2;
/// States with the latent torques.
pub const N: usize = STATES + PLACES;

/// A recording on an even grid of nodes.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Between nodes, s.
    pub dt: f64,
    /// Motor current in A and external torque in N.m, their means from each node to the next.
    pub inputs: Vec<[f64; input::COUNT]>,
    /// Motor angle and load angle at each node, rad.
    pub readings: Vec<[Option<f64>; 2]>,
    /// Variance of these readings, rad2.
    pub variance: [f64; 2],
    /// The speed of the motor below which the sensor does not tell motion from rest, rad/s.
    pub resolved_speed: f64,
}

/// States of the joint at each node.
pub type Trajectory = Vec<[f64; STATES]>;

/// A joint with its parameters, and how wrong it may be.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    /// A flexible one. About a trajectory it has no effects with states; along one it may.
    pub joint: &'a TwoMassJoint,
    /// Its parameters.
    pub p: &'a [f64],
    /// The latent torques on motor and load, N.m, each on its side of the gear.
    pub latent: [Latent; PLACES],
}

/// How the motor's friction acts from a node to the next: [`STUCK`], or the direction in which it slides.
pub fn mode(recording: &Recording, from: &[f64; STATES], to: &[f64; STATES]) -> i32 {
    let slow = |x: &[f64; STATES]| x[1].abs() < recording.resolved_speed;
    if slow(from) && slow(to) {
        STUCK
    } else if from[1] + to[1] < 0.0 {
        -1
    } else {
        1
    }
}

impl Model<'_> {
    fn modes(&self, first: i32) -> Vec<i32> {
        let mut modes = vec![0; self.joint.sizes().modes];
        modes[0] = if self.dry() { first } else { trueup_models::friction::SMOOTH };
        modes
    }
    fn dry(&self) -> bool {
        self.p[parameter::COULOMB_FRICTION] > 0.0 || self.p[parameter::STATIC_FRICTION] > 0.0
    }

    /// Rates of the states with torques added at the places.
    pub(crate) fn rates<T: Scalar>(
        &self,
        t: f64,
        x: &[T],
        p: &[T],
        inputs: &[f64; input::COUNT],
        torques: [T; PLACES],
        modes: &[i32],
    ) -> [T; STATES] {
        let u = [
            torques[0] / p[parameter::TORQUE_CONSTANT] + inputs[input::MOTOR_CURRENT],
            torques[1] + inputs[input::EXTERNAL_TORQUE],
        ];
        let mut dx = [T::zero(); MOST_STATES];
        self.joint.rates(At { t: T::constant(t), x, u: &u, p, modes }, &mut dx[..x.len()]);
        core::array::from_fn(|i| dx[i])
    }

    /// The states after a step, with derivatives by states and torques.
    fn step(
        &self,
        t: f64,
        dt: f64,
        from: &[f64; STATES],
        inputs: &[f64; input::COUNT],
        torques: [f64; PLACES],
        mode: i32,
    ) -> [Dual<N>; STATES] {
        let mut x: [Dual<N>; STATES] = core::array::from_fn(|i| Dual::variable(from[i], i));
        let d: [Dual<N>; PLACES] = core::array::from_fn(|i| Dual::variable(torques[i], STATES + i));
        let p: Vec<Dual<N>> = self.p.iter().map(|v| Dual::constant(*v)).collect();
        let whole = Dual::constant(dt);
        let turns = mode != STUCK && self.dry();
        let Some(before) = turns.then(|| self.turn(t, dt, &x, &p, inputs, d)).flatten() else {
            runge_kutta(&mut x, t, whole, |t, x| self.rates(t, x, &p, inputs, d, &self.modes(mode)));
            return x;
        };
        let first = if from[1] < 0.0 { -1 } else { 1 };
        runge_kutta(&mut x, t, before, |t, x| self.rates(t, x, &p, inputs, d, &self.modes(first)));
        // On the other side friction turns with it, or holds it.
        let beyond = self.rates(t, &x, &p, inputs, d, &self.modes(-first))[1].re;
        let second = if beyond * f64::from(-first) > 0.0 { -first } else { STUCK };
        if second == STUCK {
            x[1] = Dual::constant(0.0);
        }
        let later = t + before.re;
        runge_kutta(&mut x, later, whole - before, |t, x| {
            self.rates(t, x, &p, inputs, d, &self.modes(second))
        });
        x
    }

    /// How long after the node at `t` the motor turns, if it does within the step `dt`, with derivatives: its event moves with
    /// all that moves the speed.
    fn turn(
        &self,
        t: f64,
        dt: f64,
        x: &[Dual<N>; STATES],
        p: &[Dual<N>],
        inputs: &[f64; input::COUNT],
        torques: [Dual<N>; PLACES],
    ) -> Option<Dual<N>> {
        let now = if x[1].re < 0.0 { -1 } else { 1 };
        let rates = self.rates(t, x, p, inputs, torques, &self.modes(now));
        let after = -(x[1] / rates[1]);
        (after.re > 0.0 && after.re < dt).then_some(after)
    }

    /// A recording as a linear system about a trajectory and latent torques along it; its states are what differs from the
    /// trajectory, then the latent torques themselves.
    ///
    /// `torques` are held from each node to the next.
    pub fn about(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        torques: &[[f64; PLACES]],
    ) -> System<N, PLACES> {
        let dt = recording.dt;
        let latent = self.latent.map(|l| l.over(dt));
        let mut before = None;
        let steps = trajectory.windows(2).enumerate().map(|(k, w)| {
            let mode = mode(recording, &w[0], &w[1]);
            let t = k as f64 * dt;
            let (inputs, torques) = (&recording.inputs[k], torques[k]);
            let to = self.step(t, dt, &w[0], inputs, torques, mode);
            let mut step = Step {
                transition: SMatrix::zeros(),
                push: SVector::zeros(),
                noise: SMatrix::zeros(),
                forces: SMatrix::zeros(),
            };
            for i in 0..STATES {
                (0..N).for_each(|j| step.transition[(i, j)] = to[i].eps[j]);
                step.push[i] = to[i].re - w[1][i];
                for place in 0..PLACES {
                    step.forces[(i, place)] = to[i].eps[STATES + place];
                    step.push[i] -= to[i].eps[STATES + place] * torques[place];
                }
            }
            for (place, (rho, noise)) in latent.into_iter().enumerate() {
                let at = STATES + place;
                step.transition[(at, at)] = rho;
                step.noise[(at, at)] = noise;
            }
            let stuck = mode == STUCK && self.dry();
            if stuck {
                // Friction holds: the speed is 0 to what the sensor resolves, whatever it was.
                (0..N).for_each(|j| step.transition[(1, j)] = 0.0);
                step.push[1] = -w[1][1];
                step.noise[(1, 1)] = recording.resolved_speed.powi(2);
            } else if before == Some(STUCK) && self.dry() {
                // When it broke away within the step is not known.
                let level = self.p[parameter::COULOMB_FRICTION].max(self.p[parameter::STATIC_FRICTION]);
                step.noise[(1, 1)] += (dt * level / self.p[parameter::MOTOR_INERTIA]).powi(2);
            }
            before = Some(mode);
            step
        });
        System {
            start: SVector::zeros(),
            start_covariance: self.start_covariance(recording, trajectory),
            steps: steps.collect(),
            nodes: self.nodes(recording, trajectory),
        }
    }

    fn nodes(&self, recording: &Recording, trajectory: &[[f64; STATES]]) -> Vec<Vec<Reading<N>>> {
        let rows = self.rows();
        let node = |(x, read): (&[f64; STATES], &[Option<f64>; 2])| {
            let shown = [x[0], (x[0] - x[2]) / self.p[parameter::GEAR_RATIO]];
            let all = (0..2).filter_map(|c| {
                let (value, row) = (read[c]? - shown[c], rows[c]);
                Some(Reading { row, value, variance: recording.variance[c] })
            });
            all.collect()
        };
        trajectory.iter().zip(&recording.readings).map(node).collect()
    }

    /// What motor angle and load angle show of the states.
    fn rows(&self) -> [SVector<f64, N>; 2] {
        let mut rows = [SVector::zeros(); 2];
        let n = self.p[parameter::GEAR_RATIO];
        rows[0][0] = 1.0;
        rows[1][0] = 1.0 / n;
        rows[1][2] = -1.0 / n;
        rows
    }

    /// Nothing is known of the first states but the size of the motion.
    fn start_covariance(&self, recording: &Recording, trajectory: &[[f64; STATES]]) -> SMatrix<f64, N, N> {
        let size = |i: usize| trajectory.iter().map(|x| x[i].abs()).fold(0.0, f64::max);
        let resolved = recording.variance[0].sqrt();
        let mut all = SVector::<f64, N>::zeros();
        for i in 0..STATES {
            all[i] = (size(i) + if i % 2 == 0 { resolved } else { resolved / recording.dt }).powi(2);
        }
        for (place, latent) in self.latent.iter().enumerate() {
            all[STATES + place] = latent.deviation.powi(2);
        }
        SMatrix::from_diagonal(&all)
    }
}

/// A step of order 4 whose length may have derivatives.
fn runge_kutta(
    x: &mut [Dual<N>; STATES],
    t: f64,
    h: Dual<N>,
    rates: impl Fn(f64, &[Dual<N>; STATES]) -> [Dual<N>; STATES],
) {
    let along = |x: &[Dual<N>; STATES], k: &[Dual<N>; STATES], h: Dual<N>| -> [Dual<N>; STATES] {
        core::array::from_fn(|i| x[i] + k[i] * h)
    };
    let first = rates(t, x);
    let second = rates(t + 0.5 * h.re, &along(x, &first, h * 0.5));
    let third = rates(t + 0.5 * h.re, &along(x, &second, h * 0.5));
    let fourth = rates(t + h.re, &along(x, &third, h));
    for i in 0..STATES {
        x[i] += (first[i] + (second[i] + third[i]) * 2.0 + fourth[i]) * (h * (1.0 / 6.0));
    }
}
