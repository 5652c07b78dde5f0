//! The two-mass joint about a trajectory: states q_m, w_m, twist, w_l, then the latent torques on motor and load.
//!
//! Steps are those of the model itself with its effects (Runge-Kutta of order 4, friction sliding or sticking as the
//! trajectory does), with exact derivatives by dual numbers; so they are right for every effect that the model has. The first
//! [`EFFECTS`] states of effects (bristles, a tip on a spring) are states of the filter, unless they settle within a step:
//! what pushes back as the joint moves is no force from outside. Where the
//! motor sticks its row is off, the speed known to what the sensor resolves, and where it breaks away the speed is less sure
//! for a step. A rigid joint has the same states, the twist being 0.
//!
//! What it gets wrong: whether the motor sticks is decided by the trajectory, not estimated; a torque that is held at rest
//! tells nothing of friction's level. Further states of effects and their modes (contacts) follow the trajectory and are not
//! estimated with it.

mod along;
mod columns;
mod linearise;
mod trajectory;

pub use columns::{Along, Column, Parts};
pub use linearise::Linearised;
pub use trajectory::{sensed_trajectory, smoothed_trajectory};

use trueup_models::compiled::Compiled;
use trueup_models::friction::STUCK;
use trueup_models::joint::{TwoMassJoint, input, output, parameter};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{Plant, PlantScalar};

use crate::system::Latent;

/// States of the joint itself.
pub const STATES: usize = 4;
/// States of effects that a filter has among its own; further ones follow the trajectory.
pub const EFFECTS: usize = 2;
/// States of the joint with those of its effects, at most.
const MOST_STATES: usize = 32;
/// Most modes and outputs of a joint with its effects.
const MOST_MODES: usize = 32;
const MOST_OUTPUTS: usize = 32;
/// Places at which a torque may act: motor, load.
pub const PLACES: usize = 2;
/// States of a filter of a joint whose effects have no states: the joint's, then the latent torques.
pub const LEAN: usize = STATES + PLACES;
/// States of a filter of any joint: the joint's, those of its effects, the latent torques.
pub const FULL: usize = STATES + EFFECTS + PLACES;

/// Readings that fall to a node, as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Their mean.
    pub value: f64,
    /// By how many seconds they come after the node, in the mean.
    pub late: f64,
    /// Mean square of that about its mean, s2.
    pub spread: f64,
}

impl Sample {
    /// A reading at the node itself.
    pub fn at_node(value: f64) -> Self {
        Self { value, late: 0.0, spread: 0.0 }
    }
}

/// A sensor's readings.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Which output of the joint it shows.
    pub output: usize,
    /// Variance of a sample, in the square of its unit.
    pub variance: f64,
    /// By how many seconds they are taken to be later than they say.
    pub delay: f64,
    /// At each node; none where nothing was read.
    pub samples: Vec<Option<Sample>>,
}

/// How the motor's friction acts within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// [`STUCK`], or the direction in which it slides.
    pub mode: i32,
    /// Where the motor turns.
    pub turn: Option<Turn>,
}

/// A motor that turns within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// So long after the step's begin, s.
    pub after: f64,
    /// The direction in which it slides before.
    pub from: i32,
    /// How friction acts from then on.
    pub to: i32,
}

/// A recording on an even grid of nodes.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Between nodes, s.
    pub dt: f64,
    /// Motor current in A and external torque in N.m, their means from each node to the next.
    pub inputs: Vec<[f64; input::COUNT]>,
    /// Variance of these means.
    pub input_variance: [f64; input::COUNT],
    /// What was read.
    pub channels: Vec<Channel>,
    /// The speed of the motor below which the sensor does not tell motion from rest, rad/s.
    pub resolved_speed: f64,
    /// How friction acts from each node to the next, where that is settled; empty: as a trajectory has it.
    pub friction: Vec<Friction>,
}

impl Recording {
    /// How many nodes there are.
    pub fn nodes(&self) -> usize {
        self.inputs.len()
    }
    /// Which channels were read at a node, with their samples.
    pub(crate) fn read(&self, node: usize) -> impl Iterator<Item = (&Channel, &Sample)> {
        self.channels.iter().filter_map(move |c| Some((c, c.samples.get(node)?.as_ref()?)))
    }
    /// The channel that shows an output.
    pub fn channel(&self, output: usize) -> Option<&Channel> {
        self.channels.iter().find(|c| c.output == output)
    }
}

/// States of the joint at each node.
pub type Trajectory = Vec<[f64; STATES]>;

/// A joint with its parameters, and how wrong it may be.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    /// With any effects.
    pub joint: &'a Compiled<TwoMassJoint>,
    /// Its parameters.
    pub p: &'a [f64],
    /// The latent torques on motor and load, N.m, each on its side of the gear.
    pub latent: [Latent; PLACES],
}

