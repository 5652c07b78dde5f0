//! Free-running simulations of the sets that lead: what the balances leave open, the hold-out has to tell.

use rayon::prelude::*;

use super::{gap_report, traces};
use crate::engine::decide::{Free, Ran, Thresholds};
use crate::engine::hypothesis::Hypothesis;
use crate::engine::problem::Compared;
use crate::engine::replay::{Complete, Replayed};
use crate::engine::search::{Fitted, Search};
use crate::engine::select::{Effort, Found, NEGLIGIBLE};

/// Iterations of a last fit, free-running.
const POLISH: usize = 20;
/// Odds (natural logarithm) of the balances that free runs cannot turn.
const SETTLED: f64 = 60.0;
/// Evidence that a cause more has to bring, lest it be tried at all.
const MORE: f64 = 60.0;
/// ... and, where the others leave some excess, this share of the evidence for them,
const SHARE: f64 = 0.02;
/// ... or this share of that excess.
const NOTABLE: f64 = 0.15;

/// A set that ran freely.
#[derive(Clone, Debug)]
pub(super) struct Contender {
    /// Which of the sets that were fitted.
    pub at: usize,
    /// Fitted free-running.
    pub complete: Complete,
    /// Held-out recordings.
    pub shown: Replayed,
    /// Their gap.
    pub after: f64,
}

/// The model as it is and with its own parameters fitted, on the held-out recordings.
pub(super) struct Ground<'a> {
    /// Search that found the sets.
    pub search: &'a Search<'a>,
    /// Held-out recordings.
    pub runs: &'a [Compared],
    /// With the parameters as they were given.
    pub before: Replayed,
    /// With them fitted.
    pub tuned: Replayed,
    /// What noise leaves, by recording and channel.
    pub floors: Vec<Vec<f64>>,
    /// For what is drawn.
    pub seed: u64,
    /// Where the lines between verdicts are.
    pub limits: Thresholds,
}

