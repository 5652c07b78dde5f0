//! Candidates, and which of them were not distinguished.

use trueup_diagnosis::outcome::{CandidateCause, Diagnosis, Verdict};

use super::bars::{Bar, bars};
use super::words::{LEAST_SHARE, at, effect_name, list, percent, size};
use crate::number::number;
use crate::page::{Page, escape};

/// Candidates beyond these are not worth a row.
const CANDIDATES: usize = 15;

/// What was looked at.
pub(super) fn candidates(page: &mut Page, d: &Diagnosis) {
    if d.candidates.is_empty() {
        return;
    }
    page.section(
        "Which",
        "Each candidate was added to the model by itself, the best ones with everything fitted again. Evidence is the logarithm of its odds against \
         nothing added, on the recordings for fitting; the gap is on the others. Candidates for one cause share one \
         probability with none of these; causes that are there together have each their own.",
    );
    let claimed = |c: &CandidateCause| d.effects.iter().any(|e| e.id == c.id && e.joint == c.joint);
    let shown = d.candidates.iter().take(CANDIDATES);
    let row = |label: String, probability: f64, colour: usize| Bar {
        label,
        length: probability,
        figure: percent(probability),
        colour,
    };
    let name = |c: &CandidateCause| format!("{} ({})", effect_name(&c.id), at(d, &c.component, c.joint));
    let mut rows: Vec<Bar> = shown
        .clone()
        .filter(|c| c.probability >= LEAST_SHARE)
        .map(|c| row(name(c), c.probability, if claimed(c) { 2 } else { 7 }))
        .collect();
    let gap = d.verdict != Verdict::NoGap;
    if gap && (d.unknown.present || d.unknown.probability >= LEAST_SHARE) {
        rows.push(row(
            "none of these: a cause that no known effect explains".into(),
            d.unknown.probability,
            1,
        ));
    }
    if gap && rows.is_empty() {
        page.text("None of them has a probability of 5 % or more.");
    }
    bars(page, "Probability", &rows);
    page.html("<details><summary>Evidence, candidate by candidate</summary>");
    let rows: Vec<Vec<String>> = shown
        .map(|c| {
            let gap = c.holdout_gap.map_or_else(|| "not run".to_owned(), size);
            vec![c.id.clone(), at(d, &c.component, c.joint), percent(c.probability), number(c.evidence), gap]
        })
        .collect();
    page.table(&["candidate", "where", "probability", "log evidence", "held-out gap"], &rows);
    if d.candidates.len() > CANDIDATES {
        page.text(&format!("And {} more with less: see diagnosis.json.", d.candidates.len() - CANDIDATES));
    }
    page.html("</details>");
}

/// Causes that were not distinguished, and what the sensors can distinguish.
pub(super) fn told_apart(page: &mut Page, d: &Diagnosis) {
    let structural = !d.sensors.classes.is_empty() || !d.sensors.hidden.is_empty();
    if d.indistinguishable.is_empty() && !structural {
        return;
    }
    let open = !d.indistinguishable.is_empty();
    page.section(if open { "Causes not distinguished" } else { "What these sensors can distinguish" }, "");
    if !d.indistinguishable.is_empty() {
        page.text("Of each of these sets one is there, and these recordings do not show which:");
        let items = d.indistinguishable.iter().map(|set| {
            let names: Vec<String> = set.iter().map(|id| effect_name(id).to_owned()).collect();
            format!("<li>{}</li>", escape(&list(&names, "or")))
        });
        page.html(&format!("<ul>{}</ul>", items.collect::<String>()));
    }
    if structural {
        if open {
            page.html("<h3>What these sensors can distinguish</h3>");
        }
        page.text(
            "What the equations alone allow with these channels, before anything is compared: components in one class can only \
             be distinguished by the form of an effect, as long as nothing else is missing.",
        );
        let row = |c: &[String], what: &str| vec![c.join(", "), what.to_owned()];
        let apart = |c: &Vec<String>| {
            row(
                c,
                if c.len() > 1 { "only by the form of an effect" } else { "distinguished from all others" },
            )
        };
        let mut rows: Vec<Vec<String>> = d.sensors.classes.iter().map(apart).collect();
        if !d.sensors.hidden.is_empty() {
            rows.push(row(&d.sensors.hidden, "in no balance of measured quantities"));
        }
        page.table(&["component", "by structure"], &rows);
    }
}
