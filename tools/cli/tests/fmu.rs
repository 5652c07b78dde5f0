//! `trueup fmu info` and `validate` on broken and foreign FMUs; exit codes.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::Path;
use std::process::{Command, Output};

use trueup_fmi_description::archive::Archive;

fn trueup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueup")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn folder(description: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("modelDescription.xml"), description).unwrap();
    dir
}

fn path(dir: &Path) -> &str {
    dir.to_str().unwrap()
}

const MINIMAL: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="m" guid="{g}">
  <CoSimulation modelIdentifier="m"/>
  <ModelVariables><ScalarVariable name="u" valueReference="0" causality="input"><Real/></ScalarVariable></ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

#[test]
fn validate_names_variable_line_and_mend_and_exits_with_1() {
    let dir = folder(MINIMAL);
    let out = trueup(&["fmu", "validate", path(dir.path())]);
    assert_eq!(out.status.code(), Some(1));
    let said = text(&out.stdout);
    assert!(
        said.contains(
            "modelDescription.xml, line 4: variable `u` has no start value but needs one: add `start`"
        ),
        "{said}"
    );
    assert!(said.contains("neither binaries nor sources"), "{said}");
    assert!(text(&out.stderr).is_empty());
}

#[test]
fn a_library_without_the_functions_is_found() {
    let dir = folder(&MINIMAL.replace("<Real/>", "<Real start=\"0\"/>"));
    let platform = trueup_fmi_description::FmiVersion::V2.platform();
    let binaries = dir.path().join("binaries").join(platform);
    std::fs::create_dir_all(&binaries).unwrap();
    let library = binaries.join(format!("m{}", std::env::consts::DLL_SUFFIX));
    std::fs::write(&library, "no library").unwrap();
    let said = text(&trueup(&["fmu", "validate", path(dir.path())]).stdout);
    assert!(said.contains("no shared library"), "{said}");
    // A real program that is no FMU: this one.
    std::fs::copy(env!("CARGO_BIN_EXE_trueup"), &library).unwrap();
    let said = text(&trueup(&["fmu", "validate", path(dir.path())]).stdout);
    assert!(said.contains("fmi2DoStep") && !said.contains("fmi2GetDerivatives"), "{said}");
    // For another machine only: a warning.
    std::fs::rename(&binaries, dir.path().join("binaries/elsewhere")).unwrap();
    let out = trueup(&["fmu", "validate", path(dir.path())]);
    assert_eq!(out.status.code(), Some(0), "{}", text(&out.stdout));
    assert!(text(&out.stdout).contains("1 warning"));
}

#[test]
fn info_of_a_foreign_fmu() {
    let dir = folder(MINIMAL);
    let out = trueup(&["fmu", "info", path(dir.path()), "--json"]);
    assert_eq!(out.status.code(), Some(0));
    let value: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(value["variables"][0]["type"], "Real");
    assert_eq!(value["interfaces"]["CoSimulation"]["modelIdentifier"], "m");
}

#[test]
fn one_message_and_the_right_exit_code() {
    let dir = folder("<fmiModelDescription");
    let broken = path(dir.path());
    for (arguments, code) in [
        (&["fmu", "info", "/nowhere.fmu"][..], 1),
        (&["fmu", "info", broken], 1),
        (&["fmu", "validate", "/nowhere.fmu"], 1),
        (&["fmu", "pack", "Nothing"], 2),
        (&["fmu", "pack", "--effect", "nothing"], 2),
        (&["fmu", "pack", "--preset", "nothing"], 2),
        (&["fmu", "pack", "TwoMassJoint", "--effect", "table-tilt"], 2),
        (&["fmu", "pack", "--fmi", "4"], 2),
        (&["fmu", "pack", "TwoMassJoint", "--library", "/nowhere"], 1),
        (&["fmu", "pack", "TwoMassJoint", "--set", "nothing=1"], 2),
        (&["fmu"], 2),
    ] {
        let out = trueup(arguments);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {}", text(&out.stderr));
        assert!(!text(&out.stderr).is_empty() && !text(&out.stderr).contains("panicked"), "{arguments:?}");
    }
}

#[test]
fn a_wrong_name_is_answered_by_the_one_that_was_meant() {
    for (arguments, said) in [
        (&["info", "/nowhere.fmu"][..], "error: /nowhere.fmu: there is no such file; look at the path"),
        (&["pack", "TwoMasJoint"], "error: there is no model `TwoMasJoint`; did you mean `TwoMassJoint`?"),
        (&["pack", "--effect", "backlsh"], "there is no effect `backlsh`; did you mean `backlash`?"),
        (&["pack", "--effect", "cable-stifness:base"], "did you mean `cable-stiffness`?"),
        (&["pack", "TwoMassJoint", "--set", "loadInerti=-1"], "did you mean `loadInertia`?"),
        (&["pack", "--preset", "xyz"], "there is no preset `xyz`; `trueup fmu list` shows them"),
    ] {
        let out = trueup(&[&["fmu"], arguments].concat());
        let error = text(&out.stderr);
        assert!(error.contains(said) && !error.contains('\u{1b}'), "{arguments:?}: {error}");
    }
}

