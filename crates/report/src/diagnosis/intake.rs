//! What the diagnosis was made from.

use trueup_diagnosis::outcome::{Diagnosis, NoticedMistake, OutcomeSeverity};

use super::evidence::Evidence;
use crate::page::{Page, escape};

/// Digits of a hash that distinguish files at a glance.
const DIGITS: usize = 12;
/// Findings that are shown next to the verdict.
const MOST: usize = 8;

/// The card.
pub(super) fn intake(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    let i = &e.intake;
    let nothing = i.recordings.is_empty() && i.assumptions.is_empty() && i.command.is_empty();
    if nothing && d.findings.is_empty() && d.notes.is_empty() && d.inputs.is_none() {
        return;
    }
    page.section("What it was made from", "");
    let list = |page: &mut Page, title: &str, items: &[String]| {
        if !items.is_empty() {
            let items: String = items.iter().map(|i| format!("<li>{}</li>", escape(i))).collect();
            page.html(&format!("<h3>{title}</h3><ul>{items}</ul>"));
        }
    };
    let notes = d.findings.iter().filter(|f| f.severity == OutcomeSeverity::Note || d.findings.len() > MOST);
    let findings: Vec<String> = notes.map(said).collect();
    list(page, "Noticed", &findings.into_iter().chain(d.notes.iter().cloned()).collect::<Vec<_>>());
    let hash = |name: &str| {
        let hash = d.inputs.as_ref().and_then(|i| i.files.get(name)).map_or("", String::as_str);
        hash.get(..DIGITS).unwrap_or_default().to_owned()
    };
    if !i.recordings.is_empty() {
        page.html("<h3>Recordings</h3>");
        let rows: Vec<Vec<String>> = i
            .recordings
            .iter()
            .map(|r| {
                let channels = r.channels.to_string();
                vec![
                    r.name.clone(),
                    r.role.clone(),
                    r.duration.clone(),
                    r.rate.clone(),
                    channels,
                    hash(&r.name),
                ]
            })
            .collect();
        page.table(&["recording", "used for", "length", "readings", "channels", "SHA-256 begins"], &rows);
    }
    if !i.channels.is_empty() {
        page.html("<details><summary>Channels</summary>");
        let rows: Vec<Vec<String>> = i.channels.iter().map(|c| c.to_vec()).collect();
        page.table(&["channel", "unit", "for the model", "known of it"], &rows);
        page.html("</details>");
    }
    list(page, "Assumed", &i.assumptions);
    if !i.command.is_empty() {
        page.html(&format!("<h3>Command</h3><p><code>{}</code></p>", escape(&i.command)));
    }
    if let Some(inputs) = &d.inputs {
        page.html(&format!(
            "<p>All files read ({}) have the SHA-256 <code>{}</code>; diagnosis.json has that of each.</p>",
            inputs.files.len(),
            escape(&inputs.sha256)
        ));
    }
}

/// What may make figures wrong is seen at once, next to the verdict.
pub(super) fn doubts(page: &mut Page, d: &Diagnosis) {
    let bad: Vec<&NoticedMistake> =
        d.findings.iter().filter(|f| f.severity != OutcomeSeverity::Note).collect();
    if bad.is_empty() {
        return;
    }
    let (shown, rest) = bad.split_at(bad.len().min(MOST));
    let mut items: String = shown.iter().map(|f| format!("<li>{}</li>", escape(&said(f)))).collect();
    if !rest.is_empty() {
        items += &format!("<li>... and {} more: see diagnosis.json</li>", rest.len());
    }
    page.html(&format!("<p>What was noticed and may make figures wrong:</p><ul>{items}</ul>"));
}

/// `warning: train-1.csv:12: loadAngle: ...`
fn said(f: &NoticedMistake) -> String {
    let severity = match f.severity {
        OutcomeSeverity::Grave => "grave",
        OutcomeSeverity::Warning => "warning",
        OutcomeSeverity::Note => "note",
    };
    let line = f.line.map_or_else(String::new, |line| format!(":{line}"));
    let channel = f.channel.as_ref().map_or_else(String::new, |c| format!(" {c}:"));
    format!("{severity}: {}{line}:{channel} {}", f.file, f.text)
}
