//! Comparison of sets: balances and free runs together.

use super::{Balances, FreeRun, FreeRunResults, Thresholds, left};
use crate::engine::search::FittedSet;
use crate::engine::select::{SearchResult, above};
use trueup_numerics::order::descending;

/// What the sets that were fitted and run come to.
pub(super) struct Judge<'a> {
    found: &'a SearchResult,
    free: FreeRun,
    ran: &'a dyn FreeRunResults,
    limits: &'a Thresholds,
    pub balances: Balances,
    /// By size of a set: the largest gap of those that ran; 0: none did.
    worst: Vec<f64>,
}

impl<'a> Judge<'a> {
    pub(super) fn new(
        found: &'a SearchResult,
        free: FreeRun,
        ran: &'a dyn FreeRunResults,
        limits: &'a Thresholds,
    ) -> Self {
        let mut worst = Vec::new();
        for (at, f) in found.sets.iter().enumerate() {
            let size = f.stated.set.len();
            worst.resize(worst.len().max(size + 1), 0.0);
            worst[size] = f64::max(worst[size], ran.after(at).unwrap_or(0.0));
        }
        Self { found, free, ran, limits, balances: Balances::new(found, limits), worst }
    }
    /// What a free run leaves above the floor, as a power. A set that did not run is held to do as the best of those that
    /// lack some of its causes and ran, for only what promised more did; else no better than the worst of its size.
    fn power(&self, at: usize) -> f64 {
        let set = &self.found.sets[at].stated.set;
        let part =
            |f: &FittedSet| f.stated.set.len() < set.len() && f.stated.set.iter().all(|h| set.contains(h));
        let parts = self.found.sets.iter().enumerate().filter(|(_, f)| part(f));
        let lacking = parts.filter_map(|(at, _)| self.ran.after(at)).min_by(f64::total_cmp);
        let worst = Some(self.worst[set.len()]).filter(|w| *w > 0.0);
        let assumed = lacking.or(worst).unwrap_or(self.free.tuned);
        left(self.ran.after(at).unwrap_or(assumed), self.free.floor)
    }
    /// What a free run leaves, by which sets are distinguished.
    fn compared_power(&self, at: usize) -> f64 {
        self.power(at).max(left(self.limits.free_runs.even * self.free.floor, self.free.floor))
    }
    pub(super) fn tuned(&self) -> f64 {
        left(self.free.bare(), self.free.floor)
    }
    /// Logarithm of the probability of a set by balances and free run, up to a constant.
    fn score(&self, at: usize) -> f64 {
        let odds = self.balances.odds(&self.found.sets[at], &self.found.best);
        odds - self.limits.free_runs.weight * self.compared_power(at).ln()
    }
    /// By how much set `a` leaves more than set `b` does (logarithm of the power), as far as recordings agree on it: a free
    /// run that does better in one and worse in another is luck.
    fn further(&self, a: usize, b: usize) -> f64 {
        let all = (self.compared_power(a) / self.compared_power(b)).ln();
        let [Some(of_a), Some(of_b)] = [a, b].map(|set| self.ran.each(set)) else { return all };
        let each: Vec<f64> = of_a.iter().zip(&of_b).map(|(a, b)| (a / b).ln()).collect();
        agreed(all, &each)
    }
    /// Sets of that size with effects that ran.
    fn of_size(&self, size: usize) -> impl Iterator<Item = usize> {
        let sets = self.found.sets.iter().enumerate();
        let fits = sets.filter(move |(_, f)| f.stated.set.len() == size && f.effects() > 0);
        fits.map(|(at, _)| at).filter(|at| self.ran.after(*at).is_some())
    }
    fn best_of_size(&self, size: usize) -> Option<usize> {
        self.of_size(size).max_by(|a, b| self.score(*a).total_cmp(&self.score(*b)))
    }

