//! The screen: what each cause, and each pair of causes, would explain, from a few simulations and a linear fit.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use trueup_identification::lsq::Options;

use super::hypothesis::{self, Hypothesis, Look, Posed};
use super::order::is_order;
use super::problem::{Comparison, Unknown};
use super::search::{Fitted, Search, Stated};

/// More looks than this are made in one recording first,
const FEW: usize = 3;
/// and so many of them in all.
const LIKELIEST: usize = 2;

/// Share of a typical amplitude at which free runs are looked at.
const CLOSE: f64 = 0.05;

/// A cause as it looks from where the search stands.
#[derive(Clone, Debug)]
pub struct Screened {
    /// Which of the causes.
    pub index: usize,
    /// By how much the sum of squares would fall, half.
    pub gain: f64,
    /// Where to begin.
    pub start: Vec<f64>,
    /// Where it was looked at; none: it only frees a parameter.
    looked: Option<Looked>,
}

/// A look at a cause: values of its unknowns, and how the residuals change, amplitude by amplitude.
#[derive(Clone, Debug)]
struct Looked {
    values: Vec<f64>,
    columns: Vec<(Option<usize>, DVector<f64>)>,
    /// The same by first states that only the model with the cause has: coordinates.
    fresh: Vec<(usize, DVector<f64>)>,
    /// Only one sign of its change makes sense.
    one_sided: bool,
}

/// A set with a cause more, asked for by what a free run misses.
#[derive(Clone, Debug)]
pub struct Asked {
    /// Share of its sum of squares that the cause would explain.
    pub share: f64,
    /// The set, running freely.
    pub stated: Stated,
    /// Where a fit would begin.
    pub start: Vec<f64>,
}

/// Two causes together.
#[derive(Clone, Debug)]
pub struct Pair {
    /// Which of the causes.
    pub indices: [usize; 2],
    /// By how much the sum of squares would fall, half.
    pub gain: f64,
    /// Factors of the changes of either.
    factors: [Vec<f64>; 2],
}

impl Looked {
    /// Sets the unknowns of a cause, the first being coordinate `begin`, such that its changes have these factors.
    fn set(&self, theta: &mut [f64], begin: usize, posed: &Posed, factors: &[f64]) {
        for (k, u) in posed.unknowns.iter().enumerate() {
            theta[begin + k] = u.scale.coordinate(self.at(posed, k));
        }
        for ((keep, _), s) in self.columns.iter().zip(factors) {
            let Some(k) = keep else { continue };
            let (u, n) = (&posed.unknowns[*k], posed.neutral(*k));
            let value = (n + s * (self.values[*k] - n)).clamp(u.lower, u.upper);
            theta[begin + k] = u.scale.coordinate(value);
        }
        for &k in posed.follow.iter().filter(|_| factors[0] > 0.0) {
            theta[begin + k] = posed.unknowns[k].scale.coordinate(self.values[k] * factors[0]);
        }
    }
    /// Value of an unknown when all amplitudes are neutral.
    fn at(&self, posed: &Posed, k: usize) -> f64 {
        posed.amplitudes.iter().find(|(a, _)| *a == k).map_or(self.values[k], |(_, neutral)| *neutral)
    }
}

impl Posed {
    fn one_sided(&self) -> bool {
        match &self.amplitudes[..] {
            [] => true,
            [(k, neutral)] => self.unknowns[*k].lower >= *neutral,
            _ => false,
        }
    }
    fn neutral(&self, k: usize) -> f64 {
        self.amplitudes.iter().find(|a| a.0 == k).map_or(0.0, |a| a.1)
    }
}

