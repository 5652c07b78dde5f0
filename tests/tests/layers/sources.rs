//! What a source file may contain.

use super::rust::{Source, is_test_file};
use super::{Complaints, File, files, none};

/// Files, and folders with all that is below, that may allow `unsafe_code`, which the workspace's lints deny.
const UNSAFE: &[&str] = &[
    "crates/fmi/src/abi/",
    "crates/fmi-export/src/abi/",
    "crates/fmi-export/src/export.rs",
    "crates/fmi-import/src/core.rs",
    "crates/fmi-import/src/exit.rs",
    "crates/fmi-import/src/fmi2.rs",
    "crates/fmi-import/src/fmi3.rs",
    // The boundary of the process: memory that is shared with another one.
    "crates/fmi-import/src/isolation/calls.rs",
    "crates/fmi-import/src/isolation/frame.rs",
    "crates/fmi-import/src/isolation/host.rs",
    "crates/fmi-import/src/isolation/link.rs",
    "crates/fmi-import/src/isolation/link/remote.rs",
    "crates/fmi-import/src/isolation/memory.rs",
    "crates/fmi-import/src/isolation/open.rs",
    // A process that waits for the one with the FMUs.
    "crates/fmi-import/src/keeper.rs",
    "crates/fmi-import/src/library.rs",
    "crates/fmi-import/src/log.rs",
    "crates/fmi-import/src/program.rs",
    "crates/fmi-import/src/table.rs",
];
const LONGEST: usize = 500;

fn printing(file: &File) -> Complaints {
    if file.path.starts_with("tools/") || is_test_file(&file.path) {
        return Vec::new();
    }
    let source = Source::of(file);
    let macros = ["println!", "eprintln!", "print!", "eprint!", "dbg!"];
    let lines = macros.iter().flat_map(|m| source.lines_with(m).into_iter().map(move |line| (line, m)));
    lines
        .map(|(line, m)| {
            format!("{}:{line}: {m} in a library; return the message, tools/cli prints it", file.path)
        })
        .collect()
}

fn unsafety(file: &File) -> Complaints {
    if is_test_file(&file.path) || UNSAFE.iter().any(|allowed| file.path.starts_with(allowed)) {
        return Vec::new();
    }
    let source = Source::of(file);
    let mend =
        "move what is unsafe to the C boundary (crates/fmi-export/src/abi, crates/fmi-import/src/library.rs)";
    // `allow`, `expect` and `warn` all lift the denial; so the lint may not be named at all.
    let lines = source.lines_with("unsafe_code");
    lines
        .into_iter()
        .map(|line| format!("{}:{line}: unsafe_code is allowed away from the C boundary; {mend}", file.path))
        .collect()
}

/// Every crate takes the workspace's lints, and these deny unsafe code.
fn lints(manifest: &File) -> Complaints {
    let said = |line: &str| manifest.text.lines().any(|l| l.trim() == line);
    let (held, mend) = match manifest.path.as_str() {
        "Cargo.toml" => (said("unsafe_code = \"deny\""), "deny unsafe_code under [workspace.lints.rust]"),
        _ => (
            manifest.text.contains("[lints]\nworkspace = true"),
            "write [lints] workspace = true, which denies unsafe_code",
        ),
    };
    (!held).then(|| format!("{}: its code may be unsafe; {mend}", manifest.path)).into_iter().collect()
}

fn length(file: &File) -> Complaints {
    let lines = file.text.lines().count();
    (lines > LONGEST)
        .then(|| format!("{}: {lines} lines; split it, {LONGEST} are the most", file.path))
        .into_iter()
        .collect()
}

