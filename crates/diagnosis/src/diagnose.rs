//! From a case to a diagnosis.

mod acting;
pub mod began;
mod blind;
mod budget;
mod claim;
mod complete;
mod conclude;
mod contest;
mod dead;
mod drift;
mod estimate;
mod field;
mod ground;
mod held_out;
mod hints;
mod innovations;
pub mod input_scale;
mod left_out;
mod place;
mod progress;
pub mod record;
mod refusal;
mod strained;
mod traces;
mod twist;
mod unsimulated;
mod watch;
mod yours;

use std::borrow::Cow;

use trueup_hypotheses::innovations::findings::{CaseSearchError, search_case};
use trueup_identification::parallel;
use trueup_identification::predict::PredictError;
use trueup_signals::Loaded;

use crate::engine::decide::{Decision, FreeRun, Thresholds, decide};
use crate::engine::hypothesis::{Hypothesis, HypothesisClaim};
use crate::engine::recordings::{PreparedCase, UnfitCase};
use crate::engine::replay::{CompleteModel, FreeRunFit};
use crate::engine::search::{CaseSearch, FittedSet, excess};
use crate::engine::select::{SearchEffort, SearchResult};
use crate::engine::stretches::Stretches;
use crate::engine::subject::DiagnosisSubject;
use crate::experiment::ProposedExperiment;
use crate::outcome::*;
use crate::picture::Picture;
use crate::thinned::{Thinning, thinned};
use began::FreeRunStart;
use conclude::{DecidedCase, conclude};
use contest::{FreeRunComparison, POLISH};
use ground::ComparisonBasis;
use innovations::{DecisionBuilder, EngineDecision, JudgedCase, with_compared};
use record::DecisionRecord;

/// Part of the work that is done when the sets are found: their free runs take longer than the search.
const SEARCHED: f64 = 0.35;

/// What weighs the causes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DiagnosisEngine {
    /// Balances of accelerations along the measured motion, and free runs.
    Balances,
    /// The evidence of the innovations about a smoothed trajectory.
    Innovations,
}

/// What weighs the causes where nothing else is called for.
pub const DEFAULT_ENGINE: DiagnosisEngine = DiagnosisEngine::Innovations;

/// How to diagnose.
#[derive(Clone, Copy, Debug)]
pub struct DiagnoseOptions {
    /// For everything that is drawn.
    pub seed: u64,
    /// What weighs the causes; `None`: [`DEFAULT_ENGINE`]. Where the innovations engine cannot take a case balances weigh them, and the
    /// record gives the reason.
    pub engine: Option<DiagnosisEngine>,
    /// How far to search.
    pub effort: SearchEffort,
    /// Where the lines between verdicts are.
    pub limits: Thresholds,
    /// A grave finding of the intake caps the verdict at `unknown`: figures are reported, nothing is claimed.
    pub capped: bool,
    /// Nothing that is found on the way caps it either.
    pub force: bool,
    /// Those for fitting are healthy: when do those held out part from them?
    pub watch: bool,
    /// Large recordings are not thinned.
    pub all_readings: bool,
    /// Neither where the gap is nor what to record next: verdict, claims and gaps alone.
    pub verdict_only: bool,
}

impl Default for DiagnoseOptions {
    fn default() -> Self {
        Self {
            seed: 1,
            engine: None,
            effort: SearchEffort::default(),
            limits: Thresholds::default(),
            capped: false,
            force: false,
            watch: false,
            all_readings: false,
            verdict_only: false,
        }
    }
}

/// A diagnosis that could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DiagnoseError {
    /// The case is not fit for it.
    #[error(transparent)]
    Unfit(#[from] UnfitCase),
    /// A recording is too short.
    #[error("{0}; leave it out of case.toml, or record for longer")]
    Short(String),
    /// The nominal model cannot be simulated.
    #[error(
        "the nominal model cannot be compared with the recordings: {0}; look at the parameters of case.toml"
    )]
    Nominal(String),
    /// A figure that everything hangs on.
    #[error(
        "{what} is {value}: readings or parameters are beyond what can be computed with; look at the sizes of the recordings' values, of their noise and of the parameters of case.toml"
    )]
    NotFinite {
        /// Which.
        what: &'static str,
        /// NaN or infinite.
        value: f64,
    },
}

/// Time series of a channel of a recording, for pictures.
#[derive(Clone, Debug)]
pub struct ChannelTrace {
    /// Recording.
    pub recording: String,
    /// FMU variable.
    pub channel: String,
    /// s.
    pub time: Vec<f64>,
    /// What was measured.
    pub measured: Vec<f64>,
    /// Nominal parameters.
    pub before: Vec<f64>,
    /// Own parameters refitted.
    pub tuned: Vec<f64>,
    /// With the effects.
    pub after: Vec<f64>,
    /// Standard deviation that noise alone would leave.
    pub floor: f64,
}

