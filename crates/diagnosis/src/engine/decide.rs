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
    /// Share of the excess that an explanation has to take, lest the cause be unknown.
    pub explained: f64,
    /// Excess that may be left whatever the share.
    pub left: f64,
    /// How much of the log-likelihood ratio of the residual powers counts: the rest is put down to form.
    pub trust: f64,
    /// Times the floor up to which a free-running simulation is as good as perfect.
    pub free: f64,
    /// Odds (natural logarithm) below which two causes are not told apart.
    pub odds: f64,
}

impl Default for Thresholds {
    fn default() -> Self {
        Self { gap: 0.06, bare: 0.5, explained: 0.8, left: 0.25, trust: 0.05, free: 2.0, odds: 3.0 }
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
    /// Probability that none of the candidates is right.
    pub unknown: f64,
}

impl Fitted {
    /// Half the number of readings that count as independent, times the logarithm of the power that is left: what the
    /// likelihood is when the size of the misfit is not known.
    fn concentrated(&self, independent: f64) -> f64 {
        -0.5 * independent * ((self.chi2 + self.prior2) / self.count()).ln()
    }
}

/// Decides; `raw` is the excess of the nominal model as it is.
pub fn decide(found: &Found, raw: f64, free: Option<&Free>, limits: &Thresholds) -> Decision {
    let best = &found.best;
    let effects = best.stated.set.iter().filter(|h| h.is_effect()).count();
    let left = best.excess();
    let shown = (1.0 + raw) / (1.0 + left) - 1.0 > limits.gap || left > limits.bare;
    let gap = match free {
        Some(f) => f.before > limits.free * f.floor || shown && f.before > 1.2 * f.floor,
        None => shown,
    };
    // What nothing can explain away is no excess: declared noise may be wrong.
    let floor = found.sets.iter().map(Fitted::excess).fold(left, f64::min).min(0.0);
    let total = (raw - floor).max(1e-12);
    let structural = (found.plain.excess() - floor).max(1e-12);
    let explained_raw = 1.0 - (left - floor) / total;
    let explained = if effects > 0 { 1.0 - (left - floor) / structural } else { explained_raw };
    let independent = best.count() * limits.trust;
    let mut rivals = Vec::new();
    let mut probability = Vec::new();
    for (i, h) in best.stated.set.iter().enumerate() {
        let others = |f: &&Fitted| {
            f.stated.set.len() == best.stated.set.len()
                && !f.stated.set.contains(h)
                && best.stated.set.iter().enumerate().all(|(k, o)| k == i || f.stated.set.contains(o))
        };
        let mut list: Vec<(usize, f64)> = Vec::new();
        for (at, f) in found.sets.iter().enumerate().filter(|(_, f)| others(f)) {
            let odds =
                f.concentrated(independent) - best.concentrated(independent) + (f.occam - best.occam) * 0.5;
            list.push((at, odds.min(0.0)));
        }
        list.sort_by(|a, b| b.1.total_cmp(&a.1));
        let mass: f64 = list.iter().map(|l| l.1.exp()).sum();
        probability.push(1.0 / (1.0 + mass));
        rivals.push(list);
    }
    let as_good = free.is_some_and(|f| effects == 0 && f.tuned <= limits.free * f.floor);
    let missed = free.is_some_and(|f| effects == 0 && f.tuned > 2.0 * limits.free * f.floor);
    let unexplained = !as_good && (explained < limits.explained && left - floor > limits.left || missed);
    let unknown = 1.0 / (1.0 + ((explained - limits.explained) * 20.0).exp());
    let verdict = if !gap {
        Verdict::NoGap
    } else if unexplained {
        Verdict::Unknown
    } else if effects == 0 {
        Verdict::Parameters
    } else if best
        .stated
        .set
        .iter()
        .zip(&rivals)
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
    Decision { verdict, rivals, probability, explained, unknown }
}
