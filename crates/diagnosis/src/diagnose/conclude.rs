//! From a decision to a diagnosis: which estimate is reported, how far it shrinks the gap, and where that lies.

use trueup_identification::predict::PredictError;
use trueup_signals::Loaded;

use super::claim::{augmented, candidates, effects, elsewhere, indistinguishable, parameters};
use super::contest::{Contender, HELPS, POLISH};
use super::estimate::Reported;
use super::ground::Ground;
use super::held_out::{closed_alone, held_out};
use super::place::{look, where_it_lies};
use super::record::Record;
use super::traces::{Windowed, gap_report, traces};
use super::{Began, DiagnoseError, Diagnosed, Options, blind, drift, strained, watch};
use crate::engine::decide::Decision;
use crate::engine::hypothesis::Hypothesis;
use crate::engine::problem::Compared;
use crate::engine::replay::{Complete, DRAWS, Polished, Replayed, Settled, joined};
use crate::engine::search::{Fitted, Search};
use crate::engine::select::{Found, same};
use crate::experiment;
use crate::outcome::*;
use crate::picture::isolability;

/// A component with this share of an excess that nothing explains stands out.
const STANDS_OUT: f64 = 0.5;
/// A free run that leaves more than this share of a gap hardly helps.
const HARDLY: f64 = 0.9;
/// Iterations of a last fit, free-running, of a claim that did not run freely.
const LAST: usize = 16;
/// Place of the tuned model among the free-running fits without a claim, behind the one that standard deviations hold.
const TUNED: usize = 1;

/// What a verdict is told from.
pub(super) struct Decided {
    pub found: Found,
    pub decision: Decision,
    /// Sets that ran freely.
    pub contenders: Vec<Contender>,
    pub record: Record,
    /// What was found before any cause was looked for.
    pub noticed: Vec<Noticed>,
}

/// A model that runs freely, and what it shows.
struct Ran {
    complete: Complete,
    shown: Replayed,
}

