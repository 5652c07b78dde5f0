//! What leads a screen, linearised anew about itself.

use trueup_estimation::fit::{Effort, Fit, fit};

use crate::plain::Plain;
use crate::screen::Seen;

/// Rounds of a refit.
const ROUNDS: usize = 6;

/// A cause at the mode of its posterior.
pub fn refit(plain: &Plain, seen: &Seen) -> Option<Fit> {
    let mut start = plain.fit.theta.clone();
    start.extend(&seen.at);
    let effort = Effort { rounds: ROUNDS, held: 0, intensities: true, walls: plain.walls };
    fit(&plain.raw, &seen.posed.stated, &start, seen.latent, &plain.fit.runs, effort)
}
