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
/// As many of them are fitted so briefly,
const HINTS: usize = 8;
const BRIEF: usize = 6;
/// and of these the nearest as many in full.
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
        let (stated, start) = self.search.beside(self.fitted.as_ref()?, set)?;
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
        let mut all = self.lacked(found, base, effort, None, &[]);
        let best = all.iter().min_by(|a, b| a.after.total_cmp(&b.after));
        let Some(best) = best.filter(|b| !self.is_near(b)).and_then(|b| b.fitted.clone()) else { return all };
        let Some(base) = self.search.without(&best) else { return all };
        let better = self.lacked(found, &base, effort, None, &all);
        merge(&mut all, better);
        all
    }

    /// Of what `base`, which runs freely, lacks those that come nearest, fitted freely; of those that `ran` what does better.
    fn lacked(
        &self,
        found: &mut Found,
        base: &Fitted,
        effort: Effort,
        led: Option<&Fitted>,
        ran: &[Contender],
    ) -> Vec<Contender> {
        let mut all: Vec<Asked> = Vec::new();
        for asked in self.search.lacking(base, HINT) {
            // Of the forms of one cause in one place the likeliest.
            let cause = |a: &Asked| a.stated.set.last().cloned();
            let like = |a: &Asked| cause(a).zip(cause(&asked)).is_some_and(|(a, b)| a.same_place(&b));
            if all.len() < HINTS && !all.iter().any(like) {
                all.push(asked);
            }
        }
        // A look from afar says little of a fit, some steps of it say more.
        let brief = |a: Asked| self.search.polished(a.stated, &a.start, BRIEF);
        let mut begun: Vec<Polished> = all.into_par_iter().filter_map(brief).collect();
        begun.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        let begun = begun.into_iter().take(TRIED).filter_map(|p| p.fitted);
        self.settled(found, begun.map(|f| (f.stated, f.theta)).collect(), effort, led, ran)
    }

    /// Sets that are fitted free-running first, from where they are given, and then by their balances from there, or from
    /// where `led` had them if that is better; of those that `ran` what does better.
    fn settled(
        &self,
        found: &mut Found,
        all: Vec<(Stated, Vec<f64>)>,
        effort: Effort,
        led: Option<&Fitted>,
        ran: &[Contender],
    ) -> Vec<Contender> {
        let run = |(stated, start): (Stated, Vec<f64>)| {
            let polished = self.search.polished(stated, &start, POLISH)?;
            let from = polished.fitted.as_ref()?;
            let stated = self.search.state(&from.stated.set).ok()?;
            let starts = [Some(stated.begin_with(&[from])), led.map(|led| stated.begin_with(&[led, from]))];
            let fit = |start: Vec<f64>| self.search.fit(stated.clone(), &start, effort.options()).ok();
            let fits = starts.into_iter().flatten().filter_map(fit);
            Some((fits.max_by(|a, b| a.evidence(1.0).total_cmp(&b.evidence(1.0)))?, polished))
        };
        let fitted: Vec<(Fitted, Polished)> = all.into_par_iter().filter_map(run).collect();
        let shown = |(led, polished): (Fitted, Polished)| {
            let old = ran.iter().find(|c| same(&found.sets[c.at].stated.set, &led.stated.set));
            let new = self.shown(found.sets.len(), polished)?;
            // The fit by the balances belongs to its run.
            let stands = old.is_none_or(|old| new.after < old.after);
            stands.then(|| Contender { at: put(&mut found.sets, led), ..new })
        };
        fitted.into_iter().filter_map(shown).collect()
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
            merge(&mut all, lacking);
            self.beside_best(found, effort, &mut all);
        }
        let late = late_where(found, &all).and_then(|at| self.run(found, at));
        all.extend(late);
        all
    }

    /// Sets with a cause more than the plain model, beside the free run of its parameters.
    fn more_than_plain(&self, found: &mut Found, effort: Effort, ran: &[Contender]) -> Vec<Contender> {
        let plain = found.plain.clone();
        self.more(found, &plain, self.fitted.as_ref(), effort, ran)
    }

    /// Fits the best of these further, where it falls short.
    fn refine(&self, all: &mut [Contender], of: impl Fn(&Contender) -> bool) {
        let best = all.iter_mut().filter(|c| of(c)).min_by(|a, b| a.after.total_cmp(&b.after));
        let Some(best) = best.filter(|best| !self.is_near(best)) else { return };
        let further = |f: &Fitted| self.search.polished(f.stated.clone(), &f.theta, 2 * POLISH);
        let further = best.fitted.as_ref().and_then(further).and_then(|p| self.shown(best.at, p));
        if let Some(further) = further.filter(|f| f.after < best.after) {
            *best = further;
        }
    }

    /// A second cause beside the single one that helps most, where that falls short even once it is fitted further.
    fn beside_best(&self, found: &mut Found, effort: Effort, all: &mut Vec<Contender>) {
        let bare = self.free(&self.tuned).unwrap_or_default().bare();
        let helps = |c: &Contender| c.after <= HELPS * bare && found.sets[c.at].stated.set.len() == 1;
        self.refine(all, helps);
        let best = all.iter().filter(|c| helps(c)).min_by(|a, b| a.after.total_cmp(&b.after));
        let Some(base) = best.filter(|b| !self.is_near(b)).and_then(|b| b.fitted.clone()) else { return };
        let lacked = self.lacked(found, &base, effort, None, &[]);
        let tried: Vec<usize> = lacked.iter().map(|c| c.at).collect();
        merge(all, lacked);
        self.refine(all, |c| tried.contains(&c.at));
        // Either of the two may do as well alone: the other showed it the way.
        if let Some(pair) = far_better(all, &tried).and_then(|c| c.fitted.clone()) {
            let each = without_each(&pair.stated.set, &pair.stated.set, &[]);
            let alone = self.from(found, &pair, each, effort, all);
            merge(all, alone);
        }
    }

    /// A second cause beside the claim, the only one in `all`, whose free run falls short: of those that the balances ask for,
    /// and of those that they do not see, for these they have nothing against.
    fn second(&self, found: &mut Found, effort: Effort, all: &mut Vec<Contender>) {
        let Some((at, base)) = all.first().map(|c| (c.at, c.fitted.clone())) else { return };
        let led = found.sets[at].clone();
        all.extend(self.more(found, &led, base.as_ref(), effort, all));
        let Some(base) = base.filter(|_| !all.iter().any(|c| self.is_near(c))) else { return };
        let lacked = self.lacked(found, &base, effort, Some(&led), &[]);
        let tried: Vec<usize> = lacked.iter().map(|c| c.at).collect();
        merge(all, lacked);
        let against = |c: &Contender| found.sets[c.at].evidence(1.0) <= led.evidence(1.0) - MORE;
        all.retain(|c| !(tried.contains(&c.at) && against(c)));
        self.refine(all, |c| tried.contains(&c.at));
        if let Some(best) = far_better(all, &tried).and_then(|c| c.fitted.clone()) {
            all.extend(self.replacing(found, &led, &best, effort, all));
        }
    }

    /// `best`, which does far better than `led` that it grew out of, without each of the causes of `led`: these may have stood
    /// in for the one that was missing.
    fn replacing(
        &self,
        found: &mut Found,
        led: &Fitted,
        best: &Fitted,
        effort: Effort,
        ran: &[Contender],
    ) -> Vec<Contender> {
        let ran: Vec<&[Hypothesis]> = ran.iter().map(|c| &found.sets[c.at].stated.set[..]).collect();
        self.from(found, best, without_each(&best.stated.set, &led.stated.set, &ran), effort, &[])
    }
    /// Sets with some of the causes of `best`, from where that ended.
    fn from(
        &self,
        found: &mut Found,
        best: &Fitted,
        sets: Vec<Vec<Hypothesis>>,
        effort: Effort,
        ran: &[Contender],
    ) -> Vec<Contender> {
        let begun = |set: Vec<Hypothesis>| {
            let stated = self.search.state_like(&set, best.stated.free.clone()).ok()?;
            let start = self.search.begin_with(&stated, best);
            Some((stated, start))
        };
        self.settled(found, sets.into_iter().filter_map(begun).collect(), effort, None, ran)
    }

    /// How far the predictions of two are apart, as a gap.
    pub(super) fn apart(&self, a: &Contender, b: &Contender) -> Option<f64> {
        let pooled = self.beside(|run, channel| &a.shown[run][channel], [&b.shown; 3]);
        self.together(&pooled, pooled.each().iter().map(|g| g.after))
    }
}

