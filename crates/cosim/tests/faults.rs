//! What a run does when an FMU fails, with an FMU that fails on request, compiled here from `faulty.c`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]
#![cfg(target_os = "linux")]

use std::sync::Arc;

use crate::compiled::compiled;
use trueup_cosim::{CosimError, InputFileTable, Results, SimulateOptions, Summary, simulate};
use trueup_fmi_description::FmiVersion;
use trueup_fmi_import::{FmiStatus, UnpackedFmu};

const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="faulty" guid="{f}">
  <CoSimulation modelIdentifier="faulty" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="fault" valueReference="0" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3"/></Outputs></ModelStructure>
</fmiModelDescription>"#;

/// The unpacked FMU, or `None` with a message.
fn fmu() -> Option<(tempfile::TempDir, Arc<UnpackedFmu>)> {
    equal_steps(false)
}

fn equal_steps(only: bool) -> Option<(tempfile::TempDir, Arc<UnpackedFmu>)> {
    let folder = tempfile::tempdir().unwrap();
    let binaries = folder.path().join("binaries").join(FmiVersion::V2.platform());
    std::fs::create_dir_all(&binaries).unwrap();
    let description = if only { DESCRIPTION.replace("\"true\"", "\"false\"") } else { DESCRIPTION.into() };
    std::fs::write(folder.path().join("modelDescription.xml"), description).unwrap();
    compiled("faulty.c", &[], &binaries.join("faulty.so"))?;
    let fmu = UnpackedFmu::open(folder.path()).unwrap();
    Some((folder, fmu))
}

fn options(fault: u32) -> SimulateOptions {
    let set = vec![("fault".into(), fault.to_string())];
    SimulateOptions { set, stop: Some(1.0), step: Some(0.1), ..SimulateOptions::default() }
}

/// Result of the run and the rows of the file that is left, with its name.
fn run(
    fmu: &Arc<UnpackedFmu>,
    options: &SimulateOptions,
) -> (Result<Summary, CosimError>, String, Vec<[f64; 2]>) {
    let folder = tempfile::tempdir().unwrap();
    let mut table = Results::create(&folder.path().join("run.csv")).unwrap();
    let result = simulate(fmu, options, &mut table);
    match &result {
        Ok(_) => table.finish().unwrap(),
        Err(_) => drop(table.keep_partial().unwrap()),
    }
    let files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect();
    let [file] = &files[..] else {
        assert_eq!(files.len(), 0, "{files:?}");
        return (result, String::new(), Vec::new()); // wrong settings compute nothing
    };
    let text = std::fs::read_to_string(file).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let (time, y) = line.split_once(',').unwrap();
        [time.parse().unwrap(), y.parse().unwrap()]
    });
    (result, file.file_name().unwrap().to_string_lossy().into_owned(), rows.collect())
}

#[test]
fn a_warning_does_not_end_the_run() {
    let Some((_folder, fmu)) = fmu() else { return };
    for fault in [0, 1] {
        let (result, name, rows) = run(&fmu, &options(fault));
        assert_eq!(result.unwrap(), Summary { time: 1.0, steps: 10, discarded: 0, terminated: false });
        assert_eq!((name.as_str(), rows.len(), rows[10][0]), ("run.csv", 11, 1.0));
        assert!(rows.iter().all(|[t, y]| (t - y).abs() < 1e-12), "{rows:?}");
    }
}

#[test]
fn error_fatal_and_discard_end_it_with_call_time_and_log() {
    let Some((_folder, fmu)) = fmu() else { return };
    for (fault, status) in [(3, FmiStatus::Error), (4, FmiStatus::Fatal)] {
        let (result, name, rows) = run(&fmu, &options(fault));
        let error = result.unwrap_err();
        let CosimError::Call { time, source } = &error else { panic!("{error}") };
        assert_eq!((*time, source.status()), (0.5, Some(status)));
        let said = error.to_string();
        let fault = format!("fault {fault}");
        assert!(["t = 0.5 s", "fmi2DoStep", "instance", &fault].iter().all(|w| said.contains(w)), "{said}");
        assert_eq!((name.as_str(), rows.len()), ("run.partial.csv", 6));
    }
    let (result, name, rows) = run(&fmu, &options(2));
    let said = result.unwrap_err().to_string();
    let words =
        ["t = 0.5 s", "over 9.53674316e-8 s ended early at 0.5 s", "Discard", "however short", "fault 2"];
    assert!(words.iter().all(|w| said.contains(w)), "{said}");
    assert_eq!((name.as_str(), rows.len()), ("run.partial.csv", 6));
}

