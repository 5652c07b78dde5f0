//! Free-running simulations of the most probable sets: what the balances leave open, the hold-out has to decide.

use trueup_identification::parallel;

use super::field::{self, RivalField, RivalKind};
use super::ground::ComparisonBasis;
use crate::engine::decide::{FreeRunResults, LeftOut};
use crate::engine::replay::{CompleteModel, FreeRunFit, ReplayedReadings};
use crate::engine::screen::RequestedCause;
use crate::engine::search::FittedSet;
use crate::engine::select::{SearchEffort, SearchResult};
use trueup_numerics::order::descending;

/// Iterations of a last fit, free-running.
pub(super) const POLISH: usize = 20;
/// Evidence that a further cause requires to be tried at all,
pub(super) const MORE: f64 = 10.0;
/// and the share that it would explain of what a free run misses without it.
const MISSED: f64 = 0.3;
/// As many of them are tried in full.
pub(super) const TRIED: usize = 3;

/// A free run that leaves at most this share of a gap helps.
pub(super) const HELPS: f64 = 0.7;

/// A set that ran freely.
#[derive(Clone, Debug)]
pub(super) struct ContendingSet {
    /// Which of the sets that were fitted.
    pub at: usize,
    /// Fitted free-running.
    pub complete: CompleteModel,
    /// Held-out recordings.
    pub shown: ReplayedReadings,
    /// Their gap, channels weighed as the ground weighs them.
    pub after: f64,
    /// The free-running fit.
    pub fitted: Option<FittedSet>,
}

impl ContendingSet {
    /// As it was fitted; what it misses of the recordings for fitting is not kept.
    pub(super) fn polished(&self) -> FreeRunFit {
        FreeRunFit { complete: self.complete.clone(), misfit: f64::NAN, fitted: self.fitted.clone() }
    }
}

