//! The verdict: what the sets that were fitted say together.

use super::search::Fitted;
use super::select::Found;
use crate::outcome::Verdict;

/// Figures that were set on trials whose seeds are not those reported.
#[derive(Clone, Copy, Debug)]
pub struct Thresholds {
    /// A gap is there when the power of the nominal model's residuals exceeds what the best explanation leaves by this share.
    pub gap: f64,
    /// ... or, where nothing explains it, the floor's by this.
    pub bare: f64,
    /// Mean share, of the balances' excess and of the free-running gap, that an explanation has to take, lest the cause be
    /// unknown.
    pub explained: f64,
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
    /// Times the floor up to which a free-running simulation is as good as perfect.
    pub free: f64,
    /// Odds (natural logarithm) below which two causes are not told apart.
    pub odds: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self {
            gap: 0.06,
            bare: 0.5,
            explained: 0.8,
            left: 0.25,
            trust: 0.05,
            run: 4.0,
            most: 400.0,
            more: 4.0,
            alike: 0.5,
            needless: 1.2,
            free: 2.0,
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

impl Fitted {
    /// Half the number of readings that count as independent, times the logarithm of the power that is left: what the
    /// likelihood is when the size of the misfit is not known.
    pub fn concentrated(&self, independent: f64) -> f64 {
        -0.5 * independent * ((self.chi2 + self.prior2) / self.count()).ln()
    }
}

/// How well a free-running simulation does: its gap above the floor, as a power. Below a third of the floor nothing counts.
fn left(gap: f64, floor: f64) -> f64 {
    (gap * gap - floor * floor).max(0.1 * floor * floor).max(f64::MIN_POSITIVE)
}

/// What free-running simulations of some of the sets showed.
pub trait Ran {
    /// Gap on recordings held out.
    fn after(&self, set: usize) -> Option<f64>;
    /// How far the predictions of two sets are apart, as a gap.
    fn apart(&self, a: usize, b: usize) -> Option<f64>;
}

/// Chooses and decides; `raw` is the excess of the nominal model as it is. `found.best` and `free.after` become those of the
/// set chosen.
pub fn decide(found: &mut Found, raw: f64, free: &mut Free, ran: &dyn Ran, limits: &Thresholds) -> Decision {
    let floor_of = |gap: f64| left(gap, free.floor);
    let tuned = floor_of(free.tuned);
    let independent = limits.independent(&found.best);
    let effects = |f: &Fitted| f.stated.set.iter().filter(|h| h.is_effect()).count();
    // A set that did not run is held to do no better than the worst of its size that ran.
    let worst: Vec<f64> = (0..8)
        .map(|size| {
            let like = (0..found.sets.len()).filter(|&i| found.sets[i].stated.set.len() == size);
            like.filter_map(|i| ran.after(i)).fold(0.0, f64::max)
        })
        .collect();
    let power = |at: usize| {
        let size = found.sets[at].stated.set.len();
        let assumed = worst.get(size).copied().filter(|w| *w > 0.0).unwrap_or(free.tuned);
        floor_of(ran.after(at).unwrap_or(assumed))
    };
    let score = |at: usize| {
        let f = &found.sets[at];
        f.concentrated(independent) + 0.5 * f.occam - limits.run * power(at).ln()
    };
    let of_size = |size: usize| -> Vec<usize> {
        let all = 0..found.sets.len();
        let fits = |&i: &usize| {
            found.sets[i].stated.set.len() == size && effects(&found.sets[i]) > 0 && ran.after(i).is_some()
        };
        all.filter(fits).collect()
    };
    let best_of = |list: Vec<usize>| list.into_iter().max_by(|a, b| score(*a).total_cmp(&score(*b)));
    let size = found.best.stated.set.len();
    let chosen = if effects(&found.best) > 0 {
        let own = best_of(of_size(size));
        // One fewer that does as well; one more that does far better.
        let fewer = if size > 1 { best_of(of_size(size - 1)) } else { None };
        let more = of_size(size + 1).into_iter().min_by(|a, b| power(*a).total_cmp(&power(*b)));
        let fewer = fewer.filter(|f| own.is_none_or(|o| power(*f) < limits.needless * power(o)));
        let short = |o: usize| ran.after(o).is_some_and(|a| a > limits.free * free.floor);
        let more = more.filter(|m| own.is_none_or(|o| short(o) && power(*m) * limits.more < power(o)));
        let chosen = fewer.or(more).or(own);
        // What the balances favour changes nothing, and another effect by itself does.
        let alone = best_of(of_size(1)).filter(|a| {
            chosen.is_none_or(|c| power(c) > 0.5 * tuned) && power(*a) < 0.25 * chosen.map_or(tuned, power)
        });
        alone.or(chosen)
    } else {
        best_of(of_size(1)).filter(|&i| power(i) < 0.5 * tuned)
    };
    if let Some(at) = chosen {
        free.after = ran.after(at).unwrap_or(free.after);
    } else {
        free.after = free.tuned;
    }
    let closed = (1.0 - floor_of(free.after) / tuned).clamp(0.0, 1.0);
    let best = chosen.map_or_else(|| found.best.clone(), |at| found.sets[at].clone());
    let count = effects(&best);
    let left = best.excess();
    let shown = (1.0 + raw) / (1.0 + left) - 1.0 > limits.gap || left > limits.bare;
    let gap = free.before > limits.free * free.floor || shown && free.before > 1.2 * free.floor;
    // What nothing can explain away is no excess: declared noise may be wrong.
    let bottom = found.sets.iter().map(Fitted::excess).fold(left, f64::min).min(0.0);
    let total = (raw - bottom).max(1e-12);
    let structural = (found.plain.excess() - bottom).max(1e-12);
    let explained = 1.0 - (left - bottom) / if count > 0 { structural } else { total };
    let mut rivals = Vec::new();
    let mut probability = Vec::new();
    let own = chosen.map(&score);
    for (i, h) in best.stated.set.iter().enumerate() {
        let others = |f: &Fitted| {
            f.stated.set.len() == best.stated.set.len()
                && !f.stated.set.contains(h)
                && best.stated.set.iter().enumerate().all(|(k, o)| k == i || f.stated.set.contains(o))
        };
        let mut list: Vec<(usize, f64)> = Vec::new();
        for (at, f) in found.sets.iter().enumerate().filter(|(_, f)| others(f)) {
            let odds = match own {
                Some(own) => score(at) - own,
                _ => {
                    f.concentrated(independent) - best.concentrated(independent)
                        + (f.occam - best.occam) * 0.5
                }
            };
            list.push((at, odds.min(0.0)));
        }
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mass: f64 = list.iter().map(|l| l.1.exp()).sum();
        probability.push(1.0 / (1.0 + mass));
        rivals.push(list);
    }
    let as_good = count == 0 && free.tuned <= limits.free * free.floor;
    let missed = count == 0 && free.tuned > 1.5 * limits.free * free.floor;
    // Balances tell the law, free runs the size: either may be spoilt by the form of a law.
    let balances = explained.clamp(0.0, 1.0);
    let known = balances.max(closed).max(0.5 * (balances + closed) + 0.2);
    let unexplained = if count > 0 {
        known < limits.explained
    } else {
        !as_good && (explained < 0.8 && left - bottom > limits.left || missed)
    };
    let unknown = 1.0 / (1.0 + ((known - limits.explained) * 12.0).exp());
    let verdict = if !gap {
        Verdict::NoGap
    } else if unexplained {
        Verdict::Unknown
    } else if count == 0 {
        Verdict::Parameters
    } else if (best.stated.set.iter().zip(&rivals))
        .any(|(h, r)| h.is_effect() && r.first().is_some_and(|(_, odds)| -odds < limits.odds))
    {
        Verdict::Ambiguous
    } else {
        Verdict::Effects
    };
    let unknown = match verdict {
        Verdict::NoGap | Verdict::Parameters => unknown.min(0.05),
        _ => unknown,
    };
    probability.iter_mut().for_each(|p| *p *= 1.0 - unknown);
    found.best = best;
    Decision { verdict, rivals, probability, explained, closed, unknown }
}
