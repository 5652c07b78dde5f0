//! What runs from other start values would identify, for a reader and for machines.

use std::fmt::Write;

use serde_json::{Map, Value, json};
use trueup_identification::identify::Designed;
use trueup_report::number;

/// The values that recordings have now, each once.
fn present(d: &Designed) -> String {
    let mut values: Vec<String> = d.present.iter().map(|p| number(p.1)).collect();
    values.dedup();
    values.join(", ")
}

/// What the value that is best for all together is worth.
fn sentence(d: &Designed) -> String {
    let Some(row) = d.best_of_all() else {
        return "No value in this span gives any of the unknowns.".into();
    };
    let at = format!("{} = {} {}", d.name, number(d.rows[row].0), d.unit);
    let worth = |(k, (name, _)): (usize, &(String, &str))| match (d.now[k], d.rows[row].1[k]) {
        (Some(now), Some(then)) => Some(format!("{name} {} times as well", number(now / then))),
        (None, Some(_)) => Some(format!("{name}, which they do not give now,")),
        _ => None,
    };
    let all: Vec<String> = d.unknowns.iter().enumerate().filter_map(worth).collect();
    format!("Started at {at} (now {}), the same runs would identify {}.", present(d), all.join(", "))
}

pub(super) fn text(d: &Designed) -> String {
    let mut out = format!(
        "\nExpected standard errors over {} (Cramer-Rao; this model, these runs, sensors and noise, at the estimates)\n",
        d.name
    );
    let width = |name: &str| name.len().max(10) + 2;
    let line = |first: String, cells: Vec<String>| {
        let cells = cells.iter().zip(&d.unknowns).map(|(c, u)| format!("{c:>0$}", width(&u.0)));
        format!("  {first:<22}{}\n", cells.collect::<String>())
    };
    let errors = |all: &[Option<f64>]| {
        all.iter().map(|e| e.map_or_else(|| "-".into(), |e| format!("{e:.2e}"))).collect()
    };
    out += &line(d.unit.into(), d.unknowns.iter().map(|u| u.0.clone()).collect());
    for (value, all) in &d.rows {
        out += &line(number(*value), errors(all));
    }
    out += &line(format!("now ({})", present(d)), errors(&d.now));
    let best: Vec<Option<usize>> = (0..d.unknowns.len()).map(|k| d.best(k)).collect();
    out += &line(
        "best at".into(),
        best.iter().map(|b| b.map_or_else(|| "-".into(), |i| number(d.rows[i].0))).collect(),
    );
    let gain = |k: usize| best[k].and_then(|i| d.gain(k, i)).map_or_else(|| "-".into(), number);
    out += &line("times smaller".into(), (0..d.unknowns.len()).map(gain).collect());
    let _ = writeln!(out, "{}", sentence(d));
    out
}

pub(super) fn json(d: &Designed) -> Value {
    let unknown = |(k, (name, unit)): (usize, &(String, &str))| {
        let errors: Vec<Option<f64>> = d.rows.iter().map(|r| r.1[k]).collect();
        let best = d
            .best(k)
            .map(|i| json!({"value": d.rows[i].0, "standard_error": d.rows[i].1[k], "gain": d.gain(k, i)}));
        let all = json!({"unit": unit, "standard_error": errors, "present": d.now[k], "best": best});
        (name.clone(), all)
    };
    let parameters: Map<String, Value> = d.unknowns.iter().enumerate().map(unknown).collect();
    let present: Map<String, Value> = d.present.iter().map(|(run, v)| (run.clone(), json!(v))).collect();
    json!({
        "parameter": d.name,
        "unit": d.unit,
        "values": d.rows.iter().map(|r| r.0).collect::<Vec<f64>>(),
        "present": present,
        "parameters": parameters,
        "best": d.best_of_all().map(|i| d.rows[i].0),
        "says": sentence(d),
    })
}
