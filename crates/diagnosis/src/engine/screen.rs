//! The screen: what each cause, and each pair of causes, would explain, from a few simulations and a linear fit.

mod look;
mod looked;
mod pair;
mod projection;

use nalgebra::DVector;
use trueup_identification::parallel;
use trueup_models::effect::PUSHES;

use super::hypothesis::{Hypothesis, HypothesisClaim, PosedHypothesis, Times, TrialValues};
use super::problem::BalanceUnknown;
use super::push::{Stretch, filled};
use super::search::{CaseSearch, FittedSet, PosedSet};
use super::unknown::WRONG;
use look::AddedCause;
use looked::LinearisedCause;
pub use pair::CausePair;
use projection::Projection;
use trueup_numerics::order::descending;

/// A cause as seen from the current state of the search.
#[derive(Clone, Debug)]
pub struct ScreenedCause {
    /// Which of the causes.
    pub index: usize,
    /// By how much the sum of squares would fall, half.
    pub gain: f64,
    /// Where to begin.
    pub start: Vec<f64>,
    /// Where it was looked at; none: it only frees a parameter.
    looked: Option<LinearisedCause>,
}

/// A set with a cause more, indicated by what a free run misses.
#[derive(Clone, Debug)]
pub struct RequestedCause {
    /// Share of its sum of squares that the cause would explain.
    pub share: f64,
    /// The set, running freely.
    pub stated: PosedSet,
    /// Where a fit would begin.
    pub start: Vec<f64>,
}

