//! Free-running simulations of the sets that lead: what the balances leave open, the hold-out has to tell.

use rayon::prelude::*;

use super::field::{self, Field, Kind};
use super::ground::Ground;
use crate::engine::decide::Ran;
use crate::engine::hypothesis::Hypothesis;
use crate::engine::replay::{Complete, Polished, Replayed};
use crate::engine::screen::Asked;
use crate::engine::search::{Fitted, Stated};
use crate::engine::select::{Effort, Found, put, same};

/// Iterations of a last fit, free-running.
const POLISH: usize = 20;
/// Evidence that a cause more has to bring, lest it be tried at all,
const MORE: f64 = 10.0;
/// and the share that it would explain of what a free run misses without it.
const MISSED: f64 = 0.3;
/// ... and where the balances see nothing: one look from afar says little of a fit.
const HINT: f64 = 0.1;
/// As many of them are tried.
const TRIED: usize = 3;

/// A free run that leaves at most this share of a gap helps.
const HELPS: f64 = 0.7;

/// A set that ran freely.
#[derive(Clone, Debug)]
pub(super) struct Contender {
    /// Which of the sets that were fitted.
    pub at: usize,
    /// Fitted free-running.
    pub complete: Complete,
    /// Held-out recordings.
    pub shown: Replayed,
    /// Their gap, channels weighed as the ground weighs them.
    pub after: f64,
    /// The free-running fit.
    pub fitted: Option<Fitted>,
}

