//! A verdict by the likelihood of the innovations (crate `hypotheses`), told in the terms of a report.

use trueup_estimation::fit::Fit;
use trueup_estimation::unknown::ParametricJoint;
use trueup_hypotheses::catalogue::Cause;
use trueup_hypotheses::levels::APART;
use trueup_hypotheses::refit::Refitted;
use trueup_hypotheses::search::Found as Fits;
use trueup_hypotheses::verdict::{Kind, Verdict as Judged};

use crate::engine::decide::Decision;
use crate::engine::hypothesis::{Claim, Hypothesis, Times};
use crate::engine::search::{Fitted, Search};
use crate::engine::select::Found;
use crate::outcome::Verdict;

/// The hypotheses as sets, and the verdict as a decision; `None` where the model with a claim cannot be run.
pub(super) fn told(search: &Search<'_>, fits: &Fits, judged: &Judged) -> Option<(Found, Decision)> {
    let base = &fits.baseline;
    let plain = set(search, &[], &base.parametric, &base.fit)?;
    let with = |causes: &[&Cause], r: &Refitted| set(search, causes, &r.seen.parametrized.parametric, &r.fit);
    let singles: Vec<(usize, Fitted)> = (fits.singles.iter().enumerate())
        .filter_map(|(k, r)| Some((k, with(&[&r.seen.cause], r)?)))
        .collect();
    let claimed = matches!(judged.kind, Kind::Effects | Kind::Ambiguous);
    let pair = fits.pairs.first().filter(|_| claimed && judged.two);
    let best = match pair {
        Some((first, r)) => with(&[&fits.singles[*first].seen.cause, &r.seen.cause], r)?,
        None if claimed => singles.first().filter(|s| s.0 == 0)?.1.clone(),
        None => plain.clone(),
    };
    let rival = |(at, (k, _)): (usize, &(usize, Fitted))| (*k > 0).then(|| (at, judged.odds[*k]));
    let rivals: Vec<(usize, f64)> = match pair {
        Some(_) => Vec::new(),
        None => singles.iter().enumerate().filter_map(rival).collect(),
    };
    let own = match pair {
        Some(_) => 1.0 - judged.unknown,
        None => judged.probabilities.first().copied().unwrap_or(0.0),
    };
    let causes = best.stated.set.len();
    let decision = Decision {
        verdict: match judged.kind {
            Kind::NoGap => Verdict::NoGap,
            Kind::Parameters => Verdict::Parameters,
            Kind::Effects => Verdict::Effects,
            Kind::Ambiguous => Verdict::Ambiguous,
            Kind::Unknown => Verdict::Unknown,
        },
        probability: vec![own; causes],
        rivals: vec![rivals; causes],
        explained: judged.share.clamp(0.0, 1.0),
        blind: false,
        closed: judged.share.clamp(0.0, 1.0),
        unknown: judged.unknown,
        odds: APART,
        unmoved: false,
        left_out: None,
    };
    let sets = singles.into_iter().map(|s| s.1).chain([best.clone()]).collect();
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
