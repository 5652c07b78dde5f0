//! From a case to a diagnosis.

pub mod began;
mod blind;
mod claim;
mod complete;
mod contest;
mod drift;
mod evidence;
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
mod strained;
mod traces;
mod watch;

pub use evidence::diagnose_by_evidence;

use std::borrow::Cow;

use trueup_identification::parallel;
use trueup_identification::predict::PredictError;
use trueup_signals::Loaded;

use crate::engine::decide::{Decision, Free, Thresholds, decide};
use crate::engine::hypothesis::{Claim, Hypothesis};
use crate::engine::recordings::{Prepared, Unfit};
use crate::engine::replay::{Complete, Polished};
use crate::engine::search::{Fitted, Search, excess};
use crate::engine::select::{Effort, Found, same};
use crate::engine::stretches::Stretches;
use crate::engine::subject::Subject;
use crate::experiment::{self, Experiment};
use crate::outcome::*;
use crate::picture::{Picture, isolability};
use crate::thinned::{Thinning, thinned};
use began::Began;
use claim::{Estimated, FreeFits, augmented, candidates, effects, indistinguishable, parameters};
use contest::{Contender, Contest, POLISH};
use ground::Ground;
use held_out::{closed_alone, held_out};
use place::{look, where_it_lies};
use record::Record;
use traces::{gap_report, traces};

/// A component with this share of an excess that nothing explains stands out.
const STANDS_OUT: f64 = 0.5;

/// Part of the work that is done when the sets are found: their free runs take longer than the search.
const SEARCHED: f64 = 0.35;

/// What weighs the causes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Engine {
    /// Balances that recordings lead, and free runs.
    #[default]
    Balances,
    /// The likelihood of the innovations of a filter with latent torques; for TwoMassJoint.
    Filter,
}

