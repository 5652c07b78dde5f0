//! The results as a table in Markdown.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::{FITTED, METHODS, cells};

#[derive(Default)]
struct Entry {
    errors: Vec<f64>,
    bounds: Vec<f64>,
    covered: usize,
    intervals: usize,
}

/// Reads the results of all shards.
pub(crate) fn print(files: &[PathBuf]) {
    let mut entries: BTreeMap<(usize, &str, usize), Entry> = BTreeMap::new();
    for file in files {
        for line in std::fs::read_to_string(file).expect("the results can be read").lines() {
            let f: Vec<&str> = line.split(',').collect();
            let number = |i: usize| f[i].parse::<f64>().expect("a number");
            let Some(method) = METHODS.iter().find(|m| **m == f[2]) else { continue };
            let e = entries.entry((number(0) as usize, method, number(3) as usize)).or_default();
            e.errors.push(number(4));
            e.bounds.push(number(6));
            if number(5) >= 0.0 {
                e.intervals += 1;
                e.covered += number(5) as usize;
            }
        }
    }
    println!("| case, rate, counts | {} |", METHODS.join(" | "));
    println!("|---|{}", "---|".repeat(METHODS.len()));
    for (c, cell) in cells().iter().enumerate() {
        let text = |method: &str| -> String {
            let one = |k: usize| {
                entries.get(&(c, METHODS.iter().find(|m| **m == method)?, k)).map(|e| short(&e.errors))
            };
            (0..4).map(|k| one(k).unwrap_or_else(|| "-".into())).collect::<Vec<_>>().join(" / ")
        };
        let columns: Vec<String> = METHODS.iter().map(|m| text(m)).collect();
        println!(
            "| {}, joint {}, {} Hz, {} | {} |",
            cell.case,
            cell.joint,
            cell.rate,
            cell.counts,
            columns.join(" | ")
        );
    }
    println!(
        "\nOutput error, rms of the relative error in % (and over the Cramer-Rao bound); intervals that hold the truth:\n"
    );
    println!("| case, rate, counts | seeds | {} | covered |", FITTED.map(|f| f.0).join(" | "));
    println!("|---|---|---|---|---|---|---|");
    let mut pooled = [(0, 0); 4];
    for (c, cell) in cells().iter().enumerate() {
        let all: Vec<&Entry> = (0..4).filter_map(|k| entries.get(&(c, "output-error", k))).collect();
        let [a, b, d, e] = all[..] else { continue };
        let one = |e: &Entry| {
            let rms = rms(&e.errors);
            let bound = rms_of(&e.bounds);
            format!("{} ({:.2})", percent(rms), rms / bound)
        };
        let covered: Vec<String> = [a, b, d, e]
            .iter()
            .enumerate()
            .map(|(k, e)| {
                pooled[k].0 += e.covered;
                pooled[k].1 += e.intervals;
                format!("{}/{}", e.covered, e.intervals)
            })
            .collect();
        println!(
            "| {}, joint {}, {} Hz, {} | {} | {} | {} | {} | {} | {} |",
            cell.case,
            cell.joint,
            cell.rate,
            cell.counts,
            a.errors.len(),
            one(a),
            one(b),
            one(d),
            one(e),
            covered.join(" ")
        );
    }
    println!("\nCoverage of the 95 % intervals, pooled:\n");
    for (k, (covered, all)) in pooled.iter().enumerate() {
        println!("- {}: {covered} of {all}, {:.1} %", FITTED[k].0, 100.0 * *covered as f64 / *all as f64);
    }
}

fn rms(v: &[f64]) -> f64 {
    (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt()
}
fn rms_of(v: &[f64]) -> f64 {
    rms(v)
}
fn percent(v: f64) -> String {
    let v = 100.0 * v;
    if v.abs() >= 100.0 {
        format!("{v:.0}")
    } else if v.abs() >= 1.0 {
        format!("{v:.1}")
    } else {
        format!("{v:.3}")
    }
}
/// mean +- standard deviation in %.
fn short(v: &[f64]) -> String {
    let mean = v.iter().sum::<f64>() / v.len() as f64;
    let sd = (v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (v.len() as f64 - 1.0).max(1.0)).sqrt();
    format!("{}±{}", percent(mean), percent(sd))
}
