//! What is reported after a grave finding where the nominal model cannot be simulated: no gap, for nothing can be compared.

use trueup_signals::Loaded;

use super::{DiagnoseError, DiagnoseOptions, Diagnosed};
use crate::engine::decide::Decision;
use crate::engine::recordings::PreparedCase;
use crate::finite;
use crate::outcome::{Diagnosis, GapLocation, GapReport, NoticedMistake, SCHEMA, UnknownShare};
use crate::picture::{isolability, picture};

/// The verdict `unknown` without a gap instead of an error of the simulation, or of figures that are not finite.
///
/// # Errors
/// What has another reason than that the model cannot be simulated.
pub(super) fn in_place_of(
    found: Result<Diagnosed, DiagnoseError>,
    loaded: &Loaded,
    case: &PreparedCase,
    noticed: Vec<NoticedMistake>,
    options: &DiagnoseOptions,
) -> Result<Diagnosed, DiagnoseError> {
    match found {
        Ok(found) => match finite::check(&found.diagnosis) {
            Ok(()) => Ok(found),
            Err(why) => Ok(without_gap(loaded, case, noticed, options, &why.to_string())),
        },
        Err(DiagnoseError::Nominal(why)) => Ok(without_gap(loaded, case, noticed, options, &why)),
        Err(e) => Err(e),
    }
}

fn without_gap(
    loaded: &Loaded,
    case: &PreparedCase,
    noticed: Vec<NoticedMistake>,
    options: &DiagnoseOptions,
    why: &str,
) -> Diagnosed {
    let nothing = Decision::nothing();
    let diagnosis = Diagnosis {
        schema: SCHEMA.into(),
        model: loaded.case.model.clone(),
        verdict: nothing.verdict,
        gap: GapReport::default(),
        sensors: (&isolability(loaded, &case.subject)).into(),
        location: GapLocation::default(),
        effects: Vec::new(),
        candidates: Vec::new(),
        parameters: Default::default(),
        correlation: None,
        budget: Vec::new(),
        pack: None,
        indistinguishable: Vec::new(),
        unknown: UnknownShare { present: true, probability: nothing.unknown, place: None },
        next_experiment: None,
        watch: None,
        augmented: None,
        capped: true,
        not_compared: None,
        findings: noticed,
        inputs: None,
        notes: vec![format!(
            "there is no gap, for the nominal model cannot be compared with the recordings as they are: {why}"
        )],
    };
    Diagnosed {
        diagnosis,
        picture: (!options.verdict_only).then(|| picture(loaded, &case.subject, &case.nominal)),
        next: None,
        traces: Vec::new(),
        twists: Vec::new(),
        flexible: case.subject.flexible.clone(),
        augmented: None,
        began: Vec::new(),
        record: None,
    }
}
