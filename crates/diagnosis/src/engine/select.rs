//! Which set of causes: a beam search by evidence.

use std::borrow::Cow;

use trueup_identification::lsq::SolverOptions;
use trueup_identification::parallel;
use trueup_models::effect::PlantKind;

use super::hypothesis::{Hypothesis, Times};
use super::screen::{CausePair, ScreenedCause};
use super::search::{self, CaseSearch, FittedSet};
use trueup_numerics::order::descending;

/// How far to look.
#[derive(Clone, Copy, Debug)]
pub struct SearchEffort {
    /// Causes that are fitted in full after each screen.
    pub refits: usize,
    /// Sets that are followed further.
    pub beam: usize,
    /// Most causes in a set.
    pub most: usize,
    /// Iterations per fit.
    pub iterations: usize,
    /// How often a cause of the set is exchanged for others.
    pub exchanges: usize,
}

impl Default for SearchEffort {
    fn default() -> Self {
        Self { refits: 7, beam: 2, most: 4, iterations: 10, exchanges: 6 }
    }
}

impl SearchEffort {
    /// How a set is fitted.
    pub fn options(&self) -> SolverOptions {
        SolverOptions {
            max_iterations: self.iterations,
            cost_tolerance: 1e-4,
            radius: 1.0,
            ..SolverOptions::default()
        }
    }
    /// The same for a plant whose looks cost more: one set is followed only.
    #[must_use]
    pub fn on(self, plant: PlantKind) -> Self {
        match plant {
            PlantKind::Joint => self,
            PlantKind::Arm | PlantKind::Space => Self {
                refits: self.refits.min(5),
                beam: 1,
                most: self.most.min(3),
                exchanges: self.exchanges.min(3),
                ..self
            },
        }
    }
}

/// What the search found.
#[derive(Debug)]
pub struct SearchResult {
    /// Nothing added.
    pub plain: FittedSet,
    /// Every set that was fitted, best first.
    pub sets: Vec<FittedSet>,
    /// The set chosen.
    pub best: FittedSet,
}

impl SearchResult {
    /// Share of the floor's power that is left at the least: where a set leaves less than noise was held to leave, no perfect
    /// model leaves more than it does. Impulses take up noise that is slow, and what noise leaves is not known to a quarter.
    pub fn least(&self) -> f64 {
        let all = self.sets.iter().chain([&self.best]);
        let laws = all.filter(|f| !f.stated.set.iter().any(Hypothesis::is_push));
        let least = 1.0 + laws.map(FittedSet::excess).fold(0.0, f64::min);
        if least > 1.0 - FLOOR_UNCERTAINTY { 1.0 } else { least.max(LEAST) }
    }
    /// An excess over that.
    pub fn above(&self, excess: f64) -> f64 {
        above(excess, self.least())
    }
}

/// An excess over the share of the floor's power that is left at the least.
pub fn above(excess: f64, least: f64) -> f64 {
    (1.0 + excess) / least - 1.0
}

/// A step has to explain this share of the excess that is left.
pub const SHARE: f64 = 0.12;
/// ... and, from the second on, this share of the excess of the plain model: less is attributed to the form of the first.
const LEFT_TO_FORM: f64 = 0.03;
/// ... unless it is this share of what is left, and leaves none: what is wrong with a form no other cause corrects wholly,
pub const WHOLLY: f64 = 0.7;
/// or this share, however much is left,
pub const NEARLY: f64 = 0.85;
/// and it brings so much evidence.
pub const REQUIRED: f64 = 100.0;
/// Parameters that are so far from their prior means, in squares of standard deviations, are biased.
const BIASED: f64 = 25.0;
/// Share of what several impulses explain that one has to leave to them.
const ALIKE: f64 = 0.9;
/// Share of what the best of a screen explains that they have to explain themselves.
const LEADING: f64 = 0.5;
/// Forms of one cause that are fitted after a screen.
const FORMS: usize = 2;
/// Pairs that are fitted after a screen of all.
const PAIRS: usize = 6;
/// Sets with a cause more that are fitted for free-running simulations.
const GROW: usize = 12;
/// Sets of each size that are fitted with all derivatives.
const WHOLE: usize = 2;
/// Evidence that is apart by less is alike.
const CLOSE: f64 = 5.0;
/// Share of the floor that a set leaves at the least: less was fitted away.
const LEAST: f64 = 0.02;
/// Share of the floor that it may be off by.
const FLOOR_UNCERTAINTY: f64 = 0.25;
/// Share of the floor's power from which an excess is plain.
pub const PLAIN: f64 = 0.25;
/// An excess that is a smaller share of the floor's power than this is none.
pub const NEGLIGIBLE: f64 = 0.04;

