//! S0's five tests, made with bristles in the spring: fitted without and with them, one at a time, together, and with one left out:
//! `cargo run --release -p trueup-identification --example five_tests [SEED [DEG]]`; DEG: all five released
//! with that offset. `five_tests write DIR [SEED]` writes their recordings into a folder instead.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/testbed/mod.rs"]
mod testbed;

use testbed::bristles::{OFFSETS, SEEN, TRUTH, found, identified, record, scatter};
use trueup_identification::identify::Identified;

/// Value and standard error; what the tests do not determine keeps the value where the search began.
fn cell(r: &Identified, name: &str) -> String {
    let e = &found(r, name).estimate;
    match e.standard_error {
        Some(s) => format!("{:.4} ± {s:.4}", e.value),
        None => format!("{:.4}, not determined", e.value),
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [write, folder, rest @ ..] = &arguments[..]
        && write == "write"
    {
        let seed = rest.first().map_or(1, |s| s.parse().unwrap());
        return record(folder.as_ref(), &TRUTH, &OFFSETS, seed);
    }
    let seed = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(1);
    let folder = tempfile::tempdir().unwrap();
    let controlled: Option<f64> = std::env::args().nth(2).and_then(|d| d.parse().ok());
    let offsets = OFFSETS.map(|printed| controlled.unwrap_or(printed));
    record(folder.path(), &TRUTH, &offsets, seed);
    let all: Vec<usize> = (1..=offsets.len()).collect();
    for (bristles, count) in [(false, 3), (true, 5)] {
        let names: Vec<&str> = TRUTH.iter().map(|t| t.0).take(count).collect();
        println!("\n| fitted on | {} | residual / noise | held out / noise |", names.join(" | "));
        println!("|---|{}---|---|", "---|".repeat(count));
        let row = |label: String, train: &[usize], holdout: &[usize]| {
            let r = identified(folder.path(), train, holdout, bristles);
            let cells: Vec<String> = names.iter().map(|n| cell(&r, n)).collect();
            let fit: Vec<String> = r.channels.iter().map(|c| format!("{:.2}", c.above_floor)).collect();
            let out = if r.held_out { format!("{:.2}", r.fit[0].rms / SEEN) } else { String::new() };
            println!("| {label} | {} | {} | {out} |", cells.join(" | "), fit.join(" "));
            names.iter().map(|n| found(&r, n).estimate.value).collect::<Vec<f64>>()
        };
        let spread = |label: &str, rows: &[Vec<f64>]| {
            let of = |i: usize| scatter(&rows.iter().map(|v| v[i]).collect::<Vec<_>>());
            let cells: Vec<String> = (0..count).map(|i| format!("{:.1} %", 100.0 * of(i))).collect();
            println!("| {label} | {} | | |", cells.join(" | "));
        };
        let alone = all.iter().map(|&k| row(format!("test {k}, {}°", offsets[k - 1]), &[k], &[]));
        spread("scatter, one at a time", &alone.collect::<Vec<_>>());
        row("all five".into(), &all, &[]);
        let others = |k: usize| all.iter().copied().filter(|i| *i != k).collect::<Vec<_>>();
        let left = all.iter().map(|&k| row(format!("all but test {k}"), &others(k), &[k]));
        spread("scatter, one left out", &left.collect::<Vec<_>>());
    }
}
