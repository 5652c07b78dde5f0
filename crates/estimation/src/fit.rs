//! The posterior mode of what is unknown of a joint, with its evidence: filter, smooth, columns, a step; linearised anew
//! each round about the hypothesis itself.

use trueup_models::joint::{output, parameter as q};

use crate::evidence::{Gram, Posterior, Prior};
use crate::filter::Filter;
use crate::intake::Raw;
use crate::joint::{
    Along, Column, Linearised, Model, N, PLACES, Parts, Recording, Trajectory, sensed_trajectory,
    smoothed_trajectory,
};
use crate::smoother::{Smoothed, smooth};
use crate::system::{Latent, System};
use crate::unknown::{Assigned, ParametricJoint, Target, Unknown};

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

/// Where the intensities of the latent torques may be, N.m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least.
    pub floor: [f64; PLACES],
    /// Most.
    pub ceiling: [f64; PLACES],
}

/// A hypothesis at the mode of its posterior.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Coordinates of what is unknown.
    pub theta: Vec<f64>,
    /// Their standard deviations.
    pub deviations: Vec<f64>,
    /// The latent torques.
    pub latent: [Latent; PLACES],
    /// Recordings with what was smoothed.
    pub runs: Vec<Run>,
    /// ln p(y | hypothesis, intensities).
    pub log_evidence: f64,
}

/// A recording's system with its filter.
pub struct Filtered {
    /// About the run's trajectory.
    pub system: System<N, PLACES>,
    /// Gains.
    pub filter: Filter<N>,
}

/// Puts so much of each column into what is known: where the joint was follows what is unknown, to first order.
fn add(system: &mut System<N, PLACES>, columns: &[Column], by: &[f64]) {
    for (column, by) in columns.iter().zip(by) {
        for (step, torques) in system.steps.iter_mut().zip(&column.torques) {
            step.push += step.forces * nalgebra::SVector::from(*torques) * *by;
        }
        let readings = system.nodes.iter_mut().flatten();
        readings.zip(&column.errors).for_each(|(r, e)| r.value -= e * by);
    }
}

/// What serves for several rounds: it changes little with the trajectory.
struct Derivatives {
    linearised: Linearised,
    columns: Vec<Column>,
}

/// Derivatives by recording, with the coordinates and the rounds since they were taken.
#[derive(Default)]
struct Served {
    runs: Vec<Derivatives>,
    about: Vec<f64>,
    age: usize,
}

impl Served {
    /// Whether they have to be taken anew at `theta`; those before are gone then.
    fn renew(&mut self, theta: &[f64]) -> bool {
        self.age += 1;
        let far = theta.iter().zip(&self.about).any(|(t, a)| (t - a).abs() > NEAR);
        let fresh = self.runs.is_empty() || self.age > OLDEST || far;
        if fresh {
            *self = Self { runs: Vec::new(), about: theta.to_vec(), age: 0 };
        }
        fresh
    }
}

/// Rounds for which derivatives serve.
const OLDEST: usize = 3;
/// Coordinates may move by this meanwhile.
const NEAR: f64 = 0.1;
/// Coordinates are moved by this for a column.
const MOVED: f64 = 1e-4;
/// Largest step of a round, in coordinates: a factor e^0.5, half a typical size.
const LONGEST: f64 = 0.5;
/// Where a round's evidence falls by more than this, in nats, its step was too long.
const LOST: f64 = 10.0;
/// A round that changes the evidence by less, in nats, is the last.
const SETTLED: f64 = 0.5;
/// What a variance may become in a round, as a share.
const LEAST_FACTOR: f64 = 0.05;

