//! `trueup sweep`: killed at any time it goes on; exit codes; what a cluster is given.
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use trueup_testkit::{BlockVersion, compiler, problems};

const SWEEP: &str = r#"system = "left.fmi2.fmu"
design = "sobol"
runs = 3000
seed = 1

[run]
stop = 1
step = 0.001

[factors]
x1Start = { from = -1, to = 1 }
fault = { values = [0, 0, 0, 3] }

[outputs]
x1 = { take = "rms" }
"#;

fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    program.args(arguments).current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::piped());
    program
}

fn trueup(folder: &Path, arguments: &[&str]) -> Output {
    program(folder, arguments).output().unwrap()
}

/// Of a command that does its work: its output.
#[track_caller]
fn well(folder: &Path, arguments: &[&str]) -> String {
    let out = trueup(folder, arguments);
    assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8_lossy(&out.stdout).into_owned()
}

fn desk() -> Option<tempfile::TempDir> {
    if !compiler() {
        eprintln!("SKIPPED: no C compiler (cc)");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    problems::two_mass().blocks[0].build(BlockVersion::Two, folder.path()).unwrap();
    std::fs::write(folder.path().join("s.toml"), SWEEP).unwrap();
    Some(folder)
}

/// Numbers of the runs in all logs, in no order.
fn logged(folder: &Path) -> Vec<u64> {
    let mut runs = Vec::new();
    for log in std::fs::read_dir(folder.join("s.runs")).into_iter().flatten() {
        let text = std::fs::read_to_string(log.unwrap().path()).unwrap();
        let run = |line: &str| line.split("\"run\":").nth(1)?.split(',').next()?.parse::<u64>().ok();
        runs.extend(text.lines().filter_map(run));
    }
    runs
}

#[test]
fn killed_at_any_time_it_goes_on_without_loss_or_repeat() {
    let Some(folder) = desk() else { return };
    let folder = folder.path();
    let said = well(folder, &["sweep", "s.toml"]);
    assert!(said.starts_with("s.runs: 3000 runs; 750 of them failed"), "{said}");
    assert!(
        well(folder, &["sweep", "merge", "s.toml"]).starts_with("s.parquet: 3000 runs, 750 of them failed")
    );
    let whole = std::fs::read(folder.join("s.parquet")).unwrap();
    std::fs::remove_dir_all(folder.join("s.runs")).unwrap();
    let (mut kills, mut at) = (0, 0_u64);
    for shard in ["1/1", "2/3", "1/1", "1/2", "3/3", "1/1", "2/2", "1/1"] {
        let mut child = program(folder, &["sweep", "s.toml", "--shard", shard]).spawn().unwrap();
        // Sooner, later: also while it still reads.
        at += 1;
        std::thread::sleep(Duration::from_millis(7 * at * at % 90));
        kills += u32::from(child.try_wait().unwrap().is_none());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert!(kills > 2, "{kills}");
    well(folder, &["sweep", "s.toml"]);
    let mut runs = logged(folder);
    runs.sort_unstable();
    assert_eq!(runs, (1..=3000).collect::<Vec<_>>());
    well(folder, &["sweep", "merge", "s.toml", "-o", "again.parquet"]);
    assert!(std::fs::read(folder.join("again.parquet")).unwrap() == whole);
}

/// Also one that is killed while it begins has no process that goes on, and would write the same logs.
#[test]
#[cfg(target_os = "linux")]
fn what_is_killed_as_it_begins_leaves_no_process() {
    let Some(folder) = desk() else { return };
    let folder = std::fs::canonicalize(folder.path()).unwrap();
    let there = || {
        let processes = std::fs::read_dir("/proc").unwrap().flatten();
        processes.filter(|p| std::fs::read_link(p.path().join("cwd")).is_ok_and(|cwd| cwd == folder)).count()
    };
    for after in 0..40 {
        let mut child = program(&folder, &["sweep", "s.toml"]).spawn().unwrap();
        std::thread::sleep(Duration::from_micros(250 * after));
        child.kill().unwrap();
        child.wait().unwrap();
        // What is being ended takes a moment; the sweep takes longer than this.
        let gone = (0..50).any(|_| {
            std::thread::sleep(Duration::from_millis(10));
            there() == 0
        });
        assert!(gone, "killed after {} us", 250 * after);
    }
}

/// The same as a user who starts the program elsewhere, and as a cluster does.
#[test]
fn the_array_script_runs_every_share() {
    let Some(folder) = desk() else { return };
    let folder = folder.path();
    std::fs::write(folder.join("s.toml"), SWEEP.replace("runs = 3000", "runs = 300")).unwrap();
    well(folder.parent().unwrap(), &["sweep", folder.join("s.toml").to_str().unwrap()]);
    well(folder, &["sweep", "merge", "s.toml"]);
    let whole = std::fs::read(folder.join("s.parquet")).unwrap();
    std::fs::remove_dir_all(folder.join("s.runs")).unwrap();
    let said = well(folder, &["sweep", "s.toml", "--slurm=3"]);
    assert!(said.starts_with("s.slurm.sh: 3 tasks"), "{said}");
    assert!(!folder.join("s.runs").exists());
    let script = std::fs::read_to_string(folder.join("s.slurm.sh")).unwrap();
    assert!(script.contains("#SBATCH --array=1-3\n"), "{script}");
    for task in ["2", "3", "1"] {
        let mut bash = Command::new("bash");
        bash.arg("s.slurm.sh").current_dir(folder).env("SLURM_ARRAY_TASK_ID", task);
        bash.env("TRUEUP", env!("CARGO_BIN_EXE_trueup"));
        assert!(bash.output().unwrap().status.success());
    }
    well(folder, &["sweep", "merge", "s.toml"]);
    assert!(std::fs::read(folder.join("s.parquet")).unwrap() == whole);
}

#[test]
fn one_run_once_more_has_all_outputs_and_touches_no_log() {
    let Some(folder) = desk() else { return };
    let folder = folder.path();
    std::fs::write(folder.join("s.toml"), SWEEP.replace("[0, 0, 0, 3]", "[0]")).unwrap();
    let said = well(folder, &["sweep", "s.toml", "--run", "1"]);
    assert!(said.contains("x1Start = ") && said.contains("fault = 0") && said.contains("x1 = "), "{said}");
    let results = std::fs::read_to_string(folder.join("s-run-1.csv")).unwrap();
    assert!(results.starts_with("time,x1,v1\n") && results.lines().count() == 1002, "{}", &results[..20]);
    assert!(!folder.join("s.runs").exists());
}

/// With a process of its own an FMU that crashes is one run's reason.
#[test]
fn a_crash_is_a_row() {
    let Some(folder) = desk() else { return };
    let folder = folder.path();
    let text = SWEEP.replace("[0, 0, 0, 3]", "[0, 50]").replace("runs = 3000", "runs = 4");
    std::fs::write(folder.join("s.toml"), text).unwrap();
    let said = well(folder, &["sweep", "s.toml", "--isolate"]);
    assert!(said.starts_with("s.runs: 4 runs; 2 of them failed"), "{said}");
    let log = std::fs::read_to_string(folder.join("s.runs/1-of-1.log")).unwrap();
    assert_eq!(log.matches("crashed: SIGSEGV").count(), 2, "{log}");
}

#[test]
fn mistakes_have_their_exit_code() {
    let Some(folder) = desk() else { return };
    let folder = folder.path();
    for (arguments, code, said) in [
        (&["s.toml", "--run", "3001"][..], 2, "there is no run 3001: the sweep has runs 1 to 3000"),
        (&["s.toml", "--shard", "3/2"], 2, "write I/N with 1 <= I <= N"),
        (&["s.toml", "--slurm=0"], 2, "0 is not in"),
        (&["s.toml", "-o", "r.csv"], 2, "--run"),
        (&["absent.toml"], 1, "absent.toml: "),
        (&["merge", "s.toml"], 1, "s.runs: no run is done yet; `trueup sweep s.toml` goes on"),
        (&["merge", "s.toml", "-o", "t.csv"], 2, "end with .parquet"),
        (&[], 2, "SWEEP.toml"),
    ] {
        let out = trueup(folder, &[&["sweep"], arguments].concat());
        let error = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{arguments:?}: {error}");
        assert!(error.contains(said), "{arguments:?}: {error}");
    }
    // Two processes of one share.
    std::fs::create_dir(folder.join("s.runs")).unwrap();
    let log = std::fs::File::create(folder.join("s.runs/1-of-1.log")).unwrap();
    log.lock().unwrap();
    let out = trueup(folder, &["sweep", "s.toml"]);
    let error = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(1) && error.contains("another process runs this share"), "{error}");
}
