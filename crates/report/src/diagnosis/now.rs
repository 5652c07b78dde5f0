//! What to do now: for the user who has to decide, before any figure.

use trueup_diagnosis::diagnose::{began, record};
use trueup_diagnosis::outcome::{Diagnosis, NO_HOLDOUT, Verdict};
use trueup_diagnosis::words::check;

use super::evidence::Evidence;
use super::shell::command_line;
use super::words::{effect_name, list, sets, told_by};
use crate::page::{Page, escape};

/// Use, check, record, files.
pub(super) fn now(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    page.section("What to do now", "");
    let mut html = String::from("<dl class=\"now\">\n");
    for (what, items) in
        [("Use", usage(d, e)), ("Check on the rig", checks(d)), ("Record next", record_next(d))]
    {
        if !items.is_empty() {
            let items: String = items.iter().map(|i| format!("<dd>{i}</dd>\n")).collect();
            html += &format!("<dt>{what}</dt>\n{items}");
        }
    }
    let files = files(d, e);
    if !files.is_empty() {
        html += &format!("<dt>Files next to this page</dt>\n<dd>{}</dd>\n", files.join(", "));
    }
    page.html(&(html + "</dl>"));
}

/// A file in the same folder. What could lead elsewhere is no link.
fn link(file: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "+-_.".contains(c);
    match file.chars().all(plain) && !file.starts_with('.') {
        true => format!("<a href=\"./{0}\">{0}</a>", escape(file)),
        false => escape(file),
    }
}

fn code(text: &str) -> String {
    format!("<code>{}</code>", escape(text))
}

fn usage(d: &Diagnosis, e: &Evidence<'_>) -> Vec<String> {
    let augmented = d.augmented.iter().flatten();
    let newest = augmented.clone().find(|f| f.contains("fmi3")).or_else(|| augmented.clone().next());
    match (d.verdict, newest) {
        (Verdict::NoGap, _) => {
            vec![
                "The model as it is: it agrees with these recordings. Beyond their range nothing is proved."
                    .into(),
            ]
        }
        (Verdict::Parameters, _) => {
            let moved = d.parameters.iter().filter(|(_, a)| !a.hardly_moved());
            let moved: Vec<String> = moved.map(|(k, _)| code(k)).collect();
            let which = if moved.is_empty() { String::new() } else { format!(" ({})", moved.join(", ")) };
            vec![format!(
                "The refitted values of the model's own parameters{which}, next to yours under the verdict: put them into <code>[parameters]</code> \
                 of case.toml (lines to paste are below) and into your simulation. Nothing has to be added to the model."
            )]
        }
        (Verdict::Effects | Verdict::Ambiguous, Some(file)) => {
            let file = file.as_str();
            let files: Vec<String> = augmented.map(|f| link(f)).collect();
            let mut all = vec![
                format!(
                    "The augmented model, {}, in place of yours: the same inputs and outputs, with the effects in it and the refitted \
                     parameters as start values.",
                    list(&files, "or")
                ),
                format!(
                    "In the folder of this page, look at it with {}.",
                    code(&format!("trueup fmu info {file}"))
                ),
            ];
            if let Some(replay) = &e.replay {
                let options = replay.iter().map(String::as_str);
                let run = ["trueup", "simulate", file].into_iter().chain(options).chain(["-o", "run.csv"]);
                all.push(format!(
                    "There, run it along the first recording of this page, with its inputs and first states: {} (or in any tool that \
                     imports FMUs).",
                    code(&command_line(run))
                ));
            }
            if d.verdict == Verdict::Ambiguous {
                all.push(
                    "It has the likeliest member of each set in it. Within motions like those recorded the others would do as well; \
                     beyond them do not rely on it before one member has been identified."
                        .into(),
                );
            }
            all
        }
        (Verdict::Unknown, _) => {
            vec![
                "Nothing was added to the model: use it only where its error, shown below, does not matter."
                    .into(),
            ]
        }
        _ => Vec::new(),
    }
}

fn checks(d: &Diagnosis) -> Vec<String> {
    if d.capped {
        return vec!["The findings about the recordings, listed under the verdict: correct them first and diagnose again.".into()];
    }
    // The reason why causes were not compared is in the verdict: it is no matter of the rig.
    if d.not_compared.is_some() {
        return Vec::new();
    }
    let of =
        |id: &str| check(id).map(|check| format!("<b>{}</b>: {}", escape(effect_name(id)), escape(check)));
    let mut seen = Vec::new();
    let claimed = sets(d).into_iter().flatten().filter_map(|e| {
        let new = !seen.contains(&e.id);
        seen.push(e.id.clone());
        new.then(|| of(&e.id)).flatten()
    });
    let claimed: Vec<String> = claimed.collect();
    match d.verdict {
        Verdict::Unknown => {
            let place = d.unknown.place.as_deref().or(d.location.components.first().map(|c| c.id.as_str()));
            let mut all = vec![match place {
                Some(place) => format!(
                    "What acts at <b>{}</b> that the model does not contain; begin there.",
                    escape(place)
                ),
                None => "What acts on the rig that the model does not contain.".to_owned(),
            }];
            if let Some(i) = d.location.intervals.first() {
                all.push(format!(
                    "What happened in {} from {:.1} s to {:.1} s, where most of it shows.",
                    escape(&i.recording),
                    i.start,
                    i.end
                ));
            }
            all
        }
        Verdict::Parameters => {
            vec![
                "Whether the refitted values are possible: weigh, measure or look up what moved most.".into(),
            ]
        }
        _ => claimed,
    }
}

fn record_next(d: &Diagnosis) -> Vec<String> {
    let mut all = Vec::new();
    if let Some(n) = &d.next_experiment {
        all.push(format!("{} {}: {}", link(&n.input), escape(&n.why), escape(&told_by(n))));
    }
    let hint = d.notes.iter().any(|n| n == NO_HOLDOUT);
    if hint {
        all.push("One more run for <code>holdout</code> in case.toml: without it nothing shows that the fit holds elsewhere.".into());
    }
    if all.is_empty() {
        all.extend(match d.verdict {
            Verdict::Effects => Some("A new run, faster or larger than these, to see whether the augmented model holds there.".into()),
            Verdict::Unknown => {
                Some("The same motion again, slower and faster, and one quantity more: another sensor at the place with the largest share.".into())
            }
            _ => None,
        });
    }
    all
}

fn files(d: &Diagnosis, e: &Evidence<'_>) -> Vec<String> {
    let mut all: Vec<String> = e.files.iter().map(|f| link(f)).collect();
    if all.is_empty() {
        let said = d.augmented.iter().flatten().map(String::as_str);
        let next = d.next_experiment.iter().map(|n| n.input.as_str());
        let began = d.augmented.iter().map(|_| began::FILE);
        all = ["diagnosis.json", record::FILE]
            .into_iter()
            .chain(said)
            .chain(next)
            .chain(began)
            .map(link)
            .collect();
    }
    all
}
