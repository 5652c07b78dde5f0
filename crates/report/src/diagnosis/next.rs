//! The experiment that would tell.

use trueup_diagnosis::outcome::Diagnosis;

use super::Evidence;
use super::words::{effect_name, list, percent};
use crate::chart::Chart;
use crate::page::Page;

/// Why, and its inputs.
pub(super) fn next(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    let Some(n) = &d.next_experiment else { return };
    page.section("Next experiment", "");
    let names: Vec<String> = n.separates.iter().map(|id| effect_name(id).to_owned()).collect();
    let chance = n
        .probability
        .map_or_else(String::new, |p| format!(" Predicted to tell with probability {}.", percent(p)));
    let apart =
        if names.is_empty() { String::new() } else { format!(" It tells apart {}.", list(&names, "and")) };
    page.text(&format!("{}{apart}{chance} Its inputs: {}.", n.why, n.input));
    for (name, unit, time, values) in &e.next {
        page.chart(&Chart::over_time(name, unit).line(name, time, values));
    }
}
