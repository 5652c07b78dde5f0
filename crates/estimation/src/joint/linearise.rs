//! A recording as a linear system about a trajectory of the joint.

use nalgebra::{SMatrix, SVector};
use trueup_models::friction::{SMOOTH, STUCK};
use trueup_models::joint::{input, parameter};
use trueup_numerics::{Dual, Scalar};

use super::along::{Instants, instants};
use super::columns::shown;
use super::{EFFECTS, FULL, MOST_MODES, Model, N, PLACES, Recording, STATES, mode};
use crate::system::{Reading, Step, System};

/// A state of an effect that settles so many times within a step is none of the filter's.
const SETTLES: f64 = 1.0;

/// One step of the joint with all that is held over it.
struct Held<'a> {
    t: f64,
    dt: f64,
    inputs: &'a [f64; input::COUNT],
    torques: [f64; PLACES],
    effects: &'a [f64],
    /// Which of the effects' states are the filter's.
    free: [bool; EFFECTS],
    modes: &'a [i32],
    friction: i32,
    dry: bool,
}

impl Held<'_> {
    /// State `i` is one of the filter's.
    fn has(&self, i: usize) -> bool {
        i < STATES || self.free[i - STATES]
    }
    /// The modes with this one of the joint's friction.
    fn with(&self, friction: i32) -> [i32; MOST_MODES] {
        let mut all = [0; MOST_MODES];
        all[..self.modes.len()].copy_from_slice(self.modes);
        all[0] = if self.dry { friction } else { SMOOTH };
        all
    }
}

/// A recording as it was linearised, and which modes it had: what of it may serve again.
#[derive(Clone, Debug)]
pub struct Linearised {
    /// About the trajectory.
    pub system: System<N, PLACES>,
    /// All modes of each step, one step after the other.
    modes: Vec<i32>,
    count: usize,
    /// Whether the motor turned within each step.
    turned: Vec<bool>,
    /// Which states of effects were the filter's.
    free: Vec<[bool; EFFECTS]>,
}

impl Linearised {
    /// Step `k`, if it went in these modes and nothing turned in it.
    fn alike(&self, k: usize, modes: &[i32]) -> Option<(&Step<N, PLACES>, [bool; EFFECTS])> {
        let (from, to) = (k.saturating_sub(1) * self.count, (k + 1) * self.count);
        let same = self.modes.get(from..to)? == modes && !*self.turned.get(k)?;
        Some((self.system.steps.get(k).filter(|_| same)?, *self.free.get(k)?))
    }
}

