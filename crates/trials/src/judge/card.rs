//! The scorecard as Markdown.

use std::fmt::Write as _;
use std::path::Path;

use super::score::{Card, ScoreTarget, ScorecardLine};
use crate::error::TrialError;
use crate::files;

fn figure(line: &ScorecardLine) -> String {
    let Some(value) = line.value else { return "-".into() };
    match line.share {
        Some(s) => {
            let [low, high] = s.interval().unwrap_or([0.0, 1.0]);
            format!(
                "{:.1} % ({}/{}; {:.1} to {:.1} %)",
                100.0 * value,
                s.hits,
                s.of,
                100.0 * low,
                100.0 * high
            )
        }
        None => format!("{value:.3}"),
    }
}

fn wanted(line: &ScorecardLine) -> String {
    let number = |x: f64| {
        if line.share.is_some() { format!("{} %", (1000.0 * x).round() / 10.0) } else { x.to_string() }
    };
    match line.aim {
        ScoreTarget::Least(a, b) => format!("at least {}, {}", number(a), number(b)),
        ScoreTarget::Most(a, b) => format!("at most {}, {}", number(a), number(b)),
        ScoreTarget::Within(a, b) => format!("{} to {}", number(a), number(b)),
        ScoreTarget::Told => String::new(),
    }
}

/// The scorecard as Markdown; `commit`: what the diagnosis was built from.
pub fn markdown(cards: &[Card], commit: Option<&str>) -> String {
    let mut t = String::from("# Scorecard of the blind trials\n\n");
    if let Some(c) = commit {
        let _ = writeln!(t, "Diagnosis of commit {c}.\n");
    }
    t.push_str(
        "Shares with 95 % Wilson intervals. Effects count where refitting the parameters alone leaves at least three times \
         the floor.\n",
    );
    for card in cards {
        let _ = writeln!(t, "\n## {}\n", card.plant.name());
        for (split, all, done) in card.counts.iter().filter(|c| c.1 > 0) {
            let _ = writeln!(t, "- {}: {done} of {all} cases diagnosed", split.name());
        }
        if let (Some(first), Some(last)) = (card.seconds.first(), card.seconds.last()) {
            let middle = card.seconds[card.seconds.len() / 2];
            let _ = writeln!(t, "- wall time per case: median {middle:.1} s, from {first:.1} to {last:.1} s");
        }
        t.push_str("\n| | result | required | |\n|---|---|---|---|\n");
        for line in &card.lines {
            let met = line.value.and_then(|v| line.aim.met(v));
            let mark = met.map_or("", |m| if m { "met" } else { "**missed**" });
            let _ = writeln!(t, "| {} | {} | {} | {mark} |", line.what, figure(line), wanted(line));
        }
        t.push_str("\n### Named first by class, effect by effect\n\n| effect | |\n|---|---|\n");
        for (id, s) in &card.by_effect {
            let _ = writeln!(t, "| {id} | {}/{} |", s.hits, s.of);
        }
        t.push_str("\n### Truth and result\n\n| truth | result | cases |\n|---|---|---|\n");
        for (truth, said, n) in &card.confusion {
            let _ = writeln!(t, "| {truth} | {said} | {n} |");
        }
    }
    t
}

/// Writes the scorecard.
///
/// # Errors
/// The file cannot be written.
pub fn write_card(path: &Path, cards: &[Card], commit: Option<&str>) -> Result<(), TrialError> {
    files::whole(path, &markdown(cards, commit))
}
