//! `trueup fmu pack --platform`: what is refused, and how.
#![allow(missing_docs, clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use trueup_fmi_description::platform::Platform;

fn pack(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trueup"));
    command.args(["fmu", "pack", "JointController", "--fmi", "3"]).args(arguments).output().unwrap()
}

fn refused(arguments: &[&str], code: i32) -> String {
    let out = pack(arguments);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert_eq!(out.status.code(), Some(code), "{said}");
    said
}

/// The library of this build, which a folder of templates may hold.
fn own() -> PathBuf {
    let program = Path::new(env!("CARGO_BIN_EXE_trueup")).parent().unwrap();
    let name = format!("{}fmu_library{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let there = [program.join("deps").join(&name), program.join(&name)];
    let built = there.iter().filter(|p| p.is_file());
    built.max_by_key(|p| p.metadata().unwrap().modified().unwrap()).unwrap().clone()
}

fn template(folder: &Path, platform: Platform, name: &str, bytes: &[u8]) {
    let folder = folder.join("templates").join(platform.name());
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join(name), bytes).unwrap();
}

#[test]
fn an_unknown_platform_is_answered_by_those_that_there_are() {
    let said = refused(&["--platform", "x86_64-linux,linux64"], 2);
    assert!(
        said.contains(
            "there is no platform `linux64`; there are x86_64-linux, aarch64-linux, x86_64-windows, aarch64-darwin, x86_64-darwin, and `all`"
        ),
        "{said}"
    );
}

#[test]
fn missing_templates_are_named_with_what_makes_them() {
    let dir = tempfile::tempdir().unwrap();
    let (library, out) = (dir.path().to_str().unwrap(), dir.path().join("out"));
    let said = refused(
        &["--library", library, "--platform", "x86_64-windows,aarch64-darwin", "-o", out.to_str().unwrap()],
        1,
    );
    assert!(said.contains("no template library for x86_64-windows, aarch64-darwin in"), "{said}");
    assert!(said.contains("`tools/release x86_64-windows aarch64-darwin`"), "{said}");
    assert!(!out.exists());
}

#[test]
fn templates_that_do_not_fit_are_refused_with_their_file() {
    let host = Platform::host().unwrap();
    let other = Platform::ALL.into_iter().find(|p| *p != host).unwrap();
    let bytes = std::fs::read(own()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let library = dir.path().to_str().unwrap();
    let asked = |p: Platform| refused(&["--library", library, "--platform", p.name(), "-o", library], 1);

    template(dir.path(), other, &format!("a{}", other.suffix()), &bytes);
    assert!(asked(other).contains(&format!("it is a library for {host}, not one for {other}")));
    template(dir.path(), other, &format!("a{}", other.suffix()), b"text");
    assert!(asked(other).contains("it is no library that is known"));
    template(dir.path(), other, &format!("b{}", other.suffix()), b"text");
    assert!(asked(other).contains(&format!("are both template libraries for {other}")));

    // Of other sources: one digit of the stamp is another one.
    let stamp = fmu_library::STAMP.as_bytes();
    let stale = stamp.iter().map(|b| if *b == b'0' { b'1' } else { *b }).collect::<Vec<_>>();
    let mut old = bytes.clone();
    let places: Vec<usize> =
        (0..old.len() - stamp.len()).filter(|at| old[*at..].starts_with(stamp)).collect();
    assert!(!places.is_empty());
    places.into_iter().for_each(|at| old[at..][..stamp.len()].copy_from_slice(&stale));
    template(dir.path(), host, &format!("old{}", host.suffix()), &old);
    let said = asked(host);
    let stale = String::from_utf8(stale).unwrap();
    let told =
        format!("the template library for {host} is of {stale}, this program of {}", fmu_library::STAMP);
    assert!(said.contains("old") && said.contains(&told), "{said}");
    assert!(std::fs::read_dir(dir.path()).unwrap().count() == 1, "nothing is packed");
}

#[test]
fn named_twice_a_platform_is_packed_once() {
    let host = Platform::host().unwrap();
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    let done = pack(&["--platform", &format!("{host},{host}"), "-o", out]);
    assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
    let mut fmu =
        trueup_fmi_description::archive::Archive::open(&dir.path().join("JointController.fmi3.fmu")).unwrap();
    assert!(fmu.has(&format!("binaries/{host}/JointController{}", host.suffix())));
    let findings = trueup_fmi_description::check::archive(&mut fmu);
    assert!(findings.is_empty(), "{findings:?}");
}
