//! What was decided of the fitted sets.

use super::hypothesis::Hypothesis;
use super::result::SearchResult;
use super::search::FittedSet;
use crate::outcome::Verdict;

/// Odds (natural logarithm) below which two causes are not distinguished.
pub const APART: f64 = 3.0;
/// Probability of an unknown cause where no effect is claimed, at the most.
pub const UNKNOWN_AT_MOST: f64 = 0.05;

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
    /// Share of the latents' power that the chosen set takes.
    pub explained: f64,
    /// Probability that none of the candidates is right.
    pub unknown: f64,
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
            unknown: 1.0,
        }
    }
    /// Nothing is claimed: what the recordings say cannot be relied on. As likely as not none of the candidates is right.
    pub fn cap(&mut self) {
        self.verdict = Verdict::Unknown;
        self.unknown = self.unknown.max(0.5);
    }
    /// What is not distinguished from the `i`-th cause of the chosen set, likeliest first.
    pub fn close<'a>(&'a self, found: &'a SearchResult, i: usize) -> impl Iterator<Item = Rival<'a>> {
        self.rivals[i].iter().filter(|r| -r.1 < APART).filter_map(|(at, odds)| {
            let set = &found.sets[*at];
            Some(Rival { cause: found.best.replaced_in(set)?, set, odds: *odds })
        })
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
}