impl Ground<'_> {
    /// Gaps with `after` in the place of the model with causes.
    pub(super) fn free(&self, after: &Replayed) -> Option<Free> {
        let shown = [&self.before, &self.tuned, after];
        let traces = traces(self.search.case, shown, &self.floors);
        gap_report(&traces, self.seed).overall.map(|g| Free {
            before: g.before,
            tuned: g.tuned,
            after: g.after,
            floor: g.floor,
        })
    }

    fn run(&self, found: &Found, at: usize) -> Option<Contender> {
        let complete = self.search.polish(&found.sets[at], POLISH);
        let shown = self.search.replay(&complete, self.runs).ok()?;
        let after = self.free(&shown)?.after;
        Some(Contender { at, complete, shown, after })
    }

    /// Lets run freely: the chosen set, sets with one cause more or less that the balances favour, and the likeliest
    /// rivals; where no effect was chosen, the single effects that lead. A gap up to `near` leaves nothing to be found.
    pub(super) fn contest(&self, found: &mut Found, near: f64, effort: Effort) -> Vec<Contender> {
        let chosen = found.best.clone();
        let best = &chosen.stated.set;
        let claims = best.iter().any(Hypothesis::is_effect);
        // What the balances have settled no free run can turn.
        let open = |f: &Fitted| {
            let n = self.limits.independent(&chosen);
            f.concentrated(n) + 0.5 * f.occam > chosen.concentrated(n) + 0.5 * chosen.occam - SETTLED
        };
        let plain = found.plain.evidence(1.0);
        let kind = |f: &Fitted| {
            let set = &f.stated.set;
            let shared = set.iter().filter(|h| best.contains(h)).count();
            match () {
                () if !set.iter().any(Hypothesis::is_effect) => None,
                () if !claims => (set.len() == 1 && f.evidence(1.0) > plain + 20.0).then_some(Kind::Rival),
                () if shared == best.len() && set.len() == best.len() => Some(Kind::Best),
                () if shared == best.len() && set.len() == best.len() + 1 => {
                    let gained = f.evidence(1.0) - chosen.evidence(1.0);
                    let (left, before) = (f.excess(), chosen.excess());
                    // What the others leave is the form of a law, unless it is nothing.
                    let told = before < NEGLIGIBLE
                        || gained > SHARE * (chosen.evidence(1.0) - plain)
                        || before - left > NOTABLE * before.max(0.0) && before - left > NEGLIGIBLE;
                    (gained > MORE && told).then_some(Kind::More)
                }
                () if shared + 1 == best.len() && set.len() + 1 == best.len() => Some(Kind::Fewer),
                () if shared + 1 == best.len() && set.len() == best.len() => open(f).then_some(Kind::Rival),
                () => None,
            }
        };
        let mut all: Vec<Contender> = Vec::new();
        for wanted in [Kind::Best, Kind::More, Kind::Fewer, Kind::Rival] {
            let good = all.iter().any(|c| c.after <= near);
            let most = match wanted {
                Kind::Best | Kind::Fewer => 1,
                Kind::More if good => 0,
                Kind::More => 4,
                Kind::Rival if claims => 1 + usize::from(!good),
                Kind::Rival => 3,
            };
            if wanted == Kind::More && most > 0 && claims {
                self.search.grow(found, effort);
            }
            let mut order: Vec<usize> = (0..found.sets.len()).collect();
            order.sort_by(|a, b| found.sets[*b].evidence(1.0).total_cmp(&found.sets[*a].evidence(1.0)));
            // Of one cause in one place the better of its forms.
            let new = |at: usize| found.sets[at].stated.set.iter().find(|h| !best.contains(h));
            let like = order.into_iter().filter(|at| kind(&found.sets[*at]) == Some(wanted));
            let effects = like.filter(|at| new(*at).is_none_or(Hypothesis::is_effect));
            let list = first_of_each(effects, |at| new(at).map(|h| (&*h.id, &*h.component)), most);
            all.par_extend(list.into_par_iter().filter_map(|at| self.run(found, at)));
        }
        // Nothing of that helps: the effects that lead by themselves.
        let tuned = self.free(&self.tuned).map_or(0.0, |f| f.tuned);
        if claims && all.iter().all(|c| c.after > 0.7 * tuned) {
            let id = |at: usize| match &found.sets[at].stated.set[..] {
                [h] if h.is_effect() => Some(&*h.id),
                _ => None,
            };
            let singles = (0..found.sets.len()).filter(|at| id(*at).is_some());
            let mut list = first_of_each(singles, id, 4);
            list.retain(|at| all.iter().all(|c| c.at != *at));
            all.par_extend(list.into_par_iter().filter_map(|at| self.run(found, at)));
        }
        all
    }

    /// How far the predictions of two are apart, as a gap.
    pub(super) fn apart(&self, a: &Contender, b: &Contender) -> Option<f64> {
        let case = self.search.case;
        let mut shown = traces(case, [&b.shown, &b.shown, &b.shown], &self.floors);
        let held = a.shown.iter().flatten();
        shown.iter_mut().zip(held).for_each(|(t, y)| t.measured.clone_from(y));
        gap_report(&shown, self.seed).overall.map(|g| g.after)
    }
}

/// The first of each key, as many as `most`.
fn first_of_each<K: PartialEq>(
    list: impl Iterator<Item = usize>,
    key: impl Fn(usize) -> K,
    most: usize,
) -> Vec<usize> {
    let mut seen: Vec<(K, usize)> = Vec::new();
    for at in list {
        let key = key(at);
        if seen.len() < most && !seen.iter().any(|s| s.0 == key) {
            seen.push((key, at));
        }
    }
    seen.into_iter().map(|s| s.1).collect()
}

/// What ran.
pub(super) struct Contest<'a> {
    /// Where.
    pub ground: &'a Ground<'a>,
    /// The sets.
    pub contenders: &'a [Contender],
}

impl Contest<'_> {
    fn find(&self, set: usize) -> Option<&Contender> {
        self.contenders.iter().find(|c| c.at == set)
    }
}

impl Ran for Contest<'_> {
    fn after(&self, set: usize) -> Option<f64> {
        self.find(set).map(|c| c.after)
    }
    fn apart(&self, a: usize, b: usize) -> Option<f64> {
        self.ground.apart(self.find(a)?, self.find(b)?)
    }
}

/// What a set is to the chosen one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Best,
    More,
    Fewer,
    Rival,
}
