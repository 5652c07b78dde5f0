//! The page of `trueup identify --plot`: fit and residuals, channel by channel.

use trueup_identification::fit::ChannelComparison;
use trueup_identification::identify::Identified;
use trueup_report::{Chart, Page, Style, number};
use trueup_signals::Case;

pub(super) fn page(case: &Case, r: &Identified) -> String {
    let title = format!("{} identified by {}", r.model, r.method);
    let mut page = Page::new(&title, &format!("Case {}.", case.file.display()));
    page.section("Parameters", "");
    let rows: Vec<Vec<String>> = (r.parameters.iter().chain(&r.uncertain))
        .map(|f| {
            let e = &f.estimate;
            let end = |v: Option<f64>| v.map_or_else(|| "open".into(), number);
            vec![
                e.name.clone(),
                number(e.value),
                f.unit.into(),
                e.standard_error.map_or_else(|| "-".into(), number),
                format!("{} .. {}", end(e.ci95[0]), end(e.ci95[1])),
                number(f.nominal),
                e.reason.clone().unwrap_or_default(),
            ]
        })
        .collect();
    page.table(&["parameter", "value", "unit", "standard error", "95 % interval", "the case's", ""], &rows);
    r.notes.iter().for_each(|n| page.text(n));
    let held = if r.held_out { "Held-out recordings" } else { "Training recordings" };
    let what = "Free-running simulation, only how each recording begins estimated.";
    section(&mut page, held, what, r, 1, &r.compared);
    section(&mut page, "Training", "As fitted.", r, 0, &r.training);
    page.finish()
}

fn section(
    page: &mut Page,
    heading: &str,
    text: &str,
    r: &Identified,
    which: usize,
    all: &[ChannelComparison],
) {
    page.section(heading, text);
    for c in all {
        let run = r.names[which].get(c.run).map_or("", String::as_str);
        let unit = r.outputs.iter().find(|q| q.name == c.channel).map_or("", |q| q.unit);
        let error: Vec<f64> = c.predicted.iter().zip(&c.measured).map(|(p, y)| p - y).collect();
        let chart = Chart::over_time(&format!("{run}: {}", c.channel), unit)
            .series("measured", &c.t, &c.measured, Style::Line)
            .series("simulated", &c.t, &c.predicted, Style::Line);
        page.chart(&chart);
        page.chart(
            &Chart::over_time(&format!("{run}: {} simulated less measured", c.channel), unit)
                .line("residual", &c.t, &error),
        );
    }
}
