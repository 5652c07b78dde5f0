//! From a decision to a diagnosis: which estimate is reported, how far it shrinks the gap, and where that is.

use trueup_identification::predict::PredictError;
use trueup_signals::Loaded;

use super::claim::{augmented, candidates, effects, elsewhere, indistinguishable, parameters};
use super::estimate::{ReportedEstimate, SetEstimate, leaves_noise};
use super::ground::ComparisonBasis;
use super::held_out::{closed_alone, held_out};
use super::place::{locate_gap, look};
use super::record::DecisionRecord;
use super::traces::{WindowedGap, gap_report, traces};
use super::{
    DiagnoseError, DiagnoseOptions, Diagnosed, FreeRunStart, budget, drift, refusal, strained, twist, watch,
    yours,
};
use crate::engine::decide::Decision;
use crate::engine::replay::{CompleteModel, FittedReplay, FreeRunFit, ReplayedReadings, joined};
use crate::engine::result::{SearchResult, same};
use crate::engine::search::{CaseSearch, FittedSet};
use crate::experiment;
use crate::outcome::*;
use crate::picture::isolability;

/// A component with this share of an excess that nothing explains is reported as prominent.
const DOMINANT: f64 = 0.5;
/// Iterations of a last fit, free-running, of a claim.
const LAST: usize = 16;
/// The same of a model without effects.
pub(super) const POLISH: usize = 20;
/// Where no fit of what was found ends.
const NO_FIT: &str = "no fit of what was found ends: nothing is claimed";
/// Place of the tuned model among the free-running fits without a claim, behind the one that standard deviations hold.
const TUNED: usize = 1;

/// The figures from which a verdict is derived.
pub(super) struct DecidedCase {
    pub found: SearchResult,
    pub decision: Decision,
    /// The chosen set as evidence has it; `None`: no causes were compared.
    pub by_evidence: Option<FittedSet>,
    pub record: DecisionRecord,
    /// What was found before any cause was looked for.
    pub noticed: Vec<NoticedMistake>,
}

/// A model that runs freely, and what it shows.
struct SimulatedRuns {
    complete: CompleteModel,
    shown: ReplayedReadings,
}

