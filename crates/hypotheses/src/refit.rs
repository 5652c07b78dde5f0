//! What leads a screen, linearised anew about itself.

use trueup_estimation::fit::{Effort, Fit, Run, fit};
use trueup_estimation::joint::Model;

use crate::baseline::Baseline;
use crate::catalogue::{self, Cause};
use crate::screen::Candidate;

/// Rounds of a refit, and those that the leaders have besides.
const ROUNDS: [usize; 2] = [6, 18];
/// Leaders gain at least this share of what the first gains.
const NEAR: f64 = 0.3;
/// Rounds of a new structure before its unknowns move.
const HELD: usize = 2;
/// Candidates that are refitted, and leaders of these.
const MOST: [usize; 2] = [6, 3];

/// A cause at the mode of its posterior.
#[derive(Clone, Debug)]
pub struct Refitted {
    /// As it was seen.
    pub seen: Candidate,
    /// Its fit.
    pub fit: Fit,
}

/// The likeliest causes of a screen, each fitted; the likeliest first. Causes of another structure are among them.
pub fn refits(baseline: &Baseline, seen: &[Candidate]) -> Vec<Refitted> {
    let effort = |rounds, held| Effort { rounds, held, bounds: baseline.bounds };
    let first = |seen: &Candidate| {
        let start = [&baseline.fit.theta[..], &seen.at].concat();
        let parametric = &seen.parametrized.parametric;
        let fit =
            fit(&baseline.raw, parametric, &start, seen.latent, &baseline.fit.runs, effort(ROUNDS[0], 0))?;
        Some(Refitted { seen: seen.clone(), fit })
    };
    let mut all: Vec<Refitted> = seen.iter().take(MOST[0]).filter_map(first).collect();
    let anew = |seen: &Candidate| {
        let start = [&baseline.fit.theta[..], &seen.at].concat();
        let parametric = &seen.parametrized.parametric;
        let p = parametric.assign(&start).p;
        let model = Model { joint: &parametric.joint, p: &p, latent: seen.latent };
        let runs: Vec<Run> =
            baseline.fit.runs.iter().map(|r| Run::sensed(r.recording.clone(), &model)).collect();
        let fit = fit(&baseline.raw, parametric, &start, seen.latent, &runs, effort(ROUNDS[0], HELD))?;
        Some(Refitted { seen: seen.clone(), fit })
    };
    for cause in catalogue::all(baseline).into_iter().filter(Cause::restructures) {
        let points = Candidate::points(baseline, &cause);
        let likelier = |a: &Refitted, b: &Refitted| a.fit.log_evidence.total_cmp(&b.fit.log_evidence);
        all.extend(points.iter().filter_map(anew).max_by(likelier));
    }
    sort(&mut all);
    let gain = |r: &Refitted| r.fit.log_evidence - baseline.fit.log_evidence;
    let least = all.first().map_or(0.0, |r| NEAR * gain(r));
    for r in all.iter_mut().take(MOST[1]).filter(|r| gain(r) >= least) {
        let (parametric, f) = (&r.seen.parametrized.parametric, &r.fit);
        if let Some(more) = fit(&baseline.raw, parametric, &f.theta, f.latent, &f.runs, effort(ROUNDS[1], 0)) {
            r.fit = more;
        }
    }
    sort(&mut all);
    all
}

fn sort(all: &mut [Refitted]) {
    all.sort_by(|a, b| b.fit.log_evidence.total_cmp(&a.fit.log_evidence));
}