impl Run {
    /// A recording as its sensors show it.
    pub fn sensed(recording: Recording, model: &Model) -> Self {
        let trajectory = sensed_trajectory(model, &recording);
        let torques = vec![[0.0; PLACES]; trajectory.len().saturating_sub(1)];
        Self { recording, trajectory, torques }
    }
    /// The model's system about it, `offsets` taken off the readings.
    pub fn system(&self, model: &Model, offsets: &[f64; output::COUNT]) -> System<N, PLACES> {
        self.linearised(model, offsets, None).system
    }
    fn linearised(
        &self,
        model: &Model,
        offsets: &[f64; output::COUNT],
        earlier: Option<&Linearised>,
    ) -> Linearised {
        let mut all = model.about(&self.recording, &self.trajectory, &self.torques, earlier);
        if offsets.iter().any(|o| *o != 0.0) {
            for (k, node) in all.system.nodes.iter_mut().enumerate() {
                let read = self.recording.channels.iter().filter(|c| c.samples[k].is_some());
                node.iter_mut().zip(read).for_each(|(r, c)| r.value -= offsets[c.output]);
            }
        }
        all
    }
    /// The same with its filter.
    pub fn filtered(&self, model: &Model, offsets: &[f64; output::COUNT]) -> Filtered {
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

/// How a hypothesis is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Rounds, each linearised anew.
    pub rounds: usize,
    /// How many of the first ones leave what is unknown as it is: trajectory and intensities come first.
    pub held: usize,
    /// Where these may be.
    pub bounds: Bounds,
}

/// Fits a hypothesis from these coordinates, latent torques and trajectories on; `None` where numbers are not finite.
///
/// Of all rounds that with the most evidence is kept.
pub fn fit(
    raw: &[Raw],
    parametric: &ParametricJoint,
    start: &[f64],
    latent: [Latent; PLACES],
    runs: &[Run],
    effort: Effort,
) -> Option<Fit> {
    let (mut theta, mut latent, mut runs) = (start.to_vec(), latent, runs.to_vec());
    let mut best: Option<Fit> = None;
    let mut last = f64::NEG_INFINITY;
    let (mut served, mut length) = (Served::default(), 1.0_f64);
    for round in 0..effort.rounds {
        let at = parametric.assign(&theta);
        let model = Model { joint: &parametric.joint, p: &at.p, latent };
        let mut gram = Gram::new(theta.len());
        let mut looked = Vec::new();
        let fresh = served.renew(&theta);
        for (k, (run, raw)) in runs.iter_mut().zip(raw).enumerate() {
            if parametric.unknowns.iter().any(|u| u.target.shifts()) {
                let resolved_speed = run.recording.resolved_speed;
                run.recording = Recording { resolved_speed, ..raw.grid(&at.late) };
            }
            let earlier = served.runs.get(k).map(|d| &d.linearised);
            let linearised = run.linearised(&model, &at.offsets, earlier);
            let (system, filter) = (linearised.system.clone(), Filter::new(&linearised.system));
            let pass = filter.data(&system, false);
            if fresh {
                let columns = run.columns(raw, parametric, &theta, latent);
                served.runs.push(Derivatives { linearised, columns });
            }
            let parts: Vec<_> = served.runs[k].columns.iter().map(Column::parts).collect();
            gram.add(&pass.whitened, &filter.columns(&system, &parts), filter.log_determinant);
            looked.push(Filtered { system, filter });
        }
        let Some(posterior) = gram.posterior(&priors(parametric, &theta)) else { break };
        // Too far: shorter steps, until it rises again.
        let fell = posterior.log_evidence < last - LOST;
        length = if fell { 0.5 * length } else { (2.0 * length).min(1.0) };
        if let Some(b) = best.as_ref().filter(|_| fell) {
            theta = theta.iter().zip(&b.theta).map(|(t, b)| 0.5 * (t + b)).collect();
            (runs, last) = (b.runs.clone(), f64::NEG_INFINITY);
            served.runs.clear();
            continue;
        }
        if best.as_ref().is_none_or(|b| posterior.log_evidence > b.log_evidence) {
            best = Some(Fit {
                theta: theta.clone(),
                deviations: deviations(&posterior),
                latent,
                runs: runs.clone(),
                log_evidence: posterior.log_evidence,
            });
        }
        if round > effort.held && (posterior.log_evidence - last).abs() < SETTLED {
            if fresh {
                break;
            }
            served.age = OLDEST;
        }
        last = posterior.log_evidence;
        let before = theta.clone();
        if round >= effort.held {
            advance(&mut theta, parametric, &posterior, length);
        }
        let by: Vec<f64> = theta.iter().zip(&before).map(|(a, b)| a - b).collect();
        let mut scores = [[0.0; 2]; PLACES];
        for ((run, Filtered { mut system, filter }), d) in runs.iter_mut().zip(looked).zip(&served.runs) {
            add(&mut system, &d.columns, &by); // (EST-8)
            let all = smooth(&system, &filter, &filter.data(&system, true));
            for (place, s) in scores.iter_mut().enumerate() {
                *s = [s[0] + all.latent_score[place], s[1] + all.latent_information[place]];
            }
            follow(run, &all);
        }
        for (place, [score, information]) in scores.into_iter().enumerate() {
            let factor = (score / information.max(f64::MIN_POSITIVE)).clamp(LEAST_FACTOR, 1.0 / LEAST_FACTOR);
            let deviation = latent[place].deviation * factor.sqrt(); // (EST-7)
            latent[place].deviation =
                deviation.clamp(effort.bounds.floor[place], effort.bounds.ceiling[place]);
        }
    }
    best
}

/// Priors of what is added to `theta`.
pub fn priors(parametric: &ParametricJoint, theta: &[f64]) -> Vec<(usize, Prior)> {
    let of = |(k, u): (usize, &crate::unknown::Unknown)| {
        (k, Prior { mean: u.prior.mean - theta[k], deviation: u.prior.deviation })
    };
    parametric.unknowns.iter().enumerate().map(of).collect()
}

fn deviations(posterior: &Posterior) -> Vec<f64> {
    posterior.covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect()
}

fn advance(theta: &mut [f64], parametric: &ParametricJoint, posterior: &Posterior, length: f64) {
    for ((t, u), by) in theta.iter_mut().zip(&parametric.unknowns).zip(posterior.mean.iter()) {
        *t = (*t + length * by.clamp(-LONGEST, LONGEST)).clamp(u.lower, u.upper);
    }
}

fn follow(run: &mut Run, all: &Smoothed<N, PLACES>) {
    (run.trajectory, run.torques) = smoothed_trajectory(&run.trajectory, all);
}
