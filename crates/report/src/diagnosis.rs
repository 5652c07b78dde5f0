//! The page of a diagnosis: for a project lead in a minute, for an expert to the bottom.

mod bars;
mod budget;
mod evidence;
mod far;
mod files;
mod intake;
mod made_from;
mod maps;
mod method;
mod motion;
mod next;
mod now;
mod paste;
mod place;
mod replay;
mod sentence;
mod series;
mod shell;
mod summary;
mod summary_gap;
mod watch;
mod which;
mod words;
mod yours;

use trueup_diagnosis::outcome::{Diagnosis, Verdict};

use crate::page::Page;

pub use evidence::{Evidence, EvidenceMap, EvidenceTrace, IntakeEvidence, RecordingEvidence};
pub use files::{DiagnosisFileError, diagnosis_files};
pub use made_from::DiagnosisRun;
pub use sentence::sentence;
pub use shell::command_line;
pub use words::effect_name;

/// `report.html` of a diagnosis: one file that needs no network, and no script to be read.
pub fn diagnosis_page(diagnosis: &Diagnosis, evidence: &Evidence<'_>) -> String {
    let title = match evidence.case {
        "" => format!("Diagnosis of {}", diagnosis.model),
        case => format!("Diagnosis of {case}"),
    };
    let lead = format!(
        "What separates the simulation by {} from its recordings, and what to do about it.",
        diagnosis.model
    );
    let mut page = Page::new(&title, &lead);
    page.contents();
    summary::summary(&mut page, diagnosis);
    yours::table(&mut page, diagnosis);
    if let Some(scene) = &evidence.scene {
        page.section(
            "Motion",
            "What was measured, and the simulations laid over it. What the diagnosis names is lit.",
        );
        page.scene("", scene);
    }
    now::now(&mut page, diagnosis, evidence);
    paste::lines(&mut page, diagnosis);
    far::gap(&mut page, diagnosis);
    place::location(&mut page, diagnosis);
    watch::watch(&mut page, diagnosis);
    // What has no name is to be seen; elsewhere the pictures back the name.
    let nameless = diagnosis.verdict == Verdict::Unknown;
    if nameless {
        maps::maps(&mut page, diagnosis, evidence);
    }
    which::candidates(&mut page, diagnosis);
    which::told_apart(&mut page, diagnosis);
    next::next(&mut page, diagnosis, evidence);
    series::series(&mut page, diagnosis, evidence);
    if !nameless {
        maps::maps(&mut page, diagnosis, evidence);
    }
    intake::intake(&mut page, diagnosis, evidence);
    method::method(&mut page, diagnosis, evidence);
    page.finish()
}

/// The gaps of a diagnosis and a channel of it, for a page that shows more than one.
pub fn diagnosis_pictures(page: &mut Page, diagnosis: &Diagnosis, trace: Option<&EvidenceTrace<'_>>) {
    far::overall(page, diagnosis);
    if let Some(trace) = trace {
        series::trace(page, diagnosis, trace);
    }
}