impl ComparisonBasis<'_> {
    fn run(&self, found: &SearchResult, at: usize) -> Option<ContendingSet> {
        let set = &found.sets[at];
        let mut polished = self.search.polish(set, POLISH);
        // Worse than without its effects: from where these were left out.
        if polished.misfit > self.misfit
            && let Some(again) = self.polished_from_tuned(set).filter(|p| p.misfit < polished.misfit)
        {
            polished = again;
        }
        self.shown(at, polished)
    }
    /// A set fitted free-running from where the model without effects ended.
    fn polished_from_tuned(&self, set: &FittedSet) -> Option<FreeRunFit> {
        let (stated, start) = self.search.in_addition(self.fitted.as_ref()?, set)?;
        self.search.polished(stated, &start, POLISH)
    }
    pub(super) fn shown(&self, at: usize, polished: FreeRunFit) -> Option<ContendingSet> {
        let FreeRunFit { complete, fitted, .. } = polished;
        let shown = self.search.replay(&complete, self.runs).ok()?;
        let after = self.free(&shown)?.after;
        Some(ContendingSet { at, complete, shown, after, fitted })
    }

    /// Sets with a cause more than `prescribed`, those that explain most of what `base`, running freely, misses.
    pub(super) fn more(
        &self,
        found: &mut SearchResult,
        prescribed: &FittedSet,
        base: Option<&FittedSet>,
        effort: SearchEffort,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let Some(base) = base else { return Vec::new() };
        self.search.grow(found, prescribed, effort);
        let set = &prescribed.stated.set;
        let grown = |f: &FittedSet| {
            f.stated.set.len() == set.len() + 1
                && set.iter().all(|h| f.stated.set.contains(h))
                && f.stated.set.iter().any(|h| h.is_effect() && !set.contains(h))
                && f.evidence(1.0) > prescribed.evidence(1.0) + MORE
        };
        let new = |at: &usize| ran.iter().all(|c| c.at != *at);
        let places: Vec<usize> =
            (0..found.sets.len()).filter(new).filter(|at| grown(&found.sets[*at])).collect();
        let request = |at: usize| Some((at, self.search.requested(base, &found.sets[at])?));
        let mut all: Vec<(usize, RequestedCause)> =
            parallel::map(places, request).into_iter().flatten().collect();
        all.retain(|a| a.1.share > MISSED);
        descending(&mut all, |item| item.1.share);
        all.truncate(TRIED);
        let run = |(at, a): (usize, RequestedCause)| {
            self.shown(at, self.search.polished(a.stated, &a.start, POLISH)?)
        };
        parallel::map(all, run).into_iter().flatten().collect()
    }

    /// Noise carried through the model that is the best so far.
    fn carry(&mut self, best: &ContendingSet) {
        let tuned = self.free(&self.tuned).map_or(f64::INFINITY, |f| f.tuned);
        if best.after < tuned
            && let Ok(floors) = self.search.floors(&best.complete, self.runs, self.seed)
        {
            self.floors = floors;
        }
    }
    pub(super) fn is_near(&self, c: &ContendingSet) -> bool {
        self.free(&c.shown).is_some_and(|f| f.after <= self.limits.free_runs.near * f.floor)
    }

    /// Lets run freely: the chosen set, sets with one cause more or less that the balances favour, and the likeliest
    /// rivals; where no effect was chosen, the most probable single effects. A gap near the floor leaves nothing to be found.
    pub(super) fn contest(&mut self, found: &mut SearchResult, effort: SearchEffort) -> Vec<ContendingSet> {
        let field = RivalField::new(found, self.limits);
        let mut all = if field.claims { Vec::new() } else { self.more_than_plain(found, effort, &[]) };
        for rival_kind in [RivalKind::Best, RivalKind::Fewer, RivalKind::Rival] {
            self.enter(found, &field, rival_kind, &mut all);
            if let (RivalKind::Best, [best]) = (rival_kind, &all[..]) {
                self.carry(best);
                if field.claims && !self.is_near(best) {
                    self.second(found, effort, &mut all);
                }
            }
            if rival_kind == RivalKind::Fewer {
                self.fewer_still(found, &field, &mut all);
            }
        }
        let bare = self.free(&self.tuned).unwrap_or_default();
        let help = |all: &[ContendingSet], gap: f64| all.iter().any(|c| c.after <= HELPS * gap);
        if field.claims && !help(&all, bare.tuned) {
            all.extend(self.more_than_plain(found, effort, &all));
            let ran: Vec<usize> = all.iter().map(|c| c.at).collect();
            let list = field::leading(found, &ran);
            all.extend(parallel::map(list, |at| self.run(found, at)).into_iter().flatten());
        }
        let seen = found.above(found.plain.excess());
        let blind = seen < self.limits.gap.left || seen < self.limits.gap.bare && !help(&all, bare.bare());
        if blind && !all.iter().any(|c| self.is_near(c)) {
            let lacking = self.lacking(found, effort);
            merge(&mut all, lacking);
            if !all.iter().any(|c| self.is_near(c)) {
                let lacking = self.lacking_in_stretches(found, effort, &all);
                merge(&mut all, lacking);
            }
            self.second_to_best(found, effort, &mut all);
        }
        let late = late_where(found, &all).and_then(|at| self.run(found, at));
        all.extend(late);
        all
    }

    fn enter(
        &self,
        found: &SearchResult,
        field: &RivalField,
        rival_kind: RivalKind,
        all: &mut Vec<ContendingSet>,
    ) {
        let good = all.iter().any(|c| self.is_near(c));
        let ran: Vec<usize> = all.iter().map(|c| c.at).collect();
        let list = field.entrants(found, rival_kind, good, &ran);
        all.extend(parallel::map(list, |at| self.run(found, at)).into_iter().flatten());
    }
    /// Sets without two or more of the chosen causes, as long as those without one less do as well as all of them.
    fn fewer_still(&self, found: &SearchResult, field: &RivalField, all: &mut Vec<ContendingSet>) {
        let best = |all: &[ContendingSet], size: usize| {
            let of_size = all.iter().filter(|c| found.sets[c.at].stated.set.len() == size);
            let best = of_size.min_by(|a, b| a.after.total_cmp(&b.after));
            best.map(|c| (c.at, self.free(&c.shown).map_or(c.after, |f| c.after.max(f.floor))))
        };
        let Some((_, whole)) = best(all, field.size()) else { return };
        for size in (2..field.size()).rev() {
            let fewer = best(all, size).filter(|f| f.1 <= self.limits.free_runs.even * whole);
            let Some((at, _)) = fewer else { return };
            self.enter(found, &field.around(&found.sets[at]), RivalKind::Fewer, all);
        }
    }

    /// Sets with a cause more than the plain model, next to the free run of its parameters.
    fn more_than_plain(
        &self,
        found: &mut SearchResult,
        effort: SearchEffort,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let plain = found.plain.clone();
        self.more(found, &plain, self.fitted.as_ref(), effort, ran)
    }

    /// How far the predictions of two are apart, as a gap.
    pub(super) fn apart(&self, a: &ContendingSet, b: &ContendingSet) -> Option<f64> {
        let pooled = self.compared(|run, channel| &a.shown[run][channel], [&b.shown; 3]);
        self.together(&pooled, pooled.each().iter().map(|g| g.after))
    }
}