impl Search<'_> {
    /// How each cause would fare beside those of `base`, from one simulation per look.
    pub fn screen(&self, base: &Fitted) -> Vec<Screened> {
        let projection = Projection::new(base);
        let tasks: Vec<usize> = (0..self.causes.len())
            .filter(|i| !base.stated.set.iter().any(|h| h.same_place(&self.causes[*i])))
            .collect();
        let mut all: Vec<Screened> =
            tasks.par_iter().filter_map(|&i| self.screen_one(base, &projection, i, &[])).collect();
        all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        all
    }

    /// How a cause with an order of the shaft would fare at these orders.
    pub fn screen_orders(&self, base: &Fitted, index: usize, orders: &[f64]) -> Option<Screened> {
        self.screen_one(base, &Projection::new(base), index, orders)
    }

    fn screen_one(
        &self,
        base: &Fitted,
        projection: &Projection,
        index: usize,
        orders: &[f64],
    ) -> Option<Screened> {
        let h = &self.causes[index];
        let mut set = base.stated.set.clone();
        set.push(h.clone());
        let stated = self.state_like(&set, base.stated.free.clone()).ok()?;
        let from = self.begin_with(&stated, base);
        let last = stated.posed.last()?;
        if let hypothesis::Claim::Parameter(_) = h.claim {
            let known = base.stated.unknowns.iter().position(|u| u.name == h.id && u.run.is_none());
            if let Some(k) = known {
                let (gain, step) = projection.relaxed(base, k, hypothesis::WRONG)?;
                let mut start = from;
                start[k] += step.clamp(-0.7, 0.7);
                return Some(Screened { index, gain, start, looked: None });
            }
        }
        let begin = *stated.begin.last()?;
        let problem = self.compare(&stated);
        let looks = self.looks(base, h, last, orders)?;
        let keeps: Vec<Option<usize>> = match &last.amplitudes[..] {
            [] => vec![None],
            all => all.iter().map(|a| Some(a.0)).collect(),
        };
        // A joint that gives way has a motor of its own, which begins somewhere.
        let fresh = |k: &usize| base.place_of(&stated.unknowns[*k]).is_none();
        let fresh: Vec<usize> = (0..begin).filter(fresh).collect();
        let beside = Beside {
            base,
            projection,
            problem: &problem,
            from: &from,
            begin,
            posed: last,
            keeps: &keeps,
            fresh: &fresh,
        };
        let all = if looks.len() > FEW { beside.likeliest(looks) } else { looks };
        let found = all.into_iter().filter_map(|values| beside.at(values, None));
        let mut start = from.clone();
        if fresh.is_empty() {
            let (gain, looked, factors) = found.max_by(|a, b| a.0.total_cmp(&b.0))?;
            looked.set(&mut start, begin, last, &factors);
            return Some(Screened { index, gain, start, looked: Some(looked) });
        }
        let firm = |(gain, looked, _): (f64, Looked, _)| Some((projection.firm(&looked)?, gain, looked));
        let ((firm, steps), gain, looked) = found.filter_map(firm).max_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        looked.set(&mut start, begin, last, &[1.0]);
        looked.fresh.iter().zip(steps).for_each(|((k, _), step)| start[*k] += step);
        // What another size of it would explain: parameters that were dragged make every one look bad.
        let gain = gain.max(firm);
        Some(Screened { index, gain, start, looked: Some(looked) })
    }

    /// Where to look from at a cause; `None`: it is not to be seen beside this base. `orders`: of the shaft, if known.
    fn looks(&self, base: &Fitted, h: &Hypothesis, posed: &Posed, orders: &[f64]) -> Option<Vec<Look>> {
        let push = matches!(h.claim, hypothesis::Claim::Effect(c) if hypothesis::is_push(&c));
        let order = posed.unknowns.iter().position(is_order);
        // Times and orders are sought in what the balances miss.
        if base.stated.free.is_some() && (push || order.is_some()) {
            return None;
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

    /// How the effects would fare beside `base`, which runs freely: those that would explain at least this share of what it
    /// misses, best first.
    pub fn lacking(&self, base: &Fitted, least: f64) -> Vec<Asked> {
        let whole = 0.5 * base.residuals.norm_squared();
        let asked = |s: Screened| {
            let cause = self.causes[s.index].clone();
            let share = s.gain / whole.max(f64::MIN_POSITIVE);
            if share < least || !cause.is_effect() {
                return None;
            }
            let set = [&base.stated.set[..], std::slice::from_ref(&cause)].concat();
            let all = self.state_like(&set, base.stated.free.clone()).ok()?;
            let stated = self.state_like(&[cause], base.stated.free.clone()).ok()?;
            let there = |u: &Unknown| all.unknowns.iter().position(|v| v.name == u.name && v.run == u.run);
            let start =
                stated.unknowns.iter().map(|u| there(u).map_or(u.coordinate(), |k| s.start[k])).collect();
            Some(Asked { share, stated, start })
        };
        self.screen(base).into_iter().filter_map(asked).collect()
    }

    /// How a set would fare that has a cause more than `led`, where `base`, which runs freely, falls short: as large as the
    /// balances have it.
    pub fn asked(&self, base: &Fitted, grown: &Fitted) -> Option<Asked> {
        let mut stated = self.state_like(&grown.stated.set, base.stated.free.clone()).ok()?;
        grown.believe(&mut stated, 1.0);
        let shared = |u| base.coordinate_of(u).or_else(|| grown.coordinate_of(u));
        let start: Vec<f64> =
            stated.unknowns.iter().map(|u| shared(u).unwrap_or_else(|| u.coordinate())).collect();
        let there = self.compare(&stated).residuals(&start).ok()?;
        let difference: Vec<f64> = there.iter().zip(base.residuals.iter()).map(|(a, b)| a - b).collect();
        let projection = Projection::new(base);
        let (gain, s) = projection.best(&[&projection.out(0, &difference)]);
        let gain = if s[0] > 0.0 { gain } else { 0.0 };
        let whole = 0.5 * base.residuals.norm_squared();
        Some(Asked { share: gain / whole.max(f64::MIN_POSITIVE), stated, start })
    }

    /// Pairs of effects out of a screen beside `base`, best first: looked at apart, fitted together.
    pub fn pairs(&self, base: &Fitted, screened: &[Screened]) -> Vec<Pair> {
        let looks: Vec<(&Screened, &Looked)> = (screened.iter())
            .filter(|s| self.causes[s.index].is_effect())
            .filter_map(|s| Some((s, s.looked.as_ref()?)))
            .collect();
        let mut begin = vec![0];
        looks.iter().for_each(|(_, l)| begin.push(begin[begin.len() - 1] + l.columns.len()));
        let all: Vec<DVector<f64>> =
            looks.iter().flat_map(|(_, l)| l.columns.iter().map(|c| c.1.clone())).collect();
        if all.is_empty() {
            return Vec::new();
        }
        let all = DMatrix::from_columns(&all);
        let (among, with) = (all.tr_mul(&all), all.tr_mul(&Projection::new(base).residuals));
        let of = |a: usize, b: usize| -> Option<Pair> {
            let indices = [looks[a].0.index, looks[b].0.index];
            let [one, other] = indices.map(|i| &self.causes[i]);
            if one.same_place(other) {
                return None;
            }
            let at: Vec<usize> = (begin[a]..begin[a + 1]).chain(begin[b]..begin[b + 1]).collect();
            let products = DMatrix::from_fn(at.len(), at.len(), |i, j| among[(at[i], at[j])]);
            let (gain, mut first) = best(products, DVector::from_fn(at.len(), |i, _| with[at[i]]));
            let second = first.split_off(looks[a].1.columns.len());
            let against = |i: usize, factors: &[f64]| looks[i].1.one_sided && factors[0] <= 0.0;
            let sensible = !against(a, &first) && !against(b, &second);
            sensible.then_some(Pair { indices, gain, factors: [first, second] })
        };
        let mut pairs: Vec<Pair> = (0..looks.len())
            .flat_map(|a| (a + 1..looks.len()).map(move |b| (a, b)))
            .filter_map(|(a, b)| of(a, b))
            .filter(|p| p.gain > looks[0].0.gain)
            .collect();
        pairs.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        pairs
    }

    /// A pair fitted beside `base`.
    pub fn fit_pair(
        &self,
        base: &Fitted,
        screened: &[Screened],
        pair: &Pair,
        options: Options,
    ) -> Option<Fitted> {
        let mut set = base.stated.set.clone();
        set.extend(pair.indices.map(|i| self.causes[i].clone()));
        let stated = self.state(&set).ok()?;
        let mut start = self.begin_with(&stated, base);
        let first = stated.begin.len() - 2;
        for (k, index) in pair.indices.into_iter().enumerate() {
            let looked = screened.iter().find(|s| s.index == index)?.looked.as_ref()?;
            let posed = &stated.posed[first + k];
            let factors = &pair.factors[k];
            looked.set(&mut start, stated.begin[first + k], posed, factors);
        }
        self.fit_beside(stated, &start, options, base).ok()
    }
}

/// A cause beside those of a base.
struct Beside<'a> {
    base: &'a Fitted,
    projection: &'a Projection,
    problem: &'a Comparison<'a>,
    from: &'a [f64],
    /// Its first coordinate.
    begin: usize,
    posed: &'a Posed,
    /// Amplitudes to be looked at.
    keeps: &'a [Option<usize>],
    /// First states that the base does not have.
    fresh: &'a [usize],
}

