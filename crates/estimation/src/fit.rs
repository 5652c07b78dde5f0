//! The posterior mode of what is unknown of a joint, with its evidence: filter, smooth, columns, a step; linearised anew
//! each round about the hypothesis itself.

use crate::evidence::{Gram, Posterior, Prior};
use crate::filter::Filter;
use crate::intake::Raw;
use crate::joint::{
    Column, FULL, LEAN, Linearised, Model, PLACES, Recording, has_effect_states, smoothed_trajectory,
};
use crate::run::Run;
use crate::smoother::{Smoothed, smooth};
use crate::system::{Latent, System};
use crate::unknown::ParametricJoint;

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
    /// ln p(y | hypothesis, intensities), about the trajectory that follows from them.
    pub log_evidence: f64,
    /// A further round would change nothing.
    pub settled: bool,
}

/// Puts so much of each column into what is known: where the joint was follows what is unknown, to first order.
fn add<const N: usize>(system: &mut System<N, PLACES>, columns: &[Column], by: &[f64]) {
    for (column, by) in columns.iter().zip(by) {
        for (step, torques) in system.steps.iter_mut().zip(&column.torques) {
            step.push += step.forces * nalgebra::SVector::from(*torques) * *by;
        }
        let readings = system.nodes.iter_mut().flatten();
        readings.zip(&column.errors).for_each(|(r, e)| r.value -= e * by);
    }
}

/// What serves for several rounds: derivatives change little with the trajectory.
#[derive(Default)]
struct Derivatives<const N: usize> {
    linearised: Linearised<N>,
    columns: Vec<Column>,
}

/// Derivatives by recording, with the coordinates and the rounds since they were taken.
#[derive(Default)]
struct Served<const N: usize> {
    runs: Vec<Derivatives<N>>,
    about: Vec<f64>,
    age: usize,
}

impl<const N: usize> Served<N> {
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
/// Largest step of a round, in coordinates: a factor e^0.5, half a typical size.
const LONGEST: f64 = 0.5;
/// Where a round's evidence falls by more than this, in nats a reading, its step was too long. Less is no loss: away from the
/// trajectory that follows from a hypothesis, evidence may be more than at it.
const LOST: f64 = 0.3;
/// So often a step is halved.
const HALVED: usize = 4;
/// A round that changes the evidence by less, in nats, is the last.
const SETTLED: f64 = 0.5;
/// What a variance may become in a round, as a share.
const LEAST_FACTOR: f64 = 0.05;
/// Least slope that a secant of intensities may have: steps are at most its inverse longer than without one.
const LEAST_SLOPE: f64 = 0.5;

/// How a hypothesis is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Rounds, each linearised anew.
    pub rounds: usize,
    /// How many of the first ones leave what is unknown as it is: trajectory and intensities come first.
    pub held: usize,
    /// In how many of the first ones friction holds the motor wherever the trajectory is slow. Then that is settled, else where
    /// it holds, and with it the evidence, would change with every round.
    pub modes: usize,
    /// Where intensities may be.
    pub bounds: Bounds,
}

/// Where a fit is.
#[derive(Clone)]
struct Point {
    theta: Vec<f64>,
    latent: [Latent; PLACES],
    runs: Vec<Run>,
}

/// Fits a hypothesis from these coordinates, latent torques and trajectories on; `None` where numbers are not finite.
///
/// Only where it ends counts: linearised about another trajectory than its own, a hypothesis has another evidence, by
/// hundreds of nats either way.
pub fn fit(
    raw: &[Raw],
    parametric: &ParametricJoint,
    start: &[f64],
    latent: [Latent; PLACES],
    runs: &[Run],
    effort: Effort,
) -> Option<Fit> {
    let point = Point { theta: start.to_vec(), latent, runs: runs.to_vec() };
    if has_effect_states(&parametric.joint) {
        fit_in::<FULL>(raw, parametric, point, effort)
    } else {
        fit_in::<LEAN>(raw, parametric, point, effort)
    }
}

