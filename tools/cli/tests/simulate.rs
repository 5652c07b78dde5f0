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
    std::fs::write(folder.path().join("in.csv"), "time,u\n0.5,1\n0,2\n").unwrap();
    // One time twice is a jump, of which a run needs a stop.
    std::fs::write(folder.path().join("jump.csv"), "time,u\n0,1\n0,2\n").unwrap();
    for (arguments, code, said) in [
        (&["m", "--set", "v=1", "--outputs", "w"][..], 2, "no variable `v`"),
        (&["m", "--set", "v=1", "--outputs", "w"], 2, "no variable `w`"),
        (&["m", "--set", "u"], 2, "NAME=VALUE"),
        (&["m", "--stop", "-1"], 2, "no run from 0.0 s to -1.0 s"),
        (&["m", "--set", "-1"], 2, "error: --set -1: write NAME=VALUE"),
        (&["m", "--set", "v=-1"], 2, "no variable `v`"),
        (&["m", "--start", "-1", "--stop", "-2"], 2, "no run from -1.0 s to -2.0 s"),
        (&["m", "--start", "soon"], 2, "write seconds as a number"),
        (&["m", "--step", "-1"], 2, "write a number above 0"),
        (&["m", "--tolerance", "0"], 2, "write a number between 0 and 1, as in 1e-6"),
        (&["m", "--tolerance", "-1"], 2, "write a number between 0 and 1, as in 1e-6"),
        (&["absent.fmu"], 1, "look at the path"),
        (&["m", "-o", "r.mat"], 2, "end with .csv or .parquet"),
        (&["m"], 1, "no binary"),
        (&["absent.fmu"], 1, "absent.fmu"),
        (&["m", "--input", "in.csv"], 1, "error: in.csv:3: "),
        (&["m", "--input", "jump.csv"], 1, "has no length; choose a later stop"),
        (&["m", "-o", "nowhere/r.csv"], 1, "nowhere/r.csv"),
    ] {
        let out = trueup(folder.path(), arguments);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(said), "{arguments:?}: {error}");
        let mut left: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().file_name()).collect();
        left.sort();
        assert_eq!(left, ["in.csv", "jump.csv", "m"], "{arguments:?}");
    }
}

#[test]
fn a_file_that_is_no_fmu_is_named_once() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("half.fmu"), b"PK\x03\x04 and then nothing").unwrap();
    for (file, said) in
        [("half.fmu", "half.fmu is no FMU or not all of one"), ("absent.fmu", "there is no file absent.fmu")]
    {
        let out = trueup(folder.path(), &[file]);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{error}");
        assert!(error.contains(said) && error.matches(file).count() == 1, "{error}");
    }
}

/// Two of the FMU, connected, in a folder with a table that drives the first.
fn system() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("m");
    std::fs::create_dir(&fmu).unwrap();
    let output = r#"<ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable></ModelVariables>"#;
    std::fs::write(fmu.join("modelDescription.xml"), NO_BINARY.replace("</ModelVariables>", output)).unwrap();
    let toml = "connections = ['a.y -> b.u']\n[run]\nstop = 2\nstep = 0.5\n[components.a]\nfmu = 'm'\n[components.b]\nfmu = 'm'\n";
    std::fs::write(folder.path().join("s.toml"), toml).unwrap();
    std::fs::write(folder.path().join("in.csv"), "time,a.u\n0,1\n").unwrap();
    std::fs::write(folder.path().join("wrong.toml"), toml.replace("b.u", "b.w")).unwrap();
    folder
}

#[test]
fn a_system_is_checked_and_packed_without_being_run() {
    let folder = system();
    let check = |arguments: &[&str]| {
        let out = trueup(folder.path(), &[arguments, &["--check"]].concat());
        assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
        String::from_utf8(out.stdout).unwrap()
    };
    let said = check(&["s.toml"]);
    for part in [
        "a  m (FMI 2.0), co-simulation",
        "inputs that keep their start values: u",
        "1 values handed on",
        "in 4 steps of 0.5 s",
    ] {
        assert!(said.contains(part), "{part}\n{said}");
    }
    let said = check(&[
        "s.toml",
        "--input",
        "in.csv",
        "--outputs",
        "b.y",
        "--step",
        "0.25",
        "--algorithm",
        "jacobi",
        "--set",
        "b.u=3",
    ]);
    for part in
        ["1 driven by a file, 1 recorded", "in 8 steps of 0.25 s", "algorithm: jacobi", "1 start value"]
    {
        assert!(said.contains(part), "{part}\n{said}");
    }
    let out = trueup(folder.path(), &["s.toml", "--save-ssp", "s.ssp"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    assert_eq!(check(&["s.ssp"]), check(&["s.toml"]));
}

#[test]
fn mistakes_in_a_file_are_not_those_of_the_command_line() {
    let folder = system();
    for (arguments, code, said) in [
        (&["wrong.toml"][..], 1, "wrong.toml:1: `b.w`: the FMU has no variable `w`"),
        (&["wrong.toml", "--set", "c.u=1"], 2, "--set c.u=1: there is no component `c`; there is `a`, `b`"),
        (&["wrong.toml", "--set", "a.z=1"], 1, "--set a.z=1: start of `a.z`: the FMU has no variable `z`"),
        (
            &["s.toml", "--set", "a.u=x"],
            2,
            "--set a.u=x: start of `a.u`: `u` cannot be \"x\"; expected: Float64",
        ),
        (&["s.toml", "--outputs", "a.y,b.z"], 2, "--outputs: `b.z`: the FMU has no variable `z`"),
        (&["s.toml", "--interface", "me"], 1, "does not offer model-exchange"),
        (&["s.toml", "--algorithm", "jacoby"], 2, "did you mean `jacobi`?"),
        (&["s.toml"], 1, "no binary"),
    ] {
        let out = trueup(folder.path(), arguments);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(said), "{arguments:?}: {error}");
    }
}
