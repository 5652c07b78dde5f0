//! The experiment that would decide.

use trueup_diagnosis::outcome::Diagnosis;

use super::evidence::Evidence;
use super::words::told_by;
use crate::chart::Chart;
use crate::page::Page;

/// Why, and its inputs.
pub(super) fn next(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    let Some(n) = &d.next_experiment else { return };
    page.section("Next experiment", "");
    page.text(&format!("{}{} Its inputs: {}.", n.why, told_by(n), n.input));
    for (name, unit, time, values) in &e.next {
        page.chart(&Chart::over_time(name, unit).line(name, time, values));
    }
}