impl Beside<'_> {
    /// By how much the sum of squares would fall with unknowns around these values, half, and with which factors; in one
    /// recording, or all.
    fn at(&self, values: Vec<f64>, run: Option<usize>) -> Option<(f64, Looked, Vec<f64>)> {
        let mut looked =
            Looked { values, columns: Vec::new(), fresh: Vec::new(), one_sided: self.posed.one_sided() };
        let begins = self.problem.begins();
        let rows = run.map_or(0..begins[begins.len() - 1], |r| begins[r]..begins[r + 1]);
        for keep in self.keeps {
            let mut theta = self.from.to_vec();
            for (k, u) in self.posed.unknowns.iter().enumerate() {
                theta[self.begin + k] = u.scale.coordinate(looked.at(self.posed, k));
            }
            // What a free run adds up is in proportion only while it is small.
            let close = if self.base.stated.free.is_some() && keep.is_some() { CLOSE } else { 1.0 };
            if let Some(k) = keep {
                let (u, n) = (&self.posed.unknowns[*k], self.posed.neutral(*k));
                theta[self.begin + k] = u.scale.coordinate(n + close * (looked.values[*k] - n));
            }
            let residuals = |theta: &[f64]| {
                run.map_or_else(|| self.problem.residuals(theta), |r| self.problem.residual(r, theta))
            };
            let Ok(mut there) = residuals(&theta) else { continue };
            for (k, of) in self.fresh.iter().filter_map(|k| Some((*k, self.problem.unknowns[*k].run?))) {
                if run.is_some_and(|r| r != of) {
                    continue;
                }
                theta[k] += 1.0;
                let moved = self.problem.residual(of, &theta);
                theta[k] -= 1.0;
                let Ok(mut moved) = moved else { continue };
                let own = begins[of] - rows.start..begins[of + 1] - rows.start;
                moved.iter_mut().zip(&there[own]).for_each(|(a, b)| *a -= b);
                looked.fresh.push((k, self.projection.out(begins[of], &moved)));
            }
            let base = &self.base.residuals.as_slice()[rows.clone()];
            there.iter_mut().zip(base).for_each(|(a, b)| *a = (*a - b) / close);
            looked.columns.push((*keep, self.projection.out(rows.start, &there)));
        }
        if looked.columns.is_empty() {
            return None;
        }
        let own = looked.columns.iter().map(|c| &c.1);
        let columns: Vec<&DVector<f64>> = own.chain(looked.fresh.iter().map(|c| &c.1)).collect();
        let (gain, factors) = self.projection.best(&columns);
        let gain = if looked.one_sided && factors[0] <= 0.0 { 0.0 } else { gain };
        Some((gain, looked, factors))
    }

    /// Of many the few that explain most where most is missing.
    fn likeliest(&self, looks: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
        let begins = self.problem.begins();
        let power = |r: usize| {
            let rows = &self.base.residuals.as_slice()[begins[r]..begins[r + 1]];
            rows.iter().map(|r| r * r).sum::<f64>() / rows.len().max(1) as f64
        };
        let Some(run) = (0..begins.len() - 1).max_by(|a, b| power(*a).total_cmp(&power(*b))) else {
            return looks;
        };
        // A spring is there or not: no factor stands before it.
        let gain = |values: Vec<f64>| {
            let (gain, looked, _) = self.at(values, Some(run))?;
            let firm = if self.fresh.is_empty() { gain } else { self.projection.firm(&looked)?.0 };
            Some((firm, looked.values))
        };
        let mut all: Vec<(f64, Vec<f64>)> = looks.into_iter().filter_map(gain).collect();
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        all.truncate(LIKELIEST);
        all.into_iter().map(|a| a.1).collect()
    }
}

