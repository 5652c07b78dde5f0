//! The Modelica Association's Reference FMUs: `TRUEUP_REFERENCE_FMUS` names a folder with `2.0/<Model>.fmu` and
//! `3.0/<Model>.fmu`, as their releases are laid out. The expected values are the files' own.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

use std::path::PathBuf;

use trueup_cosim::{InputFileTable, Results, SimulateOptions, simulate};
use trueup_fmi_description::archive::Archive;
use trueup_fmi_import::UnpackedFmu;

type Rows = (Vec<String>, Vec<Vec<String>>);

fn table(text: &str) -> Rows {
    let split = |line: &str| line.split(',').map(|c| c.trim_matches('"').to_owned()).collect::<Vec<_>>();
    let mut lines = text.lines();
    (split(lines.next().unwrap()), lines.map(split).collect())
}

/// Written by different programs, times differ by rounding.
fn same_time(a: &str, b: &str) -> bool {
    let [a, b] = [a, b].map(|t| t.parse::<f64>().unwrap());
    (a - b).abs() <= 1e-12 * b.abs().max(1.0)
}

/// Simulates over the times of the reference and compares every number that both have.
fn matches_its_reference(version: u32, model: &str) {
    let Some(folder) = std::env::var_os("TRUEUP_REFERENCE_FMUS") else {
        eprintln!("SKIPPED: TRUEUP_REFERENCE_FMUS is not set to a folder of Reference FMUs");
        return;
    };
    let file = PathBuf::from(folder).join(format!("{version}.0")).join(format!("{model}.fmu"));
    let fmu = UnpackedFmu::open(&file).unwrap();
    let mut archive = Archive::open(&file).unwrap();
    let mut extra = |what: &str| {
        let name = format!("extra/org.fmi-standard.fmi-ls-ref/{model}_{what}.csv");
        archive.read(&name, 1 << 20).ok().map(|bytes| String::from_utf8(bytes).unwrap())
    };
    let (names, expected) = table(&extra("out").unwrap());
    let out = tempfile::tempdir().unwrap();
    let inputs = extra("in").map(|text| {
        let file = out.path().join("in.csv");
        std::fs::write(&file, text).unwrap();
        InputFileTable::read(&file, "".as_ref(), None)
    });
    let time = |i: usize| expected[i][0].parse::<f64>().unwrap();
    let options = SimulateOptions {
        stop: Some(time(expected.len() - 1).max(fmu.description().experiment.stop_time.unwrap_or(0.0))),
        step: Some(time(1) - time(0)),
        inputs: inputs.and_then(Result::ok),
        ..SimulateOptions::default()
    };
    let results = out.path().join("out.csv");
    let mut writer = Results::create(&results).unwrap();
    simulate(&fmu, &options, &mut writer).unwrap();
    writer.finish().unwrap();
    let (columns, rows) = table(&std::fs::read_to_string(&results).unwrap());
    // At events between the points there are two rows more, before and after.
    let rows: Vec<_> =
        rows.into_iter().filter(|r| expected.iter().any(|e| same_time(&r[0], &e[0]))).collect();
    assert_eq!(rows.len(), expected.len(), "{model} {version}");
    let mut compared = 0;
    for (at, name) in names.iter().enumerate() {
        let Some(column) = columns.iter().position(|c| c == name) else { continue };
        for (row, expected) in rows.iter().zip(&expected) {
            let (Ok(x), Ok(e)) = (row[column].parse::<f64>(), expected[at].parse::<f64>()) else { continue };
            assert!(
                (x - e).abs() <= 1e-12 * e.abs().max(1.0),
                "{model} {version} {name} at {}: {x}, {e}",
                row[0]
            );
            compared += 1;
        }
    }
    assert!(compared >= 2 * rows.len(), "{model} {version}: {compared} values compared");
}

#[test]
fn fmi2() {
    for model in ["BouncingBall", "Dahlquist", "Resource", "Stair", "VanDerPol"] {
        matches_its_reference(2, model);
    }
}

#[test]
fn fmi3() {
    for model in ["BouncingBall", "Dahlquist", "Resource", "Stair", "VanDerPol"] {
        matches_its_reference(3, model);
    }
}
