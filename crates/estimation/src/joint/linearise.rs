//! A recording as a linear system about a trajectory of the joint.

use nalgebra::{SMatrix, SVector};
use trueup_models::friction::{SMOOTH, STUCK};
use trueup_models::joint::{input, parameter};
use trueup_numerics::Scalar;
use trueup_plant::{Lanes, PlantScalar};

use super::along::{Instants, instants};
use super::columns::shown;
use super::{EFFECTS, Friction, LEAN, MOST_MODES, Model, PLACES, Recording, STATES, Turn, mode};
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
    /// Whether it is settled how friction acts, and where the motor turns then.
    settled: bool,
    turn: Option<Turn>,
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

/// A recording as it was linearised, and which modes it had: what of it may serve about another trajectory.
#[derive(Clone, Debug)]
pub struct Linearised<const N: usize> {
    /// About the trajectory.
    pub system: System<N, PLACES>,
    /// All modes of each step, one step after the other.
    modes: Vec<i32>,
    count: usize,
    /// Where the motor turned within each step.
    turns: Vec<Option<Turn>>,
    /// Whether that was settled.
    settled: bool,
    /// Which states of effects were the filter's.
    free: Vec<[bool; EFFECTS]>,
}

impl<const N: usize> Default for Linearised<N> {
    fn default() -> Self {
        let system = System {
            start: SVector::zeros(),
            start_covariance: SMatrix::zeros(),
            steps: Vec::new(),
            nodes: Vec::new(),
        };
        Self { system, modes: Vec::new(), count: 0, turns: Vec::new(), settled: false, free: Vec::new() }
    }
}

impl<const N: usize> Linearised<N> {
    /// How friction acted in each step.
    pub fn friction(&self) -> Vec<Friction> {
        let modes = self.modes.chunks(self.count.max(1)).map(|m| m[0]);
        modes.zip(&self.turns).map(|(mode, turn)| Friction { mode, turn: *turn }).collect()
    }
    /// Which states of effects step `k` has free, if it went in these modes, and nothing turned in it or
    /// that is settled: its derivatives serve.
    fn alike(&self, k: usize, modes: &[i32]) -> Option<[bool; EFFECTS]> {
        let (from, to) = (k.saturating_sub(1) * self.count, (k + 1) * self.count);
        let turned = self.turns.get(k)?.is_some() && !self.settled;
        let same = self.modes.get(from..to)? == modes && !turned;
        self.free.get(k).copied().filter(|_| same)
    }
}

