//! Columns of a joint: what an effect, a parameter or an error of a sensor does along a trajectory, at unit size.
//!
//! A torque is the difference of the model's rates with and without it, times inertia: the laws stand in the models alone.

use nalgebra::SVector;
use trueup_models::joint::{output, parameter};
use trueup_numerics::hybrid::{At, Hybrid};

use super::along::{Instant, instants};
use super::{Model, PLACES, Recording, STATES};
use crate::filter::Filter;
use crate::system::System;

/// Torques at the places in each step, and errors of the readings, one after the other; either may be empty.
#[derive(Clone, Debug, Default)]
pub struct Column {
    /// On motor and load, N.m.
    pub torques: Vec<SVector<f64, PLACES>>,
    /// In rad.
    pub errors: Vec<f64>,
}

impl Column {
    /// What it takes from the innovations.
    pub fn pass(&self, system: &System<{ super::N }, PLACES>, filter: &Filter<{ super::N }>) -> Vec<f64> {
        filter.column(system, &self.torques, &self.errors)
    }
}

/// The torques by which a model differs from another one in each step of a trajectory.
fn torques(
    (one, other): (&Model, &Model),
    recording: &Recording,
    trajectory: &[[f64; STATES]],
    scale: f64,
) -> Vec<SVector<f64, PLACES>> {
    let inertia = [other.p[parameter::MOTOR_INERTIA], other.p[parameter::LOAD_INERTIA]];
    let instants = [one, other].map(|m| instants(m, recording, trajectory));
    let step = |(k, w): (usize, &[[f64; STATES]])| {
        let t = (k as f64 + 0.5) * recording.dt;
        let rates = |(m, all): (&Model, &Vec<Instant>)| {
            let (from, to) = (&all[k], &all[k + 1]);
            let mut middle: Vec<f64> = from.x.iter().zip(&to.x).map(|(a, b)| 0.5 * (a + b)).collect();
            (0..STATES).for_each(|i| middle[i] = 0.5 * (w[0][i] + w[1][i]));
            m.rates(t, &middle, m.p, &recording.inputs[k], [0.0; PLACES], &from.modes)
        };
        let (one, other) = (rates((one, &instants[0])), rates((other, &instants[1])));
        SVector::from([(one[1] - other[1]) * inertia[0] * scale, (one[3] - other[3]) * inertia[1] * scale])
    };
    trajectory.windows(2).enumerate().map(step).collect()
}

/// What an effect does: `with` has it, `without` has not.
pub fn of_effect(
    with: &Model,
    without: &Model,
    recording: &Recording,
    trajectory: &[[f64; STATES]],
) -> Column {
    let torques = torques((with, without), recording, trajectory, 1.0);
    let shown = |m: &Model, at: &Instant, k: usize| {
        let u = &recording.inputs[k.min(recording.inputs.len() - 1)];
        let mut y = vec![0.0; m.joint.sizes().outputs];
        m.joint.outputs(At { t: k as f64 * recording.dt, x: &at.x, u, p: m.p, modes: &at.modes }, &mut y);
        [y[output::MOTOR_ANGLE], y[output::LOAD_ANGLE]]
    };
    let both = [with, without].map(|m| instants(m, recording, trajectory));
    let mut errors = Vec::new();
    for (k, read) in recording.readings.iter().enumerate().take(trajectory.len()) {
        let (one, other) = (shown(with, &both[0][k], k), shown(without, &both[1][k], k));
        errors.extend((0..2).filter(|&c| read[c].is_some()).map(|c| one[c] - other[c]));
    }
    Column { torques, errors }
}

/// What a parameter does per unit of its logarithm.
pub fn of_parameter(
    model: &Model,
    index: usize,
    recording: &Recording,
    trajectory: &[[f64; STATES]],
) -> Column {
    const MOVED: f64 = 1e-4;
    let moved = |by: f64| {
        let mut p = model.p.to_vec();
        p[index] *= 1.0 + by;
        p
    };
    let (up, down) = (moved(MOVED), moved(-MOVED));
    let of = |p| Model { p, ..model.clone() };
    let torques = torques((&of(&up), &of(&down)), recording, trajectory, 0.5 / MOVED);
    Column { torques, errors: Vec::new() }
}

/// A constant error of a reading: of motor angle (0) or load angle (1), per rad.
pub fn of_error(channel: usize, recording: &Recording) -> Column {
    let node = |read: &[Option<f64>; 2]| {
        let read = [read[0].is_some(), read[1].is_some()];
        (0..2).filter(move |&c| read[c]).map(move |c| if c == channel { 1.0 } else { 0.0 })
    };
    Column { torques: Vec::new(), errors: recording.readings.iter().flat_map(node).collect() }
}
