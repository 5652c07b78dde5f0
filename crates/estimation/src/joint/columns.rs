//! Columns of a joint: what one model does along a trajectory that another one does not.
//!
//! A torque is the difference of the models' rates, times inertia: the laws stand in the models alone.

use trueup_models::effect::Scope;
use trueup_models::friction::STUCK;
use trueup_models::joint::output;
use trueup_plant::{LANES, Lanes, PlantScalar};

use super::along::{Instants, instants};
use super::{Channel, EFFECTS, LEAN, MOST_MODES, Model, PLACES, Recording, STATES, Sample};

/// Torques at the places in each step, and errors of the readings, one after the other; either may be empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Column {
    /// On motor and load, N.m.
    pub torques: Vec<[f64; PLACES]>,
    /// In the readings' units.
    pub errors: Vec<f64>,
}

impl Column {
    /// As a filter takes it.
    pub fn parts(&self) -> (&[[f64; PLACES]], &[f64]) {
        (&self.torques, &self.errors)
    }
    /// So many times as large.
    pub fn scaled(mut self, by: f64) -> Self {
        self.torques.iter_mut().flatten().for_each(|v| *v *= by);
        self.errors.iter_mut().for_each(|v| *v *= by);
        self
    }
    /// Nothing at all.
    pub fn is_zero(&self) -> bool {
        self.torques.iter().flatten().chain(&self.errors).all(|v| *v == 0.0)
    }
}

/// Which parts of what a model does are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// Torques at the places.
    pub torques: bool,
    /// What the sensors show.
    pub readings: bool,
}

impl Parts {
    /// Everything.
    pub const ALL: Self = Self { torques: true, readings: true };
}

/// What a model does along a trajectory: torques in the middle of each step, and what the sensors show.
#[derive(Clone, Debug)]
pub struct Along {
    /// On motor and load, N.m: accelerations times inertia.
    torques: Vec<[f64; PLACES]>,
    /// Reading after reading.
    shown: Vec<f64>,
}

impl Along {
    /// Of a model; `inertia` is what accelerations are multiplied by. What is not asked for stays empty.
    pub fn new(
        model: &Model,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        inertia: [f64; 2],
        parts: Parts,
    ) -> Self {
        let along = instants(model, recording, trajectory);
        let step = |(k, w): (usize, &[[f64; STATES]])| {
            let rates = model.sliding(recording, &along, model.p, k, w);
            [rates[1] * inertia[0], rates[3] * inertia[1]]
        };
        let torques =
            if parts.torques { trajectory.windows(2).enumerate().map(step).collect() } else { Vec::new() };
        if !parts.readings {
            return Self { torques, shown: Vec::new() };
        }
        let series = model.series(recording, trajectory, &along);
        let read = |k: usize| {
            let series = &series;
            recording.read(k).map(move |(c, s)| shown(series, recording.dt, k, c, s))
        };
        Self { torques, shown: (0..trajectory.len()).flat_map(read).collect() }
    }
    /// What the torques change by with the parameters, in each of these directions: derivatives of the parameters. The
    /// states of effects stay.
    pub fn slopes(
        model: &Model,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        inertia: [f64; 2],
        directions: &[Vec<f64>],
    ) -> Vec<Column> {
        if directions.is_empty() {
            return Vec::new();
        }
        let along = instants(model, recording, trajectory);
        let mut all = vec![Column::default(); directions.len()];
        for (columns, directions) in all.chunks_mut(LANES).zip(directions.chunks(LANES)) {
            let dual = |(i, re): (usize, &f64)| {
                let eps = core::array::from_fn(|d| directions.get(d).map_or(0.0, |p| p[i]));
                Lanes::new(*re, eps)
            };
            let p: Vec<Lanes> = model.p.iter().enumerate().map(dual).collect();
            columns.iter_mut().for_each(|c| c.torques.reserve_exact(trajectory.len()));
            for (k, w) in trajectory.windows(2).enumerate() {
                let rates = model.sliding(recording, &along, &p, k, w);
                for (d, c) in columns.iter_mut().enumerate() {
                    c.torques.push([rates[1].eps[d] * inertia[0], rates[3].eps[d] * inertia[1]]);
                }
            }
        }
        all
    }
    /// What it does beyond another one.
    pub fn beyond(&self, other: &Self) -> Column {
        let torques = self.torques.iter().zip(&other.torques);
        // A part that one of them lacks is the same in both.
        Column {
            torques: torques.map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect(),
            errors: self.shown.iter().zip(&other.shown).map(|(a, b)| a - b).collect(),
        }
    }
}

impl Model<'_> {
    /// Rates in the middle of a step with these parameters, friction as if the motor slid.
    ///
    /// At rest friction balances what it is asked to, which is no law of it; where a filter holds the motor it asks for no
    /// torque there.
    fn sliding<T: PlantScalar>(
        &self,
        recording: &Recording,
        along: &Instants,
        p: &[T],
        k: usize,
        w: &[[f64; STATES]],
    ) -> [T; LEAN] {
        let t = (k as f64 + 0.5) * recording.dt;
        let middle: [f64; STATES] = core::array::from_fn(|i| 0.5 * (w[0][i] + w[1][i]));
        let (effects, states) = along.middle(k);
        let mut modes = [0; MOST_MODES];
        let modes = &mut modes[..along.modes(k).len()];
        modes.copy_from_slice(along.modes(k));
        if modes[0] == STUCK {
            modes[0] = if middle[1] < 0.0 { -1 } else { 1 };
        }
        let x = core::array::from_fn(|i| T::constant(middle.get(i).copied().unwrap_or(0.0)));
        self.rates(
            t,
            (&x, &effects[..states], [false; EFFECTS]),
            p,
            &recording.inputs[k],
            [T::zero(); PLACES],
            modes,
        )
    }
    /// Whether readings are angles and speeds alone: the same of any model, with the same states.
    pub fn shows_states(&self, recording: &Recording) -> bool {
        let sensed = self.joint.effects().iter().any(|e| e.choice.scope() == Scope::Channel);
        !sensed && recording.channels.iter().all(|c| output::STATES.contains(&c.output))
    }
    /// Its outputs at all nodes.
    pub(super) fn series(
        &self,
        recording: &Recording,
        trajectory: &[[f64; STATES]],
        along: &Instants,
    ) -> Vec<[f64; output::COUNT]> {
        let node = |(k, x): (usize, &[f64; STATES])| {
            let t = k as f64 * recording.dt;
            self.outputs(t, (x, along.effects(k)), self.p, &recording.inputs[k], along.modes(k))
        };
        trajectory.iter().enumerate().map(node).collect()
    }
}

/// What a sensor shows where a sample was taken: a parabola through the nodes about that instant.
pub(super) fn shown(
    series: &[[f64; output::COUNT]],
    dt: f64,
    node: usize,
    channel: &Channel,
    sample: &Sample,
) -> f64 {
    let y = |k: usize| series[k.min(series.len() - 1)][channel.output];
    let at = node as f64 + (sample.late - channel.delay) / dt;
    if series.len() < 3 {
        return y(node);
    }
    let middle = (at.round().max(1.0) as usize).min(series.len() - 2);
    let s = (at - middle as f64).clamp(-2.0, 2.0);
    let (before, now, after) = (y(middle - 1), y(middle), y(middle + 1));
    let bend = after - 2.0 * now + before;
    now + 0.5 * s * (after - before) + 0.5 * (s * s + sample.spread / (dt * dt)) * bend
}
