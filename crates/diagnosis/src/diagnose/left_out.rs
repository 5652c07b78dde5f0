//! Leave-one-out: what a set misses of each recording for fitting that it was not fitted to, compared with the model without effects.

use super::contest::POLISH;
use super::ground::ComparisonBasis;
use crate::engine::decide::LeftOut;
use crate::engine::fold::Fold;
use crate::engine::replay::CompleteModel;
use crate::engine::search::FittedSet;
use crate::engine::select::SearchEffort;

impl ComparisonBasis<'_> {
    /// Each recording for fitting left out in turn; `None`: there is one alone, or a model cannot be fitted or run.
    pub(super) fn left_out(&self, set: &FittedSet, effort: SearchEffort) -> Option<LeftOut> {
        let folds = self.search.case.train.len();
        if folds < 2 {
            return None;
        }
        let each = (0..folds).map(|run| self.without(run, set, effort));
        let all: Option<Vec<[f64; 3]>> = each.collect();
        let all = all?;
        let mean = |k: usize| (all.iter().map(|v| v[k].ln()).sum::<f64>() / folds as f64 / 2.0).exp();
        Some(LeftOut { tuned: mean(0), with: mean(1), noise: mean(2) })
    }

    /// What the refitted model and the set miss of one that was left out, and its noise, as powers.
    fn without(&self, run: usize, set: &FittedSet, effort: SearchEffort) -> Option<[f64; 3]> {
        let fold = Fold::new(self.search, run);
        let search = fold.search(self.search);
        let left = &search.case.holdout;
        let fit = |of: &FittedSet| Some(fold.fit(&search, of, effort.options(), POLISH)?.complete);
        let tuned = match &self.fitted {
            Some(tuned) => fit(tuned)?,
            // No fit ran nearer than the model as it was given.
            None => {
                let plain = search.state(&[]).ok()?;
                CompleteModel { theta: search.compare(&plain).start(), stated: plain }
            }
        };
        let with = fit(set)?;
        let channels = left[0].run.channels.len().max(1) as f64;
        let missed =
            |model: &CompleteModel| Some(search.misfit(&search.replay(model, left).ok()?, left) / channels);
        Some([missed(&tuned)?, missed(&with)?, search.noise(&left[0]) / channels])
    }
}
