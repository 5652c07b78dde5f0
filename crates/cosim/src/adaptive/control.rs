//! The length of the steps (docs/master-adaptive.md, section 4).

use super::coupling::NODES;

/// The error of the whole run may approach its tolerance within this part of it.
const APPROACH: f64 = 0.01;
/// While the polynomials are of a low order, the error per second is held to this part of what is allowed later.
const CAUTION: f64 = 0.1;
/// Part of the step that the estimate allows.
const SAFETY: f64 = 0.8;
const SHRINK: f64 = 0.2;
const GROW: f64 = 2.0;
/// Growth while the polynomials are of a low order.
const START: f64 = 5.0;

/// Chooses steps so that the estimated error of the whole run stays at the tolerance.
#[derive(Debug)]
pub(super) struct StepControl {
    pub(super) tolerance: f64,
    span: f64,
    /// Length of the next step in s.
    pub(super) step: f64,
    /// Estimated error of the whole run so far.
    pub(super) error: f64,
    /// The largest it has been.
    pub(super) largest: f64,
    before: f64,
    rejected: u32,
}

impl StepControl {
    /// `span`: length of the run in s; `step`: the first one.
    pub(super) fn new(tolerance: f64, span: f64, step: f64) -> Self {
        Self { tolerance, span, step, error: 0.0, largest: 0.0, before: 1.0, rejected: 0 }
    }

    /// The error allowed per s, with polynomials of `points` points.
    pub(super) fn rate(&self, points: usize) -> f64 {
        let room = (self.tolerance - self.error).max(0.01 * self.tolerance);
        room / (APPROACH * self.span) * if points < NODES { CAUTION } else { 1.0 }
    }

    /// The error per s caused by inputs that miss their sources by `missed` all the time: where what is left of the
    /// tolerance is missed, this is what is allowed.
    pub(super) fn pace(&self, missed: f64) -> f64 {
        missed / (APPROACH * self.span)
    }

    /// A step was rejected: its error per s was `ratio` times what is allowed.
    pub(super) fn reject(&mut self, ratio: f64, points: usize) {
        self.rejected += 1;
        let factor = SAFETY * ratio.powf(-1.0 / points as f64);
        self.step *= if factor.is_finite() { factor.clamp(SHRINK, SAFETY) } else { SHRINK };
    }

    /// A jump was stepped over, whose error gives no information about the next step.
    pub(super) fn jumped(&mut self, error: f64) {
        (self.error, self.largest) = (error, self.largest.max(error));
        (self.before, self.rejected) = (1.0, 0);
    }

    /// A step was accepted, after which the run's error is estimated as `error`.
    pub(super) fn accept(&mut self, ratio: f64, points: usize, error: f64) {
        (self.error, self.largest) = (error, self.largest.max(error));
        let (ratio, p) = (ratio.max(1e-3), points as f64);
        let factor = SAFETY * ratio.powf(-0.7 / p) * self.before.powf(0.3 / p);
        let most = if self.rejected > 0 {
            1.0
        } else if points < NODES {
            START
        } else {
            GROW
        };
        self.step *= factor.clamp(SHRINK, most);
        (self.before, self.rejected) = (ratio, 0);
    }
}

/// Root mean square of errors relative to scales.
pub(super) fn norm(errors: impl Iterator<Item = f64>, scales: &[f64]) -> f64 {
    let sum: f64 = errors.zip(scales).map(|(e, s)| (e / s) * (e / s)).sum();
    (sum / scales.len().max(1) as f64).sqrt()
}

/// The largest of errors relative to scales.
pub(super) fn largest(errors: impl Iterator<Item = f64>, scales: &[f64]) -> f64 {
    errors.zip(scales).map(|(e, s)| (e / s).abs()).fold(0.0, f64::max)
}
