//! A robot from its case to a diagnosis.
//!
//! Causes are compared by the innovations along its trajectory. No last fit follows: values are those of the comparison, and the gap is
//! that of free runs with nominal parameters, with refitted ones, and with what was named in the model.

use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect, search_case};
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_identification::model::SimulatedPlant;
use trueup_identification::packed::PackedModel;
use trueup_identification::recorded::runs;
use trueup_identification::run::IdentificationRun;
use trueup_models::effect::{EffectChoice, Scope};
use trueup_models::plants::PlantStructure;
use trueup_signals::{Case, Loaded, base_name, element_name};

use super::estimate::as_well;
use super::evidence_claims::{self, ComparedParameter, EvidenceNames};
use super::free_runs::{FreeReadings, FreeRuns, traces, windows};
use super::traces::gap_report;
use super::{AugmentedModel, DiagnoseError, DiagnoseOptions, Diagnosed, SEARCHED};
use crate::engine::recordings::UnfitCase;
use crate::floor;
use crate::outcome::NO_HOLDOUT;
use crate::picture::Picture;

/// Length of the windows in which runs begin again, s.
const WINDOW: f64 = 1.0;
/// Relative standard deviation of a parameter that is assumed known.
const KNOWN: f64 = 0.01;
/// Levels of dry friction: what slides, and what breaks away at the same share of it as in the case.
const DRY: [&str; 2] = ["coulombFriction", "staticFriction"];

/// Names of a robot's variables.
struct RobotNames<'a> {
    case: &'a Case,
    plant: &'a SimulatedPlant,
    nominal: &'a [f64],
}

impl RobotNames<'_> {
    /// The variable of this plant that a value of a cause is.
    fn variable(&self, cause: &FoundCause, value: &str) -> String {
        let own = self.choice(cause.id, &cause.place).filter(|c| has(c, value));
        match own {
            None => element_name(value, &[cause.joint + 1]),
            Some(c) => match c.scope() {
                Scope::Once => c.variable(value),
                Scope::Joint => element_name(&c.variable(value), &[cause.joint + 1]),
                // Of the element of an array that is read.
                Scope::Channel => {
                    let read = cause.place.rsplit(':').next().unwrap_or("");
                    format!("{}{}", c.variable(value), &read[base_name(read).len()..])
                }
            },
        }
    }

    /// Parameters with an effect, by name; those of the effect take precedence.
    fn found(&self, found: &CaseFindings, effect: &FoundEffect) -> Vec<(String, f64)> {
        let mut all: Vec<(String, f64)> =
            found.names.iter().cloned().zip(effect.theta.iter().copied()).collect();
        let put = |name: String, value: f64, all: &mut Vec<(String, f64)>| match all
            .iter_mut()
            .find(|a| a.0 == name)
        {
            Some(own) => own.1 = value,
            None => all.push((name, value)),
        };
        let mut exceeded = Vec::new();
        for (cause, v) in effect.causes.iter().flat_map(|c| c.values.iter().map(move |v| (c, v))) {
            let unit = |name: &str| {
                let name = self.variable(cause, name);
                all.iter().find(|a| a.0 == name).map(|a| a.1)
            };
            let mut value = v.with_unit(unit);
            if v.name == DRY[1] {
                // What breaks away exceeds what slides by it.
                value += unit(DRY[0]).unwrap_or(0.0);
                exceeded.push(cause.joint + 1);
            }
            if v.recording.is_none() {
                put(self.variable(cause, v.name), value, &mut all);
            }
        }
        for joint in (1..=self.plant.structure().flexible.len()).filter(|j| !exceeded.contains(j)) {
            let [slides, breaks] = DRY.map(|name| element_name(name, &[joint]));
            let of = |name: &str| self.plant.parameter(name).map(|k| self.nominal[k]);
            let level = all.iter().find(|a| a.0 == slides).map(|a| a.1);
            if let (Some(level), Some(from), Some(to)) =
                (level, of(&slides).filter(|x| *x > 0.0), of(&breaks))
            {
                put(breaks, level * to / from, &mut all);
            }
        }
        all
    }

    /// The plant with an effect, and its parameters.
    fn with(&self, found: &CaseFindings, effect: &FoundEffect) -> Result<(SimulatedPlant, Vec<f64>), String> {
        let structure = self.plant.structure();
        let mut flexible = structure.flexible.clone();
        let mut effects = structure.effects.clone();
        for c in &effect.causes {
            if c.is_of_single_recordings() {
                return Err(format!("{} differs between recordings", c.id));
            }
            if c.id == "joint-flexibility" {
                flexible.get_mut(c.joint).into_iter().for_each(|f| *f = true);
                continue;
            }
            let choice = self
                .choice(c.id, &c.place)
                .ok_or_else(|| format!("{} at {} is none of this model", c.id, c.place))?;
            if !effects.contains(&choice.id()) {
                effects.push(choice.id());
            }
        }
        let with = SimulatedPlant::new(PlantStructure { flexible, effects, ..structure.clone() });
        let with = with.map_err(|e| e.to_string())?;
        let mut values = with.carry(self.plant, self.nominal);
        for (name, value) in self.found(found, effect) {
            if let Some(k) = with.parameter(&name) {
                let q = &with.parameters()[k];
                values[k] = value.max(q.min).min(q.max);
            }
        }
        Ok((with, values))
    }
}

