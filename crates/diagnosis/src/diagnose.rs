//! From a case to a diagnosis.

mod acting;
pub mod began;
mod budget;
mod claim;
mod complete;
mod conclude;
mod dead;
mod drift;
mod estimate;
mod evidence_claims;
pub mod foreign;
mod free_runs;
mod ground;
mod held_out;
mod innovations;
pub mod input_scale;
mod place;
pub mod record;
mod refusal;
mod robot;
mod strained;
mod traces;
mod twist;
mod unsimulated;
mod watch;
mod yours;

use std::borrow::Cow;

use trueup_hypotheses::innovations::findings::{CaseSearchError, search_case};
use trueup_identification::predict::PredictError;
use trueup_models::plants;
use trueup_signals::Loaded;

use crate::engine::decide::Decision;
use crate::engine::recordings::{PreparedCase, UnfitCase};
use crate::engine::replay::{CompleteModel, FreeRunFit};
use crate::engine::result::SearchResult;
use crate::engine::search::{CaseSearch, FittedSet, excess};
use crate::engine::subject::DiagnosisSubject;
use crate::experiment::ProposedExperiment;
use crate::outcome::*;
use crate::picture::Picture;
use crate::thinned::{Thinning, thinned};
use began::FreeRunStart;
use conclude::{DecidedCase, POLISH, conclude};
use ground::ComparisonBasis;
use innovations::{DecisionBuilder, EngineDecision, JudgedCase, with_compared};
use record::DecisionRecord;

/// Part of the progress at which causes are compared; free runs follow.
const SEARCHED: f64 = 0.35;

/// How to diagnose.
#[derive(Clone, Copy, Debug)]
pub struct DiagnoseOptions {
    /// For everything that is drawn.
    pub seed: u64,
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
        Self { seed: 1, capped: false, force: false, watch: false, all_readings: false, verdict_only: false }
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
    if plants::is_robot(&loaded.case.model) {
        return robot::diagnose_robot(loaded, options, report_progress);
    }
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
            report_progress(SEARCHED, "a grave finding: no cause is looked for");
            nothing_concluded(loaded, &search, (raw, noticed.clone()), options, report_progress)
        });
        return unsimulated::in_place_of(found, loaded, &case, noticed, options);
    }
    let raw = raw?;
    report_progress(0.5 * SEARCHED, "weighing every cause by the innovations");
    match evidence(whole, &search) {
        Ok(own) => by_innovations(loaded, &search, (raw, noticed), own, options, report_progress),
        Err(e) => {
            report_progress(SEARCHED, "causes are not compared: how far the model is off");
            let found = nothing_concluded(loaded, &search, (raw, noticed), options, report_progress);
            found.map(|found| not_compared(found, &e.to_string()))
        }
    }
}

/// What the innovations show of a case.
///
/// # Errors
/// Why it cannot take it.
fn evidence(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
) -> Result<(EngineDecision, JudgedCase), CaseSearchError> {
    let findings = search_case(loaded)?;
    let decision = DecisionBuilder::new(search, &findings).build();
    let decision = decision.map_err(CaseSearchError::Made)?;
    Ok((decision, JudgedCase::from(&findings)))
}

/// The same where these recordings determine nothing about causes.
fn not_compared(mut found: Diagnosed, why: &str) -> Diagnosed {
    found.diagnosis.not_compared = Some(why.to_owned());
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
    let record = DecisionRecord { innovations: Some(judged), ..DecisionRecord::new(&found, raw, free) };
    let decided = DecidedCase { found, decision, by_evidence: Some(own), record, noticed };
    let mut diagnosed = conclude(search, options, models, ground, decided, loaded, report_progress)?;
    let candidates = &mut diagnosed.diagnosis.candidates;
    *candidates = with_compared(std::mem::take(candidates), compared);
    Ok(diagnosed)
}

/// After a grave finding, or where causes cannot be compared: how far the model as it was given is off, and where, as far as that can be determined.
fn nothing_concluded(
    loaded: &Loaded,
    search: &CaseSearch<'_>,
    (raw, noticed): (f64, Vec<NoticedMistake>),
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let broken = || DiagnoseError::Nominal("it cannot be simulated".into());
    let stated = search.state(&[]).map_err(DiagnoseError::Nominal)?;
    let start = search.compare(&stated).start();
    let plain = search.standing(stated, start).ok_or_else(broken)?;
    let found = SearchResult { best: plain.clone(), sets: Vec::new(), plain };
    let (models, ground) = ground(search, &found, [], options)?;
    let free = ground.free(&ground.tuned).unwrap_or_default();
    let record = DecisionRecord::new(&found, raw, free);
    let decision = Decision::nothing();
    let decided = DecidedCase { decision, found, by_evidence: None, record, noticed };
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
    let ground = ComparisonBasis::new(search, runs, [shown, shown_tuned], (fitted, misfit), floors);
    Ok(([before, tuned], ground))
}

fn raw_excess(search: &CaseSearch<'_>) -> Result<f64, DiagnoseError> {
    let stated = search.state(&[]).map_err(DiagnoseError::Nominal)?;
    let problem = search.compare(&stated);
    let r = problem.residuals(&problem.start()).map_err(|e| DiagnoseError::Nominal(e.to_string()))?;
    Ok(excess(&search.octaves(&r)))
}
