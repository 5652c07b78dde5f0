//! Results of FMUs in processes of their own are those of FMUs within the process, bit by bit.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};
use std::process::Command;

use trueup_fmi_import::{UnpackedFmu, UsedInterface};
use trueup_testkit::{BlockVersion, compiler, problems};

fn simulate(folder: &Path, arguments: &[&str]) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    let out =
        program.arg("simulate").args(arguments).args(["-o", "r.csv"]).current_dir(folder).output().unwrap();
    assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    std::fs::read_to_string(folder.join("r.csv")).unwrap()
}

/// Rows of both runs, which are the same.
#[track_caller]
fn same(folder: &Path, arguments: &[&str]) -> usize {
    let within = simulate(folder, arguments);
    let isolated = simulate(folder, &[arguments, &["--isolate", "--deadline", "60"]].concat());
    let first = within.lines().zip(isolated.lines()).find(|(a, b)| a != b);
    assert!(within == isolated, "{arguments:?}: {first:?}");
    within.lines().count() - 1
}

const DECAY: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="Decay" guid="{g}" numberOfEventIndicators="0">
  <ModelExchange modelIdentifier="decay"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output" variability="continuous" initial="exact"><Real start="1"/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="1" causality="local" variability="continuous"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="fixed"><Real start="1"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs><Derivatives><Unknown index="2"/></Derivatives></ModelStructure>
</fmiModelDescription>"#;

/// A foreign FMU for Model Exchange in a folder of this name, with a case of its recording.
fn decay(folder: &Path, name: &str, flags: &[&str]) -> Option<()> {
    let platform = match std::env::consts::ARCH {
        "x86_64" => "linux64".into(),
        other => format!("{other}-linux"),
    };
    let binaries = folder.join(name).join("binaries").join(platform);
    std::fs::create_dir_all(&binaries).unwrap();
    std::fs::write(folder.join(name).join("modelDescription.xml"), DECAY).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/decay.c");
    let mut cc = Command::new("cc");
    cc.args(["-shared", "-fPIC", "-o"]).arg(binaries.join("decay.so")).arg(source).args(flags);
    if !cc.status().is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: no C compiler (cc)");
        return None;
    }
    let row = |i: i32| {
        let t = f64::from(i) * 0.06;
        // Not a number of either noise, but as far from the curve.
        let noise = 1e-3 * (f64::from(i * i % 17) / 8.0 - 1.0);
        format!("{t:?},{:?}\n", (-0.7 * t).exp() + noise)
    };
    let rows: String = (0..30).map(row).collect();
    std::fs::write(folder.join("a.csv"), format!("time,x\n{rows}")).unwrap();
    let case = "model = \"Decay\"\ntrain = [\"a.csv\"]\n[parameters]\nk = 1.0\n[fit]\nparameters = [\"k\"]\n[channels.x]\nnoise = 1e-3\n";
    std::fs::write(folder.join("case.toml"), case).unwrap();
    Some(())
}

