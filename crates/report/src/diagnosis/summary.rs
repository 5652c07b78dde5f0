//! The verdict, and what is claimed.

use std::collections::BTreeSet;

use trueup_diagnosis::outcome::{Claimed, Diagnosis, Verdict};

use super::sentence::sentence;
use super::summary_gap::SummaryGap;
use super::words::{at, at_bound, badge, effect_name, percent, sets, size, times, together};
use crate::page::{Page, escape};

/// The verdict, its figures, and what is claimed.
pub(super) fn summary(page: &mut Page, d: &Diagnosis) {
    page.section("Verdict", "");
    page.html(&format!(
        "<p class=\"verdict\"><b class=\"badge\">{}</b> {}</p>",
        badge(d.verdict),
        escape(&sentence(d))
    ));
    super::intake::doubts(page, d);
    if d.verdict == Verdict::Unknown && !d.capped && d.not_compared.is_none() {
        evidence(page, d);
    }
    if !d.effects.is_empty() {
        page.table(
            &["effect", "where", "probability", "closes alone"],
            &d.effects.iter().map(|e| row(d, e)).collect::<Vec<_>>(),
        );
    }
    for set in sets(d).iter().filter(|set| set.len() > 1) {
        let names: Vec<&str> = set.iter().map(|e| effect_name(&e.id)).collect();
        page.text(&format!(
            "A set: {}. One of its members is there with probability {}; each has its part of that.",
            names.join(" / "),
            percent(together(set))
        ));
    }
    for line in d.effects.iter().filter_map(|e| basis(d, &e.component, e.joint)).collect::<BTreeSet<_>>() {
        page.text(&line);
    }
    let bound = d.effects.iter().flat_map(|e| &e.parameters).chain(&d.parameters).any(|(_, a)| at_bound(a));
    if bound {
        page.text(
            "At the bound of the search: the best value is the bound, so it is no estimate; check whether the \
             recordings show the parameter at all, or whether something else is missing.",
        );
    }
}

/// An effect; its parameters have a table of their own.
fn row(d: &Diagnosis, e: &Claimed) -> Vec<String> {
    let alone = e.closed_alone.map_or_else(|| "–".to_owned(), |c| percent(c.clamp(0.0, 1.0)));
    vec![effect_name(&e.id).to_owned(), at(d, &e.component, e.joint), percent(e.probability), alone]
}

/// What speaks for something that has no name.
fn evidence(page: &mut Page, d: &Diagnosis) {
    let mut items = Vec::new();
    if let Some(g) = SummaryGap::of(d) {
        let floors =
            if g.floor > 0.0 { format!(", {} times it", times(g.tuned / g.floor)) } else { String::new() };
        items.push(format!(
            "Beyond noise: on {} the nominal model misses {}, refitted {}; noise alone leaves {}{floors}.",
            g.judged_on(d),
            size(g.before),
            size(g.tuned),
            size(g.floor)
        ));
    }
    let best = d.candidates.iter().max_by(|a, b| a.evidence.total_cmp(&b.evidence));
    if let Some(best) = best {
        items.push(format!(
            "Beyond what is known: of {} effects compared the best, {} ({}), gains {} nats over refitted parameters, not enough to be named.",
            d.candidates.len(),
            effect_name(&best.id),
            at(d, &best.component, best.joint),
            crate::number(best.evidence)
        ));
    }
    if let Some(place) = &d.unknown.place {
        items.push(format!("In one place: most of it shows at {place}."));
    }
    if items.is_empty() {
        return;
    }
    let list: String = items.iter().map(|i| format!("<li>{}</li>", escape(i))).collect();
    page.html(&format!("<p>What speaks for it:</p><ul>{list}</ul>"));
}

/// Whether the sensors distinguish a component from the others by structure, or only the form of the effect does.
fn basis(d: &Diagnosis, component: &str, joint: Option<usize>) -> Option<String> {
    let own =
        |name: &String| *name == component || joint.is_some_and(|j| *name == format!("{component}[{j}]"));
    let class = d.sensors.classes.iter().find(|c| c.iter().any(own))?;
    let others: Vec<&str> = class.iter().filter(|name| !own(name)).map(String::as_str).collect();
    let here = at(d, component, joint);
    Some(match others.is_empty() {
        true => format!(
            "Structural: these sensors distinguish {here} from every other component by the equations alone."
        ),
        false => format!(
            "Form-based: with these sensors {} would show in the same balances as {here}; the form of the effect distinguishes them.",
            others.join(", ")
        ),
    })
}
