//! When recordings held out part from a model of healthy ones.

use trueup_diagnosis::outcome::Diagnosis;

use super::words::at;
use crate::number::number;
use crate::page::Page;

/// One row a departure; nothing where none was looked for.
pub(super) fn watch(page: &mut Page, d: &Diagnosis) {
    let Some(found) = &d.watch else { return };
    page.section(
        "When",
        "The recordings for fitting are taken to be healthy. Where one that is held out misses more of the fitted model's \
         accelerations than any of those does, over a few samples, it parts from the model: from where that first reaches half of \
         its height to where it last does.",
    );
    if found.is_empty() {
        page.text("What is held out parts from the model nowhere by more than what is healthy does.");
        return;
    }
    let rows: Vec<Vec<String>> = found
        .iter()
        .map(|w| {
            let like = w
                .like
                .as_ref()
                .map_or_else(String::new, |l| format!("{} {} more of {}", number(l.value), l.unit, l.input));
            let time = |t: f64| format!("{t:.4}");
            vec![w.recording.clone(), time(w.start), time(w.end), at(d, &w.component, w.joint), like]
        })
        .collect();
    page.table(&["recording", "from, s", "to, s", "where", "as would do"], &rows);
}