/// A diagnosis with what it was made from.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    /// What `diagnosis.json` holds.
    pub diagnosis: Diagnosis,
    /// What the case shows before any effect is named; none where the verdict alone was requested.
    pub picture: Option<Picture>,
    /// What to record next.
    pub next: Option<ProposedExperiment>,
    /// Held-out recordings (of cases without: those for fitting).
    pub traces: Vec<ChannelTrace>,
    /// The twists of their transmissions, where both ends were recorded.
    pub twists: Vec<ChannelTrace>,
    /// Which joints of the nominal model have a spring.
    pub flexible: Vec<bool>,
    /// The augmented model, where an effect is claimed.
    pub augmented: Option<AugmentedModel>,
    /// Where its free runs of those recordings began.
    pub began: Vec<FreeRunStart>,
    /// What the verdict was decided from; `None`: nothing could be simulated.
    pub record: Option<DecisionRecord>,
}

/// The model with what was claimed.
#[derive(Clone, Debug, PartialEq)]
pub struct AugmentedModel {
    /// Effects that it is packed with (ids, places behind a colon).
    pub effects: Vec<String>,
    /// Which of its joints are packed flexible.
    pub flexible: Vec<bool>,
    /// It is packed on a base that is fixed.
    pub fixed_base: bool,
    /// Its parameters by name.
    pub values: Vec<(String, f64)>,
    /// Effects that are claimed and in it: id, component, joint from 1.
    pub claims: Vec<(String, String, Option<usize>)>,
    /// The link from 0 that has a payload in one with it.
    pub payload: Option<usize>,
}

/// Diagnoses a case; `report_progress` hears how far it is (0 to 1) and what is being done.
///
/// # Errors
/// See [`DiagnoseError`].
pub fn diagnose(
    loaded: &Loaded,
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let subject = DiagnosisSubject::of(&loaded.case)?;
    let (small, thinning) = match options.all_readings {
        true => (Cow::Borrowed(loaded), None),
        false => thinned(loaded, subject.plant, &subject.inputs()),
    };
    let mut found = diagnose_all(&small, loaded, options, report_progress)?;
    found.diagnosis.findings.extend(thinning.map(Thinning::finding));
    Ok(found)
}

/// Diagnoses a case; `whole`: before it was thinned.
fn diagnose_all(
    loaded: &Loaded,
    whole: &Loaded,
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let case = PreparedCase::new(loaded)?;
    report_progress(0.01, "finding what a perfect model would leave");
    let search = CaseSearch::new(&case, options.seed).map_err(DiagnoseError::Short)?;
    report_progress(0.02, "comparing the nominal model");
    let raw = raw_excess(&search);
    let noticed = input_scale::mistaken(&search);
    let options =
        &DiagnoseOptions { capped: options.capped || !noticed.is_empty() && !options.force, ..*options };
    if options.capped {
        let found = raw.and_then(|raw| {
            nothing_concluded(loaded, &search, (raw, noticed.clone()), options, report_progress)
        });
        return unsimulated::in_place_of(found, loaded, &case, noticed, options);
    }
    let raw = raw?;
    let mut instead = None;
    if options.engine.unwrap_or(DEFAULT_ENGINE) == DiagnosisEngine::Innovations {
        report_progress(0.5 * SEARCHED, "weighing every cause by the innovations");
        match evidence(whole, &search, options) {
            Ok(own) => return by_innovations(loaded, &search, (raw, noticed), own, options, report_progress),
            Err(e) if e.is_final() => {
                let found = nothing_concluded(loaded, &search, (raw, noticed), options, report_progress);
                return found.map(|found| not_compared(found, &e.to_string()));
            }
            Err(e) => instead = Some(e.to_string()),
        }
    }
    let effort = options.effort.on(case.subject.plant);
    let mut done = 0.05;
    let mut found = search
        .select(effort, |what| {
            done = (done + SEARCHED) * 0.5;
            report_progress(done, &progress::words(what));
        })
        .map_err(DiagnoseError::Nominal)?;
    report_progress(SEARCHED, "fitting and running freely the models that lead");
    let prescribed = tuned_start(&search, &found, effort);
    // Where balances miss nothing they know the parameters better than free runs, which chase the noise of their inputs.
    let given = || {
        let theta = search.compare(&prescribed.stated).start();
        (!prescribed.misses_little())
            .then(|| search.polish(&FittedSet { theta, ..prescribed.clone() }, POLISH))
    };
    let (nearest, given) = parallel::join(|| search.polish(&prescribed, POLISH), given);
    // Where balances are blind a free run may have strayed too far to come back.
    let blind = found.above(found.plain.excess()) < options.limits.gap.left;
    let diverges = blind && !search.is_near(&nearest, options.limits.free_runs.near);
    let stretches = if diverges { Stretches::of(&search) } else { None };
    let short = stretches.as_ref().map(|s| s.search(&search));
    let in_short = short.as_ref().and_then(|s| s.polish(&prescribed.of_all(), POLISH).fitted);
    let back = in_short.as_ref().map(|f| search.polish(&f.of_all(), POLISH));
    let (models, mut ground) =
        ground(&search, &found, [Some(nearest), given, back].into_iter().flatten(), options)?;
    ground.stretches = short.as_ref().zip(in_short);
    // What the balances leave open the free-running simulation has to decide.
    let claims = found.best.stated.set.iter().any(Hypothesis::is_effect);
    let near = |f: &FreeRun| if claims { options.limits.free_runs.near * f.floor } else { f.noticed };
    let open = ground.free(&ground.tuned).is_some_and(|f| f.bare() > near(&f));
    let contenders = if open { ground.contest(&mut found, effort) } else { Vec::new() };
    // The contest may have found a model that determines the floor better.
    let mut free = ground.free(&ground.tuned).unwrap_or_default();
    let ran = FreeRunComparison { ground: &ground, contenders: &contenders, effort };
    // What happens in the recordings for fitting alone is a gap as well.
    let plain = found.above(found.plain.excess()) > options.limits.gap.bare;
    free.trained = !case.holdout.is_empty()
        && plain
        && free.before <= free.chance
        && has_gap_in_training(&search, &models[0], options);
    if free.tuned <= options.limits.gap.refitted * free.before && free.tuned > free.chance {
        free.windowed = ground.windowed(&models[1]);
    }
    all_finite([
        ("what the nominal model misses", raw),
        ("what the fitted model misses", found.plain.excess()),
        ("the gap of the nominal model", free.before),
        ("the gap of the refitted model", free.tuned),
        ("the noise floor", free.floor),
        ("what chance may leave", free.chance),
    ])?;
    let mut record = DecisionRecord::new(case.subject.plant, &found, raw, free, &ran);
    let decision = decide(&mut found, raw, &mut free, &ran, &options.limits);
    (record.left_out, record.instead) = (decision.left_out, instead);
    let decided = DecidedCase { found, decision, by_evidence: None, contenders, record, noticed };
    conclude(&search, options, models, ground, decided, loaded, report_progress)
}

