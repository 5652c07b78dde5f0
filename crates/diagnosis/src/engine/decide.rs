//! The verdict: what the sets that were fitted say together.

mod account;
mod free;
mod judge;
mod odds;
mod thresholds;

use super::hypothesis::Hypothesis;
use super::search::FittedSet;
use super::select::{SearchResult, above};
use crate::outcome::Verdict;
use account::Account;
pub(crate) use free::left;
pub use free::{FreeRun, FreeRunResults, LeftOut};
use judge::Judge;
pub use odds::Balances;
pub use thresholds::{OfBalances, OfFreeRuns, OfGap, OfOdds, Thresholds};

/// What was decided.
#[derive(Clone, Debug)]
pub struct Decision {
    /// The verdict.
    pub verdict: Verdict,
    /// Cause by cause of the chosen set: other causes in its place with their odds (natural logarithm, below 0), best
    /// first.
    pub rivals: Vec<Vec<(usize, f64)>>,
    /// Probability of each cause of the chosen set.
    pub probability: Vec<f64>,
    /// Share of the excess that the chosen set explains, or of the free-running gap where balances are blind.
    pub explained: f64,
    /// Balances see nothing of the effects that were chosen.
    pub blind: bool,
    /// Share of the free-running gap above the floor (as powers) that it closes.
    pub closed: f64,
    /// Probability that none of the candidates is right.
    pub unknown: f64,
    /// Odds below which two causes are not distinguished.
    pub odds: f64,
    /// No fit of the model's own parameters runs nearer than those given: they explain nothing.
    pub unmoved: bool,
    /// What was to be claimed misses of recordings for fitting that are left out in turn; before it which set that is, `None`: the
    /// one that the balances chose.
    pub left_out: Option<(Option<usize>, LeftOut)>,
}

/// A cause that is not distinguished from one of those chosen.
#[derive(Clone, Copy, Debug)]
pub struct Rival<'a> {
    /// The alternative cause,
    pub cause: &'a Hypothesis,
    /// in this set.
    pub set: &'a FittedSet,
    /// Its odds (natural logarithm, below 0).
    pub odds: f64,
}

impl Decision {
    /// Nothing was looked for.
    pub(crate) fn nothing() -> Self {
        Self {
            verdict: Verdict::Unknown,
            rivals: Vec::new(),
            probability: Vec::new(),
            explained: 0.0,
            blind: false,
            closed: 0.0,
            unknown: 1.0,
            odds: 0.0,
            unmoved: false,
            left_out: None,
        }
    }
    /// Nothing is claimed: what the recordings say cannot be relied on. As likely as not none of the candidates is right.
    pub fn cap(&mut self) {
        self.verdict = Verdict::Unknown;
        self.unknown = self.unknown.max(0.5);
    }
    /// What is not distinguished from the `i`-th cause of the chosen set, likeliest first.
    pub fn close<'a>(&'a self, found: &'a SearchResult, i: usize) -> impl Iterator<Item = Rival<'a>> {
        self.rivals[i].iter().filter(|r| -r.1 < self.odds).filter_map(|(at, odds)| {
            let set = &found.sets[*at];
            Some(Rival { cause: found.best.replaced_in(set)?, set, odds: *odds })
        })
    }
}

impl SearchResult {
    /// The best without any effect.
    fn without_effects(&self) -> &FittedSet {
        let own = self.sets.iter().filter(|f| f.effects() == 0);
        own.chain([&self.plain])
            .max_by(|a, b| a.evidence(1.0).total_cmp(&b.evidence(1.0)))
            .unwrap_or(&self.plain)
    }
}

impl FittedSet {
    /// The cause that another set has instead of one of its own.
    pub(crate) fn replaced_in<'a>(&self, other: &'a Self) -> Option<&'a Hypothesis> {
        self.all_replaced_in(other).next()
    }
    /// All of these: several where one effect acts at several joints.
    pub(crate) fn all_replaced_in<'a>(&self, other: &'a Self) -> impl Iterator<Item = &'a Hypothesis> {
        other.stated.set.iter().filter(|o| !self.stated.set.contains(o))
    }
    /// They differ in one cause: a command that is late in the one, a reading in the other.
    pub(crate) fn is_late_where(&self, other: &Self) -> bool {
        let differ = [self.replaced_in(other), other.replaced_in(self)];
        matches!(differ, [Some(a), Some(b)] if a.shifts() && b.shifts() && a.id != b.id)
    }
    /// How many effects it claims.
    fn effects(&self) -> usize {
        self.stated.set.iter().filter(|h| h.is_effect()).count()
    }
}

/// Share of the effects of a claim that are there, by how many it has: what a law's form leaves requires others. Counted on
/// trials whose seeds are not those reported.
const MEMBERS: [f64; 3] = [1.0, 0.75, 0.4];

/// Readings of the balances below which they say nothing: an octave has more.
const NEXT_TO_NONE: f64 = 12.0;