    /// Free runs show nothing that parameters leave: no more than chance does.
    pub(super) fn as_good(&self) -> bool {
        self.free.bare() <= self.free.chance
    }
    /// What balances miss without a set and hardly with it is known, whatever free runs show.
    fn is_known(&self, set: &FittedSet) -> bool {
        let limits = &self.limits.gap;
        let [seen, left] = [&self.found.plain, set].map(|f| above(f.excess(), self.balances.least));
        seen > limits.bare && left < limits.bare && left < (1.0 - limits.known) * seen
    }
    /// It has several causes, which possible noise of the sensors makes less necessary.
    fn is_too_much(&self, set: &FittedSet) -> bool {
        self.as_good() && set.effects() > 1 && !self.is_known(set)
    }
    /// Where no free run chose and none shows anything: the balances see nothing either, or what little they see no effect
    /// explains; or parameters take it; or it would take several effects at once.
    pub(super) fn needs_no_effect(&self) -> bool {
        let limits = &self.limits.gap;
        let above = |f: &FittedSet| above(f.excess(), self.balances.least);
        let seen = above(&self.found.plain);
        let explains = |f: &FittedSet| above(f) < (1.0 - limits.explained) * seen;
        let spurious = seen <= limits.bare && !explains(&self.found.best);
        let taken = explains(self.found.without_effects()) || self.is_too_much(&self.found.best);
        self.as_good() && (seen < limits.left || spurious || taken)
    }

    /// The final set; `None`: the one that the balances chose, or no effect.
    pub(super) fn choose(&self) -> Option<usize> {
        self.chosen().filter(|at| !self.is_too_much(&self.found.sets[*at]))
    }
    fn chosen(&self) -> Option<usize> {
        if self.found.best.effects() == 0 {
            let limits = &self.limits.free_runs;
            // What may be the sensors' noise a cause has to take nearly all of.
            let most = if self.free.bare() > self.free.chance { limits.idle } else { limits.instead };
            let explains = |&at: &usize| self.power(at) < most * self.tuned();
            let single = self.best_of_size(1);
            return self.one_more(1, single).or(single).filter(explains);
        }
        let size = self.found.best.stated.set.len();
        let own = self.best_of_size(size);
        let chosen = self.one_more(size, own).or_else(|| self.fewer(size, own)).or(own);
        self.instead_of(chosen).or(chosen)
    }
    /// A cause more than `own`, where that falls short and the other does far better.
    fn one_more(&self, size: usize, own: Option<usize>) -> Option<usize> {
        let more = self.of_size(size + 1).min_by(|a, b| self.power(*a).total_cmp(&self.power(*b)))?;
        own.is_none_or(|own| self.falls_short(own) && self.does_far_better(more, own)).then_some(more)
    }
    /// The fewest causes that do as well as `own`, where the balances do not require that; if it did not run one cause less.
    fn fewer(&self, size: usize, own: Option<usize>) -> Option<usize> {
        let Some(own) = own else { return self.best_of_size(size - 1) };
        let suffices = |fewer: &usize| !self.is_required(own, *fewer) && self.does_as_well(*fewer, own);
        (1..size).filter_map(|size| self.best_of_size(size)).find(suffices)
    }
    /// Another effect by itself, where the free run of the set chosen changes nothing: what the balances favour is then worth
    /// nothing, unless they are decisive.
    fn instead_of(&self, chosen: Option<usize>) -> Option<usize> {
        let limits = &self.limits.free_runs;
        let remains = chosen.map_or(self.tuned(), |at| self.power(at));
        let idle = chosen.is_none() || remains > limits.idle * self.tuned();
        let open = |at| chosen.is_none_or(|c| self.score(at) > self.score(c) - self.limits.odds.decisive);
        let does = |at: &usize| idle && self.power(*at) < limits.instead * remains && open(*at);
        self.of_size(1).filter(does).max_by(|a, b| self.score(*a).total_cmp(&self.score(*b)))
    }
    fn falls_short(&self, at: usize) -> bool {
        self.ran.after(at).is_some_and(|a| a > self.limits.free_runs.near * self.free.floor)
    }
    /// By more, too, than is attributed to the form of the others.
    fn does_far_better(&self, with: usize, without: usize) -> bool {
        let limits = &self.limits.free_runs;
        let [with, without] = [with, without].map(|at| self.power(at));
        with * limits.more < without && without - with > limits.form * self.tuned()
    }
    fn does_as_well(&self, without: usize, with: usize) -> bool {
        self.compared_power(without) < self.limits.free_runs.needless * self.compared_power(with)
    }
    /// What the balances plainly miss without a cause and hardly with it is no matter of a form, unless it is next to nothing of
    /// what they miss without any.
    fn is_required(&self, with: usize, without: usize) -> bool {
        let (limits, plain) = (&self.limits.balances, self.limits.gap.left);
        let [with, without] = [with, without].map(|at| &self.found.sets[at]);
        let of = |f: &FittedSet| above(f.excess(), self.balances.least);
        let [after, before] = [with, without].map(of);
        let plain = plain.max(limits.nothing * of(&self.found.plain));
        let plainly = before > plain && before - after > limits.wholly * before;
        plainly && with.evidence(1.0) > without.evidence(1.0) + limits.required
    }

