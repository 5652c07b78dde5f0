//! The verdict: what the sets that were fitted say together.

use super::search::{Fitted, Octave};
use super::select::{ASKED, Found, WHOLLY, above};
use crate::outcome::Verdict;

/// Figures that were set on trials whose seeds are not those reported.
#[derive(Clone, Copy, Debug)]
pub struct Thresholds {
    /// A gap is there when the power of the nominal model's residuals exceeds what the best explanation leaves by this share.
    pub gap: f64,
    /// ... or, where nothing explains it, the floor's by this; by so much a gap is plain whatever the held-out recordings are.
    pub bare: f64,
    /// Share of the balances' excess, or of the free-running gap, that an explanation has to take, lest the cause be unknown.
    pub explained: f64,
    /// Share of the balances' excess that makes a cause known by itself where nothing plain is left.
    pub told: f64,
    /// Share of either below which the other alone does not do.
    pub neither: f64,
    /// Excess that may be left whatever the share.
    pub left: f64,
    /// How much of the log-likelihood ratio of the residual powers counts: the rest is put down to form.
    pub trust: f64,
    /// How much the logarithm of the free-running gap (as a power) counts.
    pub run: f64,
    /// Most readings of the balances that count.
    pub most: f64,
    /// A cause more has to divide the free-running gap (as a power) by this where the balances do not ask for it.
    pub more: f64,
    /// Two predictions that are apart by less than this share of the gap that is left are alike.
    pub alike: f64,
    /// A cause less is as good when its free-running gap (as a power) is less than this times that of the whole set.
    pub needless: f64,
    /// ... unless the balances bring so much evidence for it,
    pub asked: f64,
    /// and it takes this share of what they miss without.
    pub wholly: f64,
    /// Times the floor up to which a free-running simulation is as good as perfect.
    pub free: f64,
    /// Times the floor up to which free-running gaps are alike.
    pub even: f64,
    /// Odds (natural logarithm) that the unknowns' ranges alone may bring for one cause against another.
    pub possible: f64,
    /// Odds (natural logarithm) of the balances that free runs cannot turn.
    pub settled: f64,
    /// Odds (natural logarithm) below which two causes are not told apart.
    pub odds: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            gap: 0.06,
            bare: 2.0,
            explained: 0.8,
            told: 0.95,
            neither: 0.2,
            left: 0.25,
            trust: 0.05,
            run: 4.0,
            most: 400.0,
            more: 3.0,
            alike: 0.5,
            needless: 1.2,
            asked: ASKED,
            wholly: WHOLLY,
            free: 2.0,
            even: 1.2,
            possible: 1.0,
            settled: 40.0,
            odds: 3.0,
        }
    }
}

impl Thresholds {
    /// How many readings of the balances count as independent.
    pub fn independent(&self, of: &Fitted) -> f64 {
        (of.count() * self.trust).min(self.most)
    }
}

/// Gap of free-running simulations on recordings that were not fitted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Free {
    /// Of the nominal model.
    pub before: f64,
    /// With its own parameters fitted.
    pub tuned: f64,
    /// With the causes.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
    /// What it leaves once in two hundred cases: noise of the inputs adds up along a run, and few runs are not many.
    pub chance: f64,
    /// Chance does not leave so much on the recordings for fitting, though it may on those held out.
    pub trained: bool,
}

impl Free {
    /// Without any effect: parameters that were refitted may do worse on what was held out than those that were given.
    pub(crate) fn bare(&self) -> f64 {
        self.tuned.min(self.before)
    }
}

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
    /// Share of the excess that the chosen set explains.
    pub explained: f64,
    /// Share of the free-running gap above the floor (as powers) that it closes.
    pub closed: f64,
    /// Probability that none of the candidates is right.
    pub unknown: f64,
}

impl Found {
    /// The best without any effect.
    fn without_effects(&self) -> &Fitted {
        let own = self.sets.iter().filter(|f| f.effects() == 0);
        own.chain([&self.plain])
            .max_by(|a, b| a.evidence(1.0).total_cmp(&b.evidence(1.0)))
            .unwrap_or(&self.plain)
    }
}