/// Chooses and decides; `raw` is the excess of the nominal model as it is. `found.best` and `free.after` become those of the
/// set chosen.
pub fn decide(
    found: &mut SearchResult,
    raw: f64,
    free: &mut FreeRun,
    ran: &dyn FreeRunResults,
    limits: &Thresholds,
) -> Decision {
    let judge = Judge::new(found, *free, ran, limits);
    let chosen = judge.choose();
    free.after = chosen.and_then(|at| ran.after(at)).unwrap_or(free.tuned);
    let above = |excess: f64| above(excess, judge.balances.least);
    let raw = above(raw);
    let closed = (1.0 - left(free.after, free.floor) / judge.tuned()).clamp(0.0, 1.0);
    let as_good = judge.as_good();
    let seen = above(found.plain.excess());
    let bare = || if judge.needs_no_effect() { found.without_effects() } else { &found.best };
    let mut best = chosen.map_or_else(|| bare().clone(), |at| found.sets[at].clone());
    let mut rivals: Vec<Vec<(usize, f64)>> =
        (0..best.stated.set.len()).map(|i| judge.rivals(chosen, &best, i, free.after)).collect();
    let mut claims = best.effects() > 0;
    let excess = above(best.excess());
    let account = Account {
        claims,
        whole: if claims { seen } else { raw },
        left: excess,
        closed,
        is_evidence: chosen.is_some_and(|at| ran.after(at).is_some())
            && free.after <= limits.free_runs.diverging * free.tuned,
    };
    let shown = (1.0 + raw) / (1.0 + excess) - 1.0 > limits.gap.shown || excess > limits.gap.bare;
    let plain = free.trained && seen - excess > limits.gap.bare;
    // The sensors' noise would not go with a cause.
    let taken = chosen.is_some() && free.bare() > free.noticed && closed > limits.gap.explained;
    let beyond = |gap: f64| free.before > gap;
    let gap = beyond(free.chance) || taken || shown && (plain || beyond(limits.free_runs.even * free.floor));
    let (known, explained) = (account.known(limits), account.explained(limits));
    // Parameters that leave plain misses and hardly correct a free run explain nothing.
    let gain = 1.0 - judge.tuned() / left(free.before, free.floor);
    let missed = free.bare() > limits.gap.missed * free.chance
        || account.left > limits.gap.bare && gain < limits.gap.neither;
    let unexplained = if claims {
        known < limits.gap.explained
    } else {
        !as_good && (explained < limits.gap.explained && account.left > limits.gap.left || missed)
    };
    // Refitting that takes nearly all of the gap and leaves little more than noise is enough, whatever might be added to it
    // without being known.
    let refitted = free.tuned <= limits.gap.refitted * free.before && free.is_enough(limits);
    let unexplained = unexplained && !refitted;
    if refitted && claims && known < limits.gap.explained {
        best = found.without_effects().clone();
        rivals = vec![Vec::new(); best.stated.set.len()];
        (claims, free.after) = (false, free.tuned);
    }
    // The same effect in another place is the same effect.
    let id = |at: usize| best.replaced_in(&found.sets[at]).map(|h| &*h.id);
    let others = |h: &Hypothesis, list: &[(usize, f64)]| -> Vec<f64> {
        list.iter().filter(|(at, _)| id(*at) != Some(&*h.id)).map(|l| l.1).collect()
    };
    let mut odds: Vec<Vec<f64>> =
        best.stated.set.iter().zip(&rivals).map(|(h, list)| others(h, list)).collect();
    let close = |list: &[f64]| list.first().is_some_and(|odds| -odds < limits.odds.apart);
    // Where nothing that could be refitted helps either, the free run's own luck is no wrong parameter.
    let luck = !claims && !shown && !unexplained && free.tuned > limits.gap.luck * free.before;
    // What was not refitted is no explanation, and neither is what does worse on what was held out.
    let unmoved = !claims && free.tuned == free.before;
    let worse = claims && chosen.is_some_and(|at| ran.after(at).is_some()) && free.does_worse();
    let claimed = claims && gap && !luck && !unexplained && !worse;
    let left_out = if claimed { ran.left_out(chosen, &best).map(|l| (chosen, l)) } else { None };
    let mut worse = worse || left_out.is_some_and(|(_, l)| l.does_worse(limits.free_runs.near));
    // What the refitted model leaves is chance: causes that do worse are none, and it is enough.
    if worse && refitted && free.tuned <= free.chance {
        best = found.without_effects().clone();
        rivals = vec![Vec::new(); best.stated.set.len()];
        odds = vec![Vec::new(); best.stated.set.len()];
        (claims, worse, free.after) = (false, false, free.tuned);
    }
    // Where balances have next to no readings nothing but a free run that comes near the floor is evidence for anything.
    let few = found.plain.count() < NEXT_TO_NONE && free.after > limits.free_runs.near * free.floor;
    let few = few && free.after > free.chance;
    let verdict = if !gap || luck {
        Verdict::NoGap
    } else if unexplained || unmoved || worse || few {
        Verdict::Unknown
    } else if !claims {
        Verdict::Parameters
    } else if best.stated.set.iter().zip(&odds).any(|(h, list)| h.is_effect() && close(list)) {
        Verdict::Ambiguous
    } else {
        Verdict::Effects
    };
    let unknown = 1.0 / (1.0 + ((known - limits.gap.explained) * limits.gap.steep).exp());
    let unknown = if !unexplained && (unmoved || worse || few) { unknown.max(0.5) } else { unknown };
    let unmoved = unmoved && verdict == Verdict::Unknown;
    let unknown = match verdict {
        Verdict::NoGap | Verdict::Parameters => unknown.min(limits.gap.unknown_at_most),
        _ => unknown,
    };
    let mass = |list: &Vec<f64>| list.iter().map(|odds| odds.exp()).sum::<f64>();
    let members = MEMBERS[best.effects().clamp(1, MEMBERS.len()) - 1];
    let probability = odds.iter().map(|list| (1.0 - unknown) * members / (1.0 + mass(list))).collect();
    found.best = best;
    let blind = account.is_blind(limits);
    Decision {
        verdict,
        rivals,
        probability,
        explained,
        blind,
        closed,
        unknown,
        odds: limits.odds.apart,
        unmoved,
        left_out,
    }
}

#[cfg(test)]
mod tests;