/// How the motor's friction acts from node `k` to the next: [`STUCK`], or the direction in which it slides.
pub fn mode(recording: &Recording, k: usize, from: &[f64; STATES], to: &[f64; STATES]) -> i32 {
    let slow = |x: &[f64; STATES]| x[1].abs() < recording.resolved_speed;
    if let Some(friction) = recording.friction.get(k) {
        friction.mode
    } else if slow(from) && slow(to) {
        STUCK
    } else if from[1] + to[1] < 0.0 {
        -1
    } else {
        1
    }
}

fn own(joint: &TwoMassJoint) -> usize {
    if joint.flexible() { STATES } else { 2 }
}

/// Whether effects of a joint have states of their own: its filter is of size [`FULL`], else [`LEAN`].
pub fn has_effect_states(joint: &Compiled<TwoMassJoint>) -> bool {
    joint.sizes().states > own(joint)
}

impl Model<'_> {
    /// How many of the model's states are the joint's own.
    fn own(&self) -> usize {
        own(self.joint)
    }
    /// Whether effects have states of their own.
    pub fn has_effect_states(&self) -> bool {
        has_effect_states(self.joint)
    }
    fn dry(&self) -> bool {
        self.p[parameter::COULOMB_FRICTION] > 0.0
            || self.p[parameter::STATIC_FRICTION] > 0.0
            || self.joint.effects().dry(self.p, 0)
    }
    /// Inertia that a torque on the motor moves, and the load's.
    pub fn inertia(&self) -> [f64; PLACES] {
        let (motor, load, n) = (
            self.p[parameter::MOTOR_INERTIA],
            self.p[parameter::LOAD_INERTIA],
            self.p[parameter::GEAR_RATIO],
        );
        if self.joint.flexible() { [motor, load] } else { [motor + load / (n * n), load] }
    }
    fn inputs<T: Scalar>(&self, p: &[T], inputs: &[f64; input::COUNT], torques: [T; PLACES]) -> [T; 2] {
        [
            torques[0] / p[parameter::TORQUE_CONSTANT] + inputs[input::MOTOR_CURRENT],
            torques[1] + inputs[input::EXTERNAL_TORQUE],
        ]
    }
    /// All states of the model: the joint's own, then those of its effects.
    fn gather<T: Scalar>(&self, x: &[T], effects: &[f64]) -> ([T; MOST_STATES], usize) {
        let own = self.own();
        let mut all = [T::zero(); MOST_STATES];
        all[..own].copy_from_slice(&x[..own]);
        for (to, from) in all[own..].iter_mut().zip(effects) {
            *to = T::constant(*from);
        }
        (all, own + effects.len())
    }

    /// Rates of the states with torques added at the places; of effects' states those that are `free`, the others are held.
    /// The last of `N`, the latent torques, have none.
    fn rates<T: PlantScalar, const N: usize>(
        &self,
        t: f64,
        (x, effects, free): (&[T; N], &[f64], [bool; EFFECTS]),
        p: &[T],
        inputs: &[f64; input::COUNT],
        torques: [T; PLACES],
        modes: &[i32],
    ) -> [T; N] {
        let u = self.inputs(p, inputs, torques);
        let (mut all, count) = self.gather(x, effects);
        let own = self.own();
        let followed = |e: &usize| free[*e] && own + e < count;
        for e in (0..N - LEAN).filter(followed) {
            all[own + e] = x[STATES + e];
        }
        let mut dx = [T::zero(); MOST_STATES];
        let at = At { t: T::constant(t), x: &all[..count], u: &u, p, modes };
        T::rates(self.joint, at, &[], &mut dx[..count]);
        let mut rates = [T::zero(); N];
        if self.joint.flexible() {
            rates[..STATES].copy_from_slice(&dx[..STATES]);
        } else {
            (rates[0], rates[1], rates[3]) = (dx[0], dx[1], dx[1] / p[parameter::GEAR_RATIO]);
        }
        for e in (0..N - LEAN).filter(followed) {
            rates[STATES + e] = dx[own + e];
        }
        rates
    }

    /// What the joint's outputs are.
    fn outputs<T: PlantScalar>(
        &self,
        t: f64,
        (x, effects): (&[T; STATES], &[f64]),
        p: &[T],
        inputs: &[f64; input::COUNT],
        modes: &[i32],
    ) -> [T; output::COUNT] {
        let u = self.inputs(p, inputs, [T::zero(); PLACES]);
        let (all, count) = self.gather(x, effects);
        let mut y = [T::zero(); MOST_OUTPUTS];
        let at = At { t: T::constant(t), x: &all[..count], u: &u, p, modes };
        T::outputs(self.joint, at, &mut y[..self.joint.sizes().outputs]);
        core::array::from_fn(|i| y[i])
    }
}
