//! Files and folders that the command line names and that cannot be read or written: one error with the name and the remedy, never the
//! system's words alone, and nothing is left behind.
#![cfg(target_os = "linux")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};

/// What is read, `@` for its name, and how that ends.
const READ: [(&[&str], &str); 41] = [
    (&["fmu", "info", "@"], ".fmu"),
    (&["fmu", "validate", "@"], ".fmu"),
    (&["fmu", "pack", "-o", "new", "--from", "@"], ".json"),
    (&["fmu", "pack", "SpatialFreeFlyer", "-o", "new", "--robot", "@"], ".toml"),
    (&["fmu", "pack", "SpatialFreeFlyer", "-o", "new", "--robot", "@"], ".urdf"),
    (&["fmu", "pack", "TwoMassJoint", "-o", "new", "--library", "@"], ""),
    (&["simulate", "@"], ".toml"),
    (&["simulate", "@"], ".fmu"),
    (&["simulate", "@"], ".ssp"),
    (&["simulate", "@"], ".ssd"),
    (&["simulate", "TwoMassJoint.fmi3.fmu", "--input", "@"], ".csv"),
    (&["simulate", "TwoMassJoint.fmi3.fmu", "--input", "@"], ".parquet"),
    (&["simulate", "TwoMassJoint.fmi3.fmu", "--input", "@"], ".h5"),
    (&["scale", "@", "--lambda", "0.5"], ".toml"),
    (&["scale", "@", "--lambda", "0.5"], ".fmu"),
    (&["scale", "@", "--lambda", "0.5"], ".ssp"),
    (&["scale", "@", "--lambda", "0.5", "--units", "TwoMassJoint.fmi3.fmu"], ".csv"),
    (&["scale", "in.csv", "--lambda", "0.5", "--units", "@"], ".toml"),
    (&["scale", "in.csv", "--lambda", "0.5", "--units", "@"], ".fmu"),
    (&["sweep", "@"], ".toml"),
    (&["sweep", "merge", "@"], ".toml"),
    (&["sweep", "map", "@"], ".toml"),
    (&["ports", "@"], ".fmu"),
    (&["ports", "TwoMassJoint.fmi3.fmu", "--ports", "@"], ".toml"),
    (&["init", "@"], ".csv"),
    (&["init", "@"], ".mcap"),
    (&["check", "@"], ".toml"),
    (&["check", "@"], ""),
    (&["identify", "@"], ""),
    (&["identify", "in.csv", "--fmu", "@"], ".fmu"),
    (&["diagnose", "@", "-o", "new"], ""),
    (&["statics", "@"], ".toml"),
    (&["robot", "@"], ".toml"),
    (&["robot", "@"], ".xml"),
    (&["arm", "map", "@", "--pose", "0"], ".urdf"),
    (&["trial", "generate", "-o", "new", "--corpus", "@"], ".csv"),
    (&["trial", "run", "@"], ""),
    (&["trial", "run", "trials", "--program", "@"], ""),
    (&["trial", "score", "@", "-o", "new.md"], ""),
    (&["lab", "run", "@"], ".toml"),
    (&["bench", "run", "@", "-o", "new.csv"], ""),
];

/// What is written.
const WRITTEN: [(&[&str], &str); 13] = [
    (&["simulate", "system.toml", "-o", "@"], ".csv"),
    (&["simulate", "system.toml", "-o", "@"], ".parquet"),
    (&["simulate", "system.toml", "-o", "new.csv", "--plot", "@"], ".html"),
    (&["simulate", "system.toml", "-o", "new.csv", "--log", "@"], ".txt"),
    (&["simulate", "system.toml", "--save-ssp", "@"], ".ssp"),
    (&["robot", "chaser", "--surface", "2,3", "--points", "2", "-o", "@"], ".csv"),
    (&["robot", "chaser", "--surface", "2,3", "--points", "2", "-o", "new.csv", "--plot", "@"], ".html"),
    (&["scale", "table.toml", "--lambda", "0.5", "-o", "@"], ".toml"),
    (&["identify", "gone", "--plot", "@"], ".html"),
    (&["sweep", "sweep.toml", "--run", "1", "-o", "@"], ".csv"),
    (&["sweep", "merge", "sweep.toml", "-o", "@"], ".parquet"),
    (&["ports", "TwoMassJoint.fmi3.fmu", "-o", "@"], ".toml"),
    (&["man", "-o", "@"], ""),
];