#[test]
fn an_fmu_with_effects_bears_a_name_of_its_own() {
    let dir = tempfile::tempdir().unwrap();
    let pack = |effects: &[&str]| {
        let effects = effects.iter().flat_map(|e| ["--effect", e]);
        let arguments: Vec<&str> = ["fmu", "pack", "TwoMassJoint", "--fmi", "2", "-o", path(dir.path())]
            .into_iter()
            .chain(effects)
            .collect();
        let out = trueup(&arguments);
        assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
        let file = text(&out.stdout).trim().to_owned();
        let mut archive = Archive::open(Path::new(&file)).unwrap();
        let d = trueup_fmi_description::read::read(&archive.description().unwrap()).unwrap();
        let name = Path::new(&file).file_name().unwrap().to_string_lossy().into_owned();
        (name, d.model_name.clone(), d.description.clone())
    };
    let (file, name, description) = pack(&["sensor-delay:loadAngle", "backlash"]);
    assert_eq!(name, "TwoMassJoint+backlash+sensor-delay-loadAngle");
    assert_eq!(file, format!("{name}.fmi2.fmu"));
    assert!(description.starts_with(&format!("{name}: ")), "{description}");
    let (file, name, description) = pack(&[]);
    assert_eq!((file.as_str(), name.as_str()), ("TwoMassJoint.fmi2.fmu", "TwoMassJoint"));
    assert!(!description.contains('+'), "{description}");
}

/// What pulls at the links of an arm requires a base that holds against it, and its FMU has one.
#[test]
fn a_gravity_torque_of_an_arm_wants_a_fixed_base() {
    let dir = tempfile::tempdir().unwrap();
    let pack = |more: &[&str]| {
        let all =
            [&["fmu", "pack", "--effect", "gravity-torque", "--fmi", "3", "-o", path(dir.path())], more];
        let out = trueup(&all.concat());
        (out.status.code(), text(&out.stdout), text(&out.stderr))
    };
    let (code, _, said) = pack(&["PlanarManipulator"]);
    assert!(
        code == Some(2) && said.contains("--structure base=fixed") && said.lines().count() == 1,
        "{said}"
    );
    let (code, files, said) = pack(&["PlanarManipulator", "--structure", "base=fixed"]);
    assert!(code == Some(0) && files.trim().ends_with("PlanarManipulator+gravity-torque.fmi3.fmu"), "{said}");
    let mut archive = Archive::open(Path::new(files.trim())).unwrap();
    let d = trueup_fmi_description::read::read(&archive.description().unwrap()).unwrap();
    let torque = d.variables.iter().find(|v| v.name == "gravityTorque").unwrap();
    assert!(torque.dimensions.len() == 1 && d.variables.iter().any(|v| v.name == "gravityAngle"));
    // All models that can have it as they are by default.
    let (code, files, said) = pack(&[]);
    assert!(code == Some(0) && files.trim().ends_with("TwoMassJoint+gravity-torque.fmi3.fmu"), "{said}");
    assert_eq!(files.lines().count(), 1, "{files}");
    assert!(
        text(&trueup(&["fmu", "list"]).stdout).contains("[TwoMassJoint, PlanarManipulator with base=fixed]")
    );
}

/// The program does not mind a reader that has gone.
#[cfg(unix)]
#[test]
fn a_closed_pipe_is_no_error() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_trueup"))
        .args(["fmu", "list"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let out = child.wait_with_output().unwrap();
    assert_eq!((out.status.code(), text(&out.stderr).as_str()), (Some(0), ""));
}

#[test]
fn nothing_is_written_unless_all_of_it_can_be() {
    let dir = tempfile::tempdir().unwrap();
    let (inside, file) = (dir.path().join("out"), dir.path().join("file"));
    std::fs::write(&file, "").unwrap();
    for (arguments, code, said) in [
        // Within its bounds, but not of a flexible joint.
        (
            &["PlanarManipulator", "--set", "jointStiffness[1]=0", "-o", path(&inside)][..],
            2,
            "jointStiffness[1] = 0",
        ),
        (&["PlanarManipulator", "--set", "linkMass[1]=-1", "-o", path(&inside)], 2, "it must be above 0 kg"),
        (&["TwoMassJoint", "-o", path(&file)], 1, "name another one with --output"),
    ] {
        let out = trueup(&[&["fmu", "pack"], arguments].concat());
        let message = text(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{message}");
        assert!(message.contains(said) && message.lines().count() == 1, "{message}");
        assert!(!inside.exists());
    }
}

/// Values that are meant for other inputs: a spring that is too soft for those of the default experiment.
#[test]
fn what_the_default_experiment_breaks_is_packed_without_its_result() {
    let dir = tempfile::tempdir().unwrap();
    let references = |stiffness: &str| {
        let set = format!("cubicStiffness={stiffness}");
        let out = trueup(&[
            "fmu",
            "pack",
            "TwoMassJoint",
            "--effect",
            "nonlinear-stiffness",
            "--set",
            &set,
            "--fmi",
            "2",
            "-o",
            path(dir.path()),
        ]);
        assert_eq!(out.status.code(), Some(0), "{}", text(&out.stderr));
        let name = text(&out.stdout);
        let archive = Archive::open(Path::new(name.trim())).unwrap();
        let has = ["ref", "in"].map(|kind| archive.has(&format!("documentation/TwoMassJoint_{kind}.csv")));
        (has, text(&out.stderr).contains("packed without a reference result"))
    };
    assert_eq!(references("1e-6"), ([true; 2], false));
    assert_eq!(references("-1e3"), ([false; 2], true));
}
