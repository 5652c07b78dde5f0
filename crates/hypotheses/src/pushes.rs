//! When something pushed: a matched filter on the smoother's scores, which are the derivatives of the likelihood by a torque
//! of any course.

use trueup_estimation::joint::{FULL, Model, PLACES};
use trueup_estimation::run::Run;
use trueup_estimation::smoother::smooth;
use trueup_models::joint::output;

use crate::baseline::Baseline;
use trueup_numerics::order::descending;

/// A push that would be likely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Push {
    /// Since the begin of the recording, s.
    pub start: f64,
    /// s.
    pub duration: f64,
    /// Its torque, N.m.
    pub torque: f64,
    /// What it gains alone, in nats.
    pub gain: f64,
}

/// Lengths that are looked for, s.
pub const DURATIONS: [f64; 5] = [0.1, 0.2, 0.4, 0.8, 1.4];

/// Pushes of each length at a place (0: the motor, 1: the load) at the same times in all recordings, the likeliest first, no
/// two of them at once.
pub fn pushes(baseline: &Baseline, place: usize, most: usize) -> Vec<Vec<Push>> {
    let at = baseline.parametric.assign(&baseline.fit.theta);
    let model = Model { joint: &baseline.parametric.joint, p: &at.p, latent: baseline.fit.latent };
    let runs = &baseline.fit.runs;
    let Some(dt) = runs.first().map(|r| r.recording.dt) else { return Vec::new() };
    let nodes = runs.iter().map(|r| r.recording.nodes()).min().unwrap_or(0);
    // Sums of scores and of their variances up to each node.
    let mut sums = vec![[0.0; 2]; nodes];
    for run in runs {
        let scores = scores(run, &model, &at.offsets);
        let mut sum = [0.0; 2];
        for (to, (score, variance)) in sums.iter_mut().skip(1).zip(scores) {
            sum = [sum[0] + score[place], sum[1] + variance[place]];
            *to = [to[0] + sum[0], to[1] + sum[1]];
        }
    }
    let of = |duration: &f64| {
        let length = ((duration / dt).round() as usize).max(1);
        let push = |k: usize| {
            let [score, variance] = [0, 1].map(|i| sums[k + length][i] - sums[k][i]);
            // Scores of neighbours are nearly the same: their sum varies as so many times one of them.
            let variance = (variance * length as f64).max(f64::MIN_POSITIVE);
            let (gain, torque) = (0.5 * score * score / variance, score / variance);
            Push { start: k as f64 * dt, duration: *duration, torque, gain }
        };
        let mut all: Vec<Push> = (0..nodes.saturating_sub(length + 1)).map(push).collect();
        descending(&mut all, |item| item.gain);
        let mut found: Vec<Push> = Vec::new();
        for push in all {
            let apart = |o: &Push| push.start > o.start + o.duration || o.start > push.start + push.duration;
            if found.len() < most && found.iter().all(apart) {
                found.push(push);
            }
        }
        found
    };
    DURATIONS.iter().map(of).collect()
}

type Score = [f64; PLACES];

/// Scores of a torque in each step, and their variances.
fn scores(run: &Run, model: &Model, offsets: &[f64; output::COUNT]) -> impl Iterator<Item = (Score, Score)> {
    let filtered = run.filtered::<FULL>(model, offsets);
    let pass = filtered.filter.data(&filtered.system, true);
    let all = smooth(&filtered.system, &filtered.filter, &pass, false);
    all.scores.into_iter().zip(all.score_variances).map(|(s, v)| (s.into(), v.into()))
}