impl Model<'_> {
    /// The states after a step from these, these torques at the places, and where the motor turned within it.
    fn step<T: PlantScalar, const N: usize>(
        &self,
        mut x: [T; N],
        d: [T; PLACES],
        p: &[T],
        held: &Held,
    ) -> ([T; N], Option<Turn>) {
        let count = held.modes.len();
        let rates = |friction: i32| {
            let modes = held.with(friction);
            move |t: f64, x: &[T; N]| {
                self.rates(t, (x, held.effects, held.free), p, held.inputs, d, &modes[..count])
            }
        };
        let whole = T::constant(held.dt);
        let now = if x[1].value() < 0.0 { -1 } else { 1 };
        let turn = match held.turn {
            Some(turn) => Some((T::constant(turn.after), turn.from)),
            None if held.settled || held.friction == STUCK || !held.dry => None,
            None => turn(&x, held.dt, &rates(now)(held.t, &x)).map(|after| (after, now)),
        };
        let Some((after, from)) = turn else {
            runge_kutta(&mut x, held.t, whole, rates(held.friction));
            return (x, None);
        };
        runge_kutta(&mut x, held.t, after, rates(from));
        // On the other side friction turns with it, or holds it.
        let later = held.t + after.value();
        let beyond = rates(-from)(later, &x)[1].value();
        let onward = if beyond * f64::from(-from) > 0.0 { -from } else { STUCK };
        let to = held.turn.map_or(onward, |turn| turn.to);
        if to == STUCK {
            x[1] = T::zero();
        }
        runge_kutta(&mut x, later, whole - after, rates(to));
        (x, Some(Turn { after: after.value(), from, to }))
    }

    /// Which states of effects a filter may have: those that do not settle within a step.
    fn free<const N: usize>(
        &self,
        x: &[Lanes; N],
        d: [Lanes; PLACES],
        p: &[Lanes],
        held: &Held,
    ) -> [bool; EFFECTS] {
        if held.effects.is_empty() {
            return [false; EFFECTS];
        }
        let modes = held.with(held.friction);
        let all = (x, held.effects, [true; EFFECTS]);
        let rates = self.rates(held.t, all, p, held.inputs, d, &modes[..held.modes.len()]);
        core::array::from_fn(|e| {
            e < held.effects.len().min(N - LEAN) && rates[STATES + e].eps[STATES + e] * held.dt > -SETTLES
        })
    }

    /// A recording as a linear system about a trajectory and latent torques along it; its states are what differs from the
    /// trajectory, then the latent torques themselves.
    ///
    /// `torques` are held from each node to the next.
    pub fn about<const N: usize>(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        torques: &[[f64; PLACES]],
    ) -> Linearised<N> {
        let mut all = Linearised::default();
        self.about_again(recording, trajectory, torques, &mut all);
        all
    }

    /// The same about another trajectory: derivatives stay where a step goes in the same modes.
    pub fn about_again<const N: usize>(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        torques: &[[f64; PLACES]],
        all: &mut Linearised<N>,
    ) {
        let p: Vec<Lanes> = self.p.iter().map(|v| Lanes::constant(*v)).collect();
        let along = instants(self, recording, trajectory);
        let dry = self.dry();
        let count = trajectory.len().saturating_sub(1);
        all.system.steps.resize(count, Step::default());
        let (mut turns, mut free) = (vec![None; count], vec![[false; EFFECTS]; count]);
        let mut before = None;
        for (k, w) in trajectory.windows(2).enumerate() {
            let friction = mode(recording, k, &w[0], &w[1]);
            let (effects, states) = along.middle(k);
            let mut held = Held {
                t: k as f64 * recording.dt,
                dt: recording.dt,
                inputs: &recording.inputs[k],
                torques: torques[k],
                effects: &effects[..states],
                free: [false; EFFECTS],
                modes: along.modes(k),
                friction,
                settled: !recording.friction.is_empty(),
                turn: recording.friction.get(k).and_then(|f| f.turn),
                dry,
            };
            let stuck = friction == STUCK && dry;
            let (from, to) = (full(&w[0], along.effects(k)), full(&w[1], along.effects(k + 1)));
            let earlier = all.alike(k, along.modes_from_before(k));
            let step = &mut all.system.steps[k];
            let served = earlier.and_then(|free| {
                held.free = free;
                let (found, turned) = self.step(from, held.torques, self.p, &held);
                turns[k] = turned;
                (held.settled || turned.is_none()).then_some(found)
            });
            let found = served.unwrap_or_else(|| {
                let broke_away = before == Some(STUCK) && dry && !stuck;
                let (found, turned) = self.differentiate(&from, &p, &mut held, step);
                self.add_noise(recording, stuck, broke_away, step);
                turns[k] = turned;
                found
            });
            step.push = pushed(&found, &to, &step.forces, &held);
            if stuck {
                step.push[1] = -w[1][1];
            }
            free[k] = held.free;
            before = Some(friction);
        }
        (all.turns, all.free) = (turns, free);
        all.settled = !recording.friction.is_empty();
        all.system.start_covariance = self.start_covariance(recording, trajectory);
        self.read(recording, trajectory, &along, &p, &mut all.system.nodes);
        all.system.set_latent(&self.latent, recording.dt);
        (all.modes, all.count) = along.into_modes();
    }

    /// Derivatives of a step; where it goes, and where the motor turned.
    fn differentiate<const N: usize>(
        &self,
        from: &[f64; N],
        p: &[Lanes],
        held: &mut Held,
        step: &mut Step<N, PLACES>,
    ) -> ([f64; N], Option<Turn>) {
        let x = core::array::from_fn(|i| Lanes::variable(from[i], i));
        let d = core::array::from_fn(|i| Lanes::variable(held.torques[i], N - PLACES + i));
        held.free = self.free(&x, d, p, held);
        let (found, turned) = self.step(x, d, p, held);
        *step = Step::default();
        for i in (0..N - PLACES).filter(|i| held.has(*i)) {
            (0..N).for_each(|j| step.transition[(i, j)] = found[i].eps[j]);
            (0..PLACES).for_each(|place| step.forces[(i, place)] = found[i].eps[N - PLACES + place]);
        }
        (found.map(|v| v.re), turned)
    }

    /// What is not known of a step, but the latent torques.
    fn add_noise<const N: usize>(
        &self,
        recording: &Recording,
        stuck: bool,
        broke_away: bool,
        step: &mut Step<N, PLACES>,
    ) {
        // Held over a step, a torque's noise moves the states as the torque does.
        let per_input = [self.p[parameter::TORQUE_CONSTANT], 1.0];
        for (place, scale) in per_input.into_iter().enumerate() {
            let variance = recording.input_variance[place];
            if variance > 0.0 {
                let moved = step.forces.column(place) * scale;
                step.noise += moved * moved.transpose() * variance;
            }
        }
        if stuck {
            // Friction holds: the speed is 0 to what the sensor resolves, whatever it was.
            (0..N).for_each(|j| {
                step.transition[(1, j)] = 0.0;
                step.noise[(1, j)] = 0.0;
                step.noise[(j, 1)] = 0.0;
            });
            step.noise[(1, 1)] = recording.resolved_speed.powi(2);
        } else if broke_away {
            // When it broke away within the step is not known.
            let level = self.p[parameter::COULOMB_FRICTION].max(self.p[parameter::STATIC_FRICTION]);
            step.noise[(1, 1)] += (recording.dt * level / self.inertia()[0]).powi(2);
        }
    }

    /// What was read at each node, less what the trajectory shows.
    fn read<const N: usize>(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        along: &Instants,
        p: &[Lanes],
        nodes: &mut Vec<Vec<Reading<N>>>,
    ) {
        let series = self.series(recording, trajectory, along);
        let outputs = |(k, x): (usize, &[f64; STATES])| {
            let x: [Lanes; STATES] = core::array::from_fn(|i| Lanes::variable(x[i], i));
            let t = k as f64 * recording.dt;
            self.outputs(t, (&x, along.effects(k)), p, &recording.inputs[k], along.modes(k))
        };
        // What shows states shows them alike everywhere.
        let alike = self.shows_states(recording);
        let first = trajectory.first().filter(|_| alike).map(|x| outputs((0, x)));
        nodes.resize(trajectory.len(), Vec::new());
        for (k, (x, node)) in trajectory.iter().zip(nodes).enumerate() {
            let y = first.unwrap_or_else(|| outputs((k, x)));
            node.clear();
            node.extend(recording.read(k).map(|(c, s)| Reading {
                row: SVector::from_fn(|i, _| y[c.output].eps[i]),
                value: s.value - shown(&series, recording.dt, k, c, s),
                variance: c.variance,
            }));
        }
    }

    /// Nothing is known of the first states but the size of the motion.
    fn start_covariance<const N: usize>(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
    ) -> SMatrix<f64, N, N> {
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
fn full<const N: usize>(x: &[f64; STATES], effects: &[f64]) -> [f64; N] {
    core::array::from_fn(|i| match i {
        0..STATES => x[i],
        _ if i < N - PLACES => effects.get(i - STATES).copied().unwrap_or(0.0),
        _ => 0.0,
    })
}

/// What a step adds that neither the states nor the latent torques do.
fn pushed<const N: usize>(
    found: &[f64; N],
    to: &[f64; N],
    forces: &SMatrix<f64, N, PLACES>,
    held: &Held,
) -> SVector<f64, N> {
    let mut push = SVector::zeros();
    for i in (0..N - PLACES).filter(|i| held.has(*i)) {
        push[i] = found[i] - to[i] - (0..PLACES).map(|p| forces[(i, p)] * held.torques[p]).sum::<f64>();
    }
    push
}

/// How long after the node the motor turns, if it does within the step, with derivatives: its event moves with all that
/// moves the speed.
fn turn<T: PlantScalar, const N: usize>(x: &[T; N], dt: f64, rates: &[T; N]) -> Option<T> {
    let after = -(x[1] / rates[1]);
    (after.value() > 0.0 && after.value() < dt).then_some(after)
}

/// A step of order 4 whose length may have derivatives.
fn runge_kutta<T: PlantScalar, const N: usize>(
    x: &mut [T; N],
    t: f64,
    h: T,
    rates: impl Fn(f64, &[T; N]) -> [T; N],
) {
    let along = |x: &[T; N], k: &[T; N], h: T| -> [T; N] { core::array::from_fn(|i| x[i] + k[i] * h) };
    let first = rates(t, x);
    let second = rates(t + 0.5 * h.value(), &along(x, &first, h * 0.5));
    let third = rates(t + 0.5 * h.value(), &along(x, &second, h * 0.5));
    let fourth = rates(t + h.value(), &along(x, &third, h));
    for i in 0..N - PLACES {
        x[i] += (first[i] + (second[i] + third[i]) * 2.0 + fourth[i]) * (h * (1.0 / 6.0));
    }
}