impl FittedSet {
    /// Readings that count.
    pub fn count(&self) -> f64 {
        if !self.octaves.is_empty() {
            return self.octaves.iter().map(|o| o.count).sum::<f64>().max(1.0);
        }
        self.readings as f64
    }
    /// Power of the residuals over that of the floor, what the priors object included.
    pub fn excess(&self) -> f64 {
        search::excess(&self.octaves) + self.prior2 / self.count()
    }
    /// Its balances miss nothing that is plain, so that they drag no parameter.
    pub fn misses_little(&self) -> bool {
        self.excess() < PLAIN
    }
}

impl CaseSearch<'_> {
    /// Searches.
    ///
    /// # Errors
    /// Why the nominal model cannot be fitted.
    pub fn select(
        &self,
        effort: SearchEffort,
        mut report_progress: impl FnMut(&str),
    ) -> Result<SearchResult, String> {
        let options = effort.options();
        let stated = self.state(&[])?;
        let start = self.compare(&stated).start();
        let plain = self.fit(stated, &start, options).map_err(|e| e.to_string())?;
        report_progress(&format!("nothing added: excess {:.3}", plain.excess()));
        let mut sets: Vec<FittedSet> = Vec::new();
        let mut best = plain.clone();
        let mut beam = vec![plain.clone()];
        // Where a cause has biased parameters by much, it is better seen from where they were.
        if plain.prior2 > BIASED && plain.excess() > NEGLIGIBLE {
            beam.extend(self.given(&plain));
        }
        let mut alone: Vec<(FittedSet, Vec<ScreenedCause>)> = Vec::new();
        for depth in 1..=effort.most {
            let mut grown: Vec<FittedSet> = Vec::new();
            for (followed, base) in beam.iter().enumerate() {
                let screened = self.screen(base);
                let refits = if depth == 1 { effort.refits } else { effort.refits.saturating_sub(2) };
                // Parameters were fitted with the plain model.
                let own = if depth == 1 && followed > 0 { 0 } else { refits.div_ceil(3) };
                let selected = self.likeliest(&screened, refits, own);
                let fits = self.fit_each(selected, base, options, |set| {
                    depth == 1 || !grown.iter().any(|g| same(&g.stated.set, set))
                });
                fits.into_iter().for_each(|fitted| keep(&mut grown, fitted.lean()));
                if depth == 1 {
                    alone.push((base.clone(), screened));
                }
            }
            // What hides behind another: two that were screened together.
            for (base, screened) in alone.iter().filter(|_| depth == 2) {
                let mut pairs = self.pairs(base, screened);
                pairs.truncate(PAIRS);
                let set = |p: &CausePair| p.indices.map(|i| self.causes[i].clone());
                pairs.retain(|p| !grown.iter().any(|g| same(&g.stated.set, &set(p))));
                let fits = parallel::map(&pairs, |p| self.fit_pair(base, screened, p, options));
                grown.extend(fits.into_iter().flatten().map(FittedSet::lean));
            }
            descending(&mut grown, |item| item.evidence(1.0));
            // The best once more with all derivatives.
            parallel::map(grown.iter_mut().take(WHOLE), |fitted| {
                if let Ok(whole) = self.fit(fitted.stated.clone(), &fitted.theta, options) {
                    *fitted = whole;
                }
            });
            descending(&mut grown, |item| item.evidence(1.0));
            let Some(top) = grown.first() else { break };
            report_progress(&format!("{depth}: {:?}: excess {:.3}", top.labels(), top.excess()));
            let (before, after) = (best.excess(), top.excess());
            let gained = before - after;
            let evidence = top.evidence(1.0) - best.evidence(1.0);
            let worth = evidence > 10.0
                && gained > NEGLIGIBLE
                && gained > SHARE * before.max(0.0)
                && (depth == 1
                    || gained > LEFT_TO_FORM * plain.excess()
                    || (after < NEGLIGIBLE && gained > WHOLLY * before || gained > NEARLY * before)
                        && evidence > REQUIRED);
            if worth {
                best = top.clone();
            }
            let leading: Vec<_> = grown.iter().take(effort.beam).map(|f| self.whole(f)).collect();
            beam = leading.into_iter().flatten().map(Cow::into_owned).collect();
            sets.extend(grown.into_iter().map(FittedSet::lean));
            // Of two causes neither may explain much by itself.
            let promising = depth == 1 && evidence > REQUIRED;
            if !(worth || promising) || after < NEGLIGIBLE {
                break;
            }
        }
        best = self.without_needless(best, options);
        best = self.exchanged(best, &mut sets, effort, options, &mut report_progress);
        self.share_orders(&best, &plain, &mut sets, options);
        let simpler = |f: &&FittedSet| f.stated.set.len() <= best.stated.set.len();
        let most = sets.iter().filter(simpler).max_by(|a, b| a.evidence(1.0).total_cmp(&b.evidence(1.0)));
        if let Some(most) =
            most.filter(|m| m.evidence(1.0) > best.evidence(1.0) && !best.stated.set.is_empty())
        {
            best = most.clone();
        }
        if !sets.iter().any(|f| same(&f.stated.set, &best.stated.set)) && !best.stated.set.is_empty() {
            sets.push(best.clone());
        }
        descending(&mut sets, |item| item.evidence(1.0));
        let sets = sets.into_iter().map(FittedSet::lean).collect();
        Ok(SearchResult { plain, sets, best })
    }

    /// Fits the likeliest sets with one cause more than `base`, however small their share: a free-running simulation may
    /// decide.
    pub fn grow(&self, found: &mut SearchResult, base: &FittedSet, effort: SearchEffort) {
        let options = effort.options();
        let Some(base) = self.whole(base) else { return };
        let screened = self.screen(&base);
        let selected = self.likeliest(&screened, GROW, GROW);
        let new = |set: &[Hypothesis]| !found.sets.iter().any(|f| same(&f.stated.set, set));
        let fits = self.fit_each(selected, &base, options, new);
        found.sets.extend(fits.into_iter().map(FittedSet::lean));
    }

    /// The best few of a screen, of the plant's own parameters at most `own`: where sensors are few they all take up some of what
    /// an effect does, and would crowd it out.
    fn likeliest<'s>(
        &self,
        screened: &'s [ScreenedCause],
        few: usize,
        own: usize,
    ) -> impl Iterator<Item = &'s ScreenedCause> {
        let mut left = own;
        let fits = screened.iter().filter(|s| s.gain > 2.0 && self.leads(s, screened)).filter(move |s| {
            let effect = self.causes[s.index].is_effect();
            let fits = effect || left > 0;
            left -= usize::from(fits && !effect);
            fits
        });
        // Of the forms of one cause the likelier ones.
        let mut seen: Vec<usize> = Vec::new();
        let fits = fits.filter(move |s| {
            let same = |i: &&usize| self.causes[**i].same_place(&self.causes[s.index]);
            let forms = seen.iter().filter(same).count();
            seen.push(s.index);
            forms < FORMS
        });
        fits.take(few)
    }

    /// Several impulses are rejected where one explains nearly as much: where they are hardly better, their fit costs more
    /// than it shows.
    fn leads(&self, s: &ScreenedCause, screened: &[ScreenedCause]) -> bool {
        let cause = &self.causes[s.index];
        let once = |o: &&ScreenedCause| {
            let other = &self.causes[o.index];
            other.times != Times::Several && other.same_place(cause)
        };
        let gain = |of: Option<&ScreenedCause>| of.map_or(0.0, |o| o.gain);
        cause.times != Times::Several
            || s.gain > LEADING * gain(screened.first()) && gain(screened.iter().find(once)) < ALIKE * s.gain
    }

    /// Fits `base` with each of these causes more, where the set is `selected`.
    fn fit_each<'s>(
        &self,
        causes: impl Iterator<Item = &'s ScreenedCause>,
        base: &FittedSet,
        options: SolverOptions,
        selected: impl Fn(&[Hypothesis]) -> bool,
    ) -> Vec<FittedSet> {
        let step = |s: &'s ScreenedCause| {
            let mut set = base.stated.set.clone();
            set.push(self.causes[s.index].clone());
            selected(&set).then_some((set, &s.start))
        };
        let steps: Vec<_> = causes.filter_map(step).collect();
        let fit = |(set, start): (Vec<Hypothesis>, &Vec<f64>)| {
            self.fit_in_addition(self.state(&set).ok()?, start, options, base).ok()
        };
        parallel::map(steps, fit).into_iter().flatten().collect()
    }

    /// Tries other causes instead of each of several.
    fn exchanged(
        &self,
        mut best: FittedSet,
        sets: &mut Vec<FittedSet>,
        effort: SearchEffort,
        options: SolverOptions,
        report_progress: &mut impl FnMut(&str),
    ) -> FittedSet {
        let mut i = 0;
        let mut rounds = 0;
        while best.stated.set.len() > 1 && i < best.stated.set.len() && rounds < effort.exchanges {
            rounds += 1;
            let mut fewer = best.stated.set.clone();
            let out = fewer.remove(i);
            let Ok(stated) = self.state(&fewer) else { break };
            let start = self.begin_with(&stated, &best);
            let Ok(base) = self.fit(stated, &start, options) else { break };
            let mut better: Option<FittedSet> = None;
            let few = effort.refits.saturating_sub(2);
            let screened = self.screen(&base);
            let selected = self.likeliest(&screened, few, few.div_ceil(3)).filter(|s| {
                let h = &self.causes[s.index];
                let set = [&fewer[..], std::slice::from_ref(h)].concat();
                let known = sets.iter().find(|f| same(&f.stated.set, &set));
                // A fit from elsewhere may have ended in another minimum.
                let promised = base.evidence(1.0) + s.gain - CLOSE;
                *h != out && known.is_none_or(|f| f.evidence(1.0) < promised)
            });
            for fit in self.fit_each(selected, &base, options, |_| true) {
                if fit.evidence(1.0) > better.as_ref().unwrap_or(&best).evidence(1.0) + CLOSE {
                    better = Some(fit.clone());
                }
                keep(sets, fit.lean());
            }
            match better {
                Some(found) => {
                    report_progress(&format!(
                        "exchanged: {:?}: excess {:.3}",
                        found.labels(),
                        found.excess()
                    ));
                    best = found;
                    i = 0;
                }
                None => i += 1,
            }
        }
        best
    }

    /// Tries every other cause with an order of the shaft instead of one, at the order that this one has: lines are so
    /// narrow that each would else end at an order of its own.
    fn share_orders(
        &self,
        best: &FittedSet,
        plain: &FittedSet,
        sets: &mut Vec<FittedSet>,
        options: SolverOptions,
    ) {
        for i in 0..best.stated.set.len() {
            let Some(order) = best.order_of(i) else { continue };
            let mut fewer = best.stated.set.clone();
            fewer.remove(i);
            let base = if fewer.is_empty() {
                Some(plain.clone())
            } else {
                let stated = self.state(&fewer).ok();
                stated.and_then(|s| self.fit(s.clone(), &self.begin_with(&s, best), options).ok())
            };
            let Some(base) = base else { continue };
            let places: Vec<usize> = (0..self.causes.len())
                .filter(|&k| self.causes[k].has_order() && !best.stated.set.contains(&self.causes[k]))
                .collect();
            let fits = parallel::map(places, |index| {
                let s = self.screen_orders(&base, index, &[order, 0.5 * order])?;
                let mut set = fewer.clone();
                set.push(self.causes[index].clone());
                self.fit(self.state(&set).ok()?, &s.start, options).ok()
            });
            fits.into_iter().flatten().for_each(|fitted| keep(sets, fitted.lean()));
        }
    }

    /// Leaves out what the others make needless.
    fn without_needless(&self, mut best: FittedSet, options: SolverOptions) -> FittedSet {
        while best.stated.set.len() > 1 {
            let fits = parallel::map(0..best.stated.set.len(), |i| {
                let mut set = best.stated.set.clone();
                set.remove(i);
                let stated = self.state(&set).ok()?;
                let start = self.begin_with(&stated, &best);
                self.fit(stated, &start, options).ok()
            });
            let Some(less) =
                fits.into_iter().flatten().max_by(|a, b| a.evidence(1.0).total_cmp(&b.evidence(1.0)))
            else {
                break;
            };
            let lost = less.excess() - best.excess();
            if less.evidence(1.0) > best.evidence(1.0) - 10.0
                || lost < NEGLIGIBLE
                || lost < SHARE * less.excess()
            {
                best = less;
            } else {
                break;
            }
        }
        best
    }
}

