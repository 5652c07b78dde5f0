//! States and modes of effects along a trajectory of the joint: bristles, lags, contacts.

use trueup_models::joint::{input, parameter};
use trueup_numerics::hybrid::{At, Hybrid};

use super::{MOST_STATES, Model, Recording, STATES, mode};

/// All states of the joint and its effects at an instant, and all modes.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    pub(super) x: Vec<f64>,
    pub(super) modes: Vec<i32>,
}

/// Parts of a step in which the states of effects are taken.
const PARTS: usize = 4;

/// At each node of a trajectory. The joint's own states are the trajectory's; those of effects follow from it.
pub(super) fn instants(model: &Model, recording: &Recording, trajectory: &[[f64; STATES]]) -> Vec<Instant> {
    let sizes = model.joint.sizes();
    let Some(first) = trajectory.first() else { return Vec::new() };
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
    let mut modes = model.modes(1);
    let mut all = Vec::with_capacity(trajectory.len());
    for (k, w) in trajectory.windows(2).enumerate() {
        let t = k as f64 * recording.dt;
        let u: [f64; input::COUNT] = recording.inputs[k];
        let sliding = model.modes(mode(recording, &w[0], &w[1]))[0];
        x[..STATES].copy_from_slice(&w[0]);
        settle(model, t, &x, &u, &mut modes);
        modes[0] = sliding;
        all.push(Instant { x: x.clone(), modes: modes.clone() });
        if sizes.states > STATES {
            let h = recording.dt / PARTS as f64;
            for part in 0..PARTS {
                let s = (part as f64 + 0.5) / PARTS as f64;
                (0..STATES).for_each(|i| x[i] = w[0][i] + s * (w[1][i] - w[0][i]));
                advance(model, t + s * recording.dt, &mut x, &u, &modes, h);
            }
        }
    }
    if let Some(last) = trajectory.last() {
        x[..STATES].copy_from_slice(last);
        all.push(Instant { x, modes });
    }
    all
}

/// Modes of effects as they fit the instant.
fn settle(model: &Model, t: f64, x: &[f64], u: &[f64; input::COUNT], modes: &mut [i32]) {
    let mut copy = x.to_vec();
    for _ in 0..4 {
        if model.joint.update(t, &mut copy, u, model.p, modes).settled() {
            return;
        }
        copy.copy_from_slice(x);
    }
}

/// Each state of an effect by the exponential of its own rate: exact for what follows something, however fast.
fn advance(model: &Model, t: f64, x: &mut [f64], u: &[f64; input::COUNT], modes: &[i32], h: f64) {
    let rates = |x: &[f64]| {
        let mut dx = [0.0; MOST_STATES];
        model.joint.rates(At { t, x, u, p: model.p, modes }, &mut dx[..x.len()]);
        dx
    };
    let now = rates(x);
    let mut next = x.to_vec();
    for i in STATES..x.len() {
        let moved = 1e-6 * x[i].abs().max(1e-9 + now[i].abs() * h);
        let mut other = x.to_vec();
        other[i] += moved;
        let own = (rates(&other)[i] - now[i]) / moved;
        let factor = if (own * h).abs() < 1e-6 { h } else { (own * h).exp_m1() / own };
        next[i] += factor * now[i];
    }
    x.copy_from_slice(&next);
}
