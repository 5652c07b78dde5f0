//! What free runs see and balances do not: causes that explain much of what a free run misses, tried from where it ended.

use trueup_identification::parallel;

use super::contest::{ContendingSet, HELPS, MORE, POLISH, TRIED, merge};
use super::ground::ComparisonBasis;
use crate::engine::hypothesis::Hypothesis;
use crate::engine::replay::FreeRunFit;
use crate::engine::screen::RequestedCause;
use crate::engine::search::{CaseSearch, FittedSet, PosedSet};
use crate::engine::select::{SearchEffort, SearchResult, put, same};
use trueup_numerics::order::ascending;

/// Share of what a free run misses that a cause would explain: one coarse look predicts a fit poorly.
const HINT: f64 = 0.1;
/// As many of them are fitted so briefly, and of these the nearest in full.
const HINTS: usize = 8;
const BRIEF: usize = 6;

impl ComparisonBasis<'_> {
    /// Single effects that explain much of what `self.fitted`, running freely, misses, whatever the balances say of them:
    /// these do not see what happens in reversals, nor much behind coarse encoders. Where none of them comes near, parameters
    /// are too biased to look from: others are looked at from where the best of them ended.
    pub(super) fn lacking(&self, found: &mut SearchResult, effort: SearchEffort) -> Vec<ContendingSet> {
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
        found: &mut SearchResult,
        base: &FittedSet,
        effort: SearchEffort,
        prescribed: Option<&FittedSet>,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let begun = self
            .search
            .nearest(self.search.lacking(base, HINT))
            .iter()
            .filter_map(|f| self.search.restated(f))
            .collect();
        self.fitted_both_ways(found, begun, effort, prescribed, ran)
    }

    /// The same of stretches of the recordings, which lack nothing that comes before them. What comes nearest has put the
    /// parameters right; alternatives to it are compared from there. All are then fitted to whole recordings.
    pub(super) fn lacking_in_stretches(
        &self,
        found: &mut SearchResult,
        effort: SearchEffort,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let Some((short, base)) = &self.stretches else { return Vec::new() };
        let further = |near: Vec<FittedSet>| {
            let fit = |near: FittedSet| {
                let (stated, start) = short.restated(&near)?;
                short.polished(stated, &start, POLISH)
            };
            parallel::map(near, fit).into_iter().flatten().collect::<Vec<_>>()
        };
        let mut all = further(short.nearest(short.lacking(base, HINT)));
        let best = all.iter().min_by(|a, b| a.misfit.total_cmp(&b.misfit)).and_then(|p| p.fitted.as_ref());
        let alike = best.map_or_else(Vec::new, |best| short.alike(best, HINT));
        all.extend(further(short.nearest(alike)));
        ascending(&mut all, |item| item.misfit);
        let mut each: Vec<FittedSet> = Vec::new();
        for fitted in all.into_iter().filter_map(|p| p.fitted) {
            if !each.iter().any(|e| same(&e.stated.set, &fitted.stated.set)) {
                each.push(fitted);
            }
        }
        let run = |f: FittedSet| self.by_balances(self.search.polish(&f.of_all(), POLISH), effort, None);
        let fitted = parallel::map(each, run);
        self.entered(found, fitted.into_iter().flatten(), ran)
    }

    /// Sets that are fitted free-running first, from where they are given, and then by their balances from there, or from
    /// where `prescribed` had them if that is better; of those that `ran` what does better.
    fn fitted_both_ways(
        &self,
        found: &mut SearchResult,
        all: Vec<(PosedSet, Vec<f64>)>,
        effort: SearchEffort,
        prescribed: Option<&FittedSet>,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let run = |(stated, start): (PosedSet, Vec<f64>)| {
            self.by_balances(self.search.polished(stated, &start, POLISH)?, effort, prescribed)
        };
        let fitted = parallel::map(all, run);
        self.entered(found, fitted.into_iter().flatten(), ran)
    }

    /// A set that ran freely with its fit by the balances, from where it ended or from where `prescribed` had it.
    fn by_balances(
        &self,
        polished: FreeRunFit,
        effort: SearchEffort,
        prescribed: Option<&FittedSet>,
    ) -> Option<(FittedSet, FreeRunFit)> {
        let from = polished.fitted.as_ref()?;
        let stated = self.search.state(&from.stated.set).ok()?;
        let starts = [
            Some(stated.begin_with(&[from])),
            prescribed.map(|prescribed| stated.begin_with(&[prescribed, from])),
        ];
        let fit = |start: Vec<f64>| self.search.fit(stated.clone(), &start, effort.options()).ok();
        let fits = starts.into_iter().flatten().filter_map(fit);
        Some((fits.max_by(|a, b| a.evidence(1.0).total_cmp(&b.evidence(1.0)))?, polished))
    }

    /// Sets that ran freely on the recordings held out, among those that were fitted; of those that `ran` what does better.
    fn entered(
        &self,
        found: &mut SearchResult,
        fitted: impl Iterator<Item = (FittedSet, FreeRunFit)>,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let shown = |(prescribed, polished): (FittedSet, FreeRunFit)| {
            let old = ran.iter().find(|c| same(&found.sets[c.at].stated.set, &prescribed.stated.set));
            let new = self.shown(found.sets.len(), polished)?;
            // The fit by the balances belongs to its run.
            let improves = old.is_none_or(|old| new.after < old.after);
            improves.then(|| ContendingSet { at: put(&mut found.sets, prescribed), ..new })
        };
        fitted.filter_map(shown).collect()
    }

    /// Fits the best of these further, where it falls short.
    fn refine(&self, all: &mut [ContendingSet], of: impl Fn(&ContendingSet) -> bool) {
        let best = all.iter_mut().filter(|c| of(c)).min_by(|a, b| a.after.total_cmp(&b.after));
        let Some(best) = best.filter(|best| !self.is_near(best)) else { return };
        let further = |f: &FittedSet| {
            let (stated, start) = self.search.restated(f)?;
            self.search.polished(stated, &start, 2 * POLISH)
        };
        let further = best.fitted.as_ref().and_then(further).and_then(|p| self.shown(best.at, p));
        if let Some(further) = further.filter(|f| f.after < best.after) {
            *best = further;
        }
    }

    /// A second cause in addition to the single one that helps most, where that falls short even once it is fitted further.
    pub(super) fn second_to_best(
        &self,
        found: &mut SearchResult,
        effort: SearchEffort,
        all: &mut Vec<ContendingSet>,
    ) {
        let bare = self.free(&self.tuned).unwrap_or_default().bare();
        let helps = |c: &ContendingSet| c.after <= HELPS * bare && found.sets[c.at].stated.set.len() == 1;
        self.refine(all, helps);
        let best = all.iter().filter(|c| helps(c)).min_by(|a, b| a.after.total_cmp(&b.after));
        let Some(base) = best.filter(|b| !self.is_near(b)).and_then(|b| b.fitted.clone()) else { return };
        // Either of the two may do as well alone: the other showed it the way.
        if let Some(pair) = self.grown(found, &base, None, effort, all) {
            let each = without_each(&pair.stated.set, &pair.stated.set, &[]);
            let alone = self.fewer(found, &pair, each, effort, all);
            merge(all, alone);
        }
    }

    /// A second cause in addition to the claim, the only one in `all`, whose free run falls short: of those that the balances require,
    /// and of those that they do not see, for these they have nothing against.
    pub(super) fn second(
        &self,
        found: &mut SearchResult,
        effort: SearchEffort,
        all: &mut Vec<ContendingSet>,
    ) {
        let Some((at, base)) = all.first().map(|c| (c.at, c.fitted.clone())) else { return };
        let prescribed = found.sets[at].clone();
        all.extend(self.more(found, &prescribed, base.as_ref(), effort, all));
        let Some(base) = base.filter(|_| !all.iter().any(|c| self.is_near(c))) else { return };
        // The causes of the claim may have taken the effect of the one that was missing.
        if let Some(best) = self.grown(found, &base, Some(&prescribed), effort, all) {
            let ran: Vec<&[Hypothesis]> = all.iter().map(|c| &found.sets[c.at].stated.set[..]).collect();
            let others = without_each(&best.stated.set, &prescribed.stated.set, &ran);
            all.extend(self.fewer(found, &best, others, effort, &[]));
        }
    }

    /// Adds to `all` what `base`, which runs freely, lacks, unless the balances are against it compared with `prescribed`; the best of these,
    /// if it does far better than all others.
    fn grown(
        &self,
        found: &mut SearchResult,
        base: &FittedSet,
        prescribed: Option<&FittedSet>,
        effort: SearchEffort,
        all: &mut Vec<ContendingSet>,
    ) -> Option<FittedSet> {
        let lacked = self.lacked(found, base, effort, prescribed, &[]);
        let tried: Vec<usize> = lacked.iter().map(|c| c.at).collect();
        merge(all, lacked);
        let against = |c: &ContendingSet| {
            prescribed
                .is_some_and(|prescribed| found.sets[c.at].evidence(1.0) <= prescribed.evidence(1.0) - MORE)
        };
        all.retain(|c| !(tried.contains(&c.at) && against(c)));
        self.refine(all, |c| tried.contains(&c.at));
        far_better(all, &tried).and_then(|c| c.fitted.clone())
    }

    /// Sets with some of the causes of `best`, from where that ended; of those that `ran` what does better.
    fn fewer(
        &self,
        found: &mut SearchResult,
        best: &FittedSet,
        sets: Vec<Vec<Hypothesis>>,
        effort: SearchEffort,
        ran: &[ContendingSet],
    ) -> Vec<ContendingSet> {
        let begun = |set: Vec<Hypothesis>| {
            let stated = self.search.state_like(&set, best.stated.free.clone()).ok()?;
            let start = self.search.begin_with(&stated, best);
            Some((stated, start))
        };
        self.fitted_both_ways(found, sets.into_iter().filter_map(begun).collect(), effort, None, ran)
    }
}

