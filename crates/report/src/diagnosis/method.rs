//! How it was done.

use trueup_diagnosis::diagnose::began;
use trueup_diagnosis::outcome::Diagnosis;

use super::evidence::Evidence;
use crate::page::Page;

/// Settings and versions.
pub(super) fn method(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    page.section(
        "Method and settings",
        "Parameters first: can refitting the model's own parameters, within their prior standard deviations, explain the gap? Then every effect of \
         the library by a score test, the survivors by output-error refits with all nuisance parameters, chosen by evidence and \
         by held-out prediction together; probabilities are calibrated on trials with sealed truth.",
    );
    if !e.floors.is_empty() {
        page.html("<h3>Noise floor</h3>");
        page.table(
            &["channel", "standard deviation", "from"],
            &e.floors.iter().map(|r| r.to_vec()).collect::<Vec<_>>(),
        );
    }
    let pairs = |rows: &[[String; 2]]| rows.iter().map(|r| r.to_vec()).collect::<Vec<_>>();
    if !e.settings.is_empty() {
        page.html("<h3>Settings</h3>");
        page.table(&["setting", "value"], &pairs(&e.settings));
    }
    if let Some(files) = &d.augmented {
        let files = files.join(", ");
        page.text(&format!("The augmented model: {files}. Where its free runs began: {}.", began::FILE));
    }
    let mut versions = vec![["format".to_owned(), d.schema.clone()]];
    versions.extend(e.versions.iter().cloned());
    page.html("<h3>Versions</h3>");
    page.table(&["what", "version"], &pairs(&versions));
}