impl Model<'_> {
    /// The states after a step from these, these torques at the places, and whether the motor turned within it.
    fn step<T: Scalar>(&self, mut x: [T; FULL], d: [T; PLACES], p: &[T], held: &Held) -> ([T; FULL], bool) {
        let count = held.modes.len();
        let rates = |friction: i32| {
            let modes = held.with(friction);
            move |t: f64, x: &[T; FULL]| {
                self.rates(t, (x, held.effects, held.free), p, held.inputs, d, &modes[..count])
            }
        };
        let whole = T::constant(held.dt);
        let now = if x[1].value() < 0.0 { -1 } else { 1 };
        let before = if held.friction != STUCK && held.dry {
            turn(&x, held.dt, &rates(now)(held.t, &x))
        } else {
            None
        };
        let Some(before) = before else {
            runge_kutta(&mut x, held.t, whole, rates(held.friction));
            return (x, false);
        };
        runge_kutta(&mut x, held.t, before, rates(now));
        // On the other side friction turns with it, or holds it.
        let later = held.t + before.value();
        let beyond = rates(-now)(later, &x)[1].value();
        let second = if beyond * f64::from(-now) > 0.0 { -now } else { STUCK };
        if second == STUCK {
            x[1] = T::zero();
        }
        runge_kutta(&mut x, later, whole - before, rates(second));
        (x, true)
    }

    /// Which states of effects a filter may have: those that do not settle within a step.
    fn free(&self, x: &[Dual<N>; FULL], d: [Dual<N>; PLACES], p: &[Dual<N>], held: &Held) -> [bool; EFFECTS] {
        if held.effects.is_empty() {
            return [false; EFFECTS];
        }
        let modes = held.with(held.friction);
        let all = (x, held.effects, [true; EFFECTS]);
        let rates = self.rates(held.t, all, p, held.inputs, d, &modes[..held.modes.len()]);
        core::array::from_fn(|e| {
            e < held.effects.len() && rates[STATES + e].eps[STATES + e] * held.dt > -SETTLES
        })
    }

    /// A recording as a linear system about a trajectory and latent torques along it; its states are what differs from the
    /// trajectory, then the latent torques themselves.
    ///
    /// `torques` are held from each node to the next. Derivatives are those of `earlier` where a step goes in the same modes.
    pub fn about(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        torques: &[[f64; PLACES]],
        earlier: Option<&Linearised>,
    ) -> Linearised {
        let dt = recording.dt;
        let p: Vec<Dual<N>> = self.p.iter().map(|v| Dual::constant(*v)).collect();
        let along = instants(self, recording, trajectory);
        let dry = self.dry();
        // Held over a step, a torque's noise moves the states as the torque does.
        let noisy = recording.input_variance.iter().any(|v| *v > 0.0);
        let per_input = [self.p[parameter::TORQUE_CONSTANT], 1.0];
        let (mut before, mut turned) = (None, Vec::with_capacity(trajectory.len()));
        let mut all_free = Vec::with_capacity(trajectory.len());
        let steps = trajectory.windows(2).enumerate().map(|(k, w)| {
            let friction = mode(recording, &w[0], &w[1]);
            let (effects, states) = along.middle(k);
            let mut held = Held {
                t: k as f64 * dt,
                dt,
                inputs: &recording.inputs[k],
                torques: torques[k],
                effects: &effects[..states],
                free: [false; EFFECTS],
                modes: along.modes(k),
                friction,
                dry,
            };
            let stuck = friction == STUCK && dry;
            let (from, to) = (full(&w[0], along.effects(k)), full(&w[1], along.effects(k + 1)));
            if let Some((step, free)) = earlier.and_then(|e| e.alike(k, along.modes_from_before(k))) {
                held.free = free;
                let (found, turns) = self.step(from, held.torques, self.p, &held);
                if !turns {
                    turned.push(false);
                    all_free.push(free);
                    before = Some(friction);
                    let mut step = step.clone();
                    step.push = pushed(&found, &to, &step.forces, &held);
                    if stuck {
                        step.push[1] = -w[1][1];
                    }
                    return step;
                }
            }
            let x = core::array::from_fn(|i| Dual::variable(from[i], i));
            let d = core::array::from_fn(|i| Dual::variable(held.torques[i], FULL + i));
            held.free = self.free(&x, d, &p, &held);
            let (found, turns): ([Dual<N>; FULL], bool) = self.step(x, d, &p, &held);
            all_free.push(held.free);
            turned.push(turns);
            let mut step = Step::<N, PLACES> {
                transition: SMatrix::zeros(),
                push: SVector::zeros(),
                noise: SMatrix::zeros(),
                forces: SMatrix::zeros(),
            };
            for i in (0..FULL).filter(|i| held.has(*i)) {
                (0..N).for_each(|j| step.transition[(i, j)] = found[i].eps[j]);
                (0..PLACES).for_each(|place| step.forces[(i, place)] = found[i].eps[FULL + place]);
            }
            step.push = pushed(&found.map(|v| v.re), &to, &step.forces, &held);
            if noisy {
                for (place, scale) in per_input.into_iter().enumerate() {
                    let moved = step.forces.column(place) * scale;
                    step.noise += moved * moved.transpose() * recording.input_variance[place];
                }
            }
            if stuck {
                // Friction holds: the speed is 0 to what the sensor resolves, whatever it was.
                (0..N).for_each(|j| {
                    step.transition[(1, j)] = 0.0;
                    step.noise[(1, j)] = 0.0;
                    step.noise[(j, 1)] = 0.0;
                });
                step.push[1] = -w[1][1];
                step.noise[(1, 1)] = recording.resolved_speed.powi(2);
            } else if before == Some(STUCK) && dry {
                // When it broke away within the step is not known.
                let level = self.p[parameter::COULOMB_FRICTION].max(self.p[parameter::STATIC_FRICTION]);
                step.noise[(1, 1)] += (dt * level / self.inertia()[0]).powi(2);
            }
            before = Some(friction);
            step
        });
        let mut system = System {
            start: SVector::zeros(),
            start_covariance: self.start_covariance(recording, trajectory),
            steps: steps.collect(),
            nodes: self.nodes(recording, trajectory, &along, &p),
        };
        system.set_latent(&self.latent, dt);
        let (modes, count) = along.into_modes();
        Linearised { system, modes, count, turned, free: all_free }
    }

    fn nodes(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        along: &Instants,
        p: &[Dual<N>],
    ) -> Vec<Vec<Reading<N>>> {
        let series = self.series(recording, trajectory, along);
        let outputs = |(k, x): (usize, &[f64; STATES])| {
            let x: [Dual<N>; STATES] = core::array::from_fn(|i| Dual::variable(x[i], i));
            let t = k as f64 * recording.dt;
            self.outputs(t, (&x, along.effects(k)), p, &recording.inputs[k], along.modes(k))
        };
        // What shows states shows them alike everywhere.
        let alike = self.shows_states(recording);
        let first = trajectory.first().filter(|_| alike).map(|x| outputs((0, x)));
        let node = |(k, x): (usize, &[f64; STATES])| {
            let y = first.unwrap_or_else(|| outputs((k, x)));
            let reading = |(c, s): (&super::Channel, &super::Sample)| Reading {
                row: SVector::from(y[c.output].eps),
                value: s.value - shown(&series, recording.dt, k, c, s),
                variance: c.variance,
            };
            recording.read(k).map(reading).collect()
        };
        trajectory.iter().enumerate().map(node).collect()
    }

    /// Nothing is known of the first states but the size of the motion.
    fn start_covariance(&self, recording: &Recording, trajectory: &[[f64; STATES]]) -> SMatrix<f64, N, N> {
        let size = |i: usize| trajectory.iter().map(|x| x[i].abs()).fold(0.0, f64::max);
        let resolved = recording.resolved_speed * recording.dt;
        let mut all = SVector::<f64, N>::zeros();
        for i in 0..STATES {
            all[i] = (size(i) + if i % 2 == 0 { resolved } else { resolved / recording.dt }).powi(2);
        }
        if !self.joint.flexible() {
            (all[2], all[3]) = (0.0, 0.0);
        }
        SMatrix::from_diagonal(&all)
    }
}

