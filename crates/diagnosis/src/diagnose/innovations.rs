//! A verdict by the likelihood of the innovations (crate `hypotheses`), told in the terms of a report.

use trueup_estimation::fit::Fit;
use trueup_estimation::unknown::ParametricJoint;
use trueup_hypotheses::catalogue::Cause;
use trueup_hypotheses::refit::Refitted;
use trueup_hypotheses::search::Found as Fits;
use trueup_hypotheses::verdict::{Kind, Verdict as Judged};

use crate::engine::decide::Decision;
use crate::engine::hypothesis::{Claim, Hypothesis, Times};
use crate::engine::search::{Fitted, Search};
use crate::engine::select::Found;
use crate::outcome::Verdict;

/// Odds (natural logarithm) below which two causes are not told apart: the set that holds nine tenths.
const APART: f64 = 2.2;

/// The hypotheses as sets, and the verdict as a decision; `None` where the model with a claim cannot be run.
pub(super) fn told(search: &Search<'_>, fits: &Fits, judged: &Judged) -> Option<(Found, Decision)> {
    let base = &fits.baseline;
    let plain = set(search, &[], &base.parametric, &base.fit)?;
    let claimed = judged.kind == Kind::Effects;
    let with = |causes: &[&Cause], r: &Refitted| set(search, causes, &r.seen.parametrized.parametric, &r.fit);
    let singles: Vec<(usize, Fitted)> = (fits.singles.iter().enumerate())
        .filter_map(|(k, r)| Some((k, with(&[&r.seen.cause], r)?)))
        .collect();
    let pair = judged.pair.filter(|_| claimed).map(|k| &fits.pairs[k]);
    let best = match (pair, judged.single.filter(|_| claimed)) {
        (Some((first, r)), _) => with(&[&fits.singles[*first].seen.cause, &r.seen.cause], r)?,
        (None, Some(k)) => singles.iter().find(|s| s.0 == k)?.1.clone(),
        (None, None) => plain.clone(),
    };
    let first = fits.singles.first().map_or(0.0, |r| r.fit.log_evidence);
    let odds = |k: usize| (fits.singles[k].fit.log_evidence - first) / trueup_hypotheses::levels::TEMPERATURE;
    let mut sets: Vec<Fitted> = singles.iter().map(|s| s.1.clone()).collect();
    let rivals: Vec<Vec<(usize, f64)>> = if pair.is_some() {
        vec![Vec::new(); best.stated.set.len()]
    } else {
        let other = |(at, (k, _)): (usize, &(usize, Fitted))| (*k > 0).then(|| (at, odds(*k)));
        vec![singles.iter().enumerate().filter_map(other).collect(); best.stated.set.len()]
    };
    sets.push(best.clone());
    let near = rivals.iter().flatten().any(|r| -r.1 < APART);
    let verdict = match judged.kind {
        Kind::NoGap => Verdict::NoGap,
        Kind::Parameters => Verdict::Parameters,
        Kind::Unknown => Verdict::Unknown,
        Kind::Effects if near => Verdict::Ambiguous,
        Kind::Effects => Verdict::Effects,
    };
    let own = if pair.is_some() {
        1.0 - judged.unknown
    } else {
        judged.probabilities.first().copied().unwrap_or(0.0)
    };
    let decision = Decision {
        verdict,
        probability: vec![own; best.stated.set.len()],
        rivals,
        explained: judged.share.clamp(0.0, 1.0),
        blind: false,
        closed: judged.share.clamp(0.0, 1.0),
        unknown: judged.unknown,
        odds: APART,
    };
    Some((Found { plain, sets, best }, decision))
}

/// A set of causes where the filter has its unknowns.
fn set(search: &Search<'_>, causes: &[&Cause], parametric: &ParametricJoint, fit: &Fit) -> Option<Fitted> {
    let set: Option<Vec<Hypothesis>> = causes.iter().map(|c| hypothesis(search, c)).collect();
    let stated = search.state(&set?).ok()?;
    let mut start = search.compare(&stated).start();
    for (x, u) in start.iter_mut().zip(&stated.unknowns).filter(|(_, u)| u.run.is_none()) {
        if let Some(k) = parametric.unknowns.iter().position(|v| v.target == u.target) {
            let value = parametric.unknowns[k].scale.value(fit.theta[k]).0;
            *x = u.scale.coordinate(value.clamp(u.lower, u.upper));
        }
    }
    search.standing(stated, start)
}

fn hypothesis(search: &Search<'_>, cause: &Cause) -> Option<Hypothesis> {
    let own = |h: &&Hypothesis| matches!(h.claim, Claim::Effect(c) if c == cause.choice);
    let several = |h: &&Hypothesis| own(h) && (!h.is_push() || h.times == Times::Several);
    search.causes.iter().find(several).or_else(|| search.causes.iter().find(own)).cloned()
}