#[test]
fn a_value_that_is_not_finite_ends_it_with_the_variable() {
    let Some((_folder, fmu)) = fmu() else { return };
    for (fault, value) in [(5, "NaN"), (6, "-inf")] {
        let (result, name, rows) = run(&fmu, &options(fault));
        let said = result.unwrap_err().to_string();
        assert!(said.contains("t = 0.6 s: y of instance"), "{said}");
        assert!(said.contains(&format!("is {value}")), "{said}");
        assert_eq!((name.as_str(), rows.len()), ("run.partial.csv", 6));
        assert!(rows.iter().flatten().all(|x| x.is_finite()));
    }
}

#[test]
fn a_discarded_step_is_shortened_or_continued() {
    let Some((_folder, fmu)) = fmu() else { return };
    for fault in [7, 9] {
        let (result, _, rows) = run(&fmu, &options(fault));
        let summary = result.unwrap();
        assert!(summary.discarded > 0 && !summary.terminated, "{summary:?}");
        assert_eq!((summary.time, rows.len()), (1.0, 11));
        assert!(rows.iter().all(|[t, y]| (t - y).abs() < 1e-9), "{rows:?}");
    }
    let Some((_folder, fmu)) = equal_steps(true) else { return };
    let said = run(&fmu, &options(7)).0.unwrap_err().to_string();
    assert!(said.contains("takes no other step"), "{said}");
    let odd = SimulateOptions { step: Some(0.3), ..options(0) };
    let said = run(&fmu, &odd).0.unwrap_err().to_string();
    assert!(said.contains("0.3 s does not divide 1 s"), "{said}");
}

#[test]
fn an_fmu_may_end_the_run() {
    let Some((_folder, fmu)) = fmu() else { return };
    let (result, name, rows) = run(&fmu, &options(8));
    let summary = result.unwrap();
    assert!(summary.terminated && summary.time == 0.5, "{summary:?}");
    assert_eq!((name.as_str(), rows.len()), ("run.csv", 7));
}

#[test]
fn outputs_follow_the_input_of_their_own_time() {
    let Some((folder, fmu)) = fmu() else { return };
    let file = folder.path().join("in.csv");
    std::fs::write(&file, "time,u,y\n0,10,0\n1,20,0\n").unwrap();
    let inputs = InputFileTable::read(&file, "".as_ref(), None).unwrap();
    let (result, _, rows) = run(&fmu, &SimulateOptions { inputs: Some(inputs), ..options(0) });
    result.unwrap();
    assert!(rows.iter().all(|[t, y]| (y - (t + 10.0 + 10.0 * t)).abs() < 1e-9), "{rows:?}");
}

#[test]
fn all_wrong_settings_are_named_at_once() {
    let Some((_folder, fmu)) = fmu() else { return };
    let set = [("fault", "1.5"), ("y", "1"), ("z", "1"), ("u", "nan"), ("u[1]", "0")];
    let wrong = SimulateOptions {
        set: set.iter().map(|(n, v)| ((*n).into(), (*v).into())).collect(),
        stop: Some(-1.0),
        outputs: vec!["q".into()],
        ..SimulateOptions::default()
    };
    let Err(CosimError::Setting(wrong)) = run_only(&fmu, &wrong) else { panic!() };
    assert_eq!(wrong.len(), 7, "{wrong:?}");
}

fn run_only(fmu: &Arc<UnpackedFmu>, options: &SimulateOptions) -> Result<Summary, CosimError> {
    let folder = tempfile::tempdir().unwrap();
    simulate(fmu, options, &mut Results::create(&folder.path().join("run.csv")).unwrap())
}