impl Fitted {
    /// How many effects it claims.
    fn effects(&self) -> usize {
        self.stated.set.iter().filter(|h| h.is_effect()).count()
    }
    /// Half the number of readings that count as independent, times the logarithm of the power that is left: what the
    /// likelihood is when the size of the misfit is not known. `least`: share of the floor's power that is left at the least.
    pub fn concentrated(&self, independent: f64, least: f64) -> f64 {
        let power = |o: &Octave| (o.squares / o.expected).max(0.5 * least);
        let mean = self.octaves.iter().map(|o| power(o).ln()).sum::<f64>() / self.octaves.len() as f64;
        -0.5 * independent * (mean + self.prior2 / self.count())
    }
}

/// Share of the effects of a claim that are there, by how many it has: what a law's form leaves asks for others. Counted on
/// trials whose seeds are not those reported.
const MEMBERS: [f64; 3] = [1.0, 0.75, 0.4];

/// How well a free-running simulation does: its gap above the floor, as a power. What is below a tenth of the floor's does not count.
pub(crate) fn left(gap: f64, floor: f64) -> f64 {
    (gap * gap - floor * floor).max(0.1 * floor * floor).max(f64::MIN_POSITIVE)
}

/// What free-running simulations of some of the sets showed.
pub trait Ran {
    /// Gap on recordings held out.
    fn after(&self, set: usize) -> Option<f64>;
    /// How far the predictions of two sets are apart, as a gap.
    fn apart(&self, a: usize, b: usize) -> Option<f64>;
    /// Recording by recording what a set leaves above the floor, as a power; what tells nothing from the floor is as large.
    fn each(&self, set: usize) -> Option<Vec<f64>>;
}

/// What the sets that were fitted and run come to.
struct Judge<'a> {
    found: &'a Found,
    free: Free,
    ran: &'a dyn Ran,
    limits: &'a Thresholds,
    /// Readings of the balances that count.
    independent: f64,
    /// Share of the floor's power that is left at the least.
    least: f64,
    /// By size of a set: the largest gap of those that ran; 0: none did.
    worst: Vec<f64>,
}