/// What the innovations engine makes of a case.
///
/// # Errors
/// Why it cannot take it.
fn evidence(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    options: &DiagnoseOptions,
) -> Result<(EngineDecision, JudgedCase), CaseSearchError> {
    let findings = search_case(loaded)?;
    let decision = DecisionBuilder::new(search, &findings, options.effort).build(&options.limits);
    let decision = decision.map_err(CaseSearchError::Made)?;
    Ok((decision, JudgedCase::from(&findings.judged)))
}

/// The same where these recordings determine nothing about causes.
fn not_compared(mut found: Diagnosed, why: &str) -> Diagnosed {
    found.diagnosis.notes.push(format!("causes were not compared: {why}"));
    if let Some(record) = &mut found.record {
        record.not_compared = Some(why.to_owned());
    }
    found
}

/// By the evidence of the innovations.
fn by_innovations(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    (raw, noticed): (f64, Vec<NoticedMistake>),
    (by_engine, judged): (EngineDecision, JudgedCase),
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    report_progress(SEARCHED, "fitting and running freely what was found");
    let EngineDecision { found, decision, own, compared } = by_engine;
    // Behind a servo the engine may end far from where a free run can begin.
    let given = search.case.subject.servo(0).map(|_| {
        let theta = search.compare(&found.plain.stated).start();
        search.polish(&FittedSet { theta, ..found.plain.clone() }, POLISH)
    });
    let polished = given.into_iter().chain([search.polish(&found.plain, POLISH)]);
    let (models, ground) = ground(search, &found, polished, options)?;
    let free = ground.free(&ground.tuned).unwrap_or_default();
    let ran = FreeRunComparison { ground: &ground, contenders: &[], effort: options.effort };
    let plant = search.case.subject.plant;
    let record =
        DecisionRecord { innovations: Some(judged), ..DecisionRecord::new(plant, &found, raw, free, &ran) };
    let contenders = Vec::new();
    let decided = DecidedCase { found, decision, by_evidence: Some(own), contenders, record, noticed };
    let mut diagnosed = conclude(search, options, models, ground, decided, loaded, report_progress)?;
    let candidates = &mut diagnosed.diagnosis.candidates;
    *candidates = with_compared(std::mem::take(candidates), compared);
    Ok(diagnosed)
}

