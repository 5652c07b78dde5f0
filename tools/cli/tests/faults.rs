//! Every fault of an FMU through the program, with a process of its own for each FMU: docs/faults.md. And what is left of
//! those that break the process within it.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;
use trueup_testkit::{BlockVersion, compiler, problems};

// As in tests/kit/c/block.h.
const WARNING: u32 = 1;
const DISCARD: u32 = 2;
const ERROR: u32 = 3;
const FATAL: u32 = 4;
const NOT_A_NUMBER: u32 = 5;
const FINE_STEPS: u32 = 7;
const CRASH: u32 = 50;
const ABORT: u32 = 51;
const EXIT: u32 = 52;
const HANG: u32 = 53;
const OVERFLOW: u32 = 54;
const CHDIR: u32 = 55;

/// Two masses, each an FMU of its own, as `s.toml` in a folder; `None`, with a message: there is no C compiler.
fn system(version: BlockVersion) -> Option<TempDir> {
    if !compiler() {
        eprintln!("SKIPPED: no C compiler (cc)");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let problem = problems::two_mass();
    let mut toml = String::from("connections = [\n");
    problem.connections.iter().for_each(|(a, b)| toml.push_str(&format!("  '{a} -> {b}',\n")));
    toml.push_str("]\n[run]\nalgorithm = 'jacobi'\nstop = 1\nstep = 0.01\n");
    for block in &problem.blocks {
        let file = block.build(version, folder.path()).unwrap();
        let file = file.file_name().unwrap().to_str().unwrap().to_owned();
        toml.push_str(&format!("[components.{}]\nfmu = '{file}'\n", block.name));
    }
    std::fs::write(folder.path().join("s.toml"), toml).unwrap();
    Some(folder)
}

fn simulate(folder: &Path, arguments: &[&str]) -> Output {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    program.arg("simulate").args(arguments).current_dir(folder).output().unwrap()
}

/// Component `right` fails from 0.5 s on.
fn failing(folder: &Path, fault: u32, more: &[&str]) -> (Option<i32>, String) {
    let set = format!("right.fault={fault}");
    let arguments = [&["s.toml", "--set", &set, "--set", "right.faultTime=0.5"], more].concat();
    let out = simulate(folder, &arguments);
    (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
}

/// The times of a file of results.
fn times(file: &Path) -> Vec<f64> {
    let text = std::fs::read_to_string(file).unwrap();
    text.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect()
}

/// What is left of a run next to its files.
fn left(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "s.toml" && !name.ends_with(".fmu"))
        .collect();
    names.sort();
    names
}

/// Processes that still work in a folder.
fn processes_in(folder: &Path) -> Vec<PathBuf> {
    let folder = folder.canonicalize().unwrap();
    let all = std::fs::read_dir("/proc").unwrap().flatten().map(|it| it.path());
    all.filter(|it| std::fs::read_link(it.join("cwd")).is_ok_and(|cwd| cwd == folder)).collect()
}

/// The run failed at 0.5 s, and what was computed before is kept; what was there before is not mistaken for it.
#[track_caller]
fn failed(folder: &Path, (code, said): &(Option<i32>, String), words: &[&str]) {
    assert_eq!(*code, Some(1), "{said}");
    for word in words {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert!(said.contains("at t = 0.5 s") || said.contains("at t = 0.51"), "{said}");
    let kept = times(&folder.join("results.partial.csv"));
    assert!(kept.last().is_some_and(|t| (0.49..0.511).contains(t)), "{:?}: {said}", kept.last());
    assert_eq!(left(folder), ["results.partial.csv", "results.previous.csv"], "{said}");
    assert!(said.contains("results.csv of an earlier run is kept as results.previous.csv"), "{said}");
    std::fs::rename(folder.join("results.previous.csv"), folder.join("results.csv")).unwrap();
    std::fs::remove_file(folder.join("results.partial.csv")).unwrap();
}

#[test]
fn every_fault_of_an_isolated_fmu_costs_that_fmu_alone() {
    faults_cost_that_fmu_alone(&[BlockVersion::Three]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn every_fault_of_an_isolated_fmu_costs_that_fmu_alone_in_fmi_2() {
    faults_cost_that_fmu_alone(&[BlockVersion::Two]);
}

fn faults_cost_that_fmu_alone(versions: &[BlockVersion]) {
    for &version in versions {
        let Some(folder) = system(version) else { return };
        let folder = folder.path();
        std::fs::write(folder.join("results.csv"), "of an earlier run\n").unwrap();
        let file = format!("\"right\" ({})", folder.join(format!("right.{}.fmu", version.tag())).display());
        let file = file.replace(&format!("{}/", folder.display()), "");
        let step = if version == BlockVersion::Two { "fmi2DoStep" } else { "fmi3DoStep" };
        for (fault, words) in [
            (ERROR, &["right", step, "returned Error", "fault 3 at 0.5 s"][..]),
            (DISCARD, &["right", "Discard", "fault 2"]),
            (FATAL, &["right", step, "returned Fatal", "fault 4 at 0.5 s"]),
            (NOT_A_NUMBER, &["F of instance \"right\" is NaN"]),
            (CRASH, &[step, &file, "crashed: SIGSEGV", "fault 50 at 0.5 s"]),
            (ABORT, &[step, &file, "crashed: SIGABRT", "fault 51 at 0.5 s"]),
            (EXIT, &[step, &file, "called exit(0)", "fault 52 at 0.5 s"]),
            (HANG, &[step, &file, "did not return within 1 s and was stopped", "fault 53 at 0.5 s"]),
            (OVERFLOW, &[step, &file, "its stack overflowed", "fault 54 at 0.5 s"]),
        ] {
            let deadline: &[&str] = if fault == HANG { &["--deadline", "1"] } else { &[] };
            let done = failing(folder, fault, &[&["--isolate"], deadline].concat());
            failed(folder, &done, words);
            let outlived = processes_in(folder);
            assert!(outlived.is_empty(), "{fault}: {outlived:?}");
        }
        // What is no fault, and what concerns the FMU's process alone.
        for fault in [WARNING, FINE_STEPS, CHDIR] {
            let (code, said) = failing(folder, fault, &["--isolate"]);
            assert_eq!(code, Some(0), "{fault}: {said}");
            assert_eq!(times(&folder.join("results.csv")).last(), Some(&1.0), "{fault}");
            assert_eq!(left(folder), ["results.csv"], "{fault}");
        }
    }
}

/// Faults of coupled algorithms that repeat steps, which save and restore states.
#[test]
fn other_algorithms_end_as_well() {
    let Some(folder) = system(BlockVersion::Three) else { return };
    for algorithm in ["extrapolate", "iterative", "adaptive"] {
        std::fs::write(folder.path().join("results.csv"), "of an earlier run\n").unwrap();
        let more = ["--isolate", "--algorithm", algorithm, "--tolerance", "1e-4"];
        let (code, said) = failing(folder.path(), CRASH, &more);
        assert_eq!(code, Some(1), "{algorithm}: {said}");
        assert!(said.contains("crashed: SIGSEGV") && said.contains("right"), "{algorithm}: {said}");
        assert!(times(&folder.path().join("results.partial.csv")).len() > 2, "{algorithm}");
    }
}

#[test]
fn an_exception_that_nobody_catches_ends_the_run() {
    let folder = tempfile::tempdir().unwrap();
    let fmu = folder.path().join("throwing");
    let platform = match std::env::consts::ARCH {
        "x86_64" => "linux64".into(),
        other => format!("{other}-linux"),
    };
    let binaries = fmu.join("binaries").join(platform);
    std::fs::create_dir_all(&binaries).unwrap();
    let description = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="throwing" guid="{g}">
  <CoSimulation modelIdentifier="throwing" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables><ScalarVariable name="y" valueReference="1" causality="output"><Real/></ScalarVariable></ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/></Outputs></ModelStructure>
</fmiModelDescription>"#;
    std::fs::write(fmu.join("modelDescription.xml"), description).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/throwing.cpp");
    let mut compiler = Command::new("c++");
    compiler.args(["-shared", "-fPIC", "-o"]).arg(binaries.join("throwing.so")).arg(source);
    if !compiler.status().is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: no C++ compiler (c++)");
        return;
    }
    let out = simulate(folder.path(), &["throwing", "--stop", "1", "--step", "0.1", "--isolate"]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    for word in ["fmi2DoStep", "\"throwing\"", "SIGABRT", "an uncaught exception", "about to throw at 0.5 s"]
    {
        assert!(said.contains(word), "{word}: {said}");
    }
    assert_eq!(times(&folder.path().join("results.partial.csv")).len(), 6, "{said}");
}

/// Without a process of its own: at least the run does not look like a good one.
#[test]
fn exit_within_the_process_is_no_success() {
    for version in BlockVersion::ALL {
        let Some(folder) = system(version) else { return };
        std::fs::write(folder.path().join("results.csv"), "of an earlier run\n").unwrap();
        let (code, said) = failing(folder.path(), EXIT, &[]);
        assert_eq!(code, Some(1), "{said}");
        let file = format!("right.{}.fmu", version.tag());
        for word in ["at t = 0.5 s", "\"right\"", &file, "called exit", "fault 52 at 0.5 s"] {
            assert!(said.contains(word), "{word}: {said}");
        }
        assert!(!folder.path().join("results.csv").exists());
        // What it leaves is gone with the next run.
        assert!(left(folder.path()).iter().any(|name| name.ends_with(".part")), "{:?}", left(folder.path()));
        let (code, said) = failing(folder.path(), 0, &[]);
        assert_eq!(code, Some(0), "{said}");
        assert_eq!(left(folder.path()), ["results.csv", "results.previous.csv"]);
    }
}

#[test]
fn a_change_of_the_working_directory_is_told_and_undone() {
    for version in BlockVersion::ALL {
        let Some(folder) = system(version) else { return };
        std::fs::write(folder.path().join("results.csv"), "of an earlier run\n").unwrap();
        let (code, said) = failing(folder.path(), CHDIR, &["--log", "run.log"]);
        assert_eq!(code, Some(1), "{said}");
        for word in
            ["changed the working directory to /", "that is undone", "\"right\"", "results.partial.csv"]
        {
            assert!(said.contains(word), "{word}: {said}");
        }
        assert_eq!(left(folder.path()), ["results.partial.csv", "results.previous.csv", "run.log"]);
    }
}

/// SIGTERM ends a run as Ctrl-C does: what was computed is kept.
#[test]
fn a_run_that_is_terminated_keeps_what_it_has() {
    use std::io::{BufRead, BufReader};
    for isolate in [&[][..], &["--isolate"]] {
        let Some(folder) = system(BlockVersion::Two) else { return };
        let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
        program.args(["simulate", "s.toml", "--stop", "1e6", "--progress"]).args(isolate);
        program.current_dir(folder.path()).stderr(std::process::Stdio::piped());
        let mut child = program.spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let begun = lines.next().unwrap().unwrap();
        assert!(begun.contains('%'), "{begun}");
        let id = nix::unistd::Pid::from_raw(child.id() as i32);
        nix::sys::signal::kill(id, nix::sys::signal::Signal::SIGTERM).unwrap();
        let said: Vec<String> = lines.map(Result::unwrap).collect();
        assert_eq!(child.wait().unwrap().code(), Some(1), "{said:?}");
        assert!(said.iter().any(|line| line.contains("interrupted")), "{said:?}");
        assert!(times(&folder.path().join("results.partial.csv")).len() > 1);
        assert_eq!(left(folder.path()), ["results.partial.csv"]);
    }
}

/// The master is killed: no process is left behind.
#[test]
fn no_fmu_outlives_its_master() {
    let Some(folder) = system(BlockVersion::Three) else { return };
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    let fault = ["--set", "right.fault=53", "--set", "right.faultTime=0.5", "--isolate"];
    program.args(["simulate", "s.toml"]).args(fault).current_dir(folder.path());
    let mut child = program.spawn().unwrap();
    let waited = |until: &dyn Fn(usize) -> bool| {
        (0..600).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(50));
            until(processes_in(folder.path()).len())
        })
    };
    assert!(waited(&|n| n == 3), "the program and two FMUs: {:?}", processes_in(folder.path()));
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(waited(&|n| n == 0), "{:?}", processes_in(folder.path()));
}
