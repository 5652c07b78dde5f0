//! S0's five tests, made with bristles in the spring: fitted without and with them, one at a time, together, and with one left out.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

#[path = "../tests/testbed/mod.rs"]
mod testbed;

use testbed::bristles::{OFFSETS, TRUTH, found, identified, record, scatter};

fn main() {
    let seed = std::env::args().nth(1).and_then(|s| s.parse().ok()).unwrap_or(1);
    let folder = tempfile::tempdir().unwrap();
    record(folder.path(), seed);
    for bristles in [false, true] {
        let names: Vec<&str> = TRUTH.iter().map(|t| t.0).take(if bristles { 5 } else { 3 }).collect();
        let show = |label: &str, r: &trueup_identification::identify::Identified| {
            let cells: Vec<String> = names
                .iter()
                .map(|n| {
                    let e = &found(r, n).estimate;
                    format!("{:.4} ({})", e.value, e.standard_error.map_or("-".into(), |s| format!("{s:.4}")))
                })
                .collect();
            let errors: Vec<String> = r.channels.iter().map(|c| format!("{:.2}", c.above_floor)).collect();
            println!(
                "{bristles} {label}: {} | {} | fit {:.3e}",
                cells.join(" "),
                errors.join(" "),
                r.fit[0].rms
            );
            names.iter().map(|n| found(r, n).estimate.value).collect::<Vec<f64>>()
        };
        let mut all = Vec::new();
        for k in 1..=5 {
            let r = identified(folder.path(), &[k], &[], bristles);
            all.push(show(&format!("test {k} {}", OFFSETS[k - 1]), &r));
        }
        for (i, n) in names.iter().enumerate() {
            println!(
                "  scatter {n}: {:.1} %",
                100.0 * scatter(&all.iter().map(|v| v[i]).collect::<Vec<_>>())
            );
        }
        show("all", &identified(folder.path(), &[1, 2, 3, 4, 5], &[], bristles));
        let mut all = Vec::new();
        for k in 1..=5 {
            let rest: Vec<usize> = (1..=5).filter(|i| *i != k).collect();
            all.push(show(&format!("without {k}"), &identified(folder.path(), &rest, &[k], bristles)));
        }
        for (i, n) in names.iter().enumerate() {
            println!(
                "  scatter {n}: {:.1} %",
                100.0 * scatter(&all.iter().map(|v| v[i]).collect::<Vec<_>>())
            );
        }
    }
}