/// After a grave finding no cause is searched for: how far the model as it was given is off, and where, as far as that can be determined.
fn nothing_concluded(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    (raw, noticed): (f64, Vec<NoticedMistake>),
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    report_progress(SEARCHED, "a grave finding: no cause is looked for");
    let broken = || DiagnoseError::Nominal("it cannot be simulated".into());
    let stated = search.state(&[]).map_err(DiagnoseError::Nominal)?;
    let start = search.compare(&stated).start();
    let plain = search.standing(stated, start).ok_or_else(broken)?;
    let found = SearchResult { best: plain.clone(), sets: Vec::new(), plain };
    let (models, ground) = ground(search, &found, [], options)?;
    let free = ground.free(&ground.tuned).unwrap_or_default();
    let ran = FreeRunComparison { ground: &ground, contenders: &[], effort: options.effort };
    let record = DecisionRecord::new(search.case.subject.plant, &found, raw, free, &ran);
    let (decision, contenders) = (Decision::nothing(), Vec::new());
    let decided = DecidedCase { decision, found, by_evidence: None, contenders, record, noticed };
    conclude(search, options, models, ground, decided, loaded, report_progress)
}

/// The model as it was given and with its own parameters fitted, and how both run freely. It stays as it was given where no
/// fit of it is nearer.
fn ground<'a>(
    search: &'a CaseSearch<'a>,
    found: &SearchResult,
    polished: impl IntoIterator<Item = FreeRunFit>,
    options: &DiagnoseOptions,
) -> Result<([CompleteModel; 2], ComparisonBasis<'a>), DiagnoseError> {
    let case = search.case;
    let plain = &found.plain.stated;
    let before = CompleteModel { stated: plain.clone(), theta: search.compare(plain).start() };
    let bare = search.replay(&before, &case.train).map_or(f64::INFINITY, |r| search.misfit(&r, &case.train));
    let nearest =
        (polished.into_iter()).filter(|p| p.misfit < bare).min_by(|a, b| a.misfit.total_cmp(&b.misfit));
    let (tuned, fitted, misfit) =
        nearest.map_or_else(|| (before.clone(), None, bare), |p| (p.complete, p.fitted, p.misfit));
    let runs = if case.holdout.is_empty() { &case.train } else { &case.holdout };
    let nominal = |e: PredictError| DiagnoseError::Nominal(e.to_string());
    let shown = search.replay(&before, runs).map_err(nominal)?;
    let shown_tuned = search.replay(&tuned, runs).unwrap_or_else(|_| shown.clone());
    let floors = search.floors(&tuned, runs, options.seed).map_err(nominal)?;
    let ground = ComparisonBasis::new(search, runs, [shown, shown_tuned], (fitted, misfit), floors, options);
    Ok(([before, tuned], ground))
}

/// Nothing is decided by a figure that compares with nothing.
fn all_finite<const N: usize>(figures: [(&'static str, f64); N]) -> Result<(), DiagnoseError> {
    match figures.into_iter().find(|f| !f.1.is_finite()) {
        Some((what, value)) => Err(DiagnoseError::NotFinite { what, value }),
        None => Ok(()),
    }
}

fn raw_excess(search: &CaseSearch<'_>) -> Result<f64, DiagnoseError> {
    let stated = search.state(&[]).map_err(DiagnoseError::Nominal)?;
    let problem = search.compare(&stated);
    let r = problem.residuals(&problem.start()).map_err(|e| DiagnoseError::Nominal(e.to_string()))?;
    Ok(excess(&search.octaves(&r)))
}

/// Whether this model leaves a gap in the recordings for fitting: a limit that those held out do not reach, say.
fn has_gap_in_training(search: &CaseSearch<'_>, model: &CompleteModel, options: &DiagnoseOptions) -> bool {
    let runs = &search.case.train;
    let Ok(shown) = search.replay(model, runs) else { return false };
    let Ok(floors) = search.floors(model, runs, options.seed) else { return false };
    let ground = ComparisonBasis::new(
        search,
        runs,
        [shown.clone(), shown.clone()],
        (None, f64::INFINITY),
        floors,
        options,
    );
    ground.free(&shown).is_some_and(|f| f.before > f.chance)
}

/// The plain model with all its parameters free, from where the search left it.
fn tuned_start(search: &CaseSearch<'_>, found: &SearchResult, effort: SearchEffort) -> FittedSet {
    let wide: Vec<Hypothesis> =
        search.causes.iter().filter(|h| matches!(h.claim, HypothesisClaim::Parameter(_))).cloned().collect();
    let start_from =
        if found.best.stated.set.iter().any(Hypothesis::is_effect) { &found.plain } else { &found.best };
    let fitted = search.state(&wide).ok().and_then(|stated| {
        let start = search.begin_with(&stated, start_from);
        search.fit(stated, &start, effort.options()).ok()
    });
    fitted.unwrap_or_else(|| start_from.clone())
}