/// Adds those that ran to the others; of the same set the new one takes the place of the old one.
fn merge(all: &mut Vec<Contender>, new: Vec<Contender>) {
    for new in new {
        match all.iter_mut().find(|old| old.at == new.at) {
            Some(old) => *old = new,
            None => all.push(new),
        }
    }
}

/// The best of those that were `tried` last, if it does far better than the others.
fn far_better<'c>(all: &'c [Contender], tried: &[usize]) -> Option<&'c Contender> {
    let (tried, others): (Vec<_>, Vec<_>) = all.iter().partition(|c| tried.contains(&c.at));
    let without = others.iter().map(|c| c.after).fold(f64::INFINITY, f64::min);
    let best = tried.into_iter().filter(|c| c.after <= HELPS * without);
    best.min_by(|a, b| a.after.total_cmp(&b.after))
}

/// A set without each of the causes of `led` that it has; none that `ran`, and none without effects.
fn without_each(set: &[Hypothesis], led: &[Hypothesis], ran: &[&[Hypothesis]]) -> Vec<Vec<Hypothesis>> {
    let fewer = |out: &Hypothesis| set.iter().filter(|h| *h != out).cloned().collect::<Vec<_>>();
    let new = |set: &Vec<Hypothesis>| {
        set.iter().any(Hypothesis::is_effect) && !ran.iter().any(|ran| same(ran, set))
    };
    led.iter().map(fewer).filter(new).collect()
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
    fn one_sensor(&self) -> bool {
        let runs = &self.ground.search.case.train;
        runs.iter().all(|r| r.run.channels.len() == 1 && r.run.drives.len() == 1)
    }
    fn each(&self, set: usize) -> Option<Vec<f64>> {
        Some(self.ground.of_each(&self.find(set)?.shown))
    }
}