#[test]
fn a_stranger_is_identified_in_processes_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let Some(()) = decay(folder.path(), "well", &[]) else { return };
    let Some(()) = decay(folder.path(), "crashes", &["-DCRASH"]) else { return };
    let identify = |fmu: &str, more: &[&str]| {
        let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
        program.args(["identify", ".", "--json", "--fast", "--fmu", fmu]).args(more);
        program.current_dir(folder.path()).output().unwrap()
    };
    let isolated = identify("well", &["--deadline", "60"]);
    assert!(isolated.status.success(), "{}", String::from_utf8_lossy(&isolated.stderr));
    let within = identify("well", &["--in-process"]);
    assert_eq!(String::from_utf8_lossy(&isolated.stdout), String::from_utf8_lossy(&within.stdout));
    let said = String::from_utf8_lossy(&isolated.stdout);
    assert!(said.contains("\"k\""), "{said}");

    let out = identify("crashes", &[]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    for word in ["fmi2GetDerivatives", "(crashes)", "crashed: SIGSEGV"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let out = identify("crashes", &["--in-process"]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    assert!(said.contains("crashes"), "{said}");
}

#[test]
fn ours_is_what_has_our_configuration_with_its_token() {
    let folder = tempfile::tempdir().unwrap();
    let Some((_packed, files)) = packed() else { return };
    let ours = |file: &Path| UnpackedFmu::open(file).unwrap().is_ours(UsedInterface::ModelExchange);
    assert!(files.iter().all(|file| ours(file)));
    let Some(()) = decay(folder.path(), "stranger", &[]) else { return };
    assert!(!ours(&folder.path().join("stranger")));
    // Our library behind the description of another FMU.
    let mut archive = trueup_fmi_description::archive::Archive::open(&files[0]).unwrap();
    let copy = folder.path().join("copy");
    std::fs::create_dir(&copy).unwrap();
    archive.extract(&copy).unwrap();
    assert!(ours(&copy));
    let file = copy.join("modelDescription.xml");
    let text = std::fs::read_to_string(&file).unwrap();
    let token = UnpackedFmu::open(&copy).unwrap().description().token.clone();
    std::fs::write(&file, text.replace(&token, "{another}")).unwrap();
    assert!(!ours(&copy));
}

/// Our FMUs, those under test (TRUEUP_FMUS) or packed here; `None`, with a message: the library that they are made of is not there.
/// Next to them a folder to work in.
fn packed() -> Option<(tempfile::TempDir, Vec<PathBuf>)> {
    let folder = tempfile::tempdir().unwrap();
    let there = std::env::var_os("TRUEUP_FMUS").map(PathBuf::from).filter(|there| there.is_dir());
    if let Some(there) = there {
        for file in fmus(&there) {
            std::fs::copy(&file, folder.path().join(file.file_name().unwrap())).unwrap();
        }
    } else {
        let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
        let out = program.args(["fmu", "pack", "-o"]).arg(folder.path()).output().unwrap();
        if !out.status.success() {
            eprintln!("SKIPPED: {}", String::from_utf8_lossy(&out.stderr));
            return None;
        }
    }
    let files = fmus(folder.path());
    Some((folder, files))
}

fn fmus(folder: &Path) -> Vec<PathBuf> {
    let all = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = all.filter(|file| file.extension().is_some_and(|e| e == "fmu")).collect();
    files.sort();
    files
}

#[test]
fn our_fmus_give_the_same_bits() {
    the_same_bits(false);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn all_our_fmus_give_the_same_bits() {
    the_same_bits(true);
}

/// Of the packed FMUs, in the order of their names; each model in one version by one interface, from model to model another pair of them,
/// or all.
fn the_same_bits(all: bool) {
    let chosen = |place: usize, interface: &str| {
        let (model, version) = (place / 2, place % 2);
        all || version == model % 2 && (interface == "me") == (model / 2 % 2 == 0)
    };
    let Some((folder, files)) = packed() else { return };
    assert_eq!(files.len(), 20);
    for (place, file) in files.iter().enumerate() {
        for interface in ["cs", "me"].into_iter().filter(|interface| chosen(place, interface)) {
            let file = file.to_str().unwrap();
            let rows =
                same(folder.path(), &[file, "--interface", interface, "--stop", "0.02", "--step", "0.001"]);
            // Rows at events are next to those of the steps: motors of the arm break away.
            assert!(rows >= 21, "{file} {interface}: {rows} rows");
        }
    }
    // A plant and its controller, of both versions and interfaces.
    let loops = [("fmi3", "me"), ("fmi2", "cs"), ("fmi3", "cs")];
    for (version, interface) in loops.into_iter().take(if all { 3 } else { 1 }) {
        let toml = include_str!("../../../examples/01-joint/joint.toml");
        let toml = toml.replace("../../out/", "").replace("fmi3", version);
        std::fs::write(folder.path().join("joint.toml"), toml).unwrap();
        let rows = same(folder.path(), &["joint.toml", "--stop", "0.2", "--interface", interface]);
        assert!(rows >= 201, "{version} {interface}: {rows} rows");
    }
}

#[test]
fn coupled_strangers_give_the_same_bits_with_every_algorithm() {
    if !compiler() {
        eprintln!("SKIPPED: no C compiler (cc)");
        return;
    }
    // By each algorithm in one version.
    coupled_strangers(|version, place| (version == BlockVersion::Two) == (place % 2 == 0));
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn coupled_strangers_of_both_versions_give_the_same_bits() {
    if compiler() {
        coupled_strangers(|_, _| true);
    }
}

/// With the versions and algorithms that are chosen.
fn coupled_strangers(chosen: impl Fn(BlockVersion, usize) -> bool) {
    for version in BlockVersion::ALL {
        let folder = tempfile::tempdir().unwrap();
        let problem = problems::two_mass();
        let links: Vec<_> = problem.connections.iter().map(|(a, b)| format!("'{a} -> {b}'")).collect();
        let mut toml = format!("connections = [{}]\n[run]\nstop = 1\nstep = 0.01\n", links.join(", "));
        for block in &problem.blocks {
            let file = block.build(version, folder.path()).unwrap();
            toml.push_str(&format!("[components.{}]\nfmu = '{}'\n", block.name, file.display()));
        }
        std::fs::write(folder.path().join("s.toml"), toml).unwrap();
        let algorithms = ["jacobi", "gauss-seidel", "extrapolate", "iterative", "adaptive"];
        for (_, algorithm) in algorithms.into_iter().enumerate().filter(|(k, _)| chosen(version, *k)) {
            let rows = same(folder.path(), &["s.toml", "--algorithm", algorithm]);
            assert!(rows > 10, "{algorithm}: {rows} rows");
        }
    }
}
