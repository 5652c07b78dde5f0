//! A joint that is an FMU of others, from its case to a diagnosis.
//!
//! Causes are compared by the innovations of the FMU itself. The gap is that of free runs of the FMU: with nominal parameters, with
//! refitted ones, and with what was named acting through its inputs or on its outputs.

mod joint;
mod names;
mod runs;

use std::sync::Arc;

use trueup_hypotheses::innovations::findings::{CaseFindings, search_foreign};
use trueup_hypotheses::innovations::foreign::ForeignJoint;
pub use trueup_hypotheses::innovations::foreign::JointRoles;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_identification::fmu::FmuSubject;
use trueup_identification::model::NamedVariables;
use trueup_identification::recorded::runs_of;
use trueup_identification::subject::IdentificationSubject;
use trueup_plant::Plant;
use trueup_signals::{Loaded, SensorData};

use super::free_runs::traces;
use super::traces::gap_report;
use super::{DiagnoseError, DiagnoseOptions, Diagnosed, SEARCHED, evidence_claims};
use crate::floor;
use crate::outcome::*;
use crate::picture::Picture;
use names::ForeignNames;
pub use names::{ChannelVariable, NamedStart};
use runs::ForeignRuns;

/// A case with its FMU, whose ports are known.
#[derive(Debug)]
pub struct ForeignCase {
    /// Recordings, channels named as variables of the FMU.
    pub loaded: Loaded,
    /// The FMU with coordinates and forces.
    pub plant: Arc<dyn Plant>,
    /// The FMU along recordings.
    pub subject: FmuSubject,
    /// How its motions begin.
    pub starts: Vec<NamedStart>,
    /// What the joint's variables are.
    pub channels: Vec<ChannelVariable>,
    /// The same of its inputs and its gear; `None`: causes cannot be compared, for this reason.
    pub roles: Result<JointRoles, String>,
    /// Effects that cannot be inserted: id, `id:place`, or `id:sensor:channel`.
    pub refused: Vec<String>,
    /// The same in sentences, with the reason.
    pub unreached: Vec<String>,
    /// Why calls of the FMU failed; `None`: none did.
    pub failure: fn(&dyn Plant) -> Option<String>,
}