/// What the unknowns of a fit cannot take up.
struct Projection {
    /// Orthonormal columns that span the Jacobian (with the rows of the priors).
    q: DMatrix<f64>,
    residuals: DVector<f64>,
}

impl Projection {
    fn new(base: &Fitted) -> Self {
        let mut j = base.jacobian.clone();
        for mut column in j.column_iter_mut() {
            let norm = column.norm();
            if norm > 0.0 {
                column /= norm;
            }
        }
        let q = j.qr().q();
        let residuals = &base.residuals - &q * q.tr_mul(&base.residuals);
        Self { q, residuals }
    }
    /// A change of the readings from `first` on, less what the unknowns would do against it.
    fn out(&self, first: usize, readings: &[f64]) -> DVector<f64> {
        let mut v = DVector::zeros(self.residuals.len());
        v.as_mut_slice()[first..first + readings.len()].copy_from_slice(readings);
        let along = self.q.tr_mul(&v);
        v - &self.q * along
    }
    /// Half the fall of the sum of squares with the best factors of these changes, and the factors; a factor of 1 has
    /// the prior's standard deviation.
    fn best(&self, columns: &[&DVector<f64>]) -> (f64, Vec<f64>) {
        best_of(columns, &self.residuals)
    }
    /// Half the fall of the sum of squares with a cause as it was looked at and the best first states, and their steps.
    fn firm(&self, looked: &Looked) -> Option<(f64, Vec<f64>)> {
        let fresh: Vec<&DVector<f64>> = looked.fresh.iter().map(|c| &c.1).collect();
        let with = &self.residuals + &looked.columns.first()?.1;
        let (gain, steps) = best_of(&fresh, &with);
        Some((gain + 0.5 * (self.residuals.norm_squared() - with.norm_squared()), steps))
    }
    /// Half the fall of the sum of squares when unknown `k` is doubted by `sd` instead of by its prior, and its step.
    fn relaxed(&self, base: &Fitted, k: usize, sd: f64) -> Option<(f64, f64)> {
        let (_, old) = base.stated.unknowns[k].prior?;
        let mut a = base.jacobian.tr_mul(&base.jacobian);
        let mut b = base.jacobian.tr_mul(&base.residuals);
        let r = base.theta[k] - base.stated.unknowns[k].prior?.0;
        let change = 1.0 / (sd * sd) - 1.0 / (old * old);
        a[(k, k)] += change;
        b[k] += change * r;
        let step = -a.cholesky()?.solve(&b);
        let before = 0.5 * (base.residuals.norm_squared() + change * r * r);
        let gain = -0.5 * step.dot(&b) + 0.5 * base.residuals.norm_squared() - before;
        Some((gain.max(0.0), step[k]))
    }
}

/// Of these changes of residuals.
fn best_of(columns: &[&DVector<f64>], residuals: &DVector<f64>) -> (f64, Vec<f64>) {
    let n = columns.len();
    let a = DMatrix::from_fn(n, n, |i, j| columns[i].dot(columns[j]));
    best(a, DVector::from_fn(n, |i, _| columns[i].dot(residuals)))
}

/// Of changes with products `a` among themselves and `b` with the residuals.
fn best(mut a: DMatrix<f64>, b: DVector<f64>) -> (f64, Vec<f64>) {
    let (n, bare) = (b.len(), a.clone());
    (0..n).for_each(|i| a[(i, i)] += 1.0);
    let Some(c) = a.cholesky() else { return (0.0, vec![0.0; n]) };
    let mut s = -c.solve(&b);
    // A simulation at one size says little about one that is many times as large.
    let most = s.amax();
    if most > 4.0 {
        s *= 4.0 / most;
    }
    let gain = -(b.dot(&s) + 0.5 * s.dot(&(&bare * &s)) + 0.5 * s.norm_squared());
    (gain.max(0.0), s.iter().copied().collect())
}
