//! What leads a screen, linearised anew about itself.

use trueup_estimation::fit::{Effort, Fit, fit};
use trueup_estimation::joint::Model;
use trueup_estimation::run::Run;

use crate::baseline::Baseline;
use crate::catalogue::{self, Cause};
use crate::levels::SEEN;
use crate::screen::Candidate;
use trueup_numerics::order::descending;

/// Stages of refits: how many of the likeliest go on, and for how many rounds.
const STAGES: [(usize, usize); 3] = [(usize::MAX, 3), (5, 4), (3, 18)];
/// Candidates of the screen that are refitted.
const MOST: usize = 6;
/// Those that go on have at least this share of what the first gains.
const NEAR: f64 = 0.3;
/// More rounds of the first stage for what rings: the latent torques have to leave it first.
const RINGS: usize = 6;
/// Rounds of a new structure before its unknowns move.
const HELD: usize = 2;

/// A cause at the mode of its posterior.
#[derive(Clone, Debug)]
pub struct Refitted {
    /// As it was seen.
    pub seen: Candidate,
    /// Its fit.
    pub fit: Fit,
}

/// The likeliest causes of a screen, each fitted; the likeliest first. Causes that no column shows are among them.
pub fn refits(baseline: &Baseline, seen: &[Candidate]) -> Vec<Refitted> {
    let effort = |rounds, held, modes| Effort { rounds, held, modes, bounds: baseline.bounds };
    let begin = |seen: &Candidate, runs: &[Run], held: usize| {
        let mut runs = runs.to_vec();
        let slow = if seen.parametrized.whole { RINGS } else { 0 };
        let rounds = STAGES[0].1 + held + slow;
        let modes = if seen.cause.moves_readings() {
            runs.iter_mut().for_each(|r| r.recording.friction.clear());
            rounds
        } else {
            0
        };
        let start = seen.start(baseline);
        let parametric = &seen.parametrized.parametric;
        let effort = effort(rounds, held, modes);
        let fit = fit(&baseline.raw, parametric, &start, seen.latent, &runs, effort)?;
        Some(Refitted { seen: seen.clone(), fit })
    };
    let mut all: Vec<Refitted> =
        shortlist(baseline, seen).iter().filter_map(|s| begin(s, &baseline.fit.runs, 0)).collect();
    let anew = |seen: &Candidate| {
        let start = seen.start(baseline);
        let parametric = &seen.parametrized.parametric;
        let p = parametric.assign(&start).p;
        let model = Model { joint: &parametric.joint, p: &p, latent: seen.latent };
        let sensed = |r: &Run| Run::sensed(r.recording.clone(), &model);
        begin(seen, &baseline.fit.runs.iter().map(sensed).collect::<Vec<_>>(), HELD)
    };
    for cause in catalogue::all(baseline).into_iter().filter(Cause::restructures) {
        let points = Candidate::points(baseline, &cause);
        let likelier = |a: &Refitted, b: &Refitted| a.fit.log_evidence.total_cmp(&b.fit.log_evidence);
        all.extend(points.iter().filter_map(anew).max_by(likelier));
    }
    sort(&mut all);
    for (most, rounds) in &STAGES[1..] {
        let gain = |r: &Refitted| r.fit.log_evidence - baseline.fit.log_evidence;
        let least = all.first().map_or(0.0, |r| NEAR * gain(r)).max(SEEN);
        for r in all.iter_mut().take(*most).filter(|r| !r.fit.settled && gain(r) >= least) {
            let (parametric, f) = (&r.seen.parametrized.parametric, &r.fit);
            let more = fit(&baseline.raw, parametric, &f.theta, f.latent, &f.runs, effort(*rounds, 0, 0));
            r.fit = more.unwrap_or_else(|| f.clone());
        }
        sort(&mut all);
    }
    all
}

/// What leads the screen, and causes whose states push back as the joint moves: about the baseline no column shows them.
fn shortlist(baseline: &Baseline, seen: &[Candidate]) -> Vec<Candidate> {
    let mut all: Vec<Candidate> = seen.iter().take(MOST).cloned().collect();
    for cause in catalogue::all(baseline).into_iter().filter(|c| c.built() && !c.restructures()) {
        let known = |list: &[Candidate]| list.iter().find(|c| c.cause == cause).cloned();
        if cause.choice.spec().states.is_empty() || known(&all).is_some() {
            continue;
        }
        let from = |c: Candidate| Candidate { latent: baseline.fit.latent, ..c };
        let mut points: Vec<Candidate> = Candidate::points(baseline, &cause).into_iter().map(from).collect();
        let middle = points.len() / 2;
        let middle = (middle < points.len()).then(|| points.swap_remove(middle));
        all.extend(known(seen).or(middle));
    }
    all
}

fn sort(all: &mut Vec<Refitted>) {
    descending(all, |item| item.fit.log_evidence);
}