impl CaseSearch<'_> {
    /// Those of the sets that are requested which are nearest after some steps of a fit: a coarse look predicts one poorly.
    fn nearest(&self, requested: Vec<RequestedCause>) -> Vec<FittedSet> {
        let mut all: Vec<RequestedCause> = Vec::new();
        for requested in requested {
            // Of the forms of one cause in one place the likeliest.
            let cause = |a: &RequestedCause| a.stated.set.last().cloned();
            let like =
                |a: &RequestedCause| cause(a).zip(cause(&requested)).is_some_and(|(a, b)| a.same_place(&b));
            if all.len() < HINTS && !all.iter().any(like) {
                all.push(requested);
            }
        }
        let brief = |a: RequestedCause| self.polished(a.stated, &a.start, BRIEF);
        let mut begun: Vec<FreeRunFit> = parallel::map(all, brief).into_iter().flatten().collect();
        ascending(&mut begun, |item| item.misfit);
        begun.into_iter().take(TRIED).filter_map(|p| p.fitted).collect()
    }
}

/// The best of those that were `tried` last, if it does far better than the others.
fn far_better<'c>(all: &'c [ContendingSet], tried: &[usize]) -> Option<&'c ContendingSet> {
    let (tried, others): (Vec<_>, Vec<_>) = all.iter().partition(|c| tried.contains(&c.at));
    let without = others.iter().map(|c| c.after).fold(f64::INFINITY, f64::min);
    let best = tried.into_iter().filter(|c| c.after <= HELPS * without);
    best.min_by(|a, b| a.after.total_cmp(&b.after))
}

