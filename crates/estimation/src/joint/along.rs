//! States and modes of effects along a trajectory of the joint: bristles, lags, contacts.

use trueup_models::joint::{input, parameter};
use trueup_numerics::hybrid::At;
use trueup_plant::Plant;

use super::{MOST_STATES, Model, Recording, STATES, mode};

/// States of the effects and all modes of a model, at each node of a trajectory.
#[derive(Clone, Debug)]
pub(super) struct Instants {
    effects: Vec<f64>,
    modes: Vec<i32>,
    states: usize,
    count: usize,
}

impl Instants {
    /// States of the effects at a node.
    pub(super) fn effects(&self, node: usize) -> &[f64] {
        &self.effects[node * self.states..][..self.states]
    }
    /// States of the effects in the middle between a node and the next.
    pub(super) fn middle(&self, node: usize) -> ([f64; MOST_STATES], usize) {
        let mut all = [0.0; MOST_STATES];
        let both = self.effects(node).iter().zip(self.effects(node + 1));
        all.iter_mut().zip(both).for_each(|(to, (a, b))| *to = 0.5 * (a + b));
        (all, self.states)
    }
    /// All modes from a node to the next.
    pub(super) fn modes(&self, node: usize) -> &[i32] {
        &self.modes[node * self.count..][..self.count]
    }
    /// The same, behind those of the step before, where there is one.
    pub(super) fn modes_from_before(&self, node: usize) -> &[i32] {
        &self.modes[node.saturating_sub(1) * self.count..(node + 1) * self.count]
    }
    /// All modes, and how many there are of a step.
    pub(super) fn into_modes(self) -> (Vec<i32>, usize) {
        (self.modes, self.count)
    }
}

/// Whether the motor, the load or the spring turns within a step: what follows them may change fast there.
fn turns(from: &[f64; STATES], to: &[f64; STATES], n: f64) -> bool {
    let twisting = |x: &[f64; STATES]| x[1] - n * x[3];
    from[1] * to[1] <= 0.0 || from[3] * to[3] <= 0.0 || twisting(from) * twisting(to) <= 0.0
}

/// Parts of a step with a turn in which the states of effects are taken.
const PARTS: usize = 4;

/// Along a trajectory. The joint's own states are the trajectory's; those of effects follow from it.
pub(super) fn instants(model: &Model, recording: &Recording, trajectory: &[[f64; STATES]]) -> Instants {
    let sizes = model.joint.sizes();
    let own = model.own();
    let states = sizes.states - own;
    let nodes = trajectory.len();
    let mut all = Instants {
        effects: Vec::with_capacity(nodes * states),
        modes: Vec::with_capacity(nodes * sizes.modes),
        states,
        count: sizes.modes,
    };
    let dry = model.dry();
    if states == 0 && sizes.modes == 1 {
        for (k, w) in trajectory.windows(2).enumerate() {
            all.modes.push(if dry { mode(recording, k, &w[0], &w[1]) } else { 0 });
        }
        all.modes.push(0);
        return all;
    }
    let Some(first) = trajectory.first() else { return all };
    let mut x = vec![0.0; sizes.states];
    let mut p = model.p.to_vec();
    let n = p[parameter::GEAR_RATIO];
    for (at, value) in [
        (parameter::INITIAL_MOTOR_ANGLE, first[0]),
        (parameter::INITIAL_MOTOR_VELOCITY, first[1]),
        (parameter::INITIAL_LOAD_ANGLE, (first[0] - first[2]) / n),
        (parameter::INITIAL_LOAD_VELOCITY, first[3]),
    ] {
        p[at] = value;
    }
    model.joint.start(&p, &mut x);
    let mut modes = vec![0; sizes.modes];
    for k in 0..nodes {
        let next = trajectory[(k + 1).min(nodes - 1)];
        let t = k as f64 * recording.dt;
        let u: [f64; input::COUNT] = recording.inputs[k];
        x[..own].copy_from_slice(&trajectory[k][..own]);
        if modes.len() > 1 {
            settle(model, t, &x, &u, &mut modes);
        }
        modes[0] = if dry { mode(recording, k, &trajectory[k], &next) } else { 0 };
        all.effects.extend(&x[own..]);
        all.modes.extend(&modes);
        if states > 0 {
            let parts = if turns(&trajectory[k], &next, n) { PARTS } else { 1 };
            let h = recording.dt / parts as f64;
            for part in 0..parts {
                let s = (part as f64 + 0.5) / parts as f64;
                (0..own).for_each(|i| x[i] = trajectory[k][i] + s * (next[i] - trajectory[k][i]));
                advance(model, t + s * recording.dt, &mut x, &u, &modes, h);
            }
        }
    }
    all
}

/// Modes of effects as they fit the instant.
fn settle(model: &Model, t: f64, x: &[f64], u: &[f64; input::COUNT], modes: &mut [i32]) {
    let mut copy = [0.0; MOST_STATES];
    let copy = &mut copy[..x.len()];
    for _ in 0..4 {
        copy.copy_from_slice(x);
        if model.joint.update(t, copy, u, model.p, modes).settled() {
            return;
        }
    }
}

/// Each state of an effect by the exponential of its own rate: exact for what follows something, however fast.
fn advance(model: &Model, t: f64, x: &mut [f64], u: &[f64; input::COUNT], modes: &[i32], h: f64) {
    let rates = |x: &[f64]| {
        let mut dx = [0.0; MOST_STATES];
        model.joint.rates(At { t, x, u, p: model.p, modes }, &[], &mut dx[..x.len()]);
        dx
    };
    let now = rates(x);
    let mut other = [0.0; MOST_STATES];
    let other = &mut other[..x.len()];
    other.copy_from_slice(x);
    for i in model.own()..x.len() {
        let moved = 1e-6 * x[i].abs().max(1e-9 + now[i].abs() * h);
        let before = other[i];
        other[i] += moved;
        let own = (rates(other)[i] - now[i]) / moved;
        other[i] = before;
        let factor = if (own * h).abs() < 1e-6 { h } else { (own * h).exp_m1() / own };
        x[i] += factor * now[i];
    }
}
