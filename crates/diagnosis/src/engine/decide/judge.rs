//! Sets beside each other: balances and free runs together.

use super::{Balances, Free, Ran, Thresholds, left};
use crate::engine::hypothesis::Hypothesis;
use crate::engine::search::Fitted;
use crate::engine::select::{Found, above};

/// What the sets that were fitted and run come to.
pub(super) struct Judge<'a> {
    found: &'a Found,
    free: Free,
    ran: &'a dyn Ran,
    limits: &'a Thresholds,
    pub balances: Balances,
    /// By size of a set: the largest gap of those that ran; 0: none did.
    worst: Vec<f64>,
}

impl<'a> Judge<'a> {
    pub(super) fn new(found: &'a Found, free: Free, ran: &'a dyn Ran, limits: &'a Thresholds) -> Self {
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
            |f: &Fitted| f.stated.set.len() < set.len() && f.stated.set.iter().all(|h| set.contains(h));
        let parts = self.found.sets.iter().enumerate().filter(|(_, f)| part(f));
        let lacking = parts.filter_map(|(at, _)| self.ran.after(at)).min_by(f64::total_cmp);
        let worst = Some(self.worst[set.len()]).filter(|w| *w > 0.0);
        let assumed = lacking.or(worst).unwrap_or(self.free.tuned);
        left(self.ran.after(at).unwrap_or(assumed), self.free.floor)
    }
    /// What a free run leaves, by which sets are told apart.
    fn telling(&self, at: usize) -> f64 {
        self.power(at).max(left(self.limits.free_runs.even * self.free.floor, self.free.floor))
    }
    pub(super) fn tuned(&self) -> f64 {
        left(self.free.bare(), self.free.floor)
    }
    /// Logarithm of the probability of a set by balances and free run, up to a constant.
    fn score(&self, at: usize) -> f64 {
        let told = self.balances.odds(&self.found.sets[at], &self.found.best);
        told - self.limits.free_runs.weight * self.telling(at).ln()
    }
    /// By how much set `a` leaves more than set `b` does (logarithm of the power), as far as recordings agree on it: a free
    /// run that does better in one and worse in another is luck.
    fn further(&self, a: usize, b: usize) -> f64 {
        let all = (self.telling(a) / self.telling(b)).ln();
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

    /// The set that stands in the end; `None`: the one that the balances chose, or no effect.
    pub(super) fn choose(&self) -> Option<usize> {
        let tuned = self.tuned();
        if self.found.best.effects() == 0 {
            return self.best_of_size(1).filter(|&i| self.power(i) < self.limits.free_runs.idle * tuned);
        }
        let size = self.found.best.stated.set.len();
        let own = self.best_of_size(size);
        // One fewer that does as well; one more that does far better where the own one falls short.
        let fewer = if size > 1 { self.best_of_size(size - 1) } else { None };
        let as_good = |f: usize, o: usize| {
            // What the balances miss without it and hardly with it is no matter of a form.
            let [without, with] = [f, o].map(|at| &self.found.sets[at]);
            let [before, after] = [without, with].map(|f| above(f.excess(), self.balances.least));
            let asked = with.evidence(1.0) > without.evidence(1.0) + self.limits.balances.asked
                && before - after > self.limits.balances.wholly * before;
            !asked && self.power(f) < self.limits.free_runs.needless * self.power(o)
        };
        let fewer = fewer.filter(|f| own.is_none_or(|o| as_good(*f, o)));
        let more = self.of_size(size + 1).min_by(|a, b| self.power(*a).total_cmp(&self.power(*b)));
        let short =
            |o: usize| self.ran.after(o).is_some_and(|a| a > self.limits.free_runs.near * self.free.floor);
        // ... and more than is put down to the form of the others.
        let far_better = |m: usize, o: usize| {
            let [with, without] = [m, o].map(|at| self.power(at));
            with * self.limits.free_runs.more < without && without - with > self.limits.free_runs.form * tuned
        };
        let more = more.filter(|m| own.is_none_or(|o| short(o) && far_better(*m, o)));
        let chosen = more.or(fewer).or(own);
        // What the balances favour changes nothing, and another effect by itself does.
        let remains = chosen.map_or(tuned, |c| self.power(c));
        let idle = chosen.is_none_or(|_| remains > self.limits.free_runs.idle * tuned);
        // ... unless the balances have settled it.
        let open = |a: usize| chosen.is_none_or(|c| self.score(a) > self.score(c) - self.limits.odds.settled);
        self.best_of_size(1)
            .filter(|a| idle && self.power(*a) < self.limits.free_runs.instead * remains && open(*a))
            .or(chosen)
    }

    /// Other causes in the place of the `i`-th of `best`, with their odds.
    pub(super) fn rivals(
        &self,
        chosen: Option<usize>,
        best: &Fitted,
        i: usize,
        after: f64,
    ) -> Vec<(usize, f64)> {
        let (set, h) = (&best.stated.set, &best.stated.set[i]);
        let other = |f: &Fitted| {
            f.stated.set.len() == set.len()
                && !f.stated.set.iter().any(|o| o.same_place(h))
                && set.iter().enumerate().all(|(k, o)| k == i || f.stated.set.contains(o))
        };
        let odds = |at: usize, f: &Fitted| {
            if f.stated.set.iter().any(|o| o.same_friction(h) && !set.contains(o)) {
                return 0.0;
            }
            // A command that is late moves the input's noise, a reading that is late does not: what they differ by at the floor
            // is that.
            let late = h.shifts() && best.replaced_in(f).is_some_and(Hypothesis::shifts);
            let (told, outweighs) = if late {
                (self.balances.by_size(f, best), self.limits.odds.settled)
            } else {
                (self.balances.odds(f, best), self.limits.odds.outweighs)
            };
            let Some(chosen) = chosen else { return told };
            // Predictions as near to each other as either is to the recordings tell nothing apart, unless the balances do.
            let alike = self.ran.apart(chosen, at).is_some_and(|a| a < self.limits.free_runs.alike * after);
            if alike && told > -outweighs {
                return 0.0;
            }
            // How much was possible before tells no more than so much.
            let possible = 0.5 * (f.occam - self.found.sets[chosen].occam);
            let spared = (-possible - self.limits.odds.possible).max(0.0);
            told - self.limits.free_runs.weight * self.further(at, chosen) + spared
        };
        let sets = self.found.sets.iter().enumerate().filter(|(_, f)| other(f));
        let mut list: Vec<(usize, f64)> = sets.map(|(at, f)| (at, odds(at, f).min(0.0))).collect();
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        list
    }
}

/// What all recordings together say, as far as each by itself says so too: not further from 0 than their mean less its
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
mod tests {
    use super::agreed;

    #[test]
    fn free_runs_count_as_far_as_recordings_agree() {
        assert_eq!(agreed(3.0, &[3.0]), 3.0);
        assert_eq!(agreed(3.0, &[2.0, 2.0, 2.0]), 2.0);
        assert_eq!(agreed(-1.0, &[-2.0, -2.0]), -1.0);
        // One in which it is luck: mean 1, standard error 2.
        assert_eq!(agreed(2.5, &[3.0, -1.0]), 0.0);
        assert!((agreed(2.5, &[3.0, 1.0]) - 1.0).abs() < 1e-12);
    }
}
