//! Which of the sets that were fitted are let run freely.

use crate::engine::decide::{Balances, Thresholds};
use crate::engine::hypothesis::Hypothesis;
use crate::engine::search::FittedSet;
use crate::engine::select::SearchResult;
use trueup_numerics::order::descending;

/// Evidence that a single effect has to bring to run where none was chosen.
const BRINGS: f64 = 20.0;
/// Single effects that run where nothing chosen helps.
const SINGLES: usize = 2;

/// What a set is to the chosen one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RivalKind {
    /// The chosen one itself.
    Best,
    /// The chosen one without one of its causes.
    Fewer,
    /// Another cause instead of one; where no effect was chosen, a single effect.
    Rival,
}

/// Sets that may run next to the set that the balances chose.
#[derive(Clone)]
pub(super) struct RivalField {
    chosen: FittedSet,
    /// It has an effect.
    pub claims: bool,
    /// Evidence of the plain model.
    plain: f64,
    balances: Balances,
    /// Odds that no free run can turn.
    decisive: f64,
}

impl RivalField {
    pub(super) fn new(found: &SearchResult, limits: Thresholds) -> Self {
        Self {
            chosen: found.best.clone(),
            claims: found.best.stated.set.iter().any(Hypothesis::is_effect),
            plain: found.plain.evidence(1.0),
            balances: Balances::new(found, &limits),
            decisive: limits.odds.decisive,
        }
    }

    /// The same around another set.
    pub(super) fn around(&self, chosen: &FittedSet) -> Self {
        Self { chosen: chosen.clone(), ..self.clone() }
    }
    /// How many causes the chosen set has.
    pub(super) fn size(&self) -> usize {
        self.chosen.stated.set.len()
    }

    fn kind(&self, f: &FittedSet) -> Option<RivalKind> {
        let (best, set) = (&self.chosen.stated.set, &f.stated.set);
        let shared = set.iter().filter(|h| best.contains(h)).count();
        let open = || self.balances.odds(f, &self.chosen) > -self.decisive;
        match () {
            () if !set.iter().any(Hypothesis::is_effect) => None,
            () if !self.claims => {
                (set.len() == 1 && f.evidence(1.0) > self.plain + BRINGS).then_some(RivalKind::Rival)
            }
            () if shared == best.len() && set.len() == best.len() => Some(RivalKind::Best),
            () if shared + 1 == best.len() && set.len() + 1 == best.len() => Some(RivalKind::Fewer),
            () if shared + 1 == best.len() && set.len() == best.len() => open().then_some(RivalKind::Rival),
            () => None,
        }
    }

    /// Of that kind the likeliest, of one cause in one place the better of its forms; without those that `ran`. `good`: one of
    /// these came near the floor.
    pub(super) fn entrants(
        &self,
        found: &SearchResult,
        rival_kind: RivalKind,
        good: bool,
        ran: &[usize],
    ) -> Vec<usize> {
        let best = &self.chosen.stated.set;
        let most = match rival_kind {
            RivalKind::Best => 1,
            RivalKind::Fewer => best.len(),
            RivalKind::Rival if self.claims => 1 + usize::from(!good),
            RivalKind::Rival => 2,
        };
        let mut order: Vec<usize> = (0..found.sets.len()).collect();
        descending(&mut order, |item| found.sets[*item].evidence(1.0));
        let new = |at: usize| found.sets[at].stated.set.iter().find(|h| !best.contains(h));
        let like = order.into_iter().filter(|at| self.kind(&found.sets[*at]) == Some(rival_kind));
        let effects = like.filter(|at| new(*at).is_none_or(Hypothesis::is_effect));
        let which = |at: usize| new(at).map_or(("", "", at), |h| (&*h.id, &*h.component, 0));
        first_of_each(effects.filter(|at| !ran.contains(at)), which, most)
    }
}

/// The most probable single effects, where nothing that was chosen helps; without those that `ran`.
pub(super) fn leading(found: &SearchResult, ran: &[usize]) -> Vec<usize> {
    let id = |at: usize| match &found.sets[at].stated.set[..] {
        [h] if h.is_effect() => Some(&*h.id),
        _ => None,
    };
    let singles = (0..found.sets.len()).filter(|at| id(*at).is_some());
    let mut list = first_of_each(singles, id, SINGLES);
    list.retain(|at| !ran.contains(at));
    list
}

/// The first of each key, as many as `most`.
fn first_of_each<K: PartialEq>(
    list: impl Iterator<Item = usize>,
    key: impl Fn(usize) -> K,
    most: usize,
) -> Vec<usize> {
    let mut seen: Vec<(K, usize)> = Vec::new();
    for at in list {
        let key = key(at);
        if seen.len() < most && !seen.iter().any(|s| s.0 == key) {
            seen.push((key, at));
        }
    }
    seen.into_iter().map(|s| s.1).collect()
}
