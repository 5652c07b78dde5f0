//! `trueup simulate`: exit codes and what is left on disk.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

fn trueup(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    program.arg("simulate").args(arguments).current_dir(folder).output().unwrap()
}

const NO_BINARY: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{g}">
  <CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables><ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable></ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

#[test]
fn mistakes_have_their_exit_code_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("m");
    std::fs::create_dir(&fmu).unwrap();
    std::fs::write(fmu.join("modelDescription.xml"), NO_BINARY).unwrap();
    std::fs::write(folder.path().join("in.csv"), "time,u\n0,1\n0,2\n").unwrap();
    for (arguments, code, said) in [
        (&["m", "--set", "v=1", "--outputs", "w"][..], 2, "no variable `v`"),
        (&["m", "--set", "v=1", "--outputs", "w"], 2, "no variable `w`"),
        (&["m", "--set", "u"], 2, "NAME=VALUE"),
        (&["m", "--stop", "-1"], 2, "no run from 0.0 s to -1.0 s"),
        (&["m", "-o", "r.mat"], 2, "end with .csv or .parquet"),
        (&["m"], 1, "no binary"),
        (&["absent.fmu"], 1, "absent.fmu"),
        (&["m", "--input", "in.csv"], 1, "line 3"),
        (&["m", "-o", "nowhere/r.csv"], 1, "nowhere/r.csv"),
    ] {
        let out = trueup(folder.path(), arguments);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(said), "{arguments:?}: {error}");
        let mut left: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, ["in.csv", "m"], "{arguments:?}");
    }
}