    /// Other causes instead of the `i`-th of `best`, with their odds.
    pub(super) fn rivals(
        &self,
        chosen: Option<usize>,
        best: &FittedSet,
        i: usize,
        after: f64,
    ) -> Vec<(usize, f64)> {
        let (set, h) = (&best.stated.set, &best.stated.set[i]);
        let other = |f: &FittedSet| {
            f.stated.set.len() == set.len()
                && !f.stated.set.iter().any(|o| o.same_place(h))
                && set.iter().enumerate().all(|(k, o)| k == i || f.stated.set.contains(o))
        };
        let sets = self.found.sets.iter().enumerate().filter(|(_, f)| other(f));
        let mut list: Vec<(usize, f64)> =
            sets.map(|(at, _)| (at, self.odds(at, chosen, best, i, after).min(0.0))).collect();
        descending(&mut list, |item| item.1);
        list
    }

    /// Odds of set `at` that has another cause instead of the `i`-th of `best`.
    fn odds(&self, at: usize, chosen: Option<usize>, best: &FittedSet, i: usize, after: f64) -> f64 {
        let (f, limits) = (&self.found.sets[at], &self.limits.odds);
        if self.is_law_of_the_same(f, best, i) {
            return 0.0;
        }
        let late = best.is_late_where(f);
        // All that distinguishes these behind one sensor is the form of their laws: which one closes nearly all of the gap is
        // as good.
        let twins = late && self.ran.one_sensor();
        if twins && self.closes_nearly_all(at) {
            return 0.0;
        }
        let odds = if twins { 0.0 } else { self.balances.odds(f, best) };
        let Some(chosen) = chosen else { return odds };
        // Predictions as near to each other as either is to the recordings distinguish nothing, unless the balances do.
        let outweighs = if late { limits.decisive } else { limits.outweighs };
        let alike = self.ran.apart(chosen, at).is_some_and(|a| a < self.limits.free_runs.alike * after);
        if alike && odds > -outweighs {
            return 0.0;
        }
        // The prior range counts no more than so much.
        let possible = 0.5 * (f.occam - self.found.sets[chosen].occam);
        let spared = (-possible - limits.possible).max(0.0);
        odds - self.limits.free_runs.weight * self.further(at, chosen) + spared
    }
    /// It has friction of the same rigid joint instead of the `i`-th cause.
    fn is_law_of_the_same(&self, other: &FittedSet, best: &FittedSet, i: usize) -> bool {
        let (set, h) = (&best.stated.set, &best.stated.set[i]);
        other.stated.set.iter().any(|o| o.same_friction(h) && !set.contains(o))
    }
    fn closes_nearly_all(&self, at: usize) -> bool {
        self.ran.after(at).is_some() && self.power(at) < (1.0 - self.limits.gap.known) * self.tuned()
    }
}

/// The result of all recordings together, as far as each by itself agrees: not further from 0 than their mean less its
/// standard error.
fn agreed(all: f64, each: &[f64]) -> f64 {
    let runs = each.len() as f64;
    if each.len() < 2 {
        return all;
    }
    let mean = each.iter().sum::<f64>() / runs;
    let variance = each.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (runs - 1.0);
    let sure = (mean.abs() - (variance / runs).sqrt()).max(0.0);
    all.clamp(-sure, sure)
}

#[cfg(test)]
mod tests;