/// A path of one machine in what is built or read by users.
fn machine_paths(file: &File) -> Complaints {
    if is_test_file(&file.path) {
        return Vec::new();
    }
    let text = if file.path.ends_with(".rs") { Source::of(file).literals.clone() } else { file.text.clone() };
    let mut complaints = Vec::new();
    for (i, line) in text.lines().enumerate() {
        // Spelt so that this check does not find itself.
        for folder in ["home", "root", "work", "tmp"].map(|name| format!("/{name}/")) {
            // Below another folder, or below `..`, it is no absolute path.
            let absolute =
                |at: usize| !line[..at].ends_with(|c: char| c.is_alphanumeric() || "._-}".contains(c));
            if line.match_indices(&folder).any(|(at, _)| absolute(at)) {
                complaints.push(format!(
                    "{}:{}: {folder} is a path of one machine; make it relative",
                    file.path,
                    i + 1
                ));
            }
        }
    }
    complaints
}

/// Files next to a `tests/main.rs`, and folders with a `mod.rs` there, that nothing names: their tests would never run.
/// `targets` are the paths of test binaries of their own, as the crate's manifest gives them.
fn unnamed_modules(main: &File, others: &[File], manifest: &File) -> Complaints {
    let folder = main.path.strip_suffix("main.rs").unwrap_or_default();
    let source = Source::of(main);
    let named = |name: &str| {
        source.code.lines().any(|l| l.trim().trim_start_matches("pub ") == format!("mod {name};"))
    };
    let own = |name: &str| manifest.text.contains(&format!("path = \"tests/{name}.rs\""));
    let module = |f: &File| {
        let rest = f.path.strip_prefix(folder)?;
        let name = rest.strip_suffix("/mod.rs").or_else(|| rest.strip_suffix(".rs"))?;
        (!name.contains('/') && name != "main").then(|| name.to_owned())
    };
    let missing = others.iter().filter_map(module).filter(|name| !named(name) && !own(name));
    missing
        .map(|name| format!("{folder}{name}: its tests never run; write `mod {name};` into {}", main.path))
        .collect()
}

/// Tests within the sources of a crate whose library has no harness (`test = false`): they would never run.
fn tests_without_harness(manifest: &File, sources: &[File]) -> Complaints {
    let library = manifest.text.split("\n[").find(|section| section.starts_with("lib]")).unwrap_or_default();
    if !library.lines().any(|l| l.trim() == "test = false") {
        return Vec::new();
    }
    let folder = manifest.path.replace("Cargo.toml", "src/");
    let inside = sources.iter().filter(|f| f.path.starts_with(&folder));
    let tested = inside.filter(|f| Source::of(f).code.contains("#[cfg(test)]") || f.text.contains("#[test]"));
    tested
        .map(|f| format!("{}: its tests never run; take `test = false` out of {}", f.path, manifest.path))
        .collect()
}

fn check(endings: &[&str], rule: impl Fn(&File) -> Complaints) {
    none(files(endings).iter().flat_map(rule).collect());
}

#[test]
fn only_the_program_prints() {
    check(&[".rs"], printing);
}

#[test]
fn unsafe_stays_at_the_c_boundary() {
    check(&[".rs"], unsafety);
    check(&["Cargo.toml"], lints);
}

#[test]
fn every_file_of_tests_is_run() {
    let (sources, manifests) = (files(&[".rs"]), files(&["Cargo.toml"]));
    let mains: Vec<_> = sources.iter().filter(|f| f.path.ends_with("tests/main.rs")).collect();
    assert!(mains.len() > 10, "{} tests/main.rs", mains.len());
    let mut complaints = Vec::new();
    for main in mains {
        let path = main.path.replace("tests/main.rs", "Cargo.toml");
        // A folder `tests` below `src` or another one has no manifest next to it.
        if let Some(manifest) = manifests.iter().find(|m| m.path == path) {
            complaints.extend(unnamed_modules(main, &sources, manifest));
        }
    }
    none(complaints);
}

#[test]
fn every_test_within_a_library_is_run() {
    let (sources, manifests) = (files(&[".rs"]), files(&["Cargo.toml"]));
    none(manifests.iter().flat_map(|m| tests_without_harness(m, &sources)).collect());
}

#[test]
fn no_source_file_is_too_long() {
    check(&[".rs", ".py"], length);
}

#[test]
fn no_path_of_a_machine() {
    check(&[".rs", ".toml", ".md", ".html", ".xml", ".txt", ".py", ".sh", "/run", "test"], machine_paths);
}

