//! The communication points.

/// Points `start + i step`, the last one at `stop`. Times come from an integer index, so no sum drifts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommunicationGrid {
    /// First point in s.
    pub start: f64,
    /// Last point in s.
    pub stop: f64,
    /// Distance in s; the last one may be shorter.
    pub step: f64,
    /// Number of steps.
    pub steps: u64,
}

/// Part of a step below which the rest is rounding, not a step of its own.
pub(crate) const ROUNDING: f64 = 1e-9;

impl CommunicationGrid {
    /// `None` if the times are not finite, run backwards or need more steps than doubles can count.
    pub fn new(start: f64, stop: f64, step: f64) -> Option<Self> {
        let steps = ((stop - start) / step - ROUNDING).ceil().max(0.0);
        let fits = start.is_finite() && stop >= start && step > 0.0 && steps < 2f64.powi(53);
        fits.then_some(Self { start, stop, step, steps: steps as u64 })
    }

    /// Why there is no such grid, with the remedy.
    pub(crate) fn refusal(start: f64, stop: f64, step: f64) -> String {
        if start == stop {
            return format!("a run from {start:?} s to {stop:?} s has no length; choose a later stop");
        }
        format!(
            "no run from {start:?} s to {stop:?} s in steps of {step:?} s; choose start < stop and a positive step"
        )
    }

    /// Point `i` in s.
    pub fn time(&self, i: u64) -> f64 {
        let (i, rate) = (i as f64, (1.0 / self.step).round());
        if i >= self.steps as f64 {
            self.stop
        } else if 1.0 / rate == self.step {
            self.start + i / rate // 6 steps of 0.1 s are 0.6 s, 6 * 0.1 is not
        } else {
            self.start + i * self.step
        }
    }

    /// Number of steps from the start that are of the full length: all, or all but the last.
    pub(crate) fn regular(&self) -> u64 {
        if self.is_even() { self.steps } else { self.steps.saturating_sub(1) }
    }

    /// All steps are of the same length.
    pub fn is_even(&self) -> bool {
        ((self.stop - self.start) - self.steps as f64 * self.step).abs() <= ROUNDING * self.step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_step_is_clipped_and_rounding_makes_none() {
        let grid = CommunicationGrid::new(0.0, 1.005, 0.01).unwrap();
        assert_eq!((grid.steps, grid.time(100), grid.time(101), grid.is_even()), (101, 1.0, 1.005, false));
        // 0.1 added up ten times is below 1: a sum would make an eleventh step.
        let grid = CommunicationGrid::new(0.0, 1.0, 0.1).unwrap();
        assert_eq!((grid.steps, grid.time(10), grid.is_even()), (10, 1.0, true));
        assert_eq!((grid.time(3), grid.time(6), grid.time(7)), (0.3, 0.6, 0.7));
        assert_eq!(CommunicationGrid::new(2.0, 2.0, 0.1).unwrap().steps, 0);
        for (start, stop, step) in
            [(1.0, 0.0, 0.1), (0.0, 1.0, 0.0), (0.0, f64::NAN, 0.1), (0.0, 1e300, 1e-9)]
        {
            assert_eq!(CommunicationGrid::new(start, stop, step), None);
        }
    }
}
