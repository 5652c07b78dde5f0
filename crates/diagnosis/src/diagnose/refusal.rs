//! Why a claim is refused after it was run: it predicts recordings held out worse than the refitted model, or rests on one recording.

use super::estimate::{ReportedEstimate, log_ratios, predicts_as_well};
use super::ground::ComparisonBasis;
use crate::engine::problem::Compared;
use crate::engine::replay::{CompleteModel, ReplayedReadings};
use crate::engine::search::CaseSearch;

/// A free run that leaves at most this share of a gap helps.
const HELPS: f64 = 0.7;
/// A run that leaves more than this share of a gap hardly helps.
const HARDLY: f64 = 0.9;

/// By free runs of whole recordings; `free`: the claim on those held out.
pub(super) fn of_whole(
    ground: &ComparisonBasis<'_>,
    tuned: &CompleteModel,
    claim: &CompleteModel,
    free: &ReplayedReadings,
) -> Option<String> {
    if let Some([with, without]) = ground.worse(free) {
        return Some(format!(
            "what explains the recordings for fitting leaves {:.0} % in those held out, the refitted model {:.0} %: nothing is claimed",
            100.0 * with,
            100.0 * without
        ));
    }
    rests_on_one(ground.search, tuned, claim).map(resting)
}

/// By runs over windows of so many seconds, which the true model follows through stick and slip too.
pub(super) fn in_windows(
    ground: &ComparisonBasis<'_>,
    seconds: f64,
    tuned: &CompleteModel,
    claim: &ReportedEstimate,
) -> Option<String> {
    let (search, train) = (ground.search, &ground.search.case.train);
    let windows = |c: &CompleteModel, runs: &[Compared]| search.in_windows(c, runs, seconds, None).ok();
    let [with, without] = [&claim.complete, tuned].map(|c| windows(c, ground.runs));
    if !predicts_as_well(with.as_deref(), without.as_deref()) {
        return Some(format!(
            "over windows of {seconds:.2} s what explains the recordings for fitting predicts those held out worse than the refitted model: nothing is claimed"
        ));
    }
    if train.len() < 2 {
        return None;
    }
    let with = claim.windows.clone().or_else(|| windows(&claim.complete, train))?;
    let ratios = log_ratios(&with, &windows(tuned, train)?);
    let left = |of: usize| {
        let own: Vec<f64> = ratios.iter().filter(|r| r.0 == of).map(|r| r.1).collect();
        (0.5 * own.iter().sum::<f64>() / own.len().max(1) as f64).exp()
    };
    let left: Vec<f64> = (0..train.len()).map(left).collect();
    alone(&left).map(|at| resting(train[at].run.name.clone()))
}

fn resting(name: String) -> String {
    format!(
        "what was found helps in {name} and in no other recording for fitting: a claim that rests on one recording is none; look at \
         what is particular about it, or leave it out"
    )
}

/// The one recording for fitting in which a model with causes runs far nearer than without, where it helps in none of the others.
fn rests_on_one(search: &CaseSearch<'_>, without: &CompleteModel, with: &CompleteModel) -> Option<String> {
    let runs = &search.case.train;
    let missed = |c: &CompleteModel| -> Option<Vec<f64>> {
        let shown = search.replay(c, runs).ok()?;
        let of = |(run, shown): (&Compared, &Vec<Vec<f64>>)| {
            run.run.channels.iter().zip(shown).map(|(c, s)| search.mean_square(c, s)).sum()
        };
        Some(runs.iter().zip(&shown).map(of).collect())
    };
    let (without, with) = (missed(without)?, missed(with)?);
    let left: Vec<f64> = with.iter().zip(&without).map(|(a, b)| (a / b).sqrt()).collect();
    alone(&left).map(|at| runs[at].run.name.clone())
}

/// Which of several is helped, where the others are not: what is left of each, as a gap.
fn alone(left: &[f64]) -> Option<usize> {
    let helped = |x: &f64| *x <= HELPS;
    let at = left.iter().position(helped)?;
    let others = || left.iter().enumerate().filter(|(k, _)| *k != at);
    (left.len() > 1 && others().all(|(_, x)| *x > HARDLY)).then_some(at)
}

#[cfg(test)]
mod tests {
    use super::alone;

    #[test]
    fn a_claim_rests_on_one_recording_where_it_helps_in_no_other() {
        assert_eq!(alone(&[1.02, 0.1, 0.97]), Some(1));
        assert_eq!(alone(&[0.6, 0.1, 0.97]), None);
        assert_eq!(alone(&[0.8, 0.1, 0.97]), None);
        assert_eq!(alone(&[1.0, 0.95]), None);
        assert_eq!(alone(&[0.1]), None);
        assert_eq!(alone(&[f64::NAN, 0.1]), None);
    }
}
