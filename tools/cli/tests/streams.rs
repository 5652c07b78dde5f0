//! Standard streams without a reader, closed, or full: a command ends as it does with readers.
#![cfg(unix)]

use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const SYSTEM: &str =
    "[components.joint]\nfmu = \"TwoMassJoint.fmi3.fmu\"\n\n[run]\nstop = 0.1\nstep = 0.01\n";
const SWEEP: &str = "system = \"system.toml\"\ndesign = \"grid\"\n\n[factors]\nk = { variable = \"joint.stiffness\", values = [2e-5, 3e-5] }\n\n\
                     [outputs]\nangle = { variable = \"joint.motorAngle\" }\n";
const CASE: &str = "model = \"TwoMassJoint\"\ntrain = [\"run.csv\"]\nholdout = [\"hold.csv\"]\n\n[parameters]\nstiffness = 3.07e-5\n\n\
                    [fit]\nparameters = [\"stiffness\"]\n\n[channels.motorAngle]\nnoise = 1e-3\n";

/// Those that write more than an error, on either stream; then errors of each status.
const COMMANDS: [&[&str]; 20] = [
    &["--help"],
    &["--version"],
    &["fmu", "list"],
    &["fmu", "info", "TwoMassJoint.fmi3.fmu"],
    &["simulate", "system.toml", "-o", "r.csv"],
    &["simulate", "system.toml", "-o", "r.csv", "--progress", "--isolate"],
    &["simulate", "system.toml", "--check"],
    &["simulate", "system.toml", "--save-ssp", "s.ssp"],
    &["sweep", "sweep.toml", "--run", "1", "-o", "one.csv"],
    &["scale", "table.toml", "--lambda", "0.5"],
    &["init", "case/run.csv", "--print"],
    &["check", "case"],
    &["diagnose", "case", "-o", "diagnosis", "--verdict-only", "--deadline", "0.05"],
    &["arm", "map", "--pose", "0,0,0"],
    &["robot", "chaser"],
    &["schema", "case"],
    &["simulate", "gone.toml"],
    &["check", "gone"],
    &["nonsense"],
    &["__fmu-host"],
];

/// ... that take longer.
const LONG: [&[&str]; 8] = [
    &["identify", "case", "--fast"],
    &["man", "-o", "man"],
    &["trial", "generate", "-o", "trials", "--plant", "joint", "--split", "none", "--count", "1"],
    &["trial", "run", "trials", "--limit", "1"],
    &["sweep", "sweep.toml"],
    &["completions", "bash"],
    &["fmu", "validate", "TwoMassJoint.fmi3.fmu"],
    &["scale", "case", "--lambda", "0.5", "-o", "scaled"],
];

fn desk() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    file("system.toml", SYSTEM);
    file("sweep.toml", SWEEP);
    file("table.toml", "target = { value = 7900, unit = \"kg\" }\n");
    std::fs::create_dir(folder.path().join("case")).unwrap();
    file("case/case.toml", CASE);
    for (name, size) in [("run", 1e-3), ("hold", 7e-4)] {
        let rows = (0..300).map(|k| {
            let t = 0.01 * f64::from(k);
            format!("{t:.2},{:.6},{:.6}\n", size * (3.0 * t).sin(), size * t * t)
        });
        let text = format!("time,motorCurrent,motorAngle\n{}", rows.collect::<String>());
        file(&format!("case/{name}.csv"), &text);
    }
    let out = program(folder.path(), &["fmu", "pack", "TwoMassJoint", "--fmi", "3"]).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    folder
}

fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut program = Command::new(env!("CARGO_BIN_EXE_trueup"));
    program
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    program
}

/// The end of a pipe whose reader is gone, before anything is written.
fn unread() -> Stdio {
    let (end, reader) = UnixStream::pair().unwrap();
    drop(reader);
    OwnedFd::from(end).into()
}

/// Results of the run before would change what the next one does.
fn cleared(folder: &Path) {
    for name in ["r.csv", "one.csv", "s.ssp", "table.scaled.toml"] {
        let _ = std::fs::remove_file(folder.join(name));
    }
    for name in ["scaled", "diagnosis", "man", "sweep.runs", "trials/results"] {
        let _ = std::fs::remove_dir_all(folder.join(name));
    }
}

#[track_caller]
fn ends(what: &str, arguments: &[&str], out: &Output, expected: &[i32]) {
    let (status, said) = (out.status.code(), String::from_utf8_lossy(&out.stderr));
    assert!(!said.contains("panicked"), "{arguments:?}, {what}: {said}");
    assert!(status.is_some_and(|s| expected.contains(&s)), "{arguments:?}, {what}: {status:?}: {said}");
}

#[test]
fn streams_that_nobody_reads_change_no_exit_status() {
    unread_streams(&COMMANDS, false);
}

/// A shell closes them (`2>&-`); `/dev/full` takes nothing.
#[test]
#[cfg(target_os = "linux")]
fn streams_that_are_closed_or_full_end_no_command_by_a_panic() {
    redirected(&COMMANDS, &["<&- >&- 2>&-"]);
    redirected(&COMMANDS[..3], &["2>/dev/full"]);
}

#[test]
#[cfg(target_os = "linux")]
#[ignore = "long: ./test --full runs it"]
fn no_stream_changes_any_command() {
    let all = [&COMMANDS[..], &LONG].concat();
    unread_streams(&all, true);
    redirected(&all, &["2>&-", ">&-", "<&-", "<&- >&- 2>&-", "2>/dev/full"]);
}

/// With `each` every stream alone, too.
fn unread_streams(commands: &[&[&str]], each: bool) {
    let desk = desk();
    for arguments in commands {
        let run = |change: &dyn Fn(&mut Command)| {
            cleared(desk.path());
            let mut program = program(desk.path(), arguments);
            change(&mut program);
            program.output().unwrap()
        };
        let status = run(&|_| {}).status.code().unwrap();
        let expected = [status];
        ends("no readers", arguments, &run(&|p| _ = p.stdout(unread()).stderr(unread())), &expected);
        if each {
            ends("no reader of stderr", arguments, &run(&|p| _ = p.stderr(unread())), &expected);
            ends("no reader of stdout", arguments, &run(&|p| _ = p.stdout(unread())), &expected);
        }
    }
}

#[cfg(target_os = "linux")]
fn redirected(commands: &[&[&str]], redirections: &[&str]) {
    let desk = desk();
    for arguments in commands {
        let run = |redirection: &str| {
            cleared(desk.path());
            let mut shell = Command::new("sh");
            shell
                .arg("-c")
                .arg(format!("exec \"$0\" \"$@\" {redirection}"))
                .arg(env!("CARGO_BIN_EXE_trueup"));
            shell.args(*arguments).current_dir(desk.path()).output().unwrap()
        };
        let status = run("</dev/null").status.code().unwrap();
        for redirection in redirections {
            ends(redirection, arguments, &run(redirection), &[status]);
        }
        // Results that cannot be printed were not given to anybody.
        ends(">/dev/full", arguments, &run(">/dev/full"), &[status, 1]);
    }
}
