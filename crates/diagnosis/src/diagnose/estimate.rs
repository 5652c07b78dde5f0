//! Which of two estimates of a set is reported: what page, JSON, FMU and first states have alike.
//!
//! Balances and the free-running fit err for different reasons. The free-running fit is taken where it predicts the recordings
//! for fitting better over windows than chance would have it; its interval has in it how far the other is off.

use nalgebra::DMatrix;
use trueup_models::effect;

use crate::engine::hypothesis::{Hypothesis, joint_of};
use crate::engine::problem::{BalanceTarget, BalanceUnknown};
use crate::engine::replay::{CompleteModel, FreeRunFit, Window};
use crate::engine::result::{SearchResult, same};
use crate::engine::search::{CaseSearch, FittedSet, PosedSet};
use crate::outcome::{Claimed, ClaimedAmount, EstimateCorrelation};

/// Deviation of an effect's size for its law, as a share of it: what another law of the same name would be fitted with.
const LAW_SPREAD: f64 = 0.025;

impl FittedSet {
    /// Covariance of its coordinates by their information.
    fn covariance(&self) -> DMatrix<f64> {
        let information = self.information.clone();
        let n = information.nrows();
        if n == 0 {
            return information;
        }
        information.pseudo_inverse(1e-14).unwrap_or_else(|_| DMatrix::zeros(n, n))
    }
    /// Standard deviations of its coordinates, misfit included.
    pub(crate) fn deviations(&self) -> Vec<f64> {
        let inflation = (1.0 + self.excess()).max(1.0);
        let covariance = self.covariance();
        (0..covariance.nrows()).map(|k| (covariance[(k, k)].max(0.0) * inflation).sqrt()).collect()
    }
    /// The model with these values, ready to run freely.
    fn complete(&self) -> CompleteModel {
        CompleteModel { stated: self.stated.clone(), theta: self.theta.clone() }
    }
}

/// Standard errors beyond which two predictions differ: 95 % of chance are within.
const SURE: f64 = 1.96;

/// Powers that differ by less are alike.
const ALIKE: f64 = 1.2;

/// Values with their deviations.
#[derive(Clone, Debug)]
struct One {
    fitted: FittedSet,
    sd: Vec<f64>,
}

impl One {
    fn new(fitted: &FittedSet) -> Self {
        Self { fitted: fitted.clone(), sd: fitted.deviations() }
    }
    /// Value of an unknown at so many deviations, in its unit.
    fn value(&self, k: usize, deviations: f64) -> f64 {
        let u = &self.fitted.stated.unknowns[k];
        let own = u.scale.value(self.fitted.theta[k] + deviations * self.sd[k]).0;
        own + self.base(k)
    }
    /// The value above which an excess is estimated: the report and the FMU give the sum.
    fn base(&self, k: usize) -> f64 {
        let stated = &self.fitted.stated;
        let BalanceTarget::Above { base, .. } = stated.unknowns[k].target else { return 0.0 };
        let of = |u: &BalanceUnknown| u.target == BalanceTarget::Parameter(base) && u.run.is_none();
        let at = stated.unknowns.iter().position(of);
        let fitted = at.map(|k| stated.unknowns[k].scale.value(self.fitted.theta[k]).0);
        fitted.or_else(|| stated.nominal.get(base).copied()).unwrap_or(0.0)
    }
}

/// A set as it is reported: one estimate, and the other one that its intervals have in them.
#[derive(Clone, Debug)]
pub(super) struct SetEstimate {
    reported: One,
    other: Option<One>,
}

/// An estimate with the model that runs by it.
pub(super) struct ReportedEstimate {
    pub estimated: SetEstimate,
    /// What the FMU has, and what the gap after is of.
    pub complete: CompleteModel,
    /// Which of the free-running fits it is; `None`: that of the equation error.
    pub free: Option<usize>,
    /// The recordings for fitting over windows, where estimates were compared by them.
    pub windows: Option<Vec<Window>>,
}