fn has(choice: &EffectChoice, parameter: &str) -> bool {
    choice.parameters().iter().any(|p| p.name == parameter)
}

impl EvidenceNames for RobotNames<'_> {
    fn place(&self, place: &str) -> String {
        place.to_owned()
    }
    fn joint(&self, cause: &FoundCause) -> Option<usize> {
        if let Some(channel) = cause.place.strip_prefix("sensor:") {
            let index = channel[base_name(channel).len()..].trim_matches(['[', ']']).split(',').next()?;
            return index
                .parse()
                .ok()
                .filter(|_| !matches!(base_name(channel), "tipPosition" | "tipVelocity"));
        }
        Some(cause.joint + 1).filter(|_| !matches!(&*cause.place, "base" | "tip"))
    }
    fn choice(&self, id: &str, place: &str) -> Option<EffectChoice> {
        let place = base_name(place);
        let of = |c: &EffectChoice| c.spec().id == id && c.component() == place;
        EffectChoice::all(self.plant.effect_plant()).find(of)
    }
    fn parameter_of(&self, cause: &FoundCause, value: &str) -> String {
        self.choice(cause.id, &cause.place).map_or_else(|| value.to_owned(), |c| c.variable(value))
    }
    fn is_of_plant(&self, cause: &FoundCause, value: &str) -> bool {
        !self.choice(cause.id, &cause.place).is_some_and(|c| has(&c, value))
    }
    fn parameters(&self, found: &CaseFindings, effect: &FoundEffect) -> Vec<ComparedParameter> {
        let one = |(name, value): (String, f64)| {
            let known = self.plant.parameter(&name);
            let nominal = known.map(|k| self.nominal[k]);
            // What does not move is not reported, nor what only an effect has.
            let moved = nominal.is_none_or(|x| x != value);
            let own = known.is_some() || name.contains('.');
            let doubt = self.case.doubt(&name);
            (moved && own).then(|| ComparedParameter {
                unit: known.map_or("", |k| self.plant.parameters()[k].unit).to_owned(),
                nominal,
                deviation: nominal.and_then(|x| Some(doubt? * x.abs())),
                share: doubt.unwrap_or(KNOWN),
                name,
                value,
            })
        };
        self.found(found, effect).into_iter().filter_map(one).collect()
    }
}

/// What was simulated: whole recordings, and windows of them.
struct RobotRun {
    whole: FreeReadings,
    windows: FreeReadings,
}

/// Recordings that the gap is of.
struct RobotRuns<'a> {
    whole: &'a [IdentificationRun],
    windows: &'a [IdentificationRun],
}

impl RobotRuns<'_> {
    fn run(&self, plant: &SimulatedPlant, values: &[f64]) -> Result<RobotRun, String> {
        let of = |runs| FreeRuns { subject: plant, runs }.run(values, None).map_err(|e| e.to_string());
        Ok(RobotRun { whole: of(self.whole)?, windows: of(self.windows)? })
    }
}

/// What the first misses over what the second does, window by window: logarithms of the squares, by the noise of each channel.
fn ratios(first: &FreeReadings, second: &FreeReadings) -> Vec<f64> {
    let missed = |all: &FreeReadings| {
        let mut sums = std::collections::BTreeMap::new();
        for c in all {
            let squares = c.whitened.iter().map(|w| w * w).sum::<f64>();
            *sums.entry(c.run).or_insert(0.0) += squares / c.t.len().max(1) as f64;
        }
        sums
    };
    let (first, second) = (missed(first), missed(second));
    first.iter().filter_map(|(run, a)| Some((a / second.get(run)?).ln())).collect()
}