/// The likeliest set that did not run and has a late reading where the best of those that did has a late command, or the other
/// way round.
fn late_where(found: &Found, ran: &[Contender]) -> Option<usize> {
    let best = &found.sets[ran.iter().min_by(|a, b| a.after.total_cmp(&b.after))?.at];
    let late = (0..found.sets.len()).filter(|at| found.sets[*at].is_late_where(best));
    let likeliest =
        |a: &usize, b: &usize| found.sets[*a].evidence(1.0).total_cmp(&found.sets[*b].evidence(1.0));
    late.max_by(likeliest).filter(|at| ran.iter().all(|c| c.at != *at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::made::{causes, fitted, found, stated};

    /// Contenders by their sets and the gaps of their free runs.
    fn ran(all: &[(usize, f64)]) -> Vec<Contender> {
        let complete = Complete { stated: stated(Vec::new()), theta: Vec::new() };
        let one = |&(at, after): &(usize, f64)| {
            let (complete, shown) = (complete.clone(), Vec::new());
            Contender { at, complete, shown, after, fitted: None }
        };
        all.iter().map(one).collect()
    }

    #[test]
    fn of_one_set_the_new_run_stands() {
        let mut all = ran(&[(3, 5.0), (1, 4.0)]);
        merge(&mut all, ran(&[(1, 6.0), (2, 7.0), (3, 2.0)]));
        let merged: Vec<_> = all.iter().map(|c| (c.at, c.after)).collect();
        assert_eq!(merged, [(3, 2.0), (1, 6.0), (2, 7.0)]);
    }

    #[test]
    fn what_was_tried_last_has_to_do_far_better() {
        let best = |all: &[(usize, f64)], tried: &[usize]| far_better(&ran(all), tried).map(|c| c.at);
        let all = [(0, 10.0), (1, 6.0), (2, 5.0), (3, 8.0)];
        assert_eq!(best(&all, &[1, 2]), Some(2), "5 of 8");
        assert_eq!(best(&all, &[2]), None, "5 of 6");
        assert_eq!(best(&all, &[0, 3]), None);
        assert_eq!(best(&all, &[]), None);
        assert_eq!(best(&[], &[]), None);
    }

    #[test]
    fn former_causes_are_left_out_one_by_one() {
        let [one, two, three] = ["backlash", "cable-stiffness", "sensor-delay"];
        let set = |labels: &[&str]| causes(&labels.join(" "));
        let fewer = |all: &[&str], led: &[&str], ran: &[&[&str]]| {
            let ran: Vec<Vec<Hypothesis>> = ran.iter().map(|labels| set(labels)).collect();
            let ran: Vec<&[Hypothesis]> = ran.iter().map(Vec::as_slice).collect();
            without_each(&set(all), &set(led), &ran)
        };
        let (led, all) = ([one, two], [one, two, three]);
        assert_eq!(fewer(&all, &led, &[&led, &all]), [set(&[two, three]), set(&[one, three])]);
        // In whatever order it ran.
        assert_eq!(fewer(&all, &led, &[&[three, two]]), [set(&[one, three])]);
        // A parameter by itself is no explanation.
        assert!(fewer(&[one, "motorInertia"], &[one], &[]).is_empty());
    }

    #[test]
    fn the_likeliest_that_is_late_elsewhere_runs_as_well() {
        let late = |ran_so_far: &[(usize, f64)]| {
            let left = [
                ("actuator-lag", 3.0),
                ("sensor-delay:motorAngle", 5.0),
                ("sensor-delay:loadAngle", 2.0),
                ("backlash", 1.0),
            ];
            let sets = left.iter().map(|(set, left)| fitted(set, *left, 10.0)).collect();
            late_where(&found(sets, None, 10.0), &ran(ran_so_far))
        };
        assert_eq!(late(&[(3, 4.0), (0, 2.0)]), Some(2), "a reading instead of the command");
        assert_eq!(late(&[(2, 2.0), (3, 4.0)]), Some(0), "a command instead of the reading");
        assert_eq!(late(&[(0, 2.0), (2, 3.0)]), None, "it ran");
        assert_eq!(late(&[(3, 2.0), (0, 4.0)]), None, "nothing is late in the best");
        assert_eq!(late(&[]), None);
    }
}