/// States of the joint and the first ones of its effects.
fn full(x: &[f64; STATES], effects: &[f64]) -> [f64; FULL] {
    core::array::from_fn(|i| if i < STATES { x[i] } else { effects.get(i - STATES).copied().unwrap_or(0.0) })
}

/// What a step adds that neither the states nor the latent torques do.
fn pushed(
    found: &[f64; FULL],
    to: &[f64; FULL],
    forces: &SMatrix<f64, N, PLACES>,
    held: &Held,
) -> SVector<f64, N> {
    let mut push = SVector::zeros();
    for i in (0..FULL).filter(|i| held.has(*i)) {
        push[i] = found[i] - to[i] - (0..PLACES).map(|p| forces[(i, p)] * held.torques[p]).sum::<f64>();
    }
    push
}

/// How long after the node the motor turns, if it does within the step, with derivatives: its event moves with all that
/// moves the speed.
fn turn<T: Scalar>(x: &[T; FULL], dt: f64, rates: &[T; FULL]) -> Option<T> {
    let after = -(x[1] / rates[1]);
    (after.value() > 0.0 && after.value() < dt).then_some(after)
}

/// A step of order 4 whose length may have derivatives.
fn runge_kutta<T: Scalar>(x: &mut [T; FULL], t: f64, h: T, rates: impl Fn(f64, &[T; FULL]) -> [T; FULL]) {
    let along =
        |x: &[T; FULL], k: &[T; FULL], h: T| -> [T; FULL] { core::array::from_fn(|i| x[i] + k[i] * h) };
    let first = rates(t, x);
    let second = rates(t + 0.5 * h.value(), &along(x, &first, h * 0.5));
    let third = rates(t + 0.5 * h.value(), &along(x, &second, h * 0.5));
    let fourth = rates(t + h.value(), &along(x, &third, h));
    for i in 0..FULL {
        x[i] += (first[i] + (second[i] + third[i]) * 2.0 + fourth[i]) * (h * (1.0 / 6.0));
    }
}