impl ReportedEstimate {
    /// Of a set that was fitted without free runs (`prescribed`, one or several fits), and of its free-running fits, those first that are
    /// closest to the prior. Each takes the place of those before it if it predicts better over windows of that
    /// length; where recordings hold none, if it misses less of them whole. `None`: there is no fit.
    pub(super) fn of(
        search: &CaseSearch<'_>,
        window: Option<f64>,
        prescribed: &[&FittedSet],
        free: &[&FreeRunFit],
    ) -> Option<Self> {
        let fit = |f: &&FittedSet| (None, (*f).clone(), f.complete(), f64::INFINITY);
        let free_fit = |(at, p): (usize, &&FreeRunFit)| {
            Some((Some(at), p.fitted.clone()?, p.complete.clone(), p.misfit))
        };
        let all: Vec<(Option<usize>, FittedSet, CompleteModel, f64)> =
            prescribed.iter().map(fit).chain(free.iter().enumerate().filter_map(free_fit)).collect();
        let windows = |c: &CompleteModel| search.in_windows(c, &search.case.train, window?, None).ok();
        let mut best = 0;
        let mut own = if all.len() > 1 { windows(&all.first()?.2) } else { None };
        for (k, other) in all.iter().enumerate().skip(1) {
            // A last fit that did not move predicts the same.
            let known = |o: &(_, FittedSet, CompleteModel, _)| {
                o.2.theta == other.2.theta && same(&o.2.stated.set, &other.2.stated.set)
            };
            if window.is_some() && all[..k].iter().any(known) {
                continue;
            }
            let there = windows(&other.2);
            let as_well = match window {
                Some(_) => predicts_as_well(own.as_deref(), there.as_deref()),
                None => all[best].3 <= ALIKE * other.3,
            };
            if !as_well {
                (best, own) = (k, there);
            }
        }
        let (free, reported, complete, _) = all.get(best)?;
        let other = if best > 0 { all.first() } else { all.get(1) };
        let estimated = SetEstimate::new(reported, other.map(|o| &o.1));
        Some(Self { estimated, complete: complete.clone(), free: *free, windows: own })
    }
}

/// Logarithms of what the first misses over what the second misses (as powers), window by window, with the recording that each is
/// of. Noises of channels differ by orders of magnitude: each counts by its logarithm.
pub(super) fn log_ratios(one: &[Window], other: &[Window]) -> Vec<(usize, f64)> {
    let ratio = |(a, b): (f64, f64)| (a.max(f64::MIN_POSITIVE) / b.max(f64::MIN_POSITIVE)).ln();
    let channels = |w: &Window| w.missed().count().max(1) as f64;
    let each =
        |(a, b): (&Window, &Window)| (a.of, a.missed().zip(b.missed()).map(ratio).sum::<f64>() / channels(a));
    one.iter().zip(other).map(each).collect()
}

/// Whether the first predicts as well over windows as the second, or better: by the logarithms of what they miss, as where the size
/// of a misfit is not known; a window in which a motion bifurcates counts for no more than another one. Where the mean of these
/// is within [`SURE`] standard errors of 0, or below [`ALIKE`], the two are alike; then it is the first, whose fit includes the prior
/// standard deviations. `None`: it cannot be simulated.
pub(super) fn predicts_as_well(one: Option<&[Window]>, other: Option<&[Window]>) -> bool {
    let Some(one) = one else { return false };
    let Some(other) = other else { return true };
    as_well(&log_ratios(one, other).iter().map(|r| r.1).collect::<Vec<_>>())
}

