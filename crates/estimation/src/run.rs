//! A recording about which a model is linearised: the system that it makes there, and what each unknown does to it.

use trueup_models::joint::{output, parameter as q};

use crate::filter::Filter;
use crate::intake::Raw;
use crate::joint::{
    Along, Column, Linearised, Model, PLACES, Parts, Recording, Trajectory, sensed_trajectory,
};
use crate::system::{Latent, System};
use crate::unknown::{Assigned, ParametricJoint, Target, Unknown};

/// Coordinates are moved by this for a column.
const MOVED: f64 = 1e-4;

/// A recording about which a model is linearised.
#[derive(Clone, Debug)]
pub struct Run {
    /// On its grid.
    pub recording: Recording,
    /// Where the joint was.
    pub trajectory: Trajectory,
    /// The latent torques along it, N.m.
    pub torques: Vec<[f64; PLACES]>,
}

/// A recording's system with its filter.
pub struct Filtered<const N: usize> {
    /// About the run's trajectory.
    pub system: System<N, PLACES>,
    /// Gains.
    pub filter: Filter<N>,
}

impl Run {
    /// A recording as its sensors show it.
    pub fn sensed(recording: Recording, model: &Model) -> Self {
        let trajectory = sensed_trajectory(model, &recording);
        let torques = vec![[0.0; PLACES]; trajectory.len().saturating_sub(1)];
        Self { recording, trajectory, torques }
    }
    /// The model's system about it, `offsets` taken off the readings.
    pub fn system<const N: usize>(&self, model: &Model, offsets: &[f64; output::COUNT]) -> System<N, PLACES> {
        let mut all = Linearised::default();
        self.linearise(model, offsets, &mut all);
        all.system
    }
    /// The same into `all`, derivatives kept where they serve.
    pub(crate) fn linearise<const N: usize>(
        &self,
        model: &Model,
        offsets: &[f64; output::COUNT],
        all: &mut Linearised<N>,
    ) {
        model.about_again(&self.recording, &self.trajectory, &self.torques, all);
        if offsets.iter().any(|o| *o != 0.0) {
            for (k, node) in all.system.nodes.iter_mut().enumerate() {
                let read = self.recording.channels.iter().filter(|c| c.samples[k].is_some());
                node.iter_mut().zip(read).for_each(|(r, c)| r.value -= offsets[c.output]);
            }
        }
    }
    /// The same with its filter.
    pub fn filtered<const N: usize>(&self, model: &Model, offsets: &[f64; output::COUNT]) -> Filtered<N> {
        let system = self.system(model, offsets);
        let filter = Filter::new(&system);
        Filtered { system, filter }
    }
    /// Errors of one for every reading of an output.
    pub fn error_of(&self, output: usize) -> Column {
        let nodes = 0..self.recording.nodes();
        let read = |k: usize| self.recording.channels.iter().filter(move |c| c.samples[k].is_some());
        let errors = nodes.flat_map(|k| read(k).map(|c| if c.output == output { 1.0 } else { 0.0 }));
        Column { torques: Vec::new(), errors: errors.collect() }
    }
    /// What each unknown does per unit of its coordinate, about `theta`.
    pub fn columns(
        &self,
        raw: &Raw,
        parametric: &ParametricJoint,
        theta: &[f64],
        latent: [Latent; PLACES],
    ) -> Vec<Column> {
        let at = parametric.assign(theta);
        let model = Model { joint: &parametric.joint, p: &at.p, latent };
        let inertia = model.inertia();
        let shows_states = model.shows_states(&self.recording);
        // Exact derivatives, where the parameters change nothing but torques in the same instant.
        let stateless = !model.has_effect_states();
        let exact = |u: &Unknown| match u.target {
            Target::Parameter(i) | Target::Above { at: i, .. } => shows_states && (stateless || i < q::COUNT),
            _ => false,
        };
        let direction = |k: usize| -> Vec<f64> {
            let moved = |by: f64| {
                let mut moved = theta.to_vec();
                moved[k] += by;
                parametric.assign(&moved).p
            };
            let ends = moved(MOVED).into_iter().zip(moved(-MOVED));
            ends.map(|(a, b)| (a - b) / (2.0 * MOVED)).collect()
        };
        let unknowns = &parametric.unknowns;
        let directions: Vec<Vec<f64>> =
            (0..unknowns.len()).filter(|k| exact(&unknowns[*k])).map(direction).collect();
        let (recording, trajectory) = (&self.recording, &self.trajectory);
        let mut slopes = Along::slopes(&model, recording, trajectory, inertia, &directions).into_iter();
        let mut base = None;
        let mut column = |k: usize| {
            let u = &unknowns[k];
            if exact(u) {
                return slopes.next().unwrap_or_default();
            }
            if let Target::Offset(output) = u.target {
                return self.error_of(output).scaled(u.scale.value(theta[k]).1);
            }
            // Away from a wall.
            let by = if theta[k] + MOVED > u.upper { -MOVED } else { MOVED };
            let mut moved = theta.to_vec();
            moved[k] += by;
            let to = parametric.assign(&moved);
            let other = Model { joint: &parametric.joint, p: &to.p, latent };
            let late = matches!(u.target, Target::SensorDelay(_));
            let parts = Parts { torques: !late, readings: late || !shows_states };
            let along = self.moved(raw, (&at, &to), &other, inertia, parts);
            let base =
                base.get_or_insert_with(|| Along::new(&model, recording, trajectory, inertia, Parts::ALL));
            along.beyond(base).scaled(1.0 / by)
        };
        (0..unknowns.len()).map(&mut column).collect()
    }
    /// What a model does along it, signals as late as `to` says beyond what they were on its grid.
    pub fn moved(
        &self,
        raw: &Raw,
        (at, to): (&Assigned, &Assigned),
        model: &Model,
        inertia: [f64; 2],
        parts: Parts,
    ) -> Along {
        if at.late == to.late {
            return Along::new(model, &self.recording, &self.trajectory, inertia, parts);
        }
        let mut recording = self.recording.clone();
        if (at.late.inputs, at.late.lags) != (to.late.inputs, to.late.lags) {
            recording.inputs = raw.inputs(&to.late);
        }
        for c in &mut recording.channels {
            c.delay += to.late.outputs[c.output] - at.late.outputs[c.output];
        }
        Along::new(model, &recording, &self.trajectory, inertia, parts)
    }
}