const SYSTEM: &str =
    "[components.joint]\nfmu = \"TwoMassJoint.fmi3.fmu\"\n\n[run]\nstop = 0.1\nstep = 0.01\n";
const SWEEP: &str = "system = \"system.toml\"\ndesign = \"grid\"\n\n[factors]\nk = { variable = \"joint.stiffness\", values = [2e-5, 3e-5] }\n\n\
                     [outputs]\nangle = { variable = \"joint.motorAngle\" }\n";

fn trueup(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueup")).args(arguments).current_dir(folder).output().unwrap()
}

fn desk() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    file("in.csv", "time,motorCurrent\n0,0.01\n1,0.02\n");
    file("system.toml", SYSTEM);
    file("sweep.toml", SWEEP);
    file("table.toml", "target = { value = 7900, unit = \"kg\" }\n");
    std::fs::create_dir_all(folder.path().join("trials/cases")).unwrap();
    for end in [
        "", ".fmu", ".json", ".toml", ".urdf", ".ssp", ".ssd", ".csv", ".parquet", ".h5", ".mcap", ".xml",
        ".html", ".txt",
    ] {
        std::fs::create_dir(folder.path().join(format!("folder{end}"))).unwrap();
        std::os::unix::fs::symlink(format!("loop{end}"), folder.path().join(format!("loop{end}"))).unwrap();
    }
    for arguments in [&["fmu", "pack", "TwoMassJoint", "--fmi", "3"][..], &["sweep", "sweep.toml"]] {
        let out = trueup(folder.path(), arguments);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }
    folder
}

fn names(folder: &Path) -> BTreeSet<String> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect()
}

/// One error, which names the file and does not end with the system's message.
#[track_caller]
fn refused(folder: &Path, arguments: &[&str], name: &str) {
    let (before, arguments): (_, Vec<&str>) =
        (names(folder), arguments.iter().map(|a| if *a == "@" { name } else { *a }).collect());
    let out = trueup(folder, &arguments);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(1), "{arguments:?}: {said}");
    let errors: Vec<&str> = said.lines().filter(|line| line.starts_with("error: ")).collect();
    let [error] = errors[..] else { panic!("{arguments:?}: {said}") };
    let remedy = error.rsplit_once("; ").or_else(|| error.rsplit_once(": ")).map_or("", |(_, remedy)| remedy);
    assert!(error.contains(name), "{arguments:?}: {said}");
    assert!(remedy.len() > 10 && !remedy.contains("os error"), "{arguments:?}: no remedy: {said}");
    assert_eq!(names(folder), before, "{arguments:?}: {said}");
}

#[test]
fn what_cannot_be_read_is_named_with_its_remedy() {
    read(&["gone"]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn whatever_cannot_be_read_is_named_with_its_remedy() {
    read(&["loop", "in.csv/below", "folder"]);
}

fn read(stems: &[&str]) {
    let desk = desk();
    for (arguments, end) in READ {
        for stem in stems {
            let name = format!("{stem}{end}");
            // These are folders, or may be: their messages are about what is in them.
            let folders = ["", ".fmu"].contains(&end) || ["init", "check", "statics"].contains(&arguments[0]);
            if *stem != "folder" || !folders {
                refused(desk.path(), arguments, &name);
            }
        }
    }
}

#[test]
fn what_cannot_be_written_is_named_before_the_work() {
    written(&["nowhere/new", "folder"]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn whatever_cannot_be_written_is_named_before_the_work() {
    written(&["in.csv/below", "/proc/new"]);
}

fn written(stems: &[&str]) {
    let desk = desk();
    for (arguments, end) in WRITTEN {
        for stem in stems {
            // Folders are made, and may be there.
            if !end.is_empty() || ["in.csv/below", "/proc/new"].contains(stem) {
                refused(desk.path(), arguments, &format!("{stem}{end}"));
            }
        }
    }
}