/// Runs freely what was decided, and reports where the gap is and how far it closes.
pub(super) fn conclude(
    search: &CaseSearch<'_>,
    options: &DiagnoseOptions,
    [before, tuned]: [CompleteModel; 2],
    ground: ComparisonBasis<'_>,
    DecidedCase { found, mut decision, by_evidence, record, noticed }: DecidedCase,
    loaded: &Loaded,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let (case, runs) = (search.case, ground.runs);
    let nominal = |e: PredictError| DiagnoseError::Nominal(e.to_string());
    let ran = |complete: CompleteModel| -> Result<SimulatedRuns, DiagnoseError> {
        let shown = search.replay(&complete, runs).map_err(nominal)?;
        Ok(SimulatedRuns { complete, shown })
    };
    report_progress(0.85, "running freely what was decided, and how far noise goes");
    let no_gap = decision.verdict == Verdict::NoGap;
    let mut tuned = match no_gap {
        true => SimulatedRuns { complete: before.clone(), shown: ground.before.clone() },
        false => SimulatedRuns { complete: tuned, shown: ground.tuned.clone() },
    };
    let mut notes = if case.holdout.is_empty() { vec![NO_HOLDOUT.into()] } else { Vec::new() };
    let window = search.window();
    // Of a set that was found by evidence its own values come first, unless gains, offsets or delays are estimated: the interval about
    // them would be that of the equation error there. Behind a servo no torque is measured: priors of sizes would decide the scale of all.
    let servo = case.subject.servo(0).is_some();
    let scaled = |own: &FittedSet| servo || own.stated.unknowns.iter().any(|u| u.target.is_of_case_sensor());
    let is_own = |own: &FittedSet, of: &FittedSet| same(&own.stated.set, &of.stated.set) && !scaled(own);
    let reported = |prescribed: &FittedSet, free: &[&FreeRunFit]| {
        let own = by_evidence.as_ref().filter(|own| is_own(own, prescribed));
        let prescribed: Vec<&FittedSet> = own.into_iter().chain([prescribed]).collect();
        ReportedEstimate::of(search, window, &prescribed, free)
    };
    let mut claim: Option<(ReportedEstimate, SimulatedRuns)> = None;
    if matches!(decision.verdict, Verdict::Effects | Verdict::Ambiguous) {
        // Where the values that were found leave no more than noise over windows, no free run is fitted: it can do no better.
        let enough = window.zip(by_evidence.as_ref().filter(|own| is_own(own, &found.best)));
        let enough = enough.is_some_and(|(seconds, own)| leaves_noise(search, seconds, own, options.seed));
        let attempt = || -> Result<Result<(ReportedEstimate, SimulatedRuns), String>, PredictError> {
            let polished = (!enough).then(|| search.polish(&found.best, LAST));
            let Some(own) = reported(&found.best, &polished.iter().collect::<Vec<_>>()) else {
                return Ok(Err(NO_FIT.into()));
            };
            // A claim by evidence has no need of a free run through stick and slip.
            let refused = match (window, &polished) {
                (Some(seconds), _) => refusal::in_windows(&ground, seconds, &tuned.complete, &own),
                (None, Some(polished)) => {
                    let free = search.replay(&polished.complete, runs)?;
                    refusal::of_whole(&ground, &tuned.complete, &polished.complete, &free)
                }
                (None, None) => None,
            };
            if let Some(why) = refused {
                return Ok(Err(why));
            }
            let shown = search.replay(&own.complete, runs)?;
            search.fitted_replay(&own.complete, runs)?;
            let complete = own.complete.clone();
            Ok(Ok((own, SimulatedRuns { complete, shown })))
        };
        let refused = |e: PredictError| {
            format!(
                "the model with what was found cannot be simulated on the recordings held out: {e}: nothing is claimed"
            )
        };
        match attempt().unwrap_or_else(|e| Err(refused(e))) {
            Ok(found) => claim = Some(found),
            Err(why) => {
                decision.cap();
                notes.push(why);
            }
        }
    }
    // Without a claim the refitted model is reported, by the values that its gap is of.
    let bare = found.best.stated.set.is_empty();
    let own = match (&claim, &ground.fitted) {
        (None, Some(fitted)) if !no_gap => {
            let prescribed = if bare { &found.best } else { &found.plain };
            // The tuned model has all parameters free: where the user's standard deviations let a fit predict as well, it is none.
            let held = search.polish(prescribed, POLISH);
            let free = FreeRunFit {
                complete: tuned.complete.clone(),
                misfit: ground.misfit,
                fitted: Some(fitted.clone()),
            };
            reported(prescribed, &[&held, &free])
        }
        _ => None,
    };
    if let Some(own) = own.as_ref().filter(|own| own.free != Some(TUNED)) {
        tuned = ran(own.complete.clone())?;
    }
    let claimed = claim.is_some();
    let (final_estimate, after) = match claim {
        Some((own, after)) => (Some(own), after),
        None => (own, SimulatedRuns { complete: tuned.complete.clone(), shown: tuned.shown.clone() }),
    };
    let fitted_replay = search.fitted_replay(&after.complete, runs).map_err(nominal)?;
    let floors = search.floors(&after.complete, runs, options.seed).map_err(nominal)?;
    let traces = traces(runs, [&ground.before, &tuned.shown, &after.shown], &floors);
    let models = [&before, &tuned.complete, &after.complete];
    let windowed = window.and_then(|w| windowed(search, models, &ground, &fitted_replay, (w, options.seed)));
    let twists = twist::twists(case, runs, &traces);
    let unit = |channel: &str| {
        let all = loaded.recordings.values().find_map(|r| r.channel(channel));
        all.map_or_else(String::new, |c| c.unit.clone())
    };
    let in_windows = windowed.as_ref().map(|w| (w.seconds, w.traces(runs)));
    let in_windows = in_windows.as_ref().map(|(seconds, traces)| (*seconds, traces.as_slice()));
    let gap = gap_report([&traces, &twists], in_windows, options.seed, &unit);
    let parts = gap.overall.as_ref().filter(|_| !no_gap && !options.capped && !options.verdict_only);
    let budget = parts.map_or_else(Vec::new, |overall| {
        report_progress(0.93, "taking each part out of the model");
        let replayed = |model: &CompleteModel| search.replay(model, runs).ok();
        budget::parts(search, &after.complete, overall, &replayed, &|shown| ground.gap(shown))
    });
    let (picture, location, next) = if options.verdict_only {
        (None, GapLocation::default(), None)
    } else {
        report_progress(0.95, "finding where the gap is");
        let picture = look(loaded, search, &found, &decision);
        let location = locate_gap(loaded, search, &found, &decision, &picture, &traces, options.seed);
        report_progress(0.97, "choosing what to record next");
        let next = experiment::propose(search, &found, &decision);
        (Some(picture), location, next)
    };
    let unknown = decision.verdict == Verdict::Unknown;
    let most = location.components.first().filter(|c| unknown && c.share >= DOMINANT);
    let place = most.map(|c| c.id.clone());
    let final_estimate = final_estimate.map(|own| own.estimated);
    let far = final_estimate.as_ref().map_or_else(Vec::new, |own| strained::findings(own.fitted(), case));
    let plant = case.subject.plant;
    let rival = |set: &FittedSet| {
        ReportedEstimate::of(search, window, &[set], &[])
            .map_or_else(|| SetEstimate::new(set, None), |r| r.estimated)
    };
    let claims = final_estimate.as_ref().filter(|_| claimed);
    let mut diagnosis = Diagnosis {
        schema: SCHEMA.into(),
        model: loaded.case.model.clone(),
        verdict: decision.verdict,
        gap,
        sensors: (&isolability(loaded, &case.subject)).into(),
        location,
        effects: claims.map_or_else(Vec::new, |own| effects(plant, &found, own, &rival, &decision)),
        candidates: candidates(plant, &found, &decision),
        parameters: final_estimate.as_ref().map(parameters).unwrap_or_default(),
        correlation: final_estimate.as_ref().and_then(SetEstimate::correlation),
        budget,
        pack: None,
        indistinguishable: indistinguishable(&found, &decision),
        unknown: UnknownShare { present: unknown, probability: decision.unknown, place },
        next_experiment: next.as_ref().map(|n| n.entry.clone()),
        watch: options.watch.then(|| watch::watch(search, &tuned.complete)),
        augmented: None,
        capped: options.capped,
        not_compared: None,
        findings: noticed.into_iter().chain(far).collect(),
        inputs: None,
        notes,
    };
    let overall = diagnosis.gap.overall.as_ref().map(|g| g.after);
    held_out(&found, decision.verdict, overall, &mut diagnosis.candidates);
    if let Some(overall) = &diagnosis.gap.overall {
        closed_alone(&found, overall, &mut diagnosis.effects);
    }
    drift::clear_shares(&mut diagnosis);
    diagnosis.notes.extend(elsewhere(plant, &found, &decision));
    if decision.verdict == Verdict::Ambiguous && next.is_none() && !options.verdict_only {
        diagnosis.notes.push(experiment::NOTHING.into());
    }
    let began = |(run, fitted_replay)| FreeRunStart::new(search, &after.complete, run, fitted_replay);
    let began: Vec<FreeRunStart> =
        if claimed { runs.iter().zip(&fitted_replay).map(began).collect() } else { Vec::new() };
    let model = augmented(search, &after.complete, began.first());
    yours::compared(&mut diagnosis, case, &after.complete.stated.model);
    if !options.capped {
        let of_case = claimed.then(|| loaded.case.name());
        let parameters = case.subject.parameters(&after.complete.stated.model);
        diagnosis.pack = Some(model.packed(&loaded.case.model, of_case, &parameters));
    }
    let augmented = claimed.then_some(model);
    report_progress(1.0, "done");
    Ok(Diagnosed {
        diagnosis,
        picture,
        next,
        traces,
        twists,
        flexible: case.subject.flexible.clone(),
        augmented,
        began,
        record: Some(record),
    })
}

/// What these models show of the recordings over windows; `None`: one of them cannot be simulated there.
fn windowed(
    search: &CaseSearch<'_>,
    [before, tuned, after]: [&CompleteModel; 3],
    ground: &ComparisonBasis<'_>,
    fitted_replay: &[FittedReplay],
    (seconds, seed): (f64, u64),
) -> Option<WindowedGap> {
    let shown = |c: &CompleteModel| Some(joined(&search.in_windows(c, ground.runs, seconds, None).ok()?));
    let windows = search.in_windows(after, ground.runs, seconds, Some(fitted_replay)).ok()?;
    let floors = search.window_floors(after, &windows, seed).ok()?;
    Some(WindowedGap { seconds, shown: [shown(before)?, shown(tuned)?, joined(&windows)], floors })
}
