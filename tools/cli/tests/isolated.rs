//! Results of FMUs in processes of their own are those of FMUs within the process, bit by bit.
#![cfg(target_os = "linux")]

use std::path::{Path, PathBuf};
use std::process::Command;

use trueup_testkit::{Version, compiler, problems};

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

/// Our FMUs, packed here; `None`, said aloud: the library that they are made of is not there.
fn packed() -> Option<(tempfile::TempDir, Vec<PathBuf>)> {
    let folder = tempfile::tempdir().unwrap();
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    let out = program.args(["fmu", "pack", "-o"]).arg(folder.path()).output().unwrap();
    if !out.status.success() {
        eprintln!("SKIPPED: {}", String::from_utf8_lossy(&out.stderr));
        return None;
    }
    let mut files: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|f| f.unwrap().path()).collect();
    files.sort();
    Some((folder, files))
}

#[test]
fn our_fmus_give_the_same_bits() {
    let Some((folder, files)) = packed() else { return };
    assert_eq!(files.len(), 8);
    for file in &files {
        for interface in ["cs", "me"] {
            let file = file.to_str().unwrap();
            let rows =
                same(folder.path(), &[file, "--interface", interface, "--stop", "0.05", "--step", "0.001"]);
            assert_eq!(rows, 51, "{file} {interface}");
        }
    }
    // A plant and its controller, of both versions and interfaces.
    for (version, interface) in [("fmi2", "cs"), ("fmi3", "cs"), ("fmi3", "me")] {
        let toml = include_str!("../../../examples/joint.toml");
        let toml = toml.replace("../out/", "").replace("fmi3", version);
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
    for version in Version::ALL {
        let folder = tempfile::tempdir().unwrap();
        let problem = problems::two_mass();
        let links: Vec<_> = problem.connections.iter().map(|(a, b)| format!("'{a} -> {b}'")).collect();
        let mut toml = format!("connections = [{}]\n[run]\nstop = 1\nstep = 0.01\n", links.join(", "));
        for block in &problem.blocks {
            let file = block.build(version, folder.path()).unwrap();
            toml.push_str(&format!("[components.{}]\nfmu = '{}'\n", block.name, file.display()));
        }
        std::fs::write(folder.path().join("s.toml"), toml).unwrap();
        for algorithm in ["jacobi", "gauss-seidel", "extrapolate", "iterative", "adaptive"] {
            let rows = same(folder.path(), &["s.toml", "--algorithm", algorithm]);
            assert!(rows > 10, "{algorithm}: {rows} rows");
        }
    }
}