/// What ran.
pub(super) struct FreeRunComparison<'a> {
    /// Where.
    pub ground: &'a ComparisonBasis<'a>,
    /// The sets.
    pub contenders: &'a [ContendingSet],
    /// How far each fit goes.
    pub effort: SearchEffort,
}

impl FreeRunComparison<'_> {
    fn find(&self, set: usize) -> Option<&ContendingSet> {
        self.contenders.iter().find(|c| c.at == set)
    }
}

impl FreeRunResults for FreeRunComparison<'_> {
    fn after(&self, set: usize) -> Option<f64> {
        self.find(set).map(|c| c.after)
    }
    fn apart(&self, a: usize, b: usize) -> Option<f64> {
        self.ground.apart(self.find(a)?, self.find(b)?)
    }
    fn one_sensor(&self) -> bool {
        let runs = &self.ground.search.case.train;
        runs.iter().all(|r| r.run.channels.len() == 1)
    }
    fn each(&self, set: usize) -> Option<Vec<f64>> {
        Some(self.ground.of_each(&self.find(set)?.shown))
    }
    fn left_out(&self, set: Option<usize>, fitted: &FittedSet) -> Option<LeftOut> {
        let free = set.and_then(|at| self.find(at)?.fitted.as_ref());
        self.ground.left_out(free.unwrap_or(fitted), self.effort)
    }
}

/// The likeliest set that did not run and has a late reading where the best of those that did has a late command, or the other
/// way round.
fn late_where(found: &SearchResult, ran: &[ContendingSet]) -> Option<usize> {
    let best = &found.sets[ran.iter().min_by(|a, b| a.after.total_cmp(&b.after))?.at];
    let late = (0..found.sets.len()).filter(|at| found.sets[*at].is_late_where(best));
    let likeliest =
        |a: &usize, b: &usize| found.sets[*a].evidence(1.0).total_cmp(&found.sets[*b].evidence(1.0));
    late.max_by(likeliest).filter(|at| ran.iter().all(|c| c.at != *at))
}

/// Adds those that ran to the others; of the same set the new one takes the place of the old one.
pub(super) fn merge(all: &mut Vec<ContendingSet>, new: Vec<ContendingSet>) {
    for new in new {
        match all.iter_mut().find(|old| old.at == new.at) {
            Some(old) => *old = new,
            None => all.push(new),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::engine::made::{fitted, found, stated};

    /// Contenders by their sets and the gaps of their free runs.
    pub(in crate::diagnose) fn ran(all: &[(usize, f64)]) -> Vec<ContendingSet> {
        let complete = CompleteModel { stated: stated(Vec::new()), theta: Vec::new() };
        let one = |&(at, after): &(usize, f64)| {
            let (complete, shown) = (complete.clone(), Vec::new());
            ContendingSet { at, complete, shown, after, fitted: None }
        };
        all.iter().map(one).collect()
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