impl<'a> Judge<'a> {
    fn new(found: &'a Found, free: Free, ran: &'a dyn Ran, limits: &'a Thresholds) -> Self {
        let mut worst = Vec::new();
        for (at, f) in found.sets.iter().enumerate() {
            let size = f.stated.set.len();
            worst.resize(worst.len().max(size + 1), 0.0);
            worst[size] = f64::max(worst[size], ran.after(at).unwrap_or(0.0));
        }
        Self {
            found,
            free,
            ran,
            limits,
            independent: limits.independent(&found.best),
            least: found.least(),
            worst,
        }
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
        self.power(at).max(left(self.limits.even * self.free.floor, self.free.floor))
    }
    fn tuned(&self) -> f64 {
        left(self.free.bare(), self.free.floor)
    }
    /// Logarithm of the probability of a set by its balances alone, up to a constant.
    fn told(&self, f: &Fitted) -> f64 {
        f.concentrated(self.independent, self.least) + 0.5 * f.occam
    }
    /// The same with its free run.
    fn score(&self, at: usize) -> f64 {
        self.told(&self.found.sets[at]) - self.limits.run * self.telling(at).ln()
    }
    /// By how much set `a` leaves more than set `b` does (logarithm of the power), as far as recordings agree on it: a free
    /// run that does better in one and worse in another is luck.
    fn further(&self, a: usize, b: usize) -> f64 {
        let all = (self.telling(a) / self.telling(b)).ln();
        let [Some(of_a), Some(of_b)] = [a, b].map(|set| self.ran.each(set)) else { return all };
        let each: Vec<f64> = of_a.iter().zip(&of_b).map(|(a, b)| (a / b).ln()).collect();
        let runs = each.len() as f64;
        if each.len() < 2 {
            return all;
        }
        let mean = each.iter().sum::<f64>() / runs;
        let variance = each.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (runs - 1.0);
        let sure = (mean.abs() - (variance / runs).sqrt()).max(0.0);
        all.clamp(-sure, sure)
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
    fn choose(&self) -> Option<usize> {
        let tuned = self.tuned();
        if self.found.best.effects() == 0 {
            return self.best_of_size(1).filter(|&i| self.power(i) < 0.5 * tuned);
        }
        let size = self.found.best.stated.set.len();
        let own = self.best_of_size(size);
        // One fewer that does as well; one more that does far better where the own one falls short.
        let fewer = if size > 1 { self.best_of_size(size - 1) } else { None };
        let as_good = |f: usize, o: usize| {
            // What the balances miss without it and hardly with it is no matter of a form.
            let [without, with] = [f, o].map(|at| &self.found.sets[at]);
            let [before, after] = [without, with].map(|f| above(f.excess(), self.least));
            let asked = with.evidence(1.0) > without.evidence(1.0) + self.limits.asked
                && before - after > self.limits.wholly * before;
            !asked && self.power(f) < self.limits.needless * self.power(o)
        };
        let fewer = fewer.filter(|f| own.is_none_or(|o| as_good(*f, o)));
        let more = self.of_size(size + 1).min_by(|a, b| self.power(*a).total_cmp(&self.power(*b)));
        let short = |o: usize| self.ran.after(o).is_some_and(|a| a > self.limits.free * self.free.floor);
        let more = more
            .filter(|m| own.is_none_or(|o| short(o) && self.power(*m) * self.limits.more < self.power(o)));
        let chosen = fewer.or(more).or(own);
        // What the balances favour changes nothing, and another effect by itself does.
        let remains = chosen.map_or(tuned, |c| self.power(c));
        let idle = chosen.is_none_or(|_| remains > 0.5 * tuned);
        // ... unless the balances have settled it.
        let open = |a: usize| chosen.is_none_or(|c| self.score(a) > self.score(c) - self.limits.settled);
        self.best_of_size(1).filter(|a| idle && self.power(*a) < 0.25 * remains && open(*a)).or(chosen)
    }

    /// Other causes in the place of the `i`-th of `best`, with their odds.
    fn rivals(&self, chosen: Option<usize>, best: &Fitted, i: usize, after: f64) -> Vec<(usize, f64)> {
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
            let Some(chosen) = chosen else {
                return self.told(f) - self.told(best);
            };
            // Predictions as near to each other as either is to the recordings tell nothing apart, unless the balances do.
            let alike = self.ran.apart(chosen, at).is_some_and(|a| a < self.limits.alike * after);
            // How much was possible before tells no more than so much.
            let possible = 0.5 * (f.occam - self.found.sets[chosen].occam);
            let spared = (-possible - self.limits.possible).max(0.0);
            let settled = self.told(f) < self.told(best) - self.limits.settled;
            let free = self.limits.run * self.further(at, chosen);
            if alike && !settled { 0.0 } else { self.told(f) - self.told(best) - free + spared }
        };
        let sets = self.found.sets.iter().enumerate().filter(|(_, f)| other(f));
        let mut list: Vec<(usize, f64)> = sets.map(|(at, f)| (at, odds(at, f).min(0.0))).collect();
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        list
    }
}

/// What a set does to the gap.
struct Account {
    /// It has effects.
    claims: bool,
    /// Excess without them and with them, over what is left at the least.
    whole: f64,
    left: f64,
    /// Share of the free-running gap above the floor (as powers) that it closes.
    closed: f64,
    /// Its own free run says so, and does not stray far: it may be as sensitive as the plant itself.
    witness: bool,
}

impl Account {
    /// Share of the excess that it explains.
    fn explained(&self) -> f64 {
        1.0 - self.left / self.whole.max(1e-12)
    }
    /// Share of the gap that it accounts for: balances tell the law, free runs the size, and either may be spoilt by the
    /// form of a law.
    fn known(&self, limits: &Thresholds) -> f64 {
        // Where the balances see nothing to be explained they do not vote.
        let blind = self.claims && self.whole.max(self.left) < limits.left;
        let balances = if blind { self.closed } else { self.explained().clamp(0.0, 1.0) };
        // What they see plainly and mostly do not explain is not known, however well a free run makes up for it.
        let plain = self.whole.max(self.left) > limits.bare;
        if plain && self.left > limits.left && balances < 0.5 {
            return balances;
        }
        let both = 0.5 * (balances + self.closed);
        let least = if plain { balances.min(self.closed) } else { self.closed };
        // What they see plainly and wholly explain is known, whatever becomes of a free run that bifurcates.
        let told = self.whole > limits.bare && self.left < limits.bare && balances > limits.told;
        if self.witness && least < limits.neither && !told {
            return both;
        }
        balances.max(self.closed).max(both + 0.2)
    }
}