#[test]
fn broken_rules_are_found() {
    let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
    let says = super::found;
    let library = "crates/models/src/joint.rs";

    says(
        &printing(&file(library, "fn f() {\n    println!(\"x\");\n}\n")),
        &["joint.rs:2", "println!", "tools/cli"],
    );
    assert!(printing(&file("tools/cli/src/main.rs", "println!(\"x\");")).is_empty());
    assert!(printing(&file(library, "/// println!(\"x\")\n")).is_empty());

    let allowed = "//! Text.\n#![allow(unsafe_code)] // for speed\n";
    says(&unsafety(&file(library, allowed)), &["joint.rs:2", "boundary", "move"]);
    says(&unsafety(&file(library, "#[expect(unused, unsafe_code)]\nfn f() {}\n")), &["joint.rs:1"]);
    says(&unsafety(&file("crates/fmi-export/src/core.rs", "#![warn(unsafe_code)]")), &["core.rs:1"]);
    says(&unsafety(&file("crates/fmi-import/src/fmi3x.rs", allowed)), &["fmi3x.rs:2"]);
    assert!(unsafety(&file("crates/fmi-export/src/abi/fmi3.rs", allowed)).is_empty());
    assert!(unsafety(&file("crates/numerics/tests/allocation.rs", allowed)).is_empty());
    assert!(unsafety(&file(library, "#![deny(unsafe_op_in_unsafe_fn)] // unsafe_code\n")).is_empty());

    says(&lints(&file("Cargo.toml", "unsafe_code = \"warn\"\n")), &["Cargo.toml", "deny unsafe_code"]);
    says(&lints(&file("crates/new/Cargo.toml", "[package]\n")), &["crates/new/Cargo.toml", "[lints]"]);
    assert!(lints(&file("crates/new/Cargo.toml", "[package]\n\n[lints]\nworkspace = true\n")).is_empty());

    let main = file("crates/a/tests/main.rs", "//! mod c;\nmod b;\n");
    let manifest = file("crates/a/Cargo.toml", "[[test]]\nname = \"d\"\npath = \"tests/d.rs\"\n");
    let unnamed = |path: &str| unnamed_modules(&main, &[file(path, "")], &manifest);
    says(&unnamed("crates/a/tests/c.rs"), &["crates/a/tests/c", "never run", "mod c;", "tests/main.rs"]);
    says(&unnamed("crates/a/tests/c/mod.rs"), &["crates/a/tests/c", "mod c;"]);
    for named in ["b.rs", "b/mod.rs", "d.rs", "b/c.rs", "main.rs", "made.c"] {
        assert!(unnamed(&format!("crates/a/tests/{named}")).is_empty(), "{named}");
    }
    assert!(unnamed("crates/b/tests/c.rs").is_empty());

    let bare = file("crates/a/Cargo.toml", "[package]\n\n[lib]\ntest = false\n\n[[test]]\n");
    let inline = file("crates/a/src/b.rs", "#[cfg(test)]\nmod tests {\n#[test]\nfn f() {}\n}\n");
    says(
        &tests_without_harness(&bare, std::slice::from_ref(&inline)),
        &["a/src/b.rs", "never run", "test = false"],
    );
    assert!(tests_without_harness(&bare, &[file("crates/a/src/b.rs", "fn f() {}\n")]).is_empty());
    assert!(tests_without_harness(&file("crates/a/Cargo.toml", "[package]\n"), &[inline]).is_empty());

    says(&length(&file(library, &"\n".repeat(LONGEST + 1))), &["501 lines", "split"]);
    assert!(length(&file(library, &"\n".repeat(LONGEST))).is_empty());

    says(&machine_paths(&file(library, "let p = \"/home/me/x\";\n")), &["joint.rs:1", "/home/", "relative"]);
    says(&machine_paths(&file("README.md", "run\n`/home/trueup`\n")), &["README.md:2", "/home/"]);
    assert!(machine_paths(&file("README.md", "target/home/x ../home/y")).is_empty());
    assert!(machine_paths(&file("crates/a/tests/b.rs", "\"/home/x\"")).is_empty());
}
