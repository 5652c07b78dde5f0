//! The files of a diagnosis but its FMUs.

use trueup_diagnosis::diagnose::{Diagnosed, began, record};
use trueup_diagnosis::experiment;
use trueup_signals::Loaded;

use super::made_from::{self, DiagnosisRun};
use super::replay;

/// A file that cannot be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DiagnosisFileError {
    /// Name of the file.
    pub file: &'static str,
    /// What is wrong.
    pub what: String,
}

const PAGE: &str = "report.html";
const RESULT: &str = "diagnosis.json";

/// Names and contents; nothing is simulated or fitted.
///
/// # Errors
/// A figure that is not finite, or a file that cannot be written down.
pub fn diagnosis_files(
    loaded: &Loaded,
    found: &Diagnosed,
    run: &DiagnosisRun<'_>,
) -> Result<Vec<(String, Vec<u8>)>, DiagnosisFileError> {
    let failed = |file: &'static str| {
        move |e: &dyn std::fmt::Display| DiagnosisFileError { file, what: e.to_string() }
    };
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut add = |file: &'static str, bytes: Result<Vec<u8>, std::io::Error>| {
        files.push((file.to_owned(), bytes.map_err(|e| failed(file)(&e))?));
        Ok::<_, DiagnosisFileError>(())
    };
    if found.picture.is_some() {
        if !found.began.is_empty() {
            add(began::FILE, began::csv(&found.began))?;
        }
        if let (Some(csv), true) = (replay::csv(loaded, found), found.augmented.is_some()) {
            add(replay::FILE, csv)?;
        }
    }
    if let Some(next) = &found.next {
        add(experiment::FILE, experiment::csv(&next.inputs))?;
    }
    if let Some(picture) = &found.picture {
        let decided = found.record.is_some().then(|| record::FILE.to_owned());
        let others = files.iter().map(|f| f.0.clone());
        let beside =
            [RESULT.to_owned()].into_iter().chain(decided).chain(run.fmus.iter().cloned()).chain(others);
        let page = made_from::page(loaded, found, picture, beside.collect(), run);
        finite_words(&page).map_err(|e| failed(PAGE)(&e))?;
        files.push((PAGE.into(), page.into_bytes()));
    }
    if let Some(record) = &found.record {
        let record = serde_json::to_vec(record).map_err(|e| failed(record::FILE)(&e))?;
        files.push((record::FILE.into(), record));
    }
    let result = serde_json::to_string_pretty(&found.diagnosis).map_err(|e| failed(RESULT)(&e))?;
    files.push((RESULT.into(), (result + "\n").into_bytes()));
    Ok(files)
}

/// The first figure of a page's text that is not finite. Samples of its charts are `null` then.
fn finite_words(page: &str) -> Result<(), String> {
    // The scripts of the charts come last.
    let text = page.split("<!-- uPlot").next().unwrap_or(page);
    let cells = text.split('<').filter_map(|part| part.split_once('>').map(|p| p.1));
    let words = cells
        .flat_map(|cell| cell.split(|c: char| !(c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | '/'))));
    match words.into_iter().find(|w| matches!(*w, "NaN" | "inf" | "-inf")) {
        Some(word) => Err(format!("a figure is {word}")),
        None => Ok(()),
    }
}