/// The same of these logarithms, window by window: what the first misses over what the second does, squares.
pub(super) fn as_well(ratios: &[f64]) -> bool {
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let variance = ratios.iter().map(|w| (w - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    mean <= (SURE * (variance / n).sqrt()).max(ALIKE.ln())
}

/// Whether a set leaves over windows of the recordings for fitting no more than noise of sensors and inputs does: [`ALIKE`] times that
/// power at most, as the mean of logarithms. Nothing predicts them better.
pub(super) fn leaves_noise(search: &CaseSearch<'_>, seconds: f64, set: &FittedSet, seed: u64) -> bool {
    let (model, train) = (set.complete(), &search.case.train);
    let Ok(windows) = search.in_windows(&model, train, seconds, None) else { return false };
    let over = |floors: &dyn Fn(usize, usize) -> f64| {
        let of = |w: &Window| {
            let all = w.missed_by_channel().map(|(c, missed)| (missed / floors(w.of, c).powi(2)).ln());
            all.collect::<Vec<_>>()
        };
        let all: Vec<f64> = windows.iter().flat_map(of).collect();
        all.iter().sum::<f64>() / all.len().max(1) as f64
    };
    let alike = |floors: &dyn Fn(usize, usize) -> f64| over(floors) <= ALIKE.ln();
    // That of inputs takes runs of its own.
    alike(&|run, channel| train[run].run.channels[channel].sigma)
        || search.window_floors(&model, &windows, seed).is_ok_and(|floors| alike(&|run, c| floors[run][c]))
}

impl SetEstimate {
    pub(super) fn new(reported: &FittedSet, other: Option<&FittedSet>) -> Self {
        Self { reported: One::new(reported), other: other.map(One::new) }
    }
    /// The set in numbers.
    pub(super) fn stated(&self) -> &PosedSet {
        &self.reported.fitted.stated
    }
    /// The estimate.
    pub(super) fn fitted(&self) -> &FittedSet {
        &self.reported.fitted
    }
    /// An unknown of the set; its interval includes the other estimate, as far as that is certain, and `form` times
    /// the value.
    pub(super) fn amount(&self, k: usize, form: f64) -> ClaimedAmount {
        let u = &self.stated().unknowns[k];
        let value = self.reported.value(k, 0.0);
        let apart = self.other.as_ref().and_then(|o| {
            let there = o.fitted.place_of(u)?;
            let sure = (self.reported.sd[k] / o.sd[there].max(f64::MIN_POSITIVE)).min(1.0);
            Some((o.value(there, 0.0) - value) * sure)
        });
        let base = self.reported.base(k);
        let end = |sign: f64| {
            let chance = self.reported.value(k, sign * 1.96) - value;
            value + sign * chance.hypot(apart.unwrap_or(0.0)).hypot(1.96 * form * (value - base))
        };
        let bounds = [u.lower + base, u.upper + base];
        ClaimedAmount::within(bounds, value, u.unit.clone(), [end(-1.0), end(1.0)])
    }
    /// Correlation of all that is estimated from all recordings together. `None`: less than two of them are determined.
    pub(super) fn correlation(&self) -> Option<EstimateCorrelation> {
        let unknowns = &self.stated().unknowns;
        let covariance = self.fitted().covariance();
        let shared = |k: &usize| {
            let u = &unknowns[*k];
            u.run.is_none() && u.lower < u.upper && covariance[(*k, *k)] > 0.0
        };
        let which: Vec<usize> = (0..covariance.nrows().min(unknowns.len())).filter(shared).collect();
        let of = |i: usize, j: usize| {
            if i == j {
                return 1.0;
            }
            // Of both triangles, which rounding makes differ.
            let both = 0.5 * (covariance[(i, j)] + covariance[(j, i)]);
            (both / (covariance[(i, i)] * covariance[(j, j)]).sqrt()).clamp(-1.0, 1.0)
        };
        (which.len() > 1).then(|| EstimateCorrelation {
            names: which.iter().map(|k| unknowns[*k].name.clone()).collect(),
            matrix: which.iter().map(|i| which.iter().map(|j| of(*i, *j)).collect()).collect(),
        })
    }
    /// One of its causes, as it is reported.
    pub(super) fn claimed(
        &self,
        h: &Hypothesis,
        probability: f64,
        plant: effect::PlantKind,
        found: &SearchResult,
    ) -> Claimed {
        let stated = self.stated();
        let at = stated.set.iter().position(|o| o == h).unwrap_or(0);
        let end = stated.begin.get(at + 1).copied().unwrap_or(stated.unknowns.len());
        let free = (stated.begin[at]..end).filter(|&k| stated.unknowns[k].lower < stated.unknowns[k].upper);
        // Its state when a recording began is a first state. What recurs in each recording is reported for the first one,
        // as the FMU has it.
        let free = free.filter(|k| !stated.posed[at].initial.contains(&(k - stated.begin[at])));
        let free = free.filter(|k| stated.unknowns[*k].run.is_none_or(|run| run == 0));
        let named = |k: usize| (stated.unknowns[k].stem().to_owned(), self.amount(k, LAW_SPREAD));
        let alone = found.sets.iter().find(|s| s.stated.set.len() == 1 && s.stated.set[0] == *h);
        let total = (found.plain.excess() - found.best.excess().min(0.0)).max(1e-12);
        Claimed {
            id: h.id.clone(),
            component: h.component.clone(),
            joint: joint_of(h, plant),
            probability,
            parameters: free.map(named).collect(),
            closed_alone: alone.map(|s| ((found.plain.excess() - s.excess()) / total).clamp(0.0, 1.0)),
        }
    }
}
