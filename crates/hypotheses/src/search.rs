//! What recordings say of a case: the baseline, its parameters doubted, one cause, two.

use trueup_estimation::fit::Fit;
use trueup_signals::Loaded;

use crate::baseline::{Baseline, BaselineError};
use crate::levels::{ALONE, DOUBTED, SECOND, SEEN};
use crate::refit::{Refitted, refits};
use crate::screen::screen;
use trueup_numerics::order::descending;

/// Leaders beside which a second cause is looked for, and what share of the first one's gain they have to have.
const LEADERS: usize = 2;
const NEAR: f64 = 0.5;

/// Hypotheses of a case, fitted.
#[derive(Clone, Debug)]
pub struct Found {
    /// The model as its owner believes it.
    pub baseline: Baseline,
    /// The same, its parameters in doubt; none where nothing lacks.
    pub doubted: Option<Fit>,
    /// One cause, the likeliest first.
    pub singles: Vec<Refitted>,
    /// Two: of which single, and the second one; the likeliest first.
    pub pairs: Vec<(usize, Refitted)>,
    /// What the log likelihood would be if nothing lacked.
    pub ideal: f64,
}

/// Fits what may be said of a case.
///
/// # Errors
/// See [`BaselineError`].
pub fn search(loaded: &Loaded) -> Result<Found, BaselineError> {
    let baseline = Baseline::new(loaded)?;
    let seen = screen(&baseline);
    let anything = seen.first().is_some_and(|s| s.gain > SEEN)
        || baseline.ideal() - baseline.fit.log_evidence > SECOND
        || baseline.at_ceiling(&baseline.fit);
    let doubted = if anything { baseline.doubted(DOUBTED) } else { None };
    let singles = if anything { refits(&baseline, &seen) } else { Vec::new() };
    let with = |r: &Refitted| baseline.with(&r.seen.cause, &r.seen.parametrized.parametric, &r.fit);
    let best = singles.first().map(with);
    let ideal = best.as_ref().unwrap_or(&baseline).ideal().max(baseline.ideal());
    let mut pairs = Vec::new();
    let gain = |r: &Refitted| r.fit.log_evidence - baseline.fit.log_evidence;
    let most = singles.first().map_or(0.0, gain);
    for (k, leader) in singles.iter().take(LEADERS).enumerate() {
        if most < ALONE || gain(leader) < NEAR * most {
            break;
        }
        let leader = with(leader);
        let seen = screen(&leader);
        if leader.lacks() || seen.first().is_some_and(|s| s.gain > SEEN) {
            pairs.extend(refits(&leader, &seen).into_iter().map(|r| (k, r)));
        }
    }
    descending(&mut pairs, |item| item.1.fit.log_evidence);
    Ok(Found { baseline, doubted, singles, pairs, ideal })
}