impl CaseSearch<'_> {
    /// How each cause would fare in addition to those of `base`, from one simulation per look.
    pub fn screen(&self, base: &FittedSet) -> Vec<ScreenedCause> {
        let projection = Projection::new(base);
        // Impulses in two places are a torque over time that has no name.
        let pushed = base.stated.set.iter().any(Hypothesis::is_push);
        let tasks: Vec<usize> = (0..self.causes.len())
            .filter(|i| !base.stated.set.iter().any(|h| h.same_place(&self.causes[*i])))
            .filter(|i| !(pushed && self.causes[*i].is_push()))
            .collect();
        let mut all: Vec<ScreenedCause> =
            parallel::map(tasks, |i| self.screen_one(base, &projection, i, &[]))
                .into_iter()
                .flatten()
                .collect();
        descending(&mut all, |item| item.gain);
        all
    }

    /// How a cause with an order of the shaft would fare at these orders.
    pub fn screen_orders(&self, base: &FittedSet, index: usize, orders: &[f64]) -> Option<ScreenedCause> {
        self.screen_one(base, &Projection::new(base), index, orders)
    }

    fn screen_one(
        &self,
        base: &FittedSet,
        projection: &Projection,
        index: usize,
        orders: &[f64],
    ) -> Option<ScreenedCause> {
        let h = &self.causes[index];
        let mut set = base.stated.set.clone();
        set.push(h.clone());
        let stated = self.state_like(&set, base.stated.free.clone()).ok()?;
        let from = self.begin_with(&stated, base);
        let known =
            |h: &Hypothesis| base.stated.unknowns.iter().position(|u| u.name == h.id && u.run.is_none());
        if let HypothesisClaim::Parameter(_) = h.claim
            && let Some(k) = known(h)
        {
            let (gain, step) = projection.relaxed(base, k, WRONG)?;
            let mut start = from;
            start[k] += step.clamp(-0.7, 0.7);
            return Some(ScreenedCause { index, gain, start, looked: None });
        }
        let problem = self.compare(&stated);
        let added = AddedCause::new(base, projection, &problem, &stated, &from)?;
        let best = added.firmest(self.looks(base, projection, h, stated.posed.last()?, orders)?)?;
        Some(ScreenedCause { index, gain: best.gain, start: added.start(&best), looked: Some(best.looked) })
    }

    /// Where to look from at a cause; `None`: it cannot be seen with this base. `orders`: of the shaft, if known.
    fn looks(
        &self,
        base: &FittedSet,
        projection: &Projection,
        h: &Hypothesis,
        posed: &PosedHypothesis,
        orders: &[f64],
    ) -> Option<Vec<TrialValues>> {
        let push = h.is_push();
        let order = posed.order;
        let free = base.stated.free.is_some();
        // Orders are searched in what the balances miss, and so are impulses at a different time in each recording.
        if free && (order.is_some() || push && h.times == Times::EachRun) {
            return None;
        }
        if free && push {
            return self.tried_along(base, projection, h, &posed.unknowns);
        }
        if push {
            return Some(self.push_looks(base, h, &posed.unknowns));
        }
        let Some(first) = posed.looks.first() else {
            return Some(vec![posed.unknowns.iter().map(|u| u.start).collect()]);
        };
        let given = (!orders.is_empty()).then(|| orders.to_vec());
        let at_orders = order.and_then(|at| Some((at, given.or_else(|| self.orders(base, h))?)));
        let Some((at, orders)) = at_orders else { return Some(posed.looks.clone()) };
        let look = |order: f64| {
            let mut look = first.clone();
            look[at] = order;
            look
        };
        Some(orders.into_iter().map(look).collect())
    }

    /// Where to look from at a push that balances do not show: along the recordings, and where there are several at those
    /// times that explain most together.
    fn tried_along(
        &self,
        base: &FittedSet,
        projection: &Projection,
        h: &Hypothesis,
        unknowns: &[BalanceUnknown],
    ) -> Option<Vec<TrialValues>> {
        let tries = self.tries();
        if h.times == Times::Once {
            return Some(tries.into_iter().map(|s| filled(h, unknowns, &[s])).collect());
        }
        let once = Hypothesis { times: Times::Once, ..h.clone() };
        let set = [&base.stated.set[..], std::slice::from_ref(&once)].concat();
        let stated = self.state_like(&set, base.stated.free.clone()).ok()?;
        let from = self.begin_with(&stated, base);
        let (problem, posed) = (self.compare(&stated), stated.posed.last()?);
        let added = AddedCause::new(base, projection, &problem, &stated, &from)?;
        let change = |s: Stretch| Some((s, added.change(filled(&once, &posed.unknowns, &[s]))?));
        let mut left: Vec<(Stretch, DVector<f64>)> =
            parallel::map(tries, change).into_iter().flatten().collect();
        let (mut stretches, mut taken) = (Vec::new(), Vec::new());
        while stretches.len() < PUSHES && !left.is_empty() {
            let gain = |c: &(Stretch, DVector<f64>)| {
                projection.best(&taken.iter().chain([&c.1]).collect::<Vec<_>>()).0
            };
            let at = (0..left.len()).max_by(|a, b| gain(&left[*a]).total_cmp(&gain(&left[*b])))?;
            let (stretch, change) = left.swap_remove(at);
            left.retain(|(s, _)| s.is_apart(&stretch));
            stretches.push(stretch);
            taken.push(change);
        }
        Some(vec![filled(h, unknowns, &stretches)])
    }

    /// Effects that would do at least this share of what the last cause of `best` does where it ended, running freely: a free run
    /// without it contains little information on them, for it goes elsewhere (EST-10).
    pub fn alike(&self, best: &FittedSet, least: f64) -> Vec<RequestedCause> {
        let projection = Projection::without_last(best);
        let whole = 0.5 * projection.residuals.norm_squared().max(f64::MIN_POSITIVE);
        let requested = |i: usize| {
            let s = self.screen_one(best, &projection, i, &[])?;
            let mut set = best.stated.set.clone();
            set.push(self.causes[i].clone());
            let both = self.state_like(&set, best.stated.free.clone()).ok()?;
            set.remove(set.len() - 2);
            let stated = self.state_like(&set, best.stated.free.clone()).ok()?;
            let start = both.begins_like(&stated, &s.start);
            Some(RequestedCause { share: s.gain / whole, stated, start })
        };
        let other = |i: &usize| {
            let own = &self.causes[*i];
            own.is_effect() && !best.stated.set.iter().any(|h| h.same_place(own))
        };
        let tasks: Vec<usize> = (0..self.causes.len()).filter(other).collect();
        let mut all: Vec<RequestedCause> = parallel::map(tasks, requested).into_iter().flatten().collect();
        all.retain(|a| a.share >= least);
        descending(&mut all, |item| item.share);
        all
    }

    /// How the effects would fare in addition to `base`, which runs freely: those that would explain at least this share of what it
    /// misses, best first; with the effects of `base`, or alone where it has none.
    pub fn lacking(&self, base: &FittedSet, least: f64) -> Vec<RequestedCause> {
        let whole = 0.5 * base.residuals.norm_squared();
        let requested = |s: ScreenedCause| {
            let cause = self.causes[s.index].clone();
            let share = s.gain / whole.max(f64::MIN_POSITIVE);
            if share < least || !cause.is_effect() {
                return None;
            }
            let set = [&base.stated.set[..], std::slice::from_ref(&cause)].concat();
            let all = self.state_like(&set, base.stated.free.clone()).ok()?;
            let claims = base.stated.set.iter().any(Hypothesis::is_effect);
            let own = if claims { set } else { vec![cause] };
            let mut stated = self.state_like(&own, base.stated.free.clone()).ok()?;
            if claims {
                stated.believe_like(&base.stated);
            }
            let start = all.begins_like(&stated, &s.start);
            Some(RequestedCause { share, stated, start })
        };
        self.screen(base).into_iter().filter_map(requested).collect()
    }

    /// How a set would do that has a cause more than `grown`, where `base`, which runs freely, falls short: as large as the
    /// balances have it.
    pub fn requested(&self, base: &FittedSet, grown: &FittedSet) -> Option<RequestedCause> {
        let (mut stated, start) = self.in_addition(base, grown)?;
        grown.believe(&mut stated, 1.0);
        let there = self.compare(&stated).residuals(&start).ok()?;
        let difference: Vec<f64> = there.iter().zip(base.residuals.iter()).map(|(a, b)| a - b).collect();
        let projection = Projection::new(base);
        let (gain, s) = projection.best(&[&projection.out(0, &difference)]);
        let gain = if s[0] > 0.0 { gain } else { 0.0 };
        let whole = 0.5 * base.residuals.norm_squared();
        Some(RequestedCause { share: gain / whole.max(f64::MIN_POSITIVE), stated, start })
    }
}