/// How to diagnose.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// For everything that is drawn.
    pub seed: u64,
    /// What weighs the causes.
    pub engine: Engine,
    /// How far to search.
    pub effort: Effort,
    /// Where the lines between verdicts are.
    pub limits: Thresholds,
    /// A grave finding of the intake caps the verdict at `unknown`: figures are told, nothing is claimed.
    pub capped: bool,
    /// Nothing that is found on the way caps it either.
    pub force: bool,
    /// Those for fitting are healthy: when do those held out part from them?
    pub watch: bool,
    /// Large recordings are not thinned.
    pub all_readings: bool,
    /// Neither where the gap lies nor what to record next: verdict, claims and gaps alone.
    pub verdict_only: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            seed: 1,
            engine: Engine::default(),
            effort: Effort::default(),
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
    Unfit(#[from] Unfit),
    /// A recording is too short.
    #[error("{0}; leave it out of case.toml, or record for longer")]
    Short(String),
    /// The filter cannot take it.
    #[error(transparent)]
    Filter(#[from] trueup_hypotheses::baseline::BaselineError),
    /// The innovations engine cannot take it.
    #[error(transparent)]
    Innovations(#[from] trueup_hypotheses::innovations::search::JointSearchError),
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
pub struct Trace {
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
    /// What the case shows before any effect is named; none where the verdict alone was asked for.
    pub picture: Option<Picture>,
    /// What to record next.
    pub next: Option<Experiment>,
    /// Held-out recordings (of cases without: those for fitting).
    pub traces: Vec<Trace>,
    /// Which joints of the nominal model have a spring.
    pub flexible: Vec<bool>,
    /// The augmented model, where an effect is claimed.
    pub augmented: Option<Augmented>,
    /// Where its free runs of those recordings began.
    pub began: Vec<Began>,
    /// What the verdict was decided from.
    pub record: Record,
}

/// The model with what was claimed.
#[derive(Clone, Debug, PartialEq)]
pub struct Augmented {
    /// Effects that it is packed with (ids, places behind a colon).
    pub effects: Vec<String>,
    /// Which of its joints are packed flexible.
    pub flexible: Vec<bool>,
    /// It is packed on a base that is fixed.
    pub fixed_base: bool,
    /// Its parameters by name.
    pub values: Vec<(String, f64)>,
}

/// Diagnoses a case; `tell` hears how far it is (0 to 1) and what is being done.
///
/// # Errors
/// See [`DiagnoseError`].
pub fn diagnose(
    loaded: &Loaded,
    options: &Options,
    tell: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let subject = Subject::of(&loaded.case)?;
    let (small, thinning) = match options.all_readings {
        true => (Cow::Borrowed(loaded), None),
        false => thinned(loaded, subject.plant, &subject.inputs()),
    };
    let mut found = diagnose_all(&small, options, tell)?;
    found.diagnosis.findings.extend(thinning.map(Thinning::told));
    Ok(found)
}

/// Diagnoses a case with all the readings that it has.
fn diagnose_all(
    loaded: &Loaded,
    options: &Options,
    tell: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let case = Prepared::new(loaded)?;
    tell(0.01, "finding what a perfect model would leave");
    let search = Search::new(&case, options.seed).map_err(DiagnoseError::Short)?;
    tell(0.02, "comparing the nominal model");
    let raw = raw_excess(&search)?;
    let mistaken = input_scale::mistaken(&search);
    let options = &Options { capped: options.capped || mistaken.is_some() && !options.force, ..*options };
    if options.engine == Engine::Filter {
        return by_filter(loaded, &search, (raw, mistaken), options, tell);
    }
    let effort = options.effort.on(case.subject.plant);
    let mut done = 0.05;
    let mut found = search
        .select(effort, |what| {
            done = (done + SEARCHED) * 0.5;
            tell(done, &progress::words(what));
        })
        .map_err(DiagnoseError::Nominal)?;
    tell(SEARCHED, "fitting and running freely the models that lead");
    let led = tuned_start(&search, &found, effort);
    // Where balances miss nothing they know the parameters better than free runs, which chase the noise of their inputs.
    let given = || {
        let theta = search.compare(&led.stated).start();
        (!led.misses_little()).then(|| search.polish(&Fitted { theta, ..led.clone() }, POLISH))
    };
    let (nearest, given) = parallel::join(|| search.polish(&led, POLISH), given);
    // Where balances are blind a free run may have strayed too far to come back.
    let blind = found.above(found.plain.excess()) < options.limits.gap.left;
    let strays = blind && !search.is_near(&nearest, options.limits.free_runs.near);
    let stretches = if strays { Stretches::of(&search) } else { None };
    let short = stretches.as_ref().map(|s| s.search(&search));
    let in_short = short.as_ref().and_then(|s| s.polish(&led.of_all(), POLISH).fitted);
    let back = in_short.as_ref().map(|f| search.polish(&f.of_all(), POLISH));
    let (models, mut ground) =
        ground(&search, &found, [Some(nearest), given, back].into_iter().flatten(), options)?;
    ground.stretches = short.as_ref().zip(in_short);
    // What the balances leave open the free-running simulation has to tell.
    let claims = found.best.stated.set.iter().any(Hypothesis::is_effect);
    let near = |f: &Free| if claims { options.limits.free_runs.near * f.floor } else { f.noticed };
    let open = ground.free(&ground.tuned).is_some_and(|f| f.bare() > near(&f));
    // With an input in another unit every cause is as wrong as the others.
    let tells = options.force || mistaken.is_none();
    let contenders = if open && tells { ground.contest(&mut found, effort) } else { Vec::new() };
    // The contest may have found a model that tells the floor better.
    let mut free = ground.free(&ground.tuned).unwrap_or_default();
    let ran = Contest { ground: &ground, contenders: &contenders, effort };
    // What happens in the recordings for fitting alone is a gap as well.
    let plain = found.above(found.plain.excess()) > options.limits.gap.bare;
    free.trained = !case.holdout.is_empty()
        && plain
        && free.before <= free.chance
        && has_gap_in_training(&search, &models[0], options);
    all_finite([
        ("what the nominal model misses", raw),
        ("what the fitted model misses", found.plain.excess()),
        ("the gap of the nominal model", free.before),
        ("the gap of the refitted model", free.tuned),
        ("the noise floor", free.floor),
        ("what chance may leave", free.chance),
    ])?;
    let mut record = Record::new(case.subject.plant, &found, raw, free, &ran);
    let mut decision = decide(&mut found, raw, &mut free, &ran, &options.limits);
    record.left_out = decision.left_out;
    if options.capped {
        decision.cap();
    }
    let decided = Decided { found, decision, contenders, record, mistaken };
    conclude(&search, options, models, ground, decided, loaded, tell)
}

/// By the likelihood of the innovations.
fn by_filter(
    loaded: &Loaded,
    search: &Search<'_>,
    (raw, mistaken): (f64, Option<Noticed>),
    options: &Options,
    tell: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let case = search.case;
    tell(SEARCHED, "weighing every cause by the innovations");
    let fits = trueup_hypotheses::search::search(loaded)?;
    let judged = trueup_hypotheses::verdict::judge(&fits);
    let broken = || DiagnoseError::Nominal("the model with what was found cannot be run".into());
    let (found, mut decision) = innovations::told(search, &fits, &judged).ok_or_else(broken)?;
    if options.capped {
        decision.cap();
    }
    let (models, ground) = ground(search, &found, [search.polish(&found.plain, POLISH)], options)?;
    let free = ground.free(&ground.tuned).unwrap_or_default();
    let ran = Contest { ground: &ground, contenders: &[], effort: options.effort };
    let record = Record { filter: true, ..Record::new(case.subject.plant, &found, raw, free, &ran) };
    let decided = Decided { found, decision, contenders: Vec::new(), record, mistaken };
    conclude(search, options, models, ground, decided, loaded, tell)
}

/// The model as it was given and with its own parameters fitted, and how both run freely. It stays as it was given where no
/// fit of it is nearer.
fn ground<'a>(
    search: &'a Search<'a>,
    found: &Found,
    polished: impl IntoIterator<Item = Polished>,
    options: &Options,
) -> Result<([Complete; 2], Ground<'a>), DiagnoseError> {
    let case = search.case;
    let plain = &found.plain.stated;
    let before = Complete { stated: plain.clone(), theta: search.compare(plain).start() };
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
    let ground = Ground::new(search, runs, [shown, shown_tuned], (fitted, misfit), floors, options);
    Ok(([before, tuned], ground))
}

/// What a verdict is told from.
struct Decided {
    found: Found,
    decision: Decision,
    /// Sets that ran freely.
    contenders: Vec<Contender>,
    record: Record,
    /// An input in another unit.
    mistaken: Option<Noticed>,
}

/// Runs freely what was decided, and tells where the gap lies and how far it closes.
fn conclude(
    search: &Search<'_>,
    options: &Options,
    [before, tuned]: [Complete; 2],
    ground: Ground<'_>,
    Decided { found, mut decision, contenders, record, mistaken }: Decided,
    loaded: &Loaded,
    tell: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let (case, runs) = (search.case, ground.runs);
    let replay = |c: &Complete| search.replay(c, runs).map_err(|e| DiagnoseError::Nominal(e.to_string()));
    tell(0.85, "running freely what was decided, and how far noise goes");
    let claimed = matches!(decision.verdict, Verdict::Effects | Verdict::Ambiguous);
    let no_gap = decision.verdict == Verdict::NoGap;
    let tuned = if no_gap { before.clone() } else { tuned };
    let shown_tuned = if no_gap { ground.before.clone() } else { ground.tuned.clone() };
    let gaps: Vec<(usize, f64)> =
        contenders.iter().filter_map(|c| Some((c.at, ground.gap(&c.shown)?))).collect();
    let free_fits: FreeFits = contenders.iter().filter_map(|c| Some((c.at, c.fitted.clone()?))).collect();
    let chosen = contenders
        .into_iter()
        .find(|c| claimed && same(&found.sets[c.at].stated.set, &found.best.stated.set));
    let (mut after, mut shown_after) = match chosen {
        Some(c) => (c.complete, c.shown),
        None if claimed => {
            let complete = search.polish(&found.best, 16).complete;
            let shown = replay(&complete)?;
            (complete, shown)
        }
        None => (tuned.clone(), shown_tuned.clone()),
    };
    let mut notes = if case.holdout.is_empty() { vec![NO_HOLDOUT.into()] } else { Vec::new() };
    if decision.unmoved {
        notes.push("no fit of the model's own parameters runs nearer than those given: their values stay, and explain nothing".into());
    }
    if let Some((_, l)) = decision.left_out.filter(|(_, l)| l.does_worse(options.limits.free_runs.near)) {
        notes.push(format!("recordings for fitting, each left out in turn: what explains the others leaves {:.0} % in it, the refitted model {:.0} %: nothing is claimed", 100.0 * l.with, 100.0 * l.tuned));
    }
    let worse = claimed.then(|| ground.worse(&shown_after)).flatten();
    if let Some([with, without]) = worse {
        decision.cap();
        notes.push(format!(
            "what explains the recordings for fitting leaves {:.0} % in those held out, the refitted model {:.0} %: nothing is claimed",
            100.0 * with, 100.0 * without
        ));
        (after, shown_after) = (tuned.clone(), shown_tuned.clone());
    }
    notes.extend(blind::told(search, decision.verdict));
    let claimed = claimed && worse.is_none();
    let nominal = |e: PredictError| DiagnoseError::Nominal(e.to_string());
    let settled = search.settled(&after, runs).map_err(nominal)?;
    let floors = search.floors_around(&after, runs, &settled, options.seed).map_err(nominal)?;
    let traces = traces(runs, [&ground.before, &shown_tuned, &shown_after], &floors);
    let gap = gap_report(&traces, options.seed);
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
    let best = Estimated::new(&found.best, &found, &free_fits).or_refitted(ground.fitted.as_ref());
    let unknown = decision.verdict == Verdict::Unknown;
    let most = location.components.first().filter(|c| unknown && c.share >= STANDS_OUT);
    let place = most.map(|c| c.id.clone());
    let far = if no_gap { Vec::new() } else { strained::told(&found.best, case) };
    let mut diagnosis = Diagnosis {
        schema: SCHEMA.into(),
        model: loaded.case.model.clone(),
        verdict: decision.verdict,
        gap,
        sensors: (&isolability(loaded, &case.subject)).into(),
        location,
        effects: effects(case.subject.plant, &found, &free_fits, &best, &decision),
        candidates: candidates(case.subject.plant, &found, &decision),
        parameters: parameters(&best, &decision),
        indistinguishable: indistinguishable(&found, &decision),
        unknown: Unknown { present: unknown, probability: decision.unknown, place },
        next_experiment: next.as_ref().map(|n| n.said.clone()),
        watch: options.watch.then(|| watch::watch(search, &tuned)),
        augmented: None,
        capped: options.capped,
        findings: mistaken.into_iter().chain(far).collect(),
        inputs: None,
        notes,
    };
    let overall = diagnosis.gap.overall.as_ref().map(|g| g.after);
    held_out(&found, decision.verdict, overall, &mut diagnosis.candidates, &gaps);
    if let Some(overall) = &diagnosis.gap.overall {
        closed_alone(&found, overall, &mut diagnosis.effects, &gaps);
    }
    drift::told(&mut diagnosis);
    diagnosis.notes.extend(claim::elsewhere(case.subject.plant, &found, &decision));
    if decision.verdict == Verdict::Ambiguous && next.is_none() && !options.verdict_only {
        diagnosis.notes.push(experiment::NOTHING.into());
    }
    let began = |(run, settled)| Began::new(search, &after, run, settled);
    let began: Vec<Began> = if claimed { runs.iter().zip(&settled).map(began).collect() } else { Vec::new() };
    let augmented = claimed.then(|| augmented(search, &after, began.first()));
    tell(1.0, "done");
    Ok(Diagnosed {
        diagnosis,
        picture,
        next,
        traces,
        flexible: case.subject.flexible.clone(),
        augmented,
        began,
        record,
    })
}

/// Nothing is decided by a figure that compares with nothing.
fn all_finite<const N: usize>(figures: [(&'static str, f64); N]) -> Result<(), DiagnoseError> {
    match figures.into_iter().find(|f| !f.1.is_finite()) {
        Some((what, value)) => Err(DiagnoseError::NotFinite { what, value }),
        None => Ok(()),
    }
}

fn raw_excess(search: &Search<'_>) -> Result<f64, DiagnoseError> {
    let stated = search.state(&[]).map_err(DiagnoseError::Nominal)?;
    let problem = search.compare(&stated);
    let r = problem.residuals(&problem.start()).map_err(|e| DiagnoseError::Nominal(e.to_string()))?;
    Ok(excess(&search.octaves(&r)))
}

/// Whether this model leaves a gap in the recordings for fitting: a limit that those held out do not reach, say.
fn has_gap_in_training(search: &Search<'_>, model: &Complete, options: &Options) -> bool {
    let runs = &search.case.train;
    let Ok(shown) = search.replay(model, runs) else { return false };
    let Ok(floors) = search.floors(model, runs, options.seed) else { return false };
    let ground =
        Ground::new(search, runs, [shown.clone(), shown.clone()], (None, f64::INFINITY), floors, options);
    ground.free(&shown).is_some_and(|f| f.before > f.chance)
}

/// The plain model with all its parameters free, from where the search left it.
fn tuned_start(search: &Search<'_>, found: &Found, effort: Effort) -> Fitted {
    let wide: Vec<Hypothesis> =
        search.causes.iter().filter(|h| matches!(h.claim, Claim::Parameter(_))).cloned().collect();
    let start_from =
        if found.best.stated.set.iter().any(Hypothesis::is_effect) { &found.plain } else { &found.best };
    let fitted = search.state(&wide).ok().and_then(|stated| {
        let start = search.begin_with(&stated, start_from);
        search.fit(stated, &start, effort.options()).ok()
    });
    fitted.unwrap_or_else(|| start_from.clone())
}