/// Diagnoses a robot; `report_progress` hears how far it is (0 to 1) and what is being done.
///
/// # Errors
/// Recordings that cannot be compared, or a model that cannot be simulated.
pub(super) fn diagnose_robot(
    loaded: &Loaded,
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let case = &loaded.case;
    let nominal_error = |e: &dyn std::fmt::Display| DiagnoseError::Nominal(e.to_string());
    let plant = SimulatedPlant::of_case(case, &[]).map_err(UnfitCase::from)?;
    let nominal = plant.set(&plant.defaults(), &case.parameters).map_err(UnfitCase::from)?;
    report_progress(0.02, "comparing the nominal model");
    let (train, holdout) = runs(&plant, loaded).map_err(|e| nominal_error(&e))?;
    let held_out = !holdout.is_empty();
    let compared = if held_out { holdout } else { train };
    let cut = windows(&plant, &compared, WINDOW);
    let free = RobotRuns { whole: &compared, windows: &cut };
    let before = free.run(&plant, &nominal).map_err(|e| nominal_error(&e))?;
    report_progress(0.5 * SEARCHED, "weighing every cause by the innovations");
    let searched = match options.capped {
        true => Err("a grave finding permits no conclusion".to_owned()),
        false => search_case(loaded).map_err(|e| e.to_string()),
    };
    report_progress(0.85, "running freely what was decided");
    let mut notes = if held_out { Vec::new() } else { vec![NO_HOLDOUT.into()] };
    let mut claimed = evidence_claims::EvidenceClaims::default();
    let names = RobotNames { case, plant: &plant, nominal: &nominal };
    let (mut tuned, mut after) = (None, None);
    match &searched {
        Err(why) => claimed.not_compared = Some(why.clone()).filter(|_| !options.capped),
        Ok(found) => {
            let simulated = |effect: &FoundEffect| {
                let (plant, values) = names.with(found, effect)?;
                free.run(&plant, &values)
            };
            if found.judged.verdict != EvidenceVerdict::NoGap {
                match simulated(&found.alone) {
                    Ok(run) => tuned = Some(run),
                    Err(e) => notes.push(format!("the refitted model cannot be simulated: {e}")),
                }
            }
            claimed = evidence_claims::reported(&names, found);
            if let Some(chosen) = evidence_claims::chosen(found) {
                match simulated(chosen) {
                    Ok(run) => after = Some(run),
                    Err(why) => notes.push(format!(
                        "the gap after is that of the refitted model, as what was found is not simulated: {why}"
                    )),
                }
            }
        }
    }
    let tuned = tuned.as_ref().unwrap_or(&before);
    let after = after.as_ref().unwrap_or(tuned);
    let whole = traces(&compared, loaded, [&before.whole, &tuned.whole, &after.whole]);
    let windowed = traces(&cut, loaded, [&before.windows, &tuned.windows, &after.windows]);
    let unit = |channel: &str| plant.output(channel).map_or("", |k| plant.outputs()[k].unit).to_owned();
    let gap = gap_report([&whole, &[]], Some((WINDOW, windowed.as_slice())), options.seed, &unit);
    let refused = !claimed.effects.is_empty() && !as_well(&ratios(&after.windows, &tuned.windows));
    if refused {
        notes.push(format!(
            "over windows of {WINDOW} s what explains the recordings for fitting predicts those held out worse than the refitted model: nothing is claimed"
        ));
        claimed = claimed.refused();
    }
    notes.push("values are those of the comparison of causes, without intervals".into());
    if options.watch {
        notes.push("--watch is for joints and planar arms: where a robot departs is not looked for".into());
    }
    let mut diagnosis = evidence_claims::diagnosis(case, claimed, gap, options.capped, notes);
    let mut augmented = None;
    if let (Ok(found), false) = (&searched, options.capped) {
        let chosen = evidence_claims::chosen(found).filter(|_| !refused);
        if let Ok((with, values)) = names.with(found, chosen.unwrap_or(&found.alone)) {
            let of_case = chosen.map(|_| case.name());
            let packed = PackedModel { case: of_case, ..PackedModel::of(&with, &values).of_case(case) };
            diagnosis.pack = Some(packed);
            let claim = |c: &FoundCause| (c.id.to_owned(), c.place.clone(), names.joint(c));
            augmented = chosen.map(|h| AugmentedModel {
                effects: with.structure().effects.clone(),
                flexible: with.structure().flexible.clone(),
                fixed_base: with.structure().fixed_base,
                values: with.parameters().iter().map(|q| q.name.clone()).zip(values).collect(),
                claims: h.causes.iter().map(claim).collect(),
                payload: None,
            });
        }
    }
    let record = searched.as_ref().ok().map(|found| evidence_claims::record(&names, found, &diagnosis.gap));
    report_progress(1.0, "done");
    let channels: std::collections::BTreeSet<&str> =
        compared.iter().flat_map(|r| &r.channels).map(|c| c.name.as_str()).collect();
    let floors = channels.into_iter().filter_map(|c| floor::output(loaded, c)).collect();
    let picture = (!options.verdict_only).then(|| Picture { floors, ..Picture::default() });
    Ok(Diagnosed {
        diagnosis,
        picture,
        next: None,
        traces: whole,
        twists: Vec::new(),
        flexible: plant.structure().flexible.clone(),
        augmented,
        began: Vec::new(),
        record,
    })
}
