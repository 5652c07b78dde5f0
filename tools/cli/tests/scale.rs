//! `trueup scale`: where the result goes, exit codes, what is left alone.

use std::path::Path;
use std::process::{Command, Output};

fn trueup(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    program.arg("scale").args(arguments).current_dir(folder).output().unwrap()
}

const TABLE: &str = "target = { value = 7900, unit = \"kg\" } # printed: 213.3\n";
const PLANT: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{g}">
  <CoSimulation modelIdentifier="m" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit></UnitDefinitions>
  <ModelVariables><ScalarVariable name="u" valueReference="0" causality="input"><Real unit="N" start="2"/></ScalarVariable></ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

fn desk() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    std::fs::create_dir(folder.path().join("m")).unwrap();
    file("m/modelDescription.xml", PLANT);
    file("t.toml", TABLE);
    file("r.csv", "time,u\n0.0,8.0\n2.0,4.0\n");
    let system = "inputs = \"r.csv\"\n[components.a]\nfmu = \"m\"\n";
    file("s.toml", &system.replace("\"r.csv\"", "{ file = \"r.csv\", columns = { u = \"a.u\" } }"));
    folder
}

#[test]
fn each_kind_of_file_has_its_result_beside_it() {
    let desk = desk();
    let folder = desk.path();
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    for (arguments, name, text) in [
        (&["t.toml"][..], "t.scaled.toml", TABLE.replace("7900", "987.5")),
        (&["t.scaled.toml", "--back", "-o", "b.toml"], "b.toml", TABLE.replace("7900", "7900.0")),
        (&["r.csv", "--units", "m"], "r.scaled.csv", "time,u\n0.0,2.0\n1.0,1.0\n".into()),
        (&["r.scaled.csv", "--units", "m", "--back"], "r.scaled.full.csv", "time,u\n0.0,8.0\n2.0,4.0\n".into()),
        (
            &["s.toml"],
            "s.scaled.toml",
            "inputs = { file = \"s.scaled.inputs.csv\", columns = { u = \"a.u\" } }\n[components.a]\nfmu = \"m\"\n\n\
             [run]\nstop = 1.0\nstep = 0.002\n"
                .into(),
        ),
        (&["s.toml"], "s.scaled.inputs.csv", "time,u\n0.0,2.0\n1.0,1.0\n".into()),
        (
            &["m"],
            "m.scaled.toml",
            "[components.m]\nfmu = \"m\"\n\n[components.m.start]\nu = 0.5\n\n[run]\nstop = 0.5\nstep = 0.001\n".into(),
        ),
    ] {
        let out = trueup(folder, &[arguments, &["--lambda", "0.5"]].concat());
        assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
        assert_eq!(read(name), text, "{arguments:?}");
    }
}

#[test]
fn mistakes_have_their_exit_code_and_leave_nothing() {
    let desk = desk();
    let folder = desk.path();
    let names = || {
        let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    for (arguments, code, said) in [
        (&["t.toml"][..], 2, "--lambda"),
        (&["t.toml", "--lambda", "-1"], 2, "write a number above 0, as in 0.3"),
        (&["t.toml", "--lambda", "0.3", "--exponent", "A"], 2, "write NAME=W, as in A=0"),
        (&["t.toml", "--lambda", "0.3", "-o", "t.toml"], 2, "that is where it comes from"),
        (&["t.toml", "--lambda", "0.3", "-o", "t.csv"], 2, "the result is a .toml"),
        (&["t.toml", "--lambda", "0.3", "--units", "m"], 2, "only a recording"),
        (&["r.csv", "--lambda", "0.3"], 2, "--units FILE"),
        (&["r.csv", "--lambda", "0.3", "--units", "t.toml"], 1, "t.toml"),
        (&["absent.toml", "--lambda", "0.3"], 1, "absent.toml: "),
        (&["absent.mat", "--lambda", "0.3"], 1, "there is nothing to scale in it; name a system"),
        (&["absent.toml", "--lambda", "0.3"], 1, "; name a system (.toml, .ssp), an FMU, a case"),
    ] {
        let out = trueup(folder, arguments);
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(said), "{arguments:?}: {error}");
        assert_eq!(names(), before, "{arguments:?}");
    }
    std::fs::write(folder.join("t.toml"), "k = { value = 2, unit = \"N.m/A\" }\n").unwrap();
    let out = trueup(folder, &["t.toml", "--lambda", "0.3"]);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(
        out.status.code() == Some(1)
            && error.contains("t.toml:1: `k` in N.m/A: the scale of A is not defined"),
        "{error}"
    );
    let given = trueup(folder, &["t.toml", "--lambda", "0.5", "--exponent", "A=0"]);
    assert!(given.status.success());
    assert!(std::fs::read_to_string(folder.join("t.scaled.toml")).unwrap().contains("value = 0.25"));
}

/// The example: its recordings and its nominal model, to and fro.
#[test]
fn a_case_is_scaled_with_its_recordings_and_back() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/06-backlash");
    let folder = tempfile::tempdir().unwrap();
    let case = folder.path().join("case");
    std::fs::create_dir(&case).unwrap();
    for name in ["case.toml", "train-1.csv", "train-2.csv", "train-3.csv", "holdout-1.csv"] {
        std::fs::copy(source.join(name), case.join(name)).unwrap();
    }
    let run = |arguments: &[&str]| {
        let out = trueup(folder.path(), &[arguments, &["--lambda", "0.3", "--exponent", "A=0"]].concat());
        assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    };
    run(&["case"]);
    run(&["case.scaled/case.toml", "--back", "-o", "again"]);
    let rows = |folder_name: &str, name: &str| {
        let text = std::fs::read_to_string(folder.path().join(folder_name).join(name)).unwrap();
        let cells = text.lines().skip(1).flat_map(|line| line.split(','));
        cells.map(|cell| cell.parse::<f64>().unwrap_or(f64::NAN)).collect::<Vec<f64>>()
    };
    let (first, scaled, again) =
        (rows("case", "train-1.csv"), rows("case.scaled", "train-1.csv"), rows("again", "train-1.csv"));
    assert!(first.len() > 100 && first.len() == scaled.len() && first.len() == again.len());
    assert!(first.iter().zip(&scaled).any(|(a, b)| a != b));
    let near = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan()) || (a - b).abs() < 1e-15 * a.abs();
    assert!(first.iter().zip(&again).all(|(a, b)| near(*a, *b)));
    let out = trueup(folder.path(), &["case", "--lambda", "0.3", "--exponent", "A=0", "-o", "case"]);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && error.contains("that is where it comes from"), "{error}");
    let out = trueup(folder.path(), &["case", "--lambda", "0.3", "-o", "refused"]);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(1) && error.contains("the scale of A is not defined"), "{error}");
    assert!(!folder.path().join("refused").exists());
}
