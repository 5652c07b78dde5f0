//! What the gap before is made of. Gaps do not add, their squares do.

use std::fmt::Write as _;

use trueup_diagnosis::outcome::{Diagnosis, ErrorPart, NOISE, PARAMETERS, TOGETHER, UNEXPLAINED};

use super::words::{at, effect_name, percent, size};
use crate::page::{Page, escape};

/// A part in words.
fn name(d: &Diagnosis, p: &ErrorPart) -> String {
    match p.part.as_str() {
        PARAMETERS => "your values of the model's own parameters".to_owned(),
        TOGETHER => "parameters and effects together".to_owned(),
        NOISE => "the sensors' noise".to_owned(),
        UNEXPLAINED => "left unexplained".to_owned(),
        id => match &p.component {
            Some(component) => format!("{} ({})", effect_name(id), at(d, component, p.joint)),
            None => effect_name(id).to_owned(),
        },
    }
}

/// Of the page's palette: parameters, noise and what is left as in the gaps, effects one after the other.
fn colour(p: &ErrorPart, effects: &mut usize) -> usize {
    match p.part.as_str() {
        PARAMETERS => 4,
        NOISE => 7,
        UNEXPLAINED => 1,
        _ => {
            *effects += 1;
            [2, 5, 3, 0, 6][(*effects - 1) % 5]
        }
    }
}

/// As a bar and a table.
pub(super) fn budget(page: &mut Page, d: &Diagnosis) {
    let (Some(overall), false) = (&d.gap.overall, d.budget.is_empty()) else { return };
    page.html("<h3>Error budget: what the gap before is made of</h3>");
    page.text(
        "Each part is taken out of the complete model, the others staying as they are: an effect is removed, or your values of the \
         parameters are restored. What the model then misses in addition is that part's. Gaps do not add, their squares do, so the \
         square of the gap before is divided: noise and what is left unexplained first, the rest in proportion to these additions.",
    );
    if overall.after > overall.before {
        page.text("Here the gap after is larger than the gap before, so nothing of it is explained.");
    } else if d.budget.iter().any(|p| p.part == TOGETHER) {
        page.text(
            "Here the free runs of whole recordings miss no more without any single part, so parameters and effects have one share; \
             the figures over windows show what the model gains.",
        );
    }
    let mut effects = 0;
    let mut bar = String::new();
    let mut legend = String::new();
    for p in &d.budget {
        let (what, colour) = (escape(&name(d, p)), colour(p, &mut effects));
        let share = 100.0 * p.share;
        let _ = write!(legend, "<li><i class=\"c{colour}\"></i>{what}</li>");
        if share > 0.0 {
            let _ = write!(
                bar,
                "<i class=\"c{colour}\" style=\"width:{share:.2}%\" title=\"{what}: {share:.1} %\"></i>"
            );
        }
    }
    page.html(&format!("<ul class=\"legend\">{legend}</ul>"));
    page.html(&format!(
        "<table class=\"bars\"><tbody>\n<tr><th scope=\"row\">overall</th><td class=\"bar stack\">{bar}</td>\
         <td class=\"number\">{}</td></tr></tbody></table>",
        escape(&size(overall.before))
    ));
    let row = |p: &ErrorPart| {
        let without = p.gap_without.map_or_else(|| "–".to_owned(), size);
        vec![name(d, p), without, percent(p.share)]
    };
    let whole = ["together: the gap before".to_owned(), size(overall.before), percent(1.0)];
    let rows: Vec<Vec<String>> = d.budget.iter().map(row).chain([whole.to_vec()]).collect();
    page.table(&["part", "gap of the complete model without it", "share of the square"], &rows);
}