/// Adds a fit to those of other sets; of the same set the better stays.
fn keep(sets: &mut Vec<FittedSet>, fitted: FittedSet) {
    match sets.iter_mut().find(|f| same(&f.stated.set, &fitted.stated.set)) {
        Some(old) if old.evidence(1.0) < fitted.evidence(1.0) => *old = fitted,
        Some(_) => {}
        None => sets.push(fitted),
    }
}

/// Replaces the fit of the same set, or adds one behind the others; where. Unlike [`keep`] it requires no evidence: a
/// fit of the balances from where a free run ended belongs to that run, which ended there for they had it wrong.
pub(crate) fn put(sets: &mut Vec<FittedSet>, fitted: FittedSet) -> usize {
    let at = sets.iter().position(|f| same(&f.stated.set, &fitted.stated.set)).unwrap_or(sets.len());
    if at == sets.len() {
        sets.push(fitted)
    } else {
        sets[at] = fitted
    }
    at
}

/// The same causes.
pub fn same(a: &[Hypothesis], b: &[Hypothesis]) -> bool {
    a.len() == b.len() && a.iter().all(|h| b.contains(h))
}

#[cfg(test)]
mod tests {
    use crate::engine::made::{fitted, found};

    #[test]
    fn what_is_left_at_the_least_is_that_of_laws_and_well_below_the_floor() {
        let cases = [
            ("at the floor", &[("backlash", 1.0)][..], 1.0),
            ("below it by no more than noise is known", &[("backlash", 0.8)], 1.0),
            ("well below it, wherever", &[("backlash", 0.9), ("cable-stiffness", 0.6)], 0.6),
            ("below it by a push, which takes up noise", &[("backlash", 1.0), ("external-force", 0.6)], 1.0),
            ("nearly nothing: it was fitted away", &[("backlash", 0.001)], 0.02),
        ];
        for (what, sets, least) in cases {
            let sets = sets.iter().map(|(labels, power)| fitted(labels, *power, 10.0)).collect();
            let found = found(sets, Some(0), 10.0);
            assert!((found.least() - least).abs() < 1e-12, "{what}: {}", found.least());
            // An excess over the floor's power is one over that.
            assert!((found.above(2.0 * least - 1.0) - 1.0).abs() < 1e-12, "{what}");
        }
    }
}
