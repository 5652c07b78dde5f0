//! Which gaps a sentence reports: of whole free runs, or over windows.

use std::cmp::Ordering;

use trueup_diagnosis::outcome::{Diagnosis, Verdict};

use super::words::{judged_on, size};
use crate::number;

/// The gaps that a sentence reports, each RMS(simulated - measured) / RMS(measured - its mean).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SummaryGap {
    /// Nominal parameters.
    pub(super) before: f64,
    /// Own parameters refitted, nothing added.
    pub(super) tuned: f64,
    /// What was found: [`tuned`](Self::tuned), or with the effects.
    pub(super) found: f64,
    /// What noise alone leaves.
    pub(super) floor: f64,
    /// Length of the windows in which the run begins again, s; `None`: whole free runs.
    seconds: Option<f64>,
}

impl SummaryGap {
    /// Of whole free runs; where a whole run with what was found misses more than the signal or more than before, over windows, if
    /// there are such. Such a run diverges: its gap measures how fast errors grow, not how well the model predicts.
    pub(super) fn of(d: &Diagnosis) -> Option<Self> {
        let g = d.gap.overall.as_ref()?;
        let effects = matches!(d.verdict, Verdict::Effects | Verdict::Ambiguous);
        let of = |before, tuned, after, floor, seconds| {
            let found = if effects { after } else { tuned };
            Self { before, tuned, found, floor, seconds }
        };
        let whole = of(g.before, g.tuned, g.after, g.floor, None);
        let diverges = !whole.found.is_finite() || whole.found >= 1.0 || whole.found > whole.before;
        Some(match g.window.filter(|_| diverges) {
            Some(w) => of(w.before, w.tuned, w.after, w.floor, Some(w.seconds)),
            None => whole,
        })
    }

    /// `recordings never used for fitting`, `windows of 1 s of recordings never used for fitting`
    pub(super) fn judged_on(&self, d: &Diagnosis) -> String {
        let windows = self.seconds.map_or_else(String::new, |s| format!("windows of {} s of ", number(s)));
        format!("{windows}{}", judged_on(d))
    }

    /// ` With it the gap on .. falls from .. to ..; the sensors' noise alone leaves ..`
    pub(super) fn sentence(&self, d: &Diagnosis, with: &str) -> String {
        let [before, found] = [self.before, self.found].map(size);
        // A run that ends in no number has the largest gap.
        let bounded = |x: f64| if x.is_finite() { x } else { f64::INFINITY };
        let change = match bounded(self.found).total_cmp(&bounded(self.before)) {
            _ if before == found => format!("stays at {before}"),
            Ordering::Less => format!("falls from {before} to {found}"),
            _ => format!("grows from {before} to {found}"),
        };
        format!(
            " {with} the gap on {} {change}; the sensors' noise alone leaves {}.",
            self.judged_on(d),
            size(self.floor)
        )
    }

    /// Why windows are reported; empty for whole runs.
    pub(super) fn why_windows(&self) -> &'static str {
        match self.seconds {
            Some(_) => {
                " Whole free runs with what was found miss more than the signal, or more than before: their gap measures how fast \
                 errors grow along a run, not how well the model predicts. The verdict has the figures over windows, below."
            }
            None => "",
        }
    }
}