/// Chooses and decides; `raw` is the excess of the nominal model as it is. `found.best` and `free.after` become those of the
/// set chosen.
pub fn decide(found: &mut Found, raw: f64, free: &mut Free, ran: &dyn Ran, limits: &Thresholds) -> Decision {
    let judge = Judge::new(found, *free, ran, limits);
    let chosen = judge.choose();
    free.after = chosen.and_then(|at| ran.after(at)).unwrap_or(free.tuned);
    let above = |excess: f64| above(excess, judge.least);
    let raw = above(raw);
    let closed = (1.0 - left(free.after, free.floor) / judge.tuned()).clamp(0.0, 1.0);
    let as_good = free.bare() <= free.chance;
    // Neither the free run nor the balances see anything that parameters leave; or what little these see no effect explains.
    let seen = above(found.plain.excess());
    let mended = above(found.best.excess()) < (1.0 - limits.explained) * seen;
    let spurious = chosen.is_none() && seen <= limits.bare && !mended;
    let calm = as_good && (seen < limits.left || spurious);
    let bare = || if calm { found.without_effects() } else { &found.best };
    let best = chosen.map_or_else(|| bare().clone(), |at| found.sets[at].clone());
    let rivals: Vec<Vec<(usize, f64)>> =
        (0..best.stated.set.len()).map(|i| judge.rivals(chosen, &best, i, free.after)).collect();
    let claims = best.effects() > 0;
    let excess = above(best.excess());
    let account = Account {
        claims,
        whole: if claims { seen } else { raw },
        left: excess,
        closed,
        witness: chosen.is_some_and(|at| ran.after(at).is_some()) && free.after <= 1.5 * free.tuned,
    };
    let shown = (1.0 + raw) / (1.0 + excess) - 1.0 > limits.gap || excess > limits.bare;
    let plain = free.trained && seen - excess > limits.bare;
    let gap = free.before > free.chance || shown && (plain || free.before > 1.2 * free.floor);
    let (known, explained) = (account.known(limits), account.explained());
    let missed = free.bare() > 1.5 * free.chance;
    let unexplained = if claims {
        known < limits.explained
    } else {
        !as_good && (explained < limits.explained && account.left > limits.left || missed)
    };
    let close = |list: &Vec<(usize, f64)>| list.first().is_some_and(|(_, odds)| -odds < limits.odds);
    // Where nothing that could be refitted helps either, the free run's own luck is no wrong parameter.
    let luck = !claims && !shown && !unexplained && free.tuned > 0.8 * free.before;
    let verdict = if !gap || luck {
        Verdict::NoGap
    } else if unexplained {
        Verdict::Unknown
    } else if !claims {
        Verdict::Parameters
    } else if best.stated.set.iter().zip(&rivals).any(|(h, r)| h.is_effect() && close(r)) {
        Verdict::Ambiguous
    } else {
        Verdict::Effects
    };
    let unknown = 1.0 / (1.0 + ((known - limits.explained) * 12.0).exp());
    let unknown = match verdict {
        Verdict::NoGap | Verdict::Parameters => unknown.min(0.05),
        _ => unknown,
    };
    let mass = |list: &Vec<(usize, f64)>| list.iter().map(|l| l.1.exp()).sum::<f64>();
    let members = MEMBERS[best.effects().clamp(1, MEMBERS.len()) - 1];
    let probability = rivals.iter().map(|list| (1.0 - unknown) * members / (1.0 + mass(list))).collect();
    found.best = best;
    Decision { verdict, rivals, probability, explained, closed, unknown }
}