impl Ground<'_> {
    fn run(&self, found: &Found, at: usize) -> Option<Contender> {
        let set = &found.sets[at];
        let mut polished = self.search.polish(set, POLISH);
        // Worse than without its effects: from where these were left out.
        if polished.misfit > self.misfit
            && let Some(beside) = self.beside_tuned(set).filter(|p| p.misfit < polished.misfit)
        {
            polished = beside;
        }
        self.shown(at, polished)
    }
    /// A set fitted free-running from where the model without effects ended.
    fn beside_tuned(&self, set: &Fitted) -> Option<Polished> {
        let base = self.fitted.as_ref()?;
        let stated = self.search.state_like(&set.stated.set, base.stated.free.clone()).ok()?;
        let there = |u| base.coordinate_of(u).or_else(|| set.coordinate_of(u));
        let start: Vec<f64> =
            stated.unknowns.iter().map(|u| there(u).unwrap_or_else(|| u.coordinate())).collect();
        self.search.polished(stated, &start, POLISH)
    }
    fn shown(&self, at: usize, polished: Polished) -> Option<Contender> {
        let Polished { complete, fitted, .. } = polished;
        let shown = self.search.replay(&complete, self.runs).ok()?;
        let after = self.free(&shown)?.after;
        Some(Contender { at, complete, shown, after, fitted })
    }

    /// Sets with a cause more than `led`, those that explain most of what `base`, running freely, misses.
    fn more(
        &self,
        found: &mut Found,
        led: &Fitted,
        base: Option<&Fitted>,
        effort: Effort,
        ran: &[Contender],
    ) -> Vec<Contender> {
        let Some(base) = base else { return Vec::new() };
        self.search.grow(found, led, effort);
        let set = &led.stated.set;
        let grown = |f: &Fitted| {
            f.stated.set.len() == set.len() + 1
                && set.iter().all(|h| f.stated.set.contains(h))
                && f.stated.set.iter().any(|h| h.is_effect() && !set.contains(h))
                && f.evidence(1.0) > led.evidence(1.0) + MORE
        };
        let new = |at: &usize| ran.iter().all(|c| c.at != *at);
        let places: Vec<usize> =
            (0..found.sets.len()).filter(new).filter(|at| grown(&found.sets[*at])).collect();
        let ask = |at: usize| Some((at, self.search.asked(base, &found.sets[at])?));
        let mut all: Vec<(usize, Asked)> = places.into_par_iter().filter_map(ask).collect();
        all.retain(|a| a.1.share > MISSED);
        all.sort_by(|a, b| b.1.share.total_cmp(&a.1.share));
        all.truncate(TRIED);
        let run = |(at, a): (usize, Asked)| self.shown(at, self.search.polished(a.stated, &a.start, POLISH)?);
        all.into_par_iter().filter_map(run).collect()
    }

    /// Single effects that explain much of what `self.fitted`, running freely, misses, whatever the balances say of them:
    /// these do not see what happens in reversals, nor much behind coarse encoders. Where none of them comes near, parameters
    /// were dragged too far to look from: others are looked at from where the best of them ended.
    fn lacking(&self, found: &mut Found, effort: Effort) -> Vec<Contender> {
        let Some(base) = &self.fitted else { return Vec::new() };
        let mut all = self.lacked(found, base, effort);
        let best = all.iter().min_by(|a, b| a.after.total_cmp(&b.after));
        let Some(best) = best.filter(|b| !self.is_near(b)).and_then(|b| b.fitted.clone()) else { return all };
        let Some(base) = self.search.without(&best) else { return all };
        for other in self.lacked(found, &base, effort) {
            match all.iter_mut().find(|c| c.at == other.at) {
                Some(c) if other.after < c.after => *c = other,
                Some(_) => {}
                None => all.push(other),
            }
        }
        all
    }

    fn lacked(&self, found: &mut Found, base: &Fitted, effort: Effort) -> Vec<Contender> {
        let mut all = self.search.lacking(base, HINT);
        all.truncate(TRIED);
        self.settled(found, all.into_iter().map(|a| (a.stated, a.start)).collect(), effort)
    }

    /// Sets that are fitted free-running first, from where they are given, and then by their balances from there.
    fn settled(&self, found: &mut Found, all: Vec<(Stated, Vec<f64>)>, effort: Effort) -> Vec<Contender> {
        let run = |(stated, start): (Stated, Vec<f64>)| {
            let polished = self.search.polished(stated, &start, POLISH)?;
            let from = polished.fitted.as_ref()?;
            let stated = self.search.state(&from.stated.set).ok()?;
            let start = self.search.begin_with(&stated, from);
            Some((self.search.fit(stated, &start, effort.options()).ok()?, polished))
        };
        let ran: Vec<(Fitted, Polished)> = all.into_par_iter().filter_map(run).collect();
        ran.into_iter()
            .filter_map(|(led, polished)| self.shown(put(&mut found.sets, led), polished))
            .collect()
    }

    /// Noise carried through the model that is the best so far.
    fn carry(&mut self, best: &Contender) {
        let tuned = self.free(&self.tuned).map_or(f64::INFINITY, |f| f.tuned);
        if best.after < tuned
            && let Ok(floors) = self.search.floors(&best.complete, self.runs, self.seed)
        {
            self.floors = floors;
        }
    }
    fn is_near(&self, c: &Contender) -> bool {
        self.free(&c.shown).is_some_and(|f| f.after <= self.limits.free_runs.near * f.floor)
    }

    /// Lets run freely: the chosen set, sets with one cause more or less that the balances favour, and the likeliest
    /// rivals; where no effect was chosen, the single effects that lead. A gap near the floor leaves nothing to be found.
    pub(super) fn contest(&mut self, found: &mut Found, effort: Effort) -> Vec<Contender> {
        let field = Field::new(found, self.limits);
        let mut all = if field.claims { Vec::new() } else { self.more_than_plain(found, effort, &[]) };
        for wanted in [Kind::Best, Kind::Fewer, Kind::Rival] {
            let good = all.iter().any(|c| self.is_near(c));
            let ran: Vec<usize> = all.iter().map(|c| c.at).collect();
            let list = field.entrants(found, wanted, good, &ran);
            all.par_extend(list.into_par_iter().filter_map(|at| self.run(found, at)));
            if let (Kind::Best, [best]) = (wanted, &all[..]) {
                self.carry(best);
                if field.claims && !self.is_near(best) {
                    self.second(found, effort, &mut all);
                }
            }
        }
        let bare = self.free(&self.tuned).unwrap_or_default();
        let help = |all: &[Contender], gap: f64| all.iter().any(|c| c.after <= HELPS * gap);
        if field.claims && !help(&all, bare.tuned) {
            all.extend(self.more_than_plain(found, effort, &all));
            let ran: Vec<usize> = all.iter().map(|c| c.at).collect();
            let list = field::leading(found, &ran);
            all.par_extend(list.into_par_iter().filter_map(|at| self.run(found, at)));
        }
        let seen = found.above(found.plain.excess());
        let blind = seen < self.limits.gap.left || seen < self.limits.gap.bare && !help(&all, bare.bare());
        if blind && !all.iter().any(|c| self.is_near(c)) {
            let lacking = self.lacking(found, effort);
            all.retain(|c| lacking.iter().all(|l| l.at != c.at));
            all.extend(lacking);
        }
        all
    }

    /// Sets with a cause more than the plain model, beside the free run of its parameters.
    fn more_than_plain(&self, found: &mut Found, effort: Effort, ran: &[Contender]) -> Vec<Contender> {
        let plain = found.plain.clone();
        self.more(found, &plain, self.fitted.as_ref(), effort, ran)
    }

    /// A second cause beside the claim, the only one in `all`, whose free run falls short: of those that the balances ask for,
    /// and of those that they do not see, for these they have nothing against.
    fn second(&self, found: &mut Found, effort: Effort, all: &mut Vec<Contender>) {
        let Some((at, base)) = all.first().map(|c| (c.at, c.fitted.clone())) else { return };
        let led = found.sets[at].clone();
        all.extend(self.more(found, &led, base.as_ref(), effort, all));
        let Some(base) = base.filter(|_| !all.iter().any(|c| self.is_near(c))) else { return };
        let lacked = self.lacked(found, &base, effort);
        all.retain(|c| lacked.iter().all(|l| l.at != c.at));
        let against = |c: &Contender| found.sets[c.at].evidence(1.0) <= led.evidence(1.0) - MORE;
        let lacked = lacked.into_iter().filter(|c| !against(c)).collect();
        self.replacing(found, &led, lacked, effort, all);
    }

    /// Beside a set that does far better than `led`, which it grew out of: the same without each of the causes of `led`. These
    /// may have stood in for the one that was missing.
    fn replacing(
        &self,
        found: &mut Found,
        led: &Fitted,
        lacked: Vec<Contender>,
        effort: Effort,
        all: &mut Vec<Contender>,
    ) {
        let without = all.iter().map(|c| c.after).fold(f64::INFINITY, f64::min);
        let best = lacked.iter().filter(|c| c.after <= HELPS * without);
        let best = best.min_by(|a, b| a.after.total_cmp(&b.after)).and_then(|c| c.fitted.clone());
        all.extend(lacked);
        let Some(best) = best else { return };
        let fewer = |out: &Hypothesis| {
            let set: Vec<_> = best.stated.set.iter().filter(|h| *h != out).cloned().collect();
            let new = set.iter().any(Hypothesis::is_effect)
                && !all.iter().any(|c| same(&found.sets[c.at].stated.set, &set));
            let stated = new.then(|| self.search.state_like(&set, best.stated.free.clone()).ok())??;
            let start = self.search.begin_with(&stated, &best);
            Some((stated, start))
        };
        let fewer = led.stated.set.iter().filter_map(fewer).collect();
        all.extend(self.settled(found, fewer, effort));
    }

    /// How far the predictions of two are apart, as a gap.
    pub(super) fn apart(&self, a: &Contender, b: &Contender) -> Option<f64> {
        let pooled = self.beside(|run, channel| &a.shown[run][channel], [&b.shown; 3]);
        self.together(&pooled, pooled.each().iter().map(|g| g.after))
    }
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
    fn each(&self, set: usize) -> Option<Vec<f64>> {
        Some(self.ground.of_each(&self.find(set)?.shown))
    }
}