/// Runs freely what was decided, and tells where the gap lies and how far it closes.
pub(super) fn conclude(
    search: &Search<'_>,
    options: &Options,
    [before, tuned]: [Complete; 2],
    ground: Ground<'_>,
    Decided { found, mut decision, contenders, record, noticed }: Decided,
    loaded: &Loaded,
    tell: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let (case, runs) = (search.case, ground.runs);
    let nominal = |e: PredictError| DiagnoseError::Nominal(e.to_string());
    let ran = |complete: Complete| -> Result<Ran, DiagnoseError> {
        let shown = search.replay(&complete, runs).map_err(nominal)?;
        Ok(Ran { complete, shown })
    };
    tell(0.85, "running freely what was decided, and how far noise goes");
    let no_gap = decision.verdict == Verdict::NoGap;
    let mut tuned = match no_gap {
        true => Ran { complete: before.clone(), shown: ground.before.clone() },
        false => Ran { complete: tuned, shown: ground.tuned.clone() },
    };
    let gaps: Vec<(usize, f64)> =
        contenders.iter().filter_map(|c| Some((c.at, ground.gap(&c.shown)?))).collect();
    let freely =
        |set: &Fitted| contenders.iter().find(|c| same(&found.sets[c.at].stated.set, &set.stated.set));
    let mut notes = if case.holdout.is_empty() { vec![NO_HOLDOUT.into()] } else { Vec::new() };
    if decision.unmoved {
        notes.push("no fit of the model's own parameters runs nearer than those given: their values stay, and explain nothing".into());
    }
    if let Some((_, l)) = decision.left_out.filter(|(_, l)| l.does_worse(options.limits.free_runs.near)) {
        notes.push(format!("recordings for fitting, each left out in turn: what explains the others leaves {:.0} % in it, the refitted model {:.0} %: nothing is claimed", 100.0 * l.with, 100.0 * l.tuned));
    }
    let window = search.window();
    let mut claim: Option<(Reported, Ran)> = None;
    if matches!(decision.verdict, Verdict::Effects | Verdict::Ambiguous) {
        let polished = match freely(&found.best) {
            Some(c) => c.polished(),
            None => search.polish(&found.best, LAST),
        };
        let free = match freely(&found.best) {
            Some(c) => c.shown.clone(),
            None => search.replay(&polished.complete, runs).map_err(nominal)?,
        };
        if let Some([with, without]) = ground.worse(&free) {
            decision.cap();
            notes.push(format!(
                "what explains the recordings for fitting leaves {:.0} % in those held out, the refitted model {:.0} %: nothing is claimed",
                100.0 * with, 100.0 * without
            ));
        } else if let Some(name) = rests_on_one(search, &tuned.complete, &polished.complete) {
            decision.cap();
            notes.push(format!(
                "what was found helps in {name} and in no other recording for fitting: a claim that rests on one recording is none; look at \
                 what is particular about it, or leave it out"
            ));
        } else {
            let own = Reported::of(search, window, &found.best, &[&polished]);
            let shown = if own.free.is_some() {
                Ran { complete: own.complete.clone(), shown: free }
            } else {
                ran(own.complete.clone())?
            };
            claim = Some((own, shown));
        }
    }
    // Without a claim the refitted model is reported, by the values that its gap is of.
    let bare = !found.best.stated.set.iter().any(Hypothesis::is_effect);
    let own = match (&claim, &ground.fitted) {
        (None, Some(fitted)) if !no_gap => {
            let led = if bare { &found.best } else { &found.plain };
            // The tuned model has all parameters free: where the owner's standard deviations let a fit predict as well, it is none.
            let held = search.polish(led, POLISH);
            let free = Polished {
                complete: tuned.complete.clone(),
                misfit: ground.misfit,
                fitted: Some(fitted.clone()),
            };
            Some(Reported::of(search, window, led, &[&held, &free]))
        }
        _ => None,
    };
    if let Some(own) = own.as_ref().filter(|own| own.free != Some(TUNED)) {
        tuned = ran(own.complete.clone())?;
    }
    let claimed = claim.is_some();
    let (told, after) = match claim {
        Some((own, after)) => (Some(own), after),
        None => (own, Ran { complete: tuned.complete.clone(), shown: tuned.shown.clone() }),
    };
    notes.extend(blind::told(search, decision.verdict));
    if let Some([from, to]) = search.searched_orders().filter(|_| !options.capped) {
        notes.push(format!(
            "what repeats with a shaft was looked for from {from:.2} to {to:.0} times a turn: what is faster these readings do not show"
        ));
    }
    let settled = search.settled(&after.complete, runs).map_err(nominal)?;
    let floors =
        search.floors_around(&after.complete, runs, &settled, (options.seed, DRAWS)).map_err(nominal)?;
    let traces = traces(runs, [&ground.before, &tuned.shown, &after.shown], &floors);
    let models = [&before, &tuned.complete, &after.complete];
    let windowed = window.and_then(|w| windowed(search, models, &ground, &settled, (w, options.seed)));
    let gap = gap_report(runs, &traces, windowed.as_ref(), options.seed);
    let (picture, location, next) = if options.verdict_only {
        (None, Where::default(), None)
    } else {
        tell(0.95, "finding where the gap lies");
        let picture = look(loaded, search, &found, &decision);
        let location = where_it_lies(loaded, search, &found, &decision, &picture, &traces, options.seed);
        tell(0.97, "choosing what to record next");
        let next = experiment::propose(search, &found, &decision, &options.limits);
        (Some(picture), location, next)
    };
    let unknown = decision.verdict == Verdict::Unknown;
    let most = location.components.first().filter(|c| unknown && c.share >= STANDS_OUT);
    let place = most.map(|c| c.id.clone());
    let told = told.map(|own| own.estimated);
    let far = told.as_ref().map_or_else(Vec::new, |own| strained::told(own.fitted(), case));
    let plant = case.subject.plant;
    let rival = |set: &Fitted| {
        let free = freely(set).map(Contender::polished);
        Reported::of(search, window, set, &free.iter().collect::<Vec<_>>()).estimated
    };
    let claims = told.as_ref().filter(|_| claimed);
    let mut diagnosis = Diagnosis {
        schema: SCHEMA.into(),
        model: loaded.case.model.clone(),
        verdict: decision.verdict,
        gap,
        sensors: (&isolability(loaded, &case.subject)).into(),
        location,
        effects: claims.map_or_else(Vec::new, |own| effects(plant, &found, own, &rival, &decision)),
        candidates: candidates(plant, &found, &decision),
        parameters: told.as_ref().map(parameters).unwrap_or_default(),
        indistinguishable: indistinguishable(&found, &decision),
        unknown: Unknown { present: unknown, probability: decision.unknown, place },
        next_experiment: next.as_ref().map(|n| n.said.clone()),
        watch: options.watch.then(|| watch::watch(search, &tuned.complete)),
        augmented: None,
        capped: options.capped,
        findings: noticed.into_iter().chain(far).collect(),
        inputs: None,
        notes,
    };
    let overall = diagnosis.gap.overall.as_ref().map(|g| g.after);
    held_out(&found, decision.verdict, overall, &mut diagnosis.candidates, &gaps);
    if let Some(overall) = &diagnosis.gap.overall {
        closed_alone(&found, overall, &mut diagnosis.effects, &gaps);
    }
    drift::told(&mut diagnosis);
    diagnosis.notes.extend(elsewhere(plant, &found, &decision));
    if decision.verdict == Verdict::Ambiguous && next.is_none() && !options.verdict_only {
        diagnosis.notes.push(experiment::NOTHING.into());
    }
    let began = |(run, settled)| Began::new(search, &after.complete, run, settled);
    let began: Vec<Began> = if claimed { runs.iter().zip(&settled).map(began).collect() } else { Vec::new() };
    let augmented = claimed.then(|| augmented(search, &after.complete, began.first()));
    tell(1.0, "done");
    Ok(Diagnosed {
        diagnosis,
        picture,
        next,
        traces,
        flexible: case.subject.flexible.clone(),
        augmented,
        began,
        record: Some(record),
    })
}

/// The one recording for fitting in which a model with causes runs far nearer than without, where it helps in none of the others.
fn rests_on_one(search: &Search<'_>, without: &Complete, with: &Complete) -> Option<String> {
    let runs = &search.case.train;
    let missed = |c: &Complete| -> Option<Vec<f64>> {
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

/// What these models show of the recordings over windows; `None`: one of them cannot be simulated there.
fn windowed(
    search: &Search<'_>,
    [before, tuned, after]: [&Complete; 3],
    ground: &Ground<'_>,
    settled: &[Settled],
    (seconds, seed): (f64, u64),
) -> Option<Windowed> {
    let shown = |c: &Complete| Some(joined(&search.in_windows(c, ground.runs, seconds, None).ok()?));
    let windows = search.in_windows(after, ground.runs, seconds, Some(settled)).ok()?;
    let floors = search.window_floors(after, &windows, seed).ok()?;
    Some(Windowed { seconds, shown: [shown(before)?, shown(tuned)?, joined(&windows)], floors })
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
