//! The result for a reader.

use std::fmt::Write;

use trueup_identification::identify::{FitFigure, FoundParameter, Identified};
use trueup_report::number;

/// Six digits at most, so that columns stay narrow.
fn short(x: f64) -> String {
    format!("{x:.5e}")
}

fn interval([a, b]: [Option<f64>; 2]) -> String {
    let end = |v: Option<f64>| v.map_or_else(|| "open".to_owned(), short);
    format!("{} .. {}", end(a), end(b))
}

fn row(out: &mut String, f: &FoundParameter) {
    let e = &f.estimate;
    let error = e.standard_error.map_or_else(|| "-".to_owned(), |s| format!("{s:.1e}"));
    let against = match (f.nominal, e.value / f.nominal - 1.0) {
        (n, change) if n != 0.0 && change.is_finite() => format!("{:+.2} %", 100.0 * change),
        _ => String::new(),
    };
    let name = &e.name;
    let _ = writeln!(
        out,
        "  {name:<22}{:>13} {:<10} {error:>9}   {:<30} {against}",
        short(e.value),
        f.unit,
        interval(e.ci95)
    );
    if let Some(reason) = &e.reason {
        let _ = writeln!(out, "    {reason}");
    }
}

fn figures(out: &mut String, title: &str, list: &[FitFigure]) {
    let each: Vec<String> = (list.iter())
        .map(|f| match f.nrmse {
            Some(x) => format!("{} {} ({} {})", f.channel, number(x), number(f.rms), f.unit),
            None => format!("{} does not vary ({} {})", f.channel, number(f.rms), f.unit),
        })
        .collect();
    if !each.is_empty() {
        let _ = writeln!(out, "  {title:<24}{}", each.join(", "));
    }
}

pub(super) fn text(r: &Identified) -> String {
    let through = r.fmu.as_ref().map_or(String::new(), |f| format!(" through {f}"));
    let mut out = format!("{} by {}{through}\n\n", r.model, r.method);
    let _ = writeln!(
        out,
        "  {:<22}{:>13} {:<10} {:>9}   {:<30} against the case",
        "parameter", "value", "unit", "error", "95 % interval"
    );
    r.parameters.iter().for_each(|f| row(&mut out, f));
    if !r.uncertain.is_empty() {
        out += "\n  uncertain, estimated with their prior\n";
        r.uncertain.iter().for_each(|f| row(&mut out, f));
    }
    let offsets = r.nuisance.iter().flat_map(|(run, list)| list.iter().map(move |f| (run, f)));
    for (run, f) in offsets.filter(|(_, f)| f.estimate.name.ends_with(".offset")) {
        let _ = writeln!(out, "\n  {run}");
        row(&mut out, f);
    }
    out += "\nSimulated against measured, RMS over variation\n";
    let on = if r.held_out { "held out" } else { "training" };
    figures(&mut out, on, &r.fit);
    figures(&mut out, "without the effects", &r.without);
    figures(&mut out, "with the case's values", &r.before);
    if !r.channels.is_empty() {
        out += "\nResiduals of the training\n";
        for c in &r.channels {
            let run = r.names[0].get(c.run).map_or("", String::as_str);
            let _ = writeln!(
                out,
                "  {run:<22}{:<16}{:>6.2} times the noise, neighbours correlated {:+.2}, white with probability {:.2}",
                c.channel, c.above_floor, c.lag1, c.whiteness
            );
        }
        let _ = writeln!(
            out,
            "\n{} of {} unknowns determined, condition {:.1e}; {} after {} iterations",
            r.rank.0, r.rank.1, r.condition, r.stop, r.iterations
        );
    }
    if !r.leverage.known.is_empty() {
        let columns = r.leverage.known.join(", ");
        let _ = writeln!(
            out,
            "\nIf 1 % of this were wrong, or a sensor by one step (its zero, or in a wave per turn), the estimate moves by (%): {columns}"
        );
        for (f, row) in r.parameters.iter().chain(&r.uncertain).zip(r.leverage.values.row_iter()) {
            let each = row.iter().zip(&r.leverage.known);
            let cells: Vec<String> = each
                .map(|(v, k)| match v.is_finite() {
                    true => format!("{:>9.3}", if k.contains("one step") { 100.0 * v } else { *v }),
                    false => format!("{:>9}", "-"),
                })
                .collect();
            let _ = writeln!(out, "  {:<22}{}", f.estimate.name, cells.join(" "));
        }
    }
    if r.starts.len() > 1 {
        out += "\nStarts and the cost that the first stage reached from there\n";
        for s in &r.starts {
            let cost = s.cost.map_or_else(|| "not simulated".to_owned(), |c| format!("{c:.6e}"));
            let _ = writeln!(out, "{} {:<46}{cost}", if s.chosen { " *" } else { "  " }, s.from);
        }
    }
    if let Some(d) = &r.design {
        out += &super::design::text(d);
    }
    out += if r.notes.is_empty() { "" } else { "\n" };
    for note in &r.notes {
        let _ = writeln!(out, "note: {note}");
    }
    out
}