fn fit_in<const N: usize>(
    raw: &[Raw],
    parametric: &ParametricJoint,
    mut point: Point,
    effort: Effort,
) -> Option<Fit> {
    let mut kept: Option<(Point, Posterior)> = None;
    let (mut served, mut intensities) = (Served::<N>::default(), Intensities::default());
    let (mut length, mut halved, mut before) = (1.0_f64, 0, f64::NEG_INFINITY);
    let mut settled = false;
    for round in 0..effort.rounds {
        if round >= effort.modes {
            let about = point.runs.iter_mut().zip(&served.runs);
            for (r, d) in about.filter(|(r, _)| r.recording.friction.is_empty()) {
                r.recording.friction = d.linearised.friction();
            }
        }
        let fresh = served.renew(&point.theta);
        let (gram, filters) = look(raw, parametric, &mut point, &mut served, fresh);
        let least = kept.as_ref().map(|(_, p)| p.log_evidence - LOST * gram.readings());
        let found = gram.posterior(&priors(parametric, &point.theta));
        let Some(posterior) = found.filter(|p| least.is_none_or(|l| p.log_evidence > l)) else {
            // Too far: half the way back.
            halved += 1;
            let Some((back, _)) = kept.as_ref().filter(|_| halved <= HALVED) else { break };
            let theta = point.theta.iter().zip(&back.theta).map(|(t, b)| 0.5 * (t + b)).collect();
            point = Point { theta, ..back.clone() };
            length *= 0.5;
            (served, intensities) = Default::default();
            continue;
        };
        (halved, length) = (0, (2.0 * length).min(1.0));
        let last = kept.as_ref().map_or(f64::NEG_INFINITY, |(_, p)| p.log_evidence);
        // Modes that come and go make two trajectories take turns.
        let still = [last, before].iter().any(|l| (posterior.log_evidence - l).abs() < SETTLED);
        kept = Some((point.clone(), posterior.clone()));
        if round > effort.held.max(effort.modes) && still {
            if fresh {
                settled = true;
                break;
            }
            served.age = OLDEST;
        }
        before = last;
        let theta = point.theta.clone();
        if round >= effort.held {
            advance(&mut point.theta, parametric, &posterior, length);
        }
        let by: Vec<f64> = point.theta.iter().zip(&theta).map(|(a, b)| a - b).collect();
        let mut scores = [[0.0; 2]; PLACES];
        for ((run, filter), d) in point.runs.iter_mut().zip(filters).zip(&mut served.runs) {
            let system = &mut d.linearised.system;
            add(system, &d.columns, &by); // (EST-8)
            let all = smooth(system, &filter, &filter.data(system, true), false);
            for (place, s) in scores.iter_mut().enumerate() {
                *s = [s[0] + all.latent_score[place], s[1] + all.latent_information[place]];
            }
            follow(run, &all);
        }
        intensities.advance(&mut point.latent, scores, &effort.bounds);
    }
    let (point, posterior) = kept?;
    Some(Fit {
        theta: point.theta,
        deviations: deviations(&posterior),
        latent: point.latent,
        runs: point.runs,
        log_evidence: posterior.log_evidence,
        settled,
    })
}

/// Innovations and columns about a point, with each recording's filter.
fn look<const N: usize>(
    raw: &[Raw],
    parametric: &ParametricJoint,
    point: &mut Point,
    served: &mut Served<N>,
    fresh: bool,
) -> (Gram, Vec<Filter<N>>) {
    let at = parametric.assign(&point.theta);
    let model = Model { joint: &parametric.joint, p: &at.p, latent: point.latent };
    let mut gram = Gram::new(point.theta.len());
    let shifts = parametric.unknowns.iter().any(|u| u.target.shifts());
    served.runs.resize_with(raw.len(), Derivatives::default);
    let look = |((run, raw), d): ((&mut Run, &Raw), &mut Derivatives<N>)| {
        if shifts {
            let Recording { resolved_speed, friction, .. } = run.recording.clone();
            run.recording = Recording { resolved_speed, friction, ..raw.grid(&at.late) };
        }
        run.linearise(&model, &at.offsets, &mut d.linearised);
        if fresh {
            d.columns = run.columns(raw, parametric, &point.theta, point.latent);
        }
        let system = &d.linearised.system;
        let filter = Filter::new(system);
        let parts: Vec<_> = d.columns.iter().map(Column::parts).collect();
        let data = filter.data(system, false).whitened;
        gram.add(&data, &filter.columns(system, &parts), filter.log_determinant);
        filter
    };
    let filters = point.runs.iter_mut().zip(raw).zip(&mut served.runs).map(look).collect();
    (gram, filters)
}

/// Intensities of the latent torques on their way to where their scores are as large as expected.
#[derive(Default)]
struct Intensities {
    /// Of each place the logarithm of its variance before, and that of its score over what was expected.
    before: [Option<[f64; 2]>; PLACES],
}

impl Intensities {
    fn advance(&mut self, latent: &mut [Latent; PLACES], scores: [[f64; 2]; PLACES], bounds: &Bounds) {
        let most = -LEAST_FACTOR.ln();
        for (place, [score, information]) in scores.into_iter().enumerate() {
            let excess = (score / information.max(f64::MIN_POSITIVE)).ln().clamp(-most, most);
            let at = 2.0 * latent[place].deviation.ln();
            let moved = self.before[place].filter(|b| (at - b[0]).abs() > 1e-3);
            let slope = moved.map_or(1.0, |b| ((b[1] - excess) / (at - b[0])).clamp(LEAST_SLOPE, 1.0));
            self.before[place] = Some([at, excess]);
            let variance = (at + (excess / slope).clamp(-most, most)).exp(); // (EST-7)
            latent[place].deviation = variance.sqrt().clamp(bounds.floor[place], bounds.ceiling[place]);
        }
    }
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

fn follow<const N: usize>(run: &mut Run, all: &Smoothed<N, PLACES>) {
    (run.trajectory, run.torques) = smoothed_trajectory(&run.trajectory, all);
}