/// Diagnoses a joint through its FMU; `report_progress` hears how far it is (0 to 1) and what is being done.
///
/// # Errors
/// Recordings that cannot be compared, or an FMU that cannot be simulated.
pub fn diagnose_foreign(
    case: ForeignCase,
    options: &DiagnoseOptions,
    report_progress: &mut dyn FnMut(f64, &str),
) -> Result<Diagnosed, DiagnoseError> {
    let ForeignCase { loaded, plant, subject, starts, channels, roles, refused, unreached, failure } = case;
    let begins = starts.iter().filter_map(|start| start.of(&subject)).collect();
    let subject = subject.with_coordinates(begins);
    let nominal_error = |e: &dyn std::fmt::Display| DiagnoseError::Nominal(e.to_string());
    let nominal = subject.with_values(&subject.defaults(), &loaded.case.parameters);
    let nominal = nominal.map_err(|e| nominal_error(&e))?;
    report_progress(0.02, "comparing the nominal model");
    let (train, holdout) = runs_of(&subject, &loaded).map_err(|e| nominal_error(&e))?;
    let held_out = !holdout.is_empty();
    let free = ForeignRuns::new(subject, plant.clone(), if held_out { holdout } else { train });
    let before = free.run(&nominal, None).map_err(|e| nominal_error(&e))?;
    report_progress(0.5 * SEARCHED, "weighing every cause by the innovations");
    let searched = if options.capped {
        Err("a grave finding permits no conclusion".to_owned())
    } else {
        let found = roles.and_then(|roles| search(&loaded, &plant, &roles, &channels, refused));
        match failure(&*plant) {
            Some(why) => Err(format!("a call of the FMU failed: {why}")),
            None => found,
        }
    };
    report_progress(0.85, "running freely what was decided");
    let mut notes = if held_out { Vec::new() } else { vec![NO_HOLDOUT.into()] };
    let mut claimed = evidence_claims::EvidenceClaims::default();
    let (mut tuned, mut after) = (before.clone(), before.clone());
    match &searched {
        Err(why) => claimed.not_compared = Some(why.clone()).filter(|_| !options.capped),
        Ok((joint, usual_speed, found)) => {
            let naming =
                ForeignNames { case: &loaded.case, channels: &channels, joint, usual_speed: *usual_speed };
            if found.judged.verdict != EvidenceVerdict::NoGap {
                let theta = naming.values(&free.subject, &nominal, found, &found.alone);
                match free.run(&theta, None) {
                    Ok(run) => tuned = run,
                    Err(e) => notes.push(format!("the refitted model cannot be simulated: {e}")),
                }
            }
            after = tuned.clone();
            claimed = evidence_claims::reported(&naming, found);
            if let Some(chosen) = evidence_claims::chosen(found) {
                let theta = naming.values(&free.subject, &nominal, found, chosen);
                match free.with(&naming, &theta, chosen) {
                    Ok(run) => after = run,
                    Err(why) => notes.push(format!(
                        "the gap after is that of the refitted model, as {why} is not simulated through the ports"
                    )),
                }
            }
        }
    }
    let traces = traces(&free.runs, &loaded, [&before, &tuned, &after]);
    let unit = |channel: &str| {
        let at = free.subject.output(channel);
        at.map_or_else(String::new, |at| free.subject.outputs()[at].unit.to_owned())
    };
    let gap = gap_report([&traces, &[]], None, options.seed, &unit);
    notes.push(
        "causes were compared through the FMU and its ports; values are those of the comparison, without intervals".into(),
    );
    if options.watch {
        notes.push(
            "--watch takes models of this project only: where an FMU of others departs is not looked for"
                .into(),
        );
    }
    let estimated = |s: &SensorData| s.gain.is_some() || s.offset.is_some() || s.late.is_some();
    if loaded.recordings.values().flat_map(|r| &r.channels).any(|c| estimated(&c.sensor)) {
        notes.push("gains, offsets and delays that are estimated are in the comparison, not in the free runs of the gap".into());
    }
    notes.extend(unreached.iter().map(|what| format!("not compared: {what}")));
    let diagnosis = evidence_claims::diagnosis(&loaded.case, claimed, gap, options.capped, notes);
    let record = searched.as_ref().ok().map(|(joint, usual_speed, found)| {
        let naming =
            ForeignNames { case: &loaded.case, channels: &channels, joint, usual_speed: *usual_speed };
        evidence_claims::record(&naming, found, &diagnosis.gap)
    });
    report_progress(1.0, "done");
    let floors = free.runs.iter().flat_map(|r| &r.channels).map(|c| c.name.as_str());
    let floors: std::collections::BTreeSet<&str> = floors.collect();
    let floors = floors.into_iter().filter_map(|c| floor::output(&loaded, c)).collect();
    let picture = (!options.verdict_only).then(|| Picture { floors, ..Picture::default() });
    Ok(Diagnosed {
        diagnosis,
        picture,
        next: None,
        traces,
        twists: Vec::new(),
        flexible: Vec::new(),
        augmented: None,
        began: Vec::new(),
        record,
    })
}

/// The joint, and what the innovations show of it; or why they cannot.
fn search(
    loaded: &Loaded,
    plant: &Arc<dyn Plant>,
    roles: &JointRoles,
    channels: &[ChannelVariable],
    refused: Vec<String>,
) -> Result<(ForeignJoint, f64, CaseFindings), String> {
    let named = joint::named(loaded, channels);
    let (joint, usual_speed) = joint::joint(&named, plant, roles, refused)?;
    let found = search_foreign(&named, &joint).map_err(|e| e.to_string())?;
    Ok((joint, usual_speed, found))
}
