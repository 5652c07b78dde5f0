//! Completions and manual pages.

use std::process::Command;

fn trueup(arguments: &[&str]) -> String {
    let out = Command::new(env!("CARGO_BIN_EXE_trueup")).args(arguments).output().unwrap();
    assert!(out.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

#[test]
fn completions_have_all_commands_for_each_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = trueup(&["completions", shell]);
        for word in ["trueup", "diagnose", "identify", "validate", "pack", "verdict-only"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
}

#[test]
fn every_command_has_a_page_with_examples_and_exit_status() {
    let folder = tempfile::tempdir().unwrap();
    let man = folder.path().join("man");
    let listed = trueup(&["man", "-o", man.to_str().unwrap()]);
    assert!(
        listed.lines().count() > 20 && listed.lines().count() == std::fs::read_dir(&man).unwrap().count()
    );
    for path in listed.lines() {
        let page = std::fs::read_to_string(path).unwrap();
        for part in [".TH", ".SH NAME", ".SH SYNOPSIS", "Examples:", "Exit status:"] {
            assert!(page.contains(part), "{path}: {part}");
        }
    }
    assert!(man.join("trueup-fmu-pack.1").is_file() && !man.join("trueup-__fmu-host.1").exists());
}