/// A set without each of the causes of `prescribed` that it has; none that `ran`, and none without effects.
fn without_each(
    set: &[Hypothesis],
    prescribed: &[Hypothesis],
    ran: &[&[Hypothesis]],
) -> Vec<Vec<Hypothesis>> {
    let fewer = |out: &Hypothesis| set.iter().filter(|h| *h != out).cloned().collect::<Vec<_>>();
    let new = |set: &Vec<Hypothesis>| {
        set.iter().any(Hypothesis::is_effect) && !ran.iter().any(|ran| same(ran, set))
    };
    prescribed.iter().map(fewer).filter(new).collect()
}

#[cfg(test)]
mod tests {
    use super::super::contest::tests::ran;
    use super::*;
    use crate::engine::made::causes;

    #[test]
    fn of_one_set_the_new_run_is_kept() {
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
        let fewer = |all: &[&str], prescribed: &[&str], ran: &[&[&str]]| {
            let ran: Vec<Vec<Hypothesis>> = ran.iter().map(|labels| set(labels)).collect();
            let ran: Vec<&[Hypothesis]> = ran.iter().map(Vec::as_slice).collect();
            without_each(&set(all), &set(prescribed), &ran)
        };
        let (prescribed, all) = ([one, two], [one, two, three]);
        assert_eq!(fewer(&all, &prescribed, &[&prescribed, &all]), [set(&[two, three]), set(&[one, three])]);
        // In whatever order it ran.
        assert_eq!(fewer(&all, &prescribed, &[&[three, two]]), [set(&[one, three])]);
        // A parameter by itself is no explanation.
        assert!(fewer(&[one, "motorInertia"], &[one], &[]).is_empty());
    }
}
